"""What a calibration asks for in the window, and the creation of its procedure for a tile of a target."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from underfoot.calibration.declaration import PRESSING, SHAKING, STEPPING, Calibration, MeasurementSetup
from underfoot.calibration.procedure import Procedure
from underfoot.calibration.rig import Rig
from underfoot.devices.accelerometers import LINK, Accelerometer
from underfoot.devices.force_source import WITHOUT_HARDWARE
from underfoot.engine.target import Target
from underfoot.errors import BadValue, DeviceError
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Profile
from underfoot.parameters import Parameter, Text, ask

if TYPE_CHECKING:
    from underfoot.floor.simulated_tile import SimulatedTile

MakeProcedure = Callable[[type[Calibration], Target, Tile, Profile, str], tuple[Procedure, Rig]]
"""Makes the procedure of a calibration, and its rig, of target, tile, its profile and the entered reference."""


def by_hand(target: Target) -> bool:
    """Return whether a person presses the tile, because the target is hardware."""
    return target.kind not in WITHOUT_HARDWARE


def why_not(target: Target) -> str:
    """Return why tiles of a target cannot be calibrated; "" if they can."""
    if target.kind == "replay":
        return "A recording cannot be pressed. Choose the simulated floor or a tile as the target."
    return ""


def reference_asked(declared: type[Calibration], target: Target) -> Parameter | None:
    """Return the parameter that asks for a calibration's reference; None where none is needed: the simulator asks only
    for a plate.
    """
    return _REFERENCES[declared.rig] if by_hand(target) or declared.rig == STEPPING else None


def make_procedure(
    declared: type[Calibration], target: Target, tile: Tile, profile: Profile, reference: str
) -> tuple[Procedure, Rig]:
    """Create the procedure of a calibration, and the rig that it needs."""
    known = _known_accelerometer(target, tile, reference)
    setup = MeasurementSetup(
        tile,
        profile,
        rate_hz=target.rate,
        block=target.block,
        full_scale_m_s2=known.m_s2_per_unit if known is not None else None,
        has_load_cell=not by_hand(target) or bool(reference),
        sensors=_sensors(declared.rig, reference if by_hand(target) else ""),
    )
    return declared().procedure(setup), _RIGS[declared.rig](target, tile, reference)


def _sensors(rig: str, reference: str) -> tuple[str, str]:
    """Return what load cell and displacement sensor of the entered `reference` are called in a report.

    >>> _sensors(STEPPING, "/dev/ttyACM0 9.2:0.001:120 9.1:0.05:60")
    ('load cell, 0.05 N a count, 60 at rest', 'displacement, 0.001 mm a count, 120 at rest')
    >>> _sensors(PRESSING, "9.1:0.05:120"), _sensors(SHAKING, "USB Audio")
    (('load cell, 0.05 N a count, 120 at rest', ''), ('load cell', ''))
    """
    from underfoot.calibration.rigs.device import sensor_names

    _, displacement, cell = _plate_and_sensors(reference) if rig == STEPPING else ("", "", reference)
    return sensor_names("" if rig == SHAKING else cell, displacement)


def _plate_and_sensors(entered: str) -> tuple[str, str, str]:
    """Return port of the plate, displacement sensor and load cell, as far as they were entered.

    >>> _plate_and_sensors("/dev/ttyACM0 9.2:0.001:120")
    ('/dev/ttyACM0', '9.2:0.001:120', '')
    """
    plate, displacement, cell = (*entered.split(), "", "", "")[:3]
    return plate, displacement, cell


def _pressing_rig(target: Target, tile: Tile, cell: str) -> Rig:
    """Create a rig that presses `tile`: the simulator, or a person, with a load cell if one is named."""
    from underfoot.calibration.rigs.device import DeviceRig, load_cell_of
    from underfoot.calibration.rigs.simulated_hand import SimulatedHand
    from underfoot.devices.transports import transport_of

    if not by_hand(target):
        return SimulatedHand(_simulated(target, tile))
    port = transport_of(target.kind, target.source)
    return DeviceRig(port, target.floor.index(tile.id), load_cell_of(cell) if cell else None, _SILENT_S)


def _shaking_rig(target: Target, tile: Tile, accelerometer: str) -> Rig:
    """Create a rig that shakes `tile`: the simulator, or the sound card with the accelerometer's input."""
    from underfoot.devices.outputs import outputs_of
    from underfoot.engine.shaker_rigs import SimulatedShaker, SoundCard, channels_of

    if not by_hand(target):
        return SimulatedShaker(_simulated(target, tile))
    if target.sound is None:
        raise DeviceError("no sound device is chosen; choose the one that drives the shakers under Audio")
    channel, opened = channels_of(target.floor, tile)
    known = _known_accelerometer(target, tile, accelerometer)
    if known is None:
        return SoundCard(target.sound, accelerometer, channel, channels=opened, of_floor=True)
    # As the engine does: it records on the first card.
    card = outputs_of(target.sound)[0].name
    return SoundCard(target.sound, card, channel, known.channel, channels=opened, of_floor=True)


def _known_accelerometer(target: Target, tile: Tile, card: str) -> Accelerometer | None:
    """Return the accelerometer of a tile on an input that is given under Audio; None if a `card` was entered."""
    heard = [one for one in target.accelerometers if one.tile == tile.id and one.channel != LINK]
    return heard[0] if heard and by_hand(target) and not card else None


def _stepping_rig(target: Target, tile: Tile, plate: str) -> Rig:
    """Create a rig that steps on a plate on `tile`: the simulator, or a person, with the sensors that are named."""
    from underfoot.calibration.rigs.device import DeviceRig, displacement_of, load_cell_of
    from underfoot.calibration.rigs.plate import PlateRig, simulated_plate_rig
    from underfoot.devices.plate import SIMULATED, PlateServo
    from underfoot.devices.transports import transport_of

    plate_at, displacement, cell = _plate_and_sensors(plate)
    if not by_hand(target):
        return simulated_plate_rig(_simulated(target, tile), plate_at or SIMULATED)
    if not displacement:
        raise BadValue(
            f"plate is {plate!r}; allowed: its port and a displacement sensor, as /dev/ttyACM0 9.2:0.001:120"
        )
    sensor, load_cell = displacement_of(displacement), load_cell_of(cell) if cell else None
    servo = PlateServo(plate_at)
    try:
        port = transport_of(target.kind, target.source)
        rig = DeviceRig(port, target.floor.index(tile.id), load_cell, _SILENT_S, sensor)
        return PlateRig(rig, servo)
    except BaseException:
        servo.close()
        raise


def _simulated(target: Target, tile: Tile) -> "SimulatedTile":
    """Return the tile as in the simulated floor of `target`; for an ideal floor, one of the usual kind."""
    from underfoot.floor.simulated_tile import SimulatedTile
    from underfoot.floor.tile_parameters import simulation

    return SimulatedTile(tile, simulation(target.simulation)[0])


_SILENT_S = 3.0
"""Time without a reading after which that is said: somebody stands there and presses."""

_RIGS = {PRESSING: _pressing_rig, SHAKING: _shaking_rig, STEPPING: _stepping_rig}
_REFERENCES = {
    PRESSING: ask(
        "load_cell",
        Text(
            "",
            doc="A load cell on the tile's line: its tile number and sensor, newtons a count, and its reading at rest, "
            "as 9.1:0.05:120. Nothing: Forces asks for known weights, and Places takes the tile's own newtons.",
        ),
    ),
    SHAKING: ask(
        "accelerometer",
        Text(
            "",
            doc="The sound card that hears it, by a part of its name: its first input. Nothing: the tile's "
            "accelerometer under Audio, else the default input.",
        ),
    ),
    STEPPING: ask(
        "plate",
        Text(
            "",
            doc="The serial port of the plate; on the simulator, nothing: a simulated plate. On a tile, then a "
            "displacement sensor on the tile's line: its tile number and sensor, mm a count, and its reading at rest, "
            "as 9.2:0.001:120. Then a load cell, as 9.1:0.05:120; nothing: the tile measures the force.",
        ),
    ),
}
"""Parameters that ask for a rig's reference on hardware."""
