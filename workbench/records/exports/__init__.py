"""Recordings for other programs: a file of this folder is a format, and declares itself as `FORMAT`.

A new file is a new format; `underfoot export` and the window offer what is here.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadFile, UnderfootError
from underfoot.floor.step_finder import Detections
from underfoot.records.recording import Recording
from underfoot.records.survey import RecordedForces

VIBRATION = ("commanded", "measured", "vibration")
"""Commanded and measured acceleration of tiles, m/s^2, and their drive, relative to full scale."""


class ExportStopped(UnderfootError):
    """Whoever asked for an export wants it no more; nothing of it is left."""


@dataclass(frozen=True)
class ExportSource:
    """A recording as formats take it. Times are seconds from its first frame on, as the window shows them."""

    recording: Recording
    vibration: str = "measured"
    """The one of `VIBRATION` that a format takes which carries one alone."""
    progress: Callable[[str, float], bool] = field(default=lambda text, share: True)
    """Receives the current step and its completed share; returns whether to continue."""

    def __post_init__(self) -> None:
        if self.recording.span == (0, 0):
            raise BadFile(f"{self.recording.path} holds nothing to export: it was ended before its first frame")

    @property
    def forces(self) -> RecordedForces:
        """Its floor, its rates and its force samples."""
        return RecordedForces(self.recording)

    def pieces(self, text: str) -> Iterator[tuple[NDArray[np.float64], NDArray[np.float64]]]:
        """Yield times (n,) and corner forces (n, tiles, 4), piece by piece."""
        forces = self.forces
        for time_s, force_n in forces.pieces():
            self.report_progress(text, float(time_s[-1]) / max(forces.length_s, 1e-9))
            yield time_s, force_n

    def found(self, text: str) -> Iterator[Detections]:
        """Yield contacts and footsteps, piece by piece."""
        forces = self.forces
        for found in forces.found():
            if len(found.rows):
                self.report_progress(text, float(found.rows.time_s[-1]) / max(forces.length_s, 1e-9))
            yield found

    def frames(self, source: str, text: str) -> Iterator[NDArray[np.float32]]:
        """Yield a table of `VIBRATION`, [frame, tile], for the whole recording, piece by piece; 0 in gaps."""
        forces = self.forces
        at = forces.first
        for first, rows in self.recording.blocks(source, forces.first, forces.end):
            if first > at:
                yield from _still(first - at, len(forces.floor.tiles))
            kept = rows[max(at - first, 0) : forces.end - first]
            self.report_progress(text, (first - forces.first) / max(forces.end - forces.first, 1))
            yield kept
            at = max(at, first + len(rows))
        yield from _still(forces.end - at, len(forces.floor.tiles))

    def marks(self) -> list[tuple[float, str]]:
        """Return time in seconds and text of the marks."""
        forces = self.forces
        return [((mark.frame - forces.first) / forces.rate, mark.text) for mark in self.recording.marks()]

    def report_progress(self, text: str, share: float) -> None:
        """Report the progress; raise `ExportStopped` if the export was cancelled."""
        if not self.progress(text, min(max(share, 0.0), 1.0)):
            raise ExportStopped("the export was stopped")


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
    found = [getattr(import_module(f"{__name__}.{one.name}"), "FORMAT", None) for one in iter_modules(__path__)]
    return {one.suffix: one for one in sorted((f for f in found if f is not None), key=lambda f: f.suffix)}


def format_of(path: Path) -> ExportFormat:
    """Return the format of a file by its suffix; `BadFile` if there is none."""
    known = formats()
    if path.suffix.lower() not in known:
        raise BadFile(f"{path} has the suffix {path.suffix or '(none)'}; allowed: {', '.join(known)}")
    return known[path.suffix.lower()]


def _still(frames: int, tiles: int) -> Iterator[NDArray[np.float32]]:
    for begin in range(0, frames, 48_000):
        yield np.zeros((min(48_000, frames - begin), tiles), np.float32)
