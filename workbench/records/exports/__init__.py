"""Recordings for other programs: a file of this folder is a format, and declares itself as `FORMAT`.

A new file is a new format; `underfoot export` and the window offer what is here.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.floor.contacts import ContactRows
from underfoot.floor.footsteps import Step
from underfoot.floor.profile_parts import PARTS
from underfoot.floor.step_finder import find_steps
from underfoot.plugins import values_in
from underfoot.records.notes import Notes
from underfoot.records.recording import Recording
from underfoot.records.survey import (
    STANCE,
    RecordedForces,
    Stance,
    load_cached_steps,
    noted_stances,
    with_stances,
)
from underfoot.records.tables import step_columns

VIBRATION = ("commanded", "measured", "vibration")
"""Commanded and measured acceleration of tiles, m/s^2, and their drive, relative to full scale."""
DECIDED_S = 5.0
"""Time after its end at which a step certainly has its person, side and measures (`walks.WalkTracker`)."""
MOST_GAP_DAYS = 1.0
"""Longest gap whose silence is written: no session has such a one, but a damaged file may say so, by months."""


class ExportStopped(UnderfootError):
    """Whoever asked for an export wants it no more; nothing of it is left."""


@dataclass(frozen=True)
class ExportSource:
    """A recording, or a stretch of it, as formats take it. Times are seconds from its first frame on."""

    recording: Recording
    vibration: str = "measured"
    """The one of `VIBRATION` that a format takes which carries one alone."""
    progress: Callable[[str, float], bool] = field(default=lambda text, share: True)
    """Receives the current step and its completed share; returns whether to continue."""
    stretch_s: tuple[float, float] | None = None
    """Beginning and end of the stretch in seconds from the recording's first frame; None for the whole recording."""

    def __post_init__(self) -> None:
        """Raise `BadFile` for a recording of nothing, `BadValue` for a stretch that is not in the recording."""
        if self.recording.span == (0, 0):
            raise BadFile(f"{self.recording.path} holds nothing to export: it was ended before its first frame")
        if self.stretch_s is not None:
            (begin_s, end_s), length_s = self.stretch_s, self.forces.length_s
            if not 0.0 <= begin_s < end_s <= length_s or self.end == self.first:
                raise BadValue(
                    f"the stretch is from {begin_s:.10g} to {end_s:.10g} s; allowed: from a second to a later one, "
                    f"within the recording's 0 to {length_s:.10g} s"
                )

    @cached_property  # for each of its pieces
    def forces(self) -> RecordedForces:
        """The floor, the rates and the ends of the whole recording."""
        return RecordedForces(self.recording)

    @property
    def first(self) -> int:
        """The first session frame."""
        return self._frame_at(None if self.stretch_s is None else self.stretch_s[0], self.forces.first)

    @property
    def end(self) -> int:
        """The session frame after the last."""
        return self._frame_at(None if self.stretch_s is None else self.stretch_s[1], self.forces.end)

    @property
    def from_s(self) -> float:
        """Seconds of the recording before the first frame."""
        return (self.first - self.forces.first) / self.forces.rate

    @property
    def length_s(self) -> float:
        """Duration in seconds."""
        return (self.end - self.first) / self.forces.rate

    @property
    def begun(self) -> str:
        """Date and local time at which the recording was begun, to the second (ISO 8601); "" if it is not known."""
        return self.recording.about.get("begun", "")

    @property
    def calibrations(self) -> list[str]:
        """The calibrations in use when it was begun, each as tile, name, day and digest."""
        found = self.recording.calibrations.items()
        return [f"{tile} {PARTS.get(kind, kind)} {named}" for tile, parts in found for kind, named in parts.items()]

    def pieces(self, text: str) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield times (n,) and corner forces (n, tiles, 4), piece by piece."""
        begin, end = (-math.inf, math.inf) if self.stretch_s is None else (self.first, self.end)
        for time_s, force_n in self._pieces(begin, end, text):
            yield self._from_first(time_s), force_n

    def found(self, text: str) -> Iterator[tuple[ContactRows, list[Stance]]]:
        """Yield contacts and footsteps with their force over the stance, piece by piece.

        Those of a stretch are what is found in the whole recording: all samples of contacts in it, and the steps that
        begin and end in it, with their numbers.
        """
        until = math.inf if self.stretch_s is None else self.end + DECIDED_S * self.forces.rate
        pieces = self._pieces(-math.inf, until, text)
        for found, stances in with_stances(find_steps(pieces, self.forces.floor, self.forces.rate_hz)):
            rows = replace(found.rows, time_s=self._from_first(found.rows.time_s))
            if self.stretch_s is not None:
                rows = rows.select((rows.time_s >= 0.0) & (rows.time_s < self.length_s))
            yield rows, self._within(stances)

    def steps(self, text: str) -> list[Step]:
        """Return the footsteps alone: those of the recording's survey where there is one, else what is found now."""
        known = load_cached_steps(self.recording)
        if known is None:
            return [one.step for _, stances in self.found(text) for one in stances]
        return [one.step for one in self._within(known)]

    def frames(self, source: str, text: str) -> Iterator[NDArray[np.float32]]:
        """Yield a table of `VIBRATION`, [frame, tile], from the first frame to the last, piece by piece; 0 in gaps.

        `BadFile` for a gap of more than `MOST_GAP_DAYS`.
        """
        at, end, tiles = self.first, self.end, len(self.forces.floor.tiles)
        nothing = end, np.zeros((0, tiles), np.float32)  # of which what is still lasts to the end
        for first, rows in chain(self.recording.blocks(source, at, end), [nothing]):
            if (days := (first - at) / self.forces.rate / 86_400.0) > MOST_GAP_DAYS:
                from_s = self.from_s + self._time_s(at)
                raise BadFile(
                    f"{self.recording.path} has no vibration for {days:.1f} days from {from_s:.10g} s on; allowed: for "
                    "up to a day; export a stretch before or after"
                )
            while at < first:
                still = np.zeros((min(48_000, first - at), tiles), np.float32)
                self._report_frame(text, at)
                yield still
                at += len(still)
            kept = rows[max(at - first, 0) : end - first]
            if len(kept):
                self._report_frame(text, at)
                yield kept
            at = max(at, first + len(rows))

    def marks(self) -> list[tuple[float, str]]:
        """Return time in seconds and text of the marks."""
        return [(self._time_s(mark.frame), mark.text) for mark in self.recording.marks() if self._has(mark.frame)]

    def commands(self) -> list[tuple[float, str, str]]:
        """Return time in seconds, kind and body of the commands."""
        found = self.recording.commands()
        return [(self._time_s(frame), kind, body) for frame, kind, body in found if self._has(frame)]

    def gaps(self) -> list[tuple[float, float]]:
        """Return beginning and length in seconds of the gaps."""
        ends = [(max(gap.first, self.first), min(gap.first + gap.count, self.end)) for gap in self.recording.gaps()]
        return [(self._time_s(begin), (end - begin) / self.forces.rate) for begin, end in ends if begin < end]

    def _pieces(self, begin: float, end: float, text: str) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield times from the recording's first frame on, and corner forces, between two session frames."""
        first, last = max(begin, self.forces.first), min(end, self.forces.end)
        for rows in self.recording.force_blocks_between(begin, end):
            self.report_progress(text, float(rows[-1, 0] - first) / max(last - first, 1.0))
            yield (rows[:, 0] - self.forces.first) / self.forces.rate, rows[:, 2:].reshape(len(rows), -1, 4)

    def _from_first(self, time_s: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return times from the stretch's first frame on, of times from the recording's."""
        return time_s if self.stretch_s is None else np.round(time_s - self.from_s, 9) + 0.0  # no -0

    def _within(self, stances: Sequence[Stance]) -> list[Stance]:
        """Return the steps that begin and end here, to a frame: a stretch may be that of a step."""
        noted, frame_at = noted_stances(stances, self._notes), self.forces.frame_at
        if self.stretch_s is None:
            return noted
        return [
            Stance(replace(one.step, start_s=float(self._from_first(np.array(one.step.start_s)))), one.force_n)
            for one in noted
            if self.first <= frame_at(one.step.start_s) and frame_at(one.step.end_s) <= self.end
        ]

    @cached_property  # for each piece of the steps
    def _notes(self) -> Notes:
        return self.recording.notes()

    def _frame_at(self, second: float | None, otherwise: int) -> int:
        return otherwise if second is None else self.forces.first + round(second * self.forces.rate)

    def _time_s(self, frame: int) -> float:
        return (frame - self.first) / self.forces.rate

    def _has(self, frame: int) -> bool:
        return self.stretch_s is None or self.first <= frame < self.end

    def _report_frame(self, text: str, frame: int) -> None:
        self.report_progress(text, (frame - self.first) / max(self.end - self.first, 1))

    def report_progress(self, text: str, share: float) -> None:
        """Report the progress; raise `ExportStopped` if the export was cancelled."""
        if not self.progress(text, min(max(share, 0.0), 1.0)):
            raise ExportStopped("the export was stopped")


def stance_columns(stances: Sequence[Stance]) -> dict[str, NDArray[Any]]:
    """Return the columns of a table of recorded steps, and as `stance_n` the force of each at 0 to 100 % of stance, N,
    [step, `STANCE`]."""
    curves = np.array([one.force_n for one in stances], np.float64).reshape(-1, STANCE)
    return step_columns((one.step for one in stances), recorded=True) | {"stance_n": curves}


@dataclass(frozen=True)
class ExportFormat:
    """A format: its suffix and description, what it omits of a recording, and the function that writes it."""

    suffix: str
    title: str
    cannot: str
    write: Callable[[ExportSource, Path], None]


@cache
def formats() -> dict[str, ExportFormat]:
    """Return all formats by suffix.

    >>> list(formats())
    ['.c3d', '.csv', '.h5', '.mat', '.wav']
    """
    found = {value.suffix: value for value in values_in(__name__) if isinstance(value, ExportFormat)}
    return dict(sorted(found.items()))


def format_of(path: Path) -> ExportFormat:
    """Return the format of a file by its suffix; `BadFile` if there is none."""
    known = formats()
    if path.suffix.lower() not in known:
        raise BadFile(f"{path} has the suffix {path.suffix or '(none)'}; allowed: {', '.join(known)}")
    return known[path.suffix.lower()]


def write_export(export: ExportSource, path: Path) -> None:
    """Write an export in the format of the path's suffix; of a recording that is being written, all that it has now."""
    with export.recording.at_one_moment():
        format_of(path).write(export, path)
