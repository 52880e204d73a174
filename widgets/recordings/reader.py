"""Reads a recording in a separate thread, so that the window never waits for a disk."""

import sqlite3
import threading
from collections.abc import Callable
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PySide6.QtCore import QObject, Signal

from underfoot.errors import UnderfootError
from underfoot.floor.layout import Floor
from underfoot.floor.profile_parts import InUse
from underfoot.records import envelopes
from underfoot.records.envelopes import Envelope
from underfoot.records.notes import Notes
from underfoot.records.recording import Gap, Mark, Recording
from underfoot.records.renaming import rename_recording
from underfoot.records.survey import Survey, has_envelopes, load_cached_survey, open_envelopes

LEVELS = (1, 4, 16, 64)
"""Number of blocks in a bin of each level that is kept in memory."""
RAW_S, FINE_S = 0.004, 0.1
"""Durations of a pixel below which samples are read, and below which fine bins are read, in seconds."""
WINDOW_S = 0.1
"""Time around the cursor over which vibration is measured."""
NEAR_S = 0.05
"""Furthest a force sample is from the cursor that it stands for: the first comes a block or two after the vibration."""

_CHANGES = ("change", "rename")
"""Kinds of requests that change a file; these are never dropped."""


@dataclass(frozen=True)
class OpenedRecording:
    """Immediately available facts of a recording. Times are session frames."""

    path: Path
    about: dict[str, str]
    floor: Floor
    rate: float
    first: int
    end: int
    marks: list[Mark]
    notes: Notes
    commands: list[tuple[int, str, str]]
    gaps: list[Gap]
    survey: Survey | None
    is_drawn: bool
    """Whether the envelopes are complete."""
    calibrations: InUse

    @property
    def length_s(self) -> float:
        """Duration of the recording in seconds."""
        return (self.end - self.first) / self.rate


@dataclass(frozen=True)
class OverviewEnvelopes:
    """The envelopes of a whole recording by source, finest level first; `baseline_n` is the unloaded reading of each
    force column, in N.
    """

    levels: dict[str, tuple[Envelope, ...]]
    baseline_n: NDArray[np.float32]

    def envelope(self, source: str, frames: float) -> Envelope:
        """Return the level with bins of `frames`, or the next finer one."""
        levels = self.levels[source]
        fitting = [level for level in levels if len(level) and float(np.median(level.end - level.begin)) <= frames]
        return fitting[-1] if fitting else levels[0]


@dataclass(frozen=True)
class DetailEnvelopes:
    """Envelopes of a range of session frames, finer than the overview; vibration of one tile only."""

    begin: float
    end: float
    frames: float
    """Session frames a bin."""
    tile: int
    envelopes: dict[str, Envelope]


@dataclass(frozen=True)
class Vibration:
    """The vibration of a tile around a moment: peak acceleration in m/s^2, level in dB re 1 m/s^2, and strongest
    frequency in Hz.
    """

    peak_m_s2: float
    level_db: float
    frequency_hz: float


@dataclass(frozen=True)
class CursorValues:
    """Values at a session frame: corner forces (tiles, 4) in N, and the vibration of a tile by source."""

    frame: float
    tile: int
    corners_n: NDArray[np.float64] | None
    vibration: dict[str, Vibration] = field(default_factory=dict)


class RecordingReader(QObject):
    """Reads one recording at a time. Of several requests of a kind, it reads only the latest."""

    opened = Signal(object)
    """`OpenedRecording`."""
    extended = Signal(object)
    """Carries a new `OpenedRecording`, because the recording has grown."""
    unchanged = Signal()
    """The recording has not grown since it was last read."""
    overview_read = Signal(object)
    """`OverviewEnvelopes`: once it is opened, and after each `reread`."""
    detail_read = Signal(object)
    """`DetailEnvelopes`."""
    cursor_values_read = Signal(object)
    """`CursorValues`."""
    marked = Signal(list)
    """Carries all marks of the recording after a change, also by another program."""
    notes_read = Signal(object)
    """Carries the `Notes` of its steps after a change, also by another program."""
    renamed = Signal(object, object)
    """The old and the new `Path` of a recording."""
    not_renamed = Signal(object, str)
    """The `Path` of a recording, and why it keeps its name."""
    failed = Signal(str)
    """Why something could not be done, in a line."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._requests: dict[str, Callable[[], None]] = {}
        self._condition = threading.Condition()
        self._thread: threading.Thread | None = None
        self._is_ending = False
        self._recording: Recording | None = None
        self._open_files = ExitStack()
        self._base: sqlite3.Connection | None = None
        self._finest: dict[str, Envelope] = {}
        self._span = (0, 0)
        self._state: int | None = None

    # --- requests, from the window's thread ---

    def open(self, path: Path) -> None:
        """Open a recording in the place of the one before."""
        with self._condition:
            for kind in [kind for kind in self._requests if not kind.startswith(_CHANGES)]:
                del self._requests[kind]
        self._enqueue("open", partial(self._open, path))

    def reread(self) -> None:
        """Read the overview again, because the recording has grown."""
        self._enqueue("overview", self._read_overview)

    def read_new(self) -> None:
        """Read again the parts that grow during recording, if they have grown."""
        self._enqueue("grown", self._read_new)

    def request_detail(self, begin: float, end: float, frames: float, tile: int) -> None:
        """Request envelopes from frame `begin` to `end`, with `frames` per pixel."""
        self._enqueue("strip", partial(self._read_detail, begin, end, frames, tile))

    def request_cursor_values(self, frame: float, tile: int) -> None:
        """Request the values at a session frame."""
        self._enqueue("moment", partial(self._read_cursor_values, frame, tile))

    def change(self, change: Callable[[Recording], object]) -> None:
        """Apply an edit to the recording's marks, or to what is noted of its steps."""
        self._enqueue(f"change {id(change)}", partial(self._change, change))

    def rename(self, path: Path, name: str) -> None:
        """Give a recording another name; if it is open, it stays open."""
        self._enqueue(f"rename {path}", partial(self._rename, path, name))

    def close_file(self) -> None:
        """Close the file."""
        self._enqueue("open", self._close_recording)

    def close(self) -> None:
        """End the thread, and close the file."""
        with self._condition:
            self._is_ending = True
            self._condition.notify()
        if self._thread is not None:
            self._thread.join()

    def _enqueue(self, kind: str, do: Callable[[], None]) -> None:
        with self._condition:
            self._requests.pop(kind, None)
            self._requests[kind] = do
            self._condition.notify()
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name="recording reader")
            self._thread.start()

    # --- the thread ---

    def _run(self) -> None:
        while True:
            with self._condition:
                self._condition.wait_for(lambda: self._is_ending or self._requests)
                if self._is_ending:
                    break
                kind = next(iter(self._requests))
                do = self._requests.pop(kind)
            try:
                do()
            except UnderfootError as error:
                self.failed.emit(str(error))
            except sqlite3.Error as error:
                self.failed.emit(f"The recording cannot be read: {error}")
        self._open_files.close()

    def _close_recording(self) -> None:
        self._open_files.close()
        self._recording = self._base = None

    def _open(self, path: Path) -> None:
        recording = self._open_file(path)
        self.opened.emit(_opened(recording, self._floor))
        self._read_overview()

    def _open_file(self, path: Path) -> Recording:
        self._close_recording()
        recording = self._open_files.enter_context(Recording(path))
        floor = recording.floor
        self._recording, self._floor, self._span, self._state = recording, floor, recording.span, None
        tiles = len(floor.tiles)
        self._finest = {source: envelopes.empty(tiles + (source == "force")) for source in envelopes.SOURCES}
        self._find_base()
        return recording

    def _rename(self, path: Path, name: str) -> None:
        is_open = self._recording is not None and self._recording.path == path
        if is_open:
            self._close_recording()  # some systems rename no open file, and this one would count as being read
        now = path
        try:
            now = rename_recording(path, name)
            self.renamed.emit(path, now)
        except UnderfootError as error:
            self.not_renamed.emit(path, str(error))
        if is_open:
            self._open_file(now)

    def _read_new(self) -> None:
        recording = self._recording
        if recording is None:
            return
        state = recording.state
        if state == self._state:
            self.unchanged.emit()
            return
        span = recording.span
        if span == self._span:
            self._tell_notes(recording)
            self.unchanged.emit()
        else:
            self.extended.emit(_opened(recording, self._floor))
            self._read_overview()
        self._state, self._span = state, span  # if all of it could be read

    def _find_base(self) -> None:
        """Find the envelopes: in the recording, else in the cache, where they are made if missing."""
        if self._recording is None or self._base is not None:
            return
        self._base = self._recording.envelope_base()
        if self._base is None:
            try:
                self._base = self._open_files.enter_context(closing(open_envelopes(self._recording)))
                self._base.execute("select 1 from envelope limit 1").fetchone()
            except sqlite3.Error:
                self._base = None

    def _read_overview(self) -> None:
        self._find_base()
        levels = {}
        for source, finest in self._finest.items():
            if self._base is not None and self._recording is not None:
                with self._recording.readable("envelope"):  # or those in the cache
                    finest = self._finest[source] = envelopes.read_overview(self._base, source, finest)
            levels[source] = tuple(finest.coarser(factor) if factor > 1 else finest for factor in LEVELS)
        rest = envelopes.resting_n(levels["force"][0])
        rest[-1] = rest[:-1].sum()  # a person may be on the floor all the time, but not on the same tile
        self.overview_read.emit(OverviewEnvelopes(levels, rest))

    def _read_detail(self, begin: float, end: float, frames: float, tile: int) -> None:
        recording = self._recording
        if recording is None or self._base is None:
            return
        rate = recording.rate_hz
        found = {}
        for source, finest in self._finest.items():
            if frames > RAW_S * rate:
                with recording.readable("envelope"):
                    fine = envelopes.read(self._base, source, envelopes.FINE, finest.low.shape[1], begin, end)
                # No finer than half a pixel, because each picture reads all bins.
                made = fine.coarser(max(1, int(0.5 * frames / envelopes.FINE_FRAMES)))
            elif source == "force":
                rows = recording.force_samples_between(begin, end)
                period = rate / recording.force_rate_hz
                made = envelopes.of_samples(rows[:, 0], period, envelopes.loads(rows[:, 2:]))
            else:
                made = _samples_of(recording, source, begin, end, tile)
            is_whole = source == "force" or frames <= RAW_S * rate
            found[source] = made if is_whole else made.column(tile)
        self.detail_read.emit(DetailEnvelopes(begin, end, frames, tile, found))

    def _read_cursor_values(self, frame: float, tile: int) -> None:
        recording = self._recording
        if recording is None:
            return
        rate = recording.rate_hz
        rows = recording.force_samples_between(frame - NEAR_S * rate, frame + NEAR_S * rate)
        nearest = max(int(np.searchsorted(rows[:, 0], frame, "right")) - 1, 0)  # the last one, else the next
        corners = rows[nearest, 2:].reshape(-1, 4).copy() if len(rows) else None
        half = round(0.5 * WINDOW_S * rate)
        vibration = {}
        for source in ("commanded", "measured"):
            values = recording.frames_between(source, round(frame) - half, round(frame) + half)[:, tile]
            if np.isfinite(values).any():
                vibration[source] = vibration_of(np.nan_to_num(values), rate)
        self.cursor_values_read.emit(CursorValues(frame, tile, corners, vibration))

    def _change(self, change: Callable[[Recording], object]) -> None:
        if self._recording is not None:
            change(self._recording)
            self._tell_notes(self._recording)

    def _tell_notes(self, recording: Recording) -> None:
        self.marked.emit(recording.marks())
        self.notes_read.emit(recording.notes())


def _opened(recording: Recording, floor: Floor) -> OpenedRecording:
    """Return the current facts of a recording."""
    return OpenedRecording(
        recording.path,
        recording.about,
        floor,
        recording.rate_hz,
        *recording.span,
        recording.marks(),
        recording.notes(),
        recording.commands(),
        recording.gaps(),
        load_cached_survey(recording),
        has_envelopes(recording),
        recording.calibrations,
    )


def _samples_of(recording: Recording, source: str, begin: float, end: float, tile: int) -> Envelope:
    """Return the samples of one tile between two session frames, one per bin."""
    parts = [(first, rows[:, tile : tile + 1]) for first, rows in recording.blocks(source, int(begin), int(end))]
    if not parts:
        return envelopes.empty(1)
    at = np.concatenate([np.arange(first, first + len(rows), dtype=np.float64) for first, rows in parts])
    return envelopes.of_samples(at, 1.0, np.concatenate([rows for _, rows in parts]))


def vibration_of(samples: NDArray[np.float32], rate: float) -> Vibration:
    """Return the vibration of a signal in m/s^2 (n,); its frequency is the largest of the spectrum, NaN for silence.

    >>> tone = 0.5 * np.sin(2 * np.pi * 200 / 48000 * np.arange(4800))
    >>> found = vibration_of(tone.astype(np.float32), 48000.0)
    >>> round(found.peak_m_s2, 3), round(found.level_db, 1), round(found.frequency_hz)
    (0.5, -9.0, 200)
    """
    peak, rms = float(np.abs(samples).max()), float(np.sqrt(np.mean(np.square(samples, dtype=np.float64))))
    if rms < 1e-6:
        return Vibration(peak, -np.inf, np.nan)
    size = 8 * len(samples)  # zero-padded: accurate to 1 or 2 Hz between bins
    spectrum = np.abs(np.fft.rfft(samples * np.hanning(len(samples)), size))
    return Vibration(peak, 20.0 * float(np.log10(rms)), float(np.argmax(spectrum)) * rate / size)
