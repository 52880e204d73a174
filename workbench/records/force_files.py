"""Files that forces are read from: a force CSV with its floor beside it, a recording, or force plates in a C3D file."""

import os
from pathlib import Path

import numpy as np

from underfoot.errors import BadFile
from underfoot.files import no_file
from underfoot.floor.forces import ForceSeries, load_floor_beside, read_forces, require_room
from underfoot.floor.layout import Floor
from underfoot.patch.preset_files import walks
from underfoot.quantities import counted
from underfoot.records.notes import Notes
from underfoot.records.recording import Recording, is_recording

_TWO, _THIRD = "a force CSV, a recording", "a C3D file with force plates"
FORMS = f"{_TWO}, or {_THIRD}"


def read_force_file(
    path: str | Path, floor: Floor | None = None, stretch_s: tuple[float, float] | None = None
) -> tuple[ForceSeries, Floor]:
    """Read the forces in a file, or in a part of it, with times in seconds from its beginning, and their floor.

    A recording and a C3D file bring their floor, and `floor` must have as many tiles if it is given; beside a CSV it is
    looked for where it is not given. Raises `BadFile` for what cannot be read, and for fewer than two samples.
    """
    path = Path(path)
    if not os.path.isfile(path):
        allowed = FORMS if path.suffix or path.is_absolute() else forms_or_walks()  # a word may be a walk
        raise BadFile(f"{path} cannot be read: {no_file(path)} (allowed: {allowed})")
    if is_recording(path):
        forces, own = _recorded(path, stretch_s)
    elif path.suffix.lower() == ".c3d":
        from underfoot.records.c3d_plates import read_plates

        forces, own = read_plates(path)
    else:
        own = floor or load_floor_beside(path)
        forces = read_forces(path, own)
    require_as_many_tiles(path, own, floor)
    return (forces if stretch_s is None else _cut(path, forces, stretch_s)), floor or own


def require_as_many_tiles(path: Path, own: Floor, floor: Floor | None) -> None:
    """Raise `BadFile` if the floor that is given for a file's forces, if any, has not as many tiles as its own."""
    if floor is not None and len(floor.tiles) != len(own.tiles):
        raise BadFile(f"{path} has {counted(len(own.tiles), 'tile')}; allowed: {len(floor.tiles)}, as the floor has")


def forms_or_walks() -> str:
    """Return in words what forces are read from where a name stands for a preset walk, too.

    >>> forms_or_walks()
    'a force CSV, a recording, a C3D file with force plates, or a preset walk: corridor'
    """
    return f"{_TWO}, {_THIRD}, or a preset walk: {', '.join(walks())}"


def floor_of(path: str | Path) -> Floor:
    """Return the floor of a file's forces, without reading the forces if possible."""
    path = Path(path)
    if is_recording(path):
        with Recording(path) as recording:
            return recording.floor
    if path.suffix.lower() == ".c3d":
        from underfoot.records.c3d_plates import floor_of_plates

        return floor_of_plates(path)
    return load_floor_beside(path)


def notes_of(path: Path) -> Notes | None:
    """Return what is noted of the steps in a file's forces; None if it is no recording."""
    if not is_recording(path):
        return None
    with Recording(path) as recording:
        return recording.notes()


def _recorded(path: Path, stretch_s: tuple[float, float] | None) -> tuple[ForceSeries, Floor]:
    with Recording(path) as recording:
        floor = recording.floor
        rate, force_rate = recording.rate_hz, recording.force_rate_hz
        first, end = recording.span
        begin, until = (first + rate * time_s for time_s in stretch_s) if stretch_s else (-np.inf, np.inf)
        length_s = (min(until, end) - max(begin, first)) / rate
        require_room(path, length_s, force_rate, len(floor.tiles))
        rows = recording.force_samples_between(max(begin, first - rate), min(until, end + rate))
    if len(rows) < 2:
        raise BadFile(f"{path} holds no force samples{' there' if stretch_s else ': it was ended before the first'}")
    return ForceSeries((rows[:, 0] - first) / rate, rows[:, 2:].reshape(len(rows), -1, 4), force_rate), floor


def _cut(path: Path, forces: ForceSeries, stretch_s: tuple[float, float]) -> ForceSeries:
    begin, end = np.searchsorted(forces.time_s, stretch_s)
    if end - begin < 2:
        raise BadFile(f"{path} has no samples from {stretch_s[0]:g} to {stretch_s[1]:g} s")
    return ForceSeries(forces.time_s[begin:end], forces.force_n[begin:end], forces.rate_hz)
