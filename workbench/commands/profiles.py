"""What the commands that calibrate have in common: which tile, its profile, and what is left behind."""

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from underfoot.commands.files import FILE, require_room
from underfoot.errors import BadFile, BadValue

if TYPE_CHECKING:
    from underfoot.calibration.procedures.procedure import Result
    from underfoot.floor.layout import Floor, Tile
    from underfoot.floor.profile import Profile
    from underfoot.floor.simulated_tile import SimulatedTile


_OPTIONS = (
    click.option("--floor", type=FILE, help="Floor JSON that has the tile and its sensors; the default floor without."),
    click.option("--tile", default="", help="Which tile; by default the only one of the file, or the floor's first."),
    click.option("--serial", default="", help="The tile's serial number, kept in its profile."),
    click.option("--seed", type=int, default=1, show_default=True, help="Of the simulated tile and hand."),
    click.option("--profile", type=FILE, help="Profile JSON to read and to write; what it holds besides stays."),
    click.option("--report", type=FILE, help="Folder for a page with pictures, figures and raw data."),
    click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON."),
)


def of_a_tile(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options that say which tile, and where what is found goes."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def require_writable(profile: Path | None, report: Path | None) -> None:
    """Say before the work, and not after it, that profile or report cannot be written."""
    require_room(profile)
    if report is not None and report.exists() and not report.is_dir():
        raise BadFile(f"{report} is not a folder")


def floor_of(path: Path | None) -> "Floor":
    """The floor in a file; the default one without."""
    from underfoot.floor.layout import Floor, default_floor

    return default_floor() if path is None else Floor.load(path)


def tile_of(floor: "Floor", tile: str) -> "Tile":
    """The tile with this id; the first one without."""
    return floor.tiles[floor.index(tile)] if tile else floor.tiles[0]


def simulated_tile(target: str, tile: "Tile", seed: int) -> "SimulatedTile | None":
    """The tile of the target "simulator" or "simulator:PARAMETERS.json"; None for another target."""
    from underfoot.engine.target import simulation_of
    from underfoot.floor.simulated_tile import SimulatedTile
    from underfoot.floor.tile_parameters import TileParameters

    path = simulation_of(target)
    if path is None:
        return None
    if seed < 0:
        raise BadValue(f"--seed is {seed}; allowed: 0 or more")
    return SimulatedTile(tile, TileParameters.load(path) if path else None, seed)


def own_profile(path: Path | None, tile: str, serial: str) -> "Profile":
    """The profile that is to be updated, or an empty one; one of another tile is refused before the work."""
    from underfoot.floor.profile import Profile, load_for_tile

    return Profile(tile=tile, serial=serial) if path is None or not path.exists() else load_for_tile(path, tile, serial)


def conclude(result: "Result", known: "Profile", path: Path | None, report: Path | None, as_json: bool) -> None:
    """Put the result into what is `known`: report first, then the profile, whole or not at all, then figures."""
    from underfoot.calibration.files.report import figures, write_report

    new = result.apply(known)
    if report is not None:
        write_report(result, report, new)
    if path is not None:
        new.save(path)
    if as_json:
        print(json.dumps(figures(result)))
        return
    print(result.verdict)
    for name, value, unit in result.quantities:
        print(f"{name.replace('_', ' ')}: {value:.4g} {unit}".rstrip())
    for warning in result.warnings:
        print(f"underfoot: {warning}", file=sys.stderr)
