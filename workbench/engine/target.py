"""Target of a session: where force comes from and vibration goes."""

from msgspec import Struct

from underfoot.devices.accelerometers import LINK, Accelerometer
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.force_source import SENSOR_HZ, ForceSource
from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transports import TRANSPORTS, transport_of
from underfoot.errors import DeviceError
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile, profiles_of
from underfoot.floor.simulated_plates import PlateOutput
from underfoot.floor.tile_parameters import simulation
from underfoot.records.force_files import read_force_file


class Target(Struct, frozen=True):
    """The source of force and the output of vibration."""

    floor: Floor
    kind: str = "simulator"
    source: str = ""
    sound: str | None = None
    rate: int = 48_000
    block: int = 128
    walker: bool = True
    latency_s: float = 0.0
    profiles: str = ""
    simulation: str = ""
    sensor_hz: float = SENSOR_HZ
    accelerometers: tuple[Accelerometer, ...] = ()
    round_trip_frames: int = 0
    stretch_s: tuple[float, float] | None = None


def simulation_of(text: str) -> str | None:
    """Return the simulation in a target's text: a parameter file or people, "" for neither; None if not simulated.

    >>> simulation_of("simulator"), simulation_of("simulator:people=2"), simulation_of("walk.csv")
    ('', 'people=2', None)
    """
    kind, _, path = text.partition(":")
    return path if kind == "simulator" else None


def force_rate_hz(target: Target) -> float:
    """Return the force sample rate of a target; `BadFile` or `BadValue` if its file or address is invalid."""
    if target.kind == "replay":
        return _recorded(target).rate_hz
    if target.kind in TRANSPORTS:
        transport_of(target.kind, target.source)
        return target.sensor_hz
    return SENSOR_HZ


def is_simulated(target: Target) -> bool:
    """Return whether the tiles' response is simulated. Accelerometers on the card's inputs take precedence."""
    if target.kind in ("simulator", "replay"):
        return all(accelerometer.channel == LINK for accelerometer in target.accelerometers)
    return bool(target.simulation) and not target.accelerometers


def plates_of(target: Target) -> tuple[PlateOutput, ...]:
    """Return the places on simulated plates where a session measures acceleration."""
    return ("accelerometer",) if is_simulated(target) else ()


def require_source(target: Target) -> None:
    """Raise `DeviceError` or `BadFile`, before a session begins, if a transport or a file cannot be opened."""
    simulation(target.simulation)
    if target.kind in TRANSPORTS:
        transport = transport_of(target.kind, target.source)
        transport.open()
        transport.close()


def source_of(target: Target, frame: int = 0) -> ForceSource:
    """Return the force source of a target, from session frame `frame` on. A `DeviceFloor` reads once it is started."""
    if target.kind == "replay":
        return Replay(_recorded(target), target.floor, target.rate, start=frame, repeats=True)
    if target.kind in TRANSPORTS:
        transport = transport_of(target.kind, target.source)
        return DeviceFloor(transport, target.floor, target.rate, _profiles(target), target.sensor_hz, frame)
    if target.kind != "simulator":
        allowed = ", ".join(("simulator", "replay", *TRANSPORTS))
        raise DeviceError(f"there is no target of kind {target.kind!r}; allowed: {allowed}")
    tiles, people = simulation(target.simulation)
    simulated = SimulatedFloor(
        target.floor, target.rate, walking=target.walker, simulation=tiles, profiles=_profiles(target), people=people
    )
    simulated.skip(frame)
    return simulated


def _recorded(target: Target) -> ForceSeries:
    return read_force_file(target.source, target.floor, target.stretch_s)[0]


def _profiles(target: Target) -> dict[str, Profile]:
    return profiles_of(target.profiles, target.floor) if target.profiles else {}
