"""The measured walks beside this checkout, read in place; none of them is copied."""

from pathlib import Path

import numpy as np
import pytest

from underfoot.floor.forces import floor_beside, read_forces
from underfoot.floor.layout import Floor

DATA = Path(__file__).resolve().parents[2] / "../shared/data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"the measured walks are not at {DATA}")

WALKS = ("adult/walk1", "adult/walk2", "adult/walk3", "three-steps/walk", "two-plates/walk")


def walk(name):
    """Return floor and forces of a walk."""
    path = DATA / f"{name}.csv"
    floor = Floor.load(floor_beside(path))
    return floor, read_forces(path, floor)


def reference_centroids(name, tile):
    """Return the reference's centroid for a tile, in its frame: shape (n, 2), NaN where it is blank."""
    path = DATA / f"{name}.reference.csv"
    columns = path.read_text().splitlines()[0].split(",")
    table = np.genfromtxt(path, delimiter=",", skip_header=1)
    return table[:, columns.index(f"{tile}_cop_x") :][:, :2]


def reference_steps(name):
    """Return the README's figures of a walk's tiles: ms, peak, valley, peak (N), impulse (N s) and loading (kN/s)."""
    folder, _, file = name.partition("/")
    label = f"{folder} {file}" if folder == "adult" else folder
    steps = {}
    for line in (DATA / "README.md").read_text().splitlines():
        cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if cells[0] == label and len(cells) == 8:
            steps[cells[1]] = [float(cell.split()[0]) for cell in cells[2:]]
    return steps
