"""The folder of a floor's calibration profiles."""

import hashlib
import re
from pathlib import Path

from underfoot.floor.layout import Floor


def profile_folder(root: Path, floor: Floor, simulation: str = "") -> Path:
    """Return the folder below `root` of this floor's profiles, named by its title and a hash of its tiles' layout.

    Tiles simulated from a parameter file have their own profiles, with a folder for each file.

    >>> from underfoot.floor.layout import default_floor
    >>> profile_folder(Path("profiles"), default_floor()).name.startswith("2-x-2-tiles-")
    True
    >>> profile_folder(Path("profiles"), default_floor(), "presets/plywood-tile.json").name.endswith("-plywood-tile")
    True
    """
    name = re.sub(r"[^A-Za-z0-9]+", "-", floor.title).strip("-").lower() or "floor"
    return root / f"{name[:40]}{_ending(floor, simulation)}"


def profiles_elsewhere(folder: Path, floor: Floor, simulation: str) -> list[Path]:
    """Return the folders beside this one with profiles of the same tiles, of a floor with another title; none at first.

    Which of two floors with the same tiles it is, nobody can tell: these are named, and not used.
    """
    beside = sorted(folder.parent.iterdir()) if folder.parent.is_dir() else []
    return [one for one in beside if one.name.endswith(_ending(floor, simulation)) and one != folder]


def _ending(floor: Floor, simulation: str) -> str:
    """Return what the names of the folders of these tiles end with."""
    simulated = f"-{Path(simulation).stem}" if simulation else ""
    return f"-{hashlib.sha256(Floor(floor.tiles).dumps()).hexdigest()[:8]}{simulated}"
