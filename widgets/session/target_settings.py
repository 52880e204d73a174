"""Targets from the settings, and their descriptions."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

from underfoot.devices.accelerometers import Accelerometer, accelerometers_of
from underfoot.devices.transports import TRANSPORTS
from underfoot.devices.transports.serial import LASTING_NAMES
from underfoot.engine.target import Target
from underfoot.errors import BadValue, UnderfootError
from underfoot.floor.layout import Floor, default_floor, grid_of
from underfoot.floor.tile_parameters import simulation
from underfoot.quantities import counted
from underfoot.records.force_files import floor_of
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.session.targets import display_name


def make_target(settings: Settings, kind: str, source: str, floor: Floor) -> Target:
    """Return a target with the sound device of the settings; a simulated one has their simulated tile."""
    simulated = kind == "simulator"
    return Target(
        floor=floor,
        kind=kind,
        source="" if simulated else source,
        simulation=settings.simulation if simulated else "",
        sound=settings.sound,
        rate=settings.rate,
        block=settings.block,
        accelerometers=_accelerometers(settings, floor),
    )


def _accelerometers(settings: Settings, floor: Floor) -> tuple[Accelerometer, ...]:
    """Return the accelerometers of the settings; none on a floor that lacks one of their tiles."""
    try:
        return accelerometers_of(settings.accelerometers, floor)
    except BadValue:
        return ()


def remembered_target(settings: Settings) -> Target:
    """Return the last target; the simulated floor of four ideal tiles if its file is gone."""
    try:
        if settings.kind == "replay":
            return make_target(settings, "replay", settings.source, floor_of(settings.source))
        floor = Floor.load(settings.source) if settings.source else default_floor(settings.rows, settings.columns)
        simulation(settings.simulation)
    except UnderfootError:
        floor, settings.simulation = default_floor(), ""
    return make_target(settings, "simulator", "", floor)


def numbers_beside(references: Mapping[str, str]) -> tuple[int, ...]:
    """Return the numbers on the tiles' line of the sensors among the references of calibrations.

    >>> numbers_beside({"fsr": "9.1:0.05:120", "plate": "/dev/ttyACM0 12.2:0.001 9.1:0.05", "response": "USB 2.0: Mic"})
    (9, 12)
    """
    words = " ".join(references.values()).split()
    if not words:
        return ()
    from underfoot.calibration.rigs.device import load_cell_of  # which most windows need not load at their start

    found = set[int]()
    for word in words:
        with suppress(BadValue):
            found.add(load_cell_of(word).tile)
    return tuple(sorted(found))


def target_text(target: Target) -> str:
    """Describe a target.

    >>> target_text(Target(default_floor(2, 3)))
    'Simulated floor  2 × 3'
    >>> target_text(Target(default_floor(2, 3), simulation="presets/plywood-tile.json"))
    'Plywood tile  2 × 3'
    >>> target_text(Target(default_floor(), "serial", "/dev/serial/by-id/usb-Teensyduino_12345670-if00"))
    'Serial port  usb-Teensyduino_12345670-if00'
    """
    if target.kind == "replay":
        return f"Recorded forces  {Path(target.source).stem}"
    if target.kind in TRANSPORTS:
        return f"{TRANSPORTS[target.kind].label}  {target.source.replace(f'{LASTING_NAMES}/', '')}"
    what = display_name(Path(target.simulation)) if target.simulation else "Simulated floor"
    grid = grid_of(target.floor)
    where = f"{grid[0]} × {grid[1]}" if grid else target.floor.title or counted(len(target.floor.tiles), "tile")
    return f"{what}  {where}"
