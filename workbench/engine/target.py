"""Target of a session: where force comes from and vibration goes."""

from pathlib import Path

from msgspec import Struct

from underfoot.clock import RATE_HZ
from underfoot.devices.accelerometers import LINK, Accelerometer
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.force_source import SENSOR_HZ, WITHOUT_HARDWARE, ForceSource
from underfoot.devices.replay import Replay
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.devices.transport import asked
from underfoot.devices.transports import TRANSPORTS, split_target, transport_of
from underfoot.errors import BadValue, DeviceError, require
from underfoot.files import names_file
from underfoot.floor.forces import LEAST_HZ, MOST_HZ, ForceSeries
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.profile import profiles_of
from underfoot.floor.simulated_plates import PlateOutput
from underfoot.floor.tile_parameters import simulation
from underfoot.records.force_files import read_force_file


class Target(Struct, frozen=True):
    """The source of force and the output of vibration. Plain data: files and devices are opened by the engine."""

    floor: Floor
    kind: str = "simulator"
    """One of `WITHOUT_HARDWARE`, or the scheme of a transport."""
    source: str = ""
    """File of a replay, or address of a transport."""
    sound: str | None = None
    """Name of the sound device; "" for the system's own, None for none."""
    rate: int = RATE_HZ
    """Frames per second."""
    block: int = 128
    """Frames per block."""
    walker: bool = True
    """Whether somebody walks on a simulated floor."""
    latency_s: float = 0.0
    """Requested latency of the sound device; 0 for the least."""
    profiles: str = ""
    """Folder of the tiles' profiles; "" for none."""
    simulation: str = ""
    """Parameter file of simulated tiles, or people, as `simulation_of` returns it."""
    sensor_hz: float = SENSOR_HZ
    """Sample rate of hardware."""
    beside: tuple[int, ...] = ()
    """Numbers on the tiles' line that are no tile's: of load cells and displacement sensors."""
    accelerometers: tuple[Accelerometer, ...] = ()
    round_trip_frames: int = 0
    """Measured round trip of the sound device; 0 if not measured."""
    stretch_s: tuple[float, float] | None = None
    """Start and end of the stretch of a file that is replayed; None for all of it."""
    repeats: bool = True
    """Whether a file is replayed again and again, or once."""


def simulation_of(text: str) -> str | None:
    """Return the simulation in a target's text: a parameter file or people, "" for neither; None if not simulated.

    A preset may be named instead of its file. `BadValue` for a name that is none's.

    >>> simulation_of("simulator"), simulation_of("simulator:people=2"), simulation_of("walk.csv")
    ('', 'people=2', None)
    """
    kind, _, named = text.partition(":")
    if kind != "simulator":
        return None
    if not named or "=" in named or names_file(named):
        return named
    from underfoot.patch.preset_files import simulations  # which most starts need not load

    presets = simulations()
    require(named in presets, "simulator", named, f"PARAMETERS.json, people=N,path=PATH, {', '.join(presets)}")
    return str(presets[named])


def live_target(name: str, floor: str | Path | None = None, sensor_hz: float | None = None) -> Target | None:
    """Return the simulator or hardware of this name on the floor in a file, by default the default floor.

    Return None for another name, such as a file's. `sensor_hz`: how many samples per second the tiles of hardware
    send, `LEAST_HZ` to `MOST_HZ`; by default 1000. Raise `BadValue` for another rate, and for any rate where the target
    has its own.

    >>> live_target("udp:127.0.0.1:9000").kind, live_target("simulator:people=2").simulation, live_target("walk.csv")
    ('udp', 'people=2', None)
    >>> live_target("udp:127.0.0.1:9000", sensor_hz=200.0).sensor_hz
    200.0
    """
    hardware, simulation = split_target(name), simulation_of(name)
    if sensor_hz is not None:
        if hardware is None:
            raise BadValue(f"--sensor-rate is for tiles of hardware; {name} has its own rate")
        if not LEAST_HZ <= sensor_hz <= MOST_HZ:
            raise BadValue(f"--sensor-rate is {sensor_hz:g}; allowed: {LEAST_HZ:g} to {MOST_HZ:g} Hz")
    if hardware is None and simulation is None:
        return None
    kind, source = hardware or ("simulator", "")
    layout = Floor.load(floor) if floor else default_floor()
    return Target(layout, kind, source, simulation=simulation or "", sensor_hz=sensor_hz or SENSOR_HZ)


def sound_device(option: str | None) -> str | None:
    """Return the device of an option, as `Target.sound`: the option's "default" is the system's own.

    >>> sound_device("default"), sound_device("hw:1"), sound_device(None)
    ('', 'hw:1', None)
    """
    return "" if option == "default" else option


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
    if target.kind in WITHOUT_HARDWARE:
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
        asked(transport, transport.open)
        asked(transport, transport.close)


def source_of(target: Target, frame: int = 0) -> ForceSource:
    """Return the force source of a target, from session frame `frame` on. A `DeviceFloor` reads once it is started."""
    if target.kind == "replay":
        return Replay(_recorded(target), target.floor, target.rate, start=frame, repeats=target.repeats)
    profiles = profiles_of(target.profiles, target.floor)
    if target.kind in TRANSPORTS:
        transport = transport_of(target.kind, target.source)
        return DeviceFloor(
            transport, target.floor, target.rate, profiles, target.sensor_hz, frame, beside=target.beside
        )
    if target.kind != "simulator":
        allowed = ", ".join((*WITHOUT_HARDWARE, *TRANSPORTS))
        raise DeviceError(f"there is no target of kind {target.kind!r}; allowed: {allowed}")
    tiles, people = simulation(target.simulation)
    simulated = SimulatedFloor(
        target.floor, target.rate, walking=target.walker, simulation=tiles, profiles=profiles, people=people
    )
    simulated.skip(frame)
    return simulated


def _recorded(target: Target) -> ForceSeries:
    return read_force_file(target.source, target.floor, target.stretch_s)[0]
