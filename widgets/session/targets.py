"""The choices of the target chooser."""

from pathlib import Path

from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.target import Target
from underfoot.floor.layout import grid_of
from underfoot.patch import preset_files
from underfoot.widgets.main_bar import Choices

GRIDS = ((2, 2), (6, 6))
"""Rows and columns of floors that are chosen without a question."""


def choices() -> Choices:
    """Return the floors and tiles to choose from, by keys: a kind and, if no question follows, the choice within it."""
    return (
        *((f"simulator {rows} {columns}", f"Simulated floor  {rows} × {columns}") for rows, columns in GRIDS),
        ("grid", "Simulated floor of another size…"),
        ("floor", "Simulated floor from a file…"),
        (
            (
                ("simulation ideal", "Ideal sensors"),
                *((f"simulation {name}", display_name(Path(name))) for name in preset_files.simulations()),
                ("", ""),
                ("simulation", "Open…"),
            ),
            "Simulated tile or people",
        ),
        ("", ""),
        ("recording", "Open a recording…"),
        ("forces", "Play recorded forces from a file…"),
        ("", ""),
        *((f"transport {scheme}", f"{transport.title}…") for scheme, transport in TRANSPORTS.items()),
    )


def keys_of(target: Target) -> frozenset[str]:
    """Return the keys of the choices that make up a target: its floor, or where its forces come from, and its tiles.

    >>> from underfoot.floor.layout import default_floor
    >>> sorted(keys_of(Target(default_floor(6, 6))))
    ['simulation ideal', 'simulator 6 6']
    >>> sorted(keys_of(Target(default_floor(3, 4))))
    ['grid', 'simulation ideal']
    """
    if target.kind == "replay":
        return frozenset({"forces"})
    if target.kind in TRANSPORTS:
        return frozenset({f"transport {target.kind}"})
    known = {str(path): f"simulation {name}" for name, path in preset_files.simulations().items()}
    tile = known.get(target.simulation, "simulation") if target.simulation else "simulation ideal"
    grid = grid_of(target.floor)
    return frozenset({tile, f"simulator {grid[0]} {grid[1]}" if grid in GRIDS else "grid" if grid else "floor"})


def display_name(path: Path) -> str:
    """Return a file's name for display.

    >>> display_name(Path("presets/plywood-tile.json"))
    'Plywood tile'
    """
    return path.stem.replace("-", " ").replace("_", " ").capitalize()
