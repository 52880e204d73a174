"""Files of a variable stiffness plate: footsteps on it, and its calibration for studies.

Footsteps are a CSV `position,footstep,force_n,displacement_mm`, a row per sample.
"""

from contextlib import suppress
from math import isfinite
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.csv_tables import read_csv_table
from underfoot.devices.plate import PlateCalibration
from underfoot.errors import BadFile
from underfoot.floor.profile import Profile

COLUMNS = ("position", "footstep", "force_n", "displacement_mm")
Profiles = dict[tuple[float, str], tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Force and displacement by position and footstep."""


def read_plate_profiles(path: str | Path) -> Profiles:
    """Read the footsteps in a file; `BadFile` names the invalid line."""
    table = read_csv_table(path, "a table of footsteps")
    missing = [name for name in COLUMNS if name not in table.names]
    if missing:
        raise BadFile(f"{path} has no column {missing[0]}; allowed: a CSV with the columns {', '.join(COLUMNS)}")
    found: dict[tuple[float, str], list[tuple[float, float]]] = {}
    for number, cells in table.rows:
        place, line = f"{path}, line {number}", dict(zip(table.names, cells, strict=True))
        position, force, displacement = (_number(place, name, line[name]) for name in (COLUMNS[0], *COLUMNS[2:]))
        if not 0.0 <= position <= 1.0:
            raise BadFile(f"{place}: position is {position:g}; allowed: 0 to 1, the servo's whole way")
        found.setdefault((position, line["footstep"]), []).append((force, displacement))
    if not found:
        raise BadFile(f"{path} has no samples; allowed: a CSV with the columns {', '.join(COLUMNS)}")
    arrays = {key: np.array(samples) for key, samples in found.items()}
    return {key: (samples[:, 0], samples[:, 1]) for key, samples in arrays.items()}


def _number(place: str, name: str, cell: str) -> float:
    """Return a cell's number; `BadFile` if it has none."""
    with suppress(ValueError):
        number = float(cell)
        if isfinite(number):
            return number
    raise BadFile(f"{place}: {name} is {cell[:60]!r}; allowed: a finite number")


def plate_file(profile_path: Path) -> Path:
    """Return the place of the plate's own file, beside its tile's profile.

    >>> plate_file(Path("t1.json")).name
    't1.plate.json'
    """
    return profile_path.with_suffix(".plate.json")


def write_plate_file(profile: Profile, profile_path: Path) -> Path | None:
    """Write the plate in a tile's profile to a separate file beside it, for studies; return None if there is no plate.

    >>> write_plate_file(Profile(tile="t1"), Path("t1.json")) is None
    True
    """
    part = profile.plate
    if part is None:
        return None
    path = plate_file(profile_path)
    error = part.error / 100.0 if part.error_unit else None
    calibration = PlateCalibration(
        positions=part.positions, stiffness_n_mm=part.stiffness_n_mm, error=error, made=part.made
    )
    calibration.save(path)
    return path
