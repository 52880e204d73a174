"""Survey of a recording: contacts, footsteps with their force over the stance, and envelopes of the samples.

It takes a while for a long recording, and is kept in the cache folder. `underfoot.engine.survey_process` does it beside
the window.
"""

import hashlib
import sqlite3
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import TypeVar

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.errors import BadFile
from underfoot.files import cache_folder, make_folder, uri_of, write_file
from underfoot.floor.contacts import Contact
from underfoot.floor.footsteps import Step, is_step
from underfoot.floor.step_finder import Detections, find_steps
from underfoot.records import envelopes
from underfoot.records.balance import PLACES_S, BalanceMeans
from underfoot.records.notes import Notes
from underfoot.records.recording import Recording

FORMAT = 6
"""Of the files in the cache; others are made anew."""
STANCE = 101
"""Points of a curve of stance: 0, 1, ... 100 % of the contact."""
KEPT = 200
"""Number of recordings whose files stay in the cache; the oldest are removed."""


class ContactSpan(msgspec.Struct, frozen=True):
    """A contact from one second to another of the recording, on rows `tiles` of the floor.

    `places` are x and y, m, and force, N, each `PLACES_S` from `start_s` on.
    """

    id: int
    start_s: float
    end_s: float
    tiles: tuple[int, ...]
    places: tuple[tuple[float, float, float], ...] = ()

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Return x and y in metres and the force in newtons at a second of the recording.

        >>> ContactSpan(1, 0.0, 0.05, (0,), ((0.1, 0.2, 0.0), (0.2, 0.2, 500.0), (0.4, 0.2, 0.0))).at(0.025)
        (0.2, 0.2, 500.0)
        """
        at = (time_s - self.start_s) / PLACES_S
        x_m, y_m, force_n = (
            float(np.interp(at, np.arange(len(column)), column)) for column in zip(*self.places, strict=True)
        )
        return x_m, y_m, force_n


class Stance(msgspec.Struct, frozen=True):
    """A footstep, and its force, N, at 0 to 100 % of the contact: `STANCE` values."""

    step: Step
    force_n: tuple[float, ...]


class Survey(msgspec.Struct):
    """The results up to `until_s`, in seconds from the recording's first frame."""

    contacts: list[ContactSpan] = []
    steps: list[Stance] = []
    until_s: float = 0.0
    whole: bool = False
    balance: bytearray = msgspec.field(default_factory=bytearray)
    """What all contacts bear together, and where, for `balance.loaded_times`. Pieces are added in place."""


def noted_stances(stances: Sequence[Stance], notes: Notes) -> list[Stance]:
    """Return footsteps with what is noted of them, as `Notes.on` does."""
    steps = notes.on(one.step for one in stances)
    return [Stance(step, one.force_n) for step, one in zip(steps, stances, strict=True)]


class RecordedForces:
    """The force samples of a recording: its floor, samples a second, and pieces of it, read as they are asked for.

    Times are seconds from the recording's first frame on.
    """

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self.floor = recording.floor
        self.rate = recording.rate_hz
        self.rate_hz = recording.force_rate_hz
        self.first, self.end = recording.span

    @property
    def length_s(self) -> float:
        """The seconds that were recorded."""
        return (self.end - self.first) / self.rate

    def frame_at(self, time_s: float) -> int:
        """Return the session frame of a second."""
        return self.first + round(time_s * self.rate)

    def pieces(self) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield times (n,) and corner forces (n, tiles, 4), block by block."""
        for _, rows in self._recording.blocks("force"):
            yield (rows[:, 0] - self.first) / self.rate, rows[:, 2:].reshape(len(rows), -1, 4)

    def found(self) -> Iterator[Detections]:
        """Yield contacts and footsteps, piece by piece, with what is noted of the steps."""
        notes = self._recording.notes()
        for found in find_steps(self.pieces(), self.floor, self.rate_hz):
            yield replace(found, steps=notes.on(found.steps))


def survey(recording: Recording, progress: Callable[[Survey], bool]) -> Survey:
    """Find contacts and footsteps; `progress` is given what there is so far, and says whether to go on."""
    forces = RecordedForces(recording)
    return survey_of(forces.found(), forces.length_s, progress)


def survey_of(stream: Iterable[Detections], length_s: float, progress: Callable[[Survey], bool]) -> Survey:
    """Collect what is found in forces of this length, as `survey` does."""
    made, means = Survey(), BalanceMeans()
    for found, stances in with_stances(stream):
        made.contacts += map(_span, found.finished)
        made.steps += stances
        made.balance += means.take(found.rows)
        if len(found.rows):
            made.until_s = float(found.rows.time_s[-1])
        if not progress(made):
            return made
    made.balance += means.rest()
    made.until_s, made.whole = length_s, True
    return made


def with_stances(stream: Iterable[Detections]) -> Iterator[tuple[Detections, list[Stance]]]:
    """Yield what is found in forces, piece by piece, each with its footsteps and their force over the stance."""
    curves: dict[int, tuple[float, ...]] = {}
    for found in stream:
        curves |= {contact.id: stance_of(contact) for contact in found.finished if is_step(contact)}
        yield found, [Stance(step, curves.pop(step.contact)) for step in found.steps]


def stance_of(contact: Contact) -> tuple[float, ...]:
    """Return the force of a contact at 0 to 100 % of its duration, to 0.1 N.

    >>> ramp = np.linspace(0.0, 500.0, 51)
    >>> stance = stance_of(Contact(1, 0.0, 0.5, (0,), False, 0.0, 0.0, np.linspace(0, 0.5, 51), ramp, ramp, ramp))
    >>> len(stance), stance[0], stance[50], stance[100]
    (101, 0.0, 250.0, 500.0)
    """
    at = np.linspace(contact.time_s[0], contact.time_s[-1], STANCE)
    return tuple(np.interp(at, contact.time_s, contact.force_n).round(1).tolist())


def _span(contact: Contact) -> ContactSpan:
    at_s = np.arange(contact.start_s, contact.time_s[-1] + PLACES_S, PLACES_S)
    curves = ((contact.x_m, 3), (contact.y_m, 3), (contact.force_n, 0))
    columns = [np.interp(at_s, contact.time_s, values).round(digits).tolist() for values, digits in curves]
    places = tuple(zip(*columns, strict=True))
    return ContactSpan(contact.id, contact.start_s, contact.end_s, tuple(map(int, contact.tiles)), places)


# --- the cache ---


def load_cached_survey(recording: Recording) -> Survey | None:
    """Return the cached survey of a recording in its present state; None if there is none."""
    found = _cached(recording, Survey)  # with what was noted when it was made
    if found is not None:
        found.steps = noted_stances(found.steps, recording.notes())
    return found


def load_cached_steps(recording: Recording) -> list[Stance] | None:
    """Return the footsteps alone of the cached survey of a recording, as `load_cached_survey` does."""
    found = _cached(recording, _Steps)
    return None if found is None else noted_stances(found.steps, recording.notes())


def cached_step_count(recording: Recording) -> int | None:
    """Return how many footsteps are in the cached survey of a recording; None if there is none. It is not all read."""
    found = _cached(recording, _Counted)
    return None if found is None else len(found.steps)


class _Steps(msgspec.Struct):
    """Of a `Survey`, what is read for its steps: the places of contacts are most of it."""

    steps: list[Stance]


class _Counted(msgspec.Struct):
    """Of a `Survey`, what is read to count its steps."""

    steps: list[msgspec.Raw]


_Kind = TypeVar("_Kind", Survey, _Steps, _Counted)


def _cached(recording: Recording, kind: type[_Kind]) -> _Kind | None:
    with suppress(OSError, msgspec.DecodeError):
        return msgspec.msgpack.decode(_place(recording, "survey").read_bytes(), type=kind)
    return None


def cache_survey(recording: Recording, made: Survey) -> None:
    """Keep a survey for the next time, unless the recording has grown since; a cache that cannot be written to is left
    alone."""
    if made.until_s != RecordedForces(recording).length_s:
        return
    with suppress(BadFile, OSError):
        path = _place(recording, "survey")
        make_folder(path.parent)
        with suppress(OSError):  # another program may remove the same ones
            files = sorted(path.parent.iterdir(), key=lambda file: file.stat().st_mtime)
            for old in files[: max(0, len(files) - 3 * KEPT)]:
                old.unlink(missing_ok=True)
        write_file(path, msgspec.msgpack.encode(made))


def cached_files(recording: Recording) -> tuple[Path, ...]:
    """Return the files of a recording in the cache, which may be missing; they are found by its path."""
    return tuple(_place(recording, suffix) for suffix in ("survey", "envelopes"))


def envelope_file(recording: Recording) -> Path:
    """Return the file for the envelopes of a recording of an earlier version."""
    return _place(recording, "envelopes")


def make_envelopes(recording: Recording, progress: Callable[[float], bool]) -> None:
    """Make the envelopes of a recording that has none, in the cache; goes on where it was left.

    `progress` is given the share that is done, and says whether to go on. `BadFile` where the cache cannot be written
    to.
    """
    path = envelope_file(recording)
    make_folder(path.parent)
    frames = recording.rate_hz / recording.force_rate_hz
    first, end = recording.span
    try:
        with closing(sqlite3.connect(path, isolation_level=None)) as base:
            base.execute("pragma journal_mode = wal")
            base.executescript(envelopes.TABLE)
            for number, source in enumerate(envelopes.SOURCES):
                for share in _make_of(base, recording, source, frames):
                    if not progress((number + (share - first) / max(end - first, 1)) / len(envelopes.SOURCES)):
                        return
            base.execute("pragma user_version = 1")
            base.execute("pragma journal_mode = delete")
    except sqlite3.Error as error:
        raise BadFile(f"{path} cannot be written: {error}") from None


def has_envelopes(recording: Recording) -> bool:
    """Return whether a recording's envelopes are complete, in its file or in the cache."""
    if recording.envelope_base() is not None:
        return True
    with suppress(sqlite3.Error), closing(open_envelopes(recording)) as base:
        return bool(base.execute("pragma user_version").fetchone()[0] == 1)
    return False


def open_envelopes(recording: Recording) -> sqlite3.Connection:
    """Open the cached envelopes, as far as they are complete; `sqlite3.Error` if there are none."""
    return sqlite3.connect(f"{uri_of(envelope_file(recording))}?mode=ro", uri=True)


def _make_of(base: sqlite3.Connection, recording: Recording, source: str, frames: float) -> Iterator[float]:
    """Put block after block; gives the session frame that was reached, now and then, when all before is safe."""
    done = envelopes.end_of(base, source)
    base.execute("begin")
    for number, (at, rows) in enumerate(recording.blocks(source)):
        first = round(rows[0, 0]) if source == "force" else at
        if first >= done:
            values = envelopes.loads(rows[:, 2:]) if source == "force" else rows
            envelopes.put(base, source, first, values, frames if source == "force" else 1.0)
        if number % 20 == 19:
            base.execute("commit")
            yield first
            base.execute("begin")
    base.execute("commit")


def _place(recording: Recording, suffix: str) -> Path:
    """Return the cache file for a recording in its present state and length; marks do not change it.

    What is said about it tells it from one that had its name before: when it was begun, floor, patch and all else.
    """
    said = f"{FORMAT}|{recording.path.resolve()}|{recording.span}|{sorted(recording.about.items())}"
    name = hashlib.sha256(said.encode()).hexdigest()[:24]
    return cache_folder() / "recordings" / f"{name}.{suffix}"
