"""`underfoot emulate`: a tile's firmware, or a floor's, without a tile."""

import threading
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, fields, make_dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import ended_by_signals
from underfoot.commands.options import SECONDS, command, require_seconds, two_numbers
from underfoot.commands.telling import tell
from underfoot.devices.transport import Sender, made
from underfoot.devices.transports import TRANSPORTS
from underfoot.errors import BadFile, BadValue, DeviceError
from underfoot.files import read_large_file
from underfoot.options import option, shared
from underfoot.plugins import refuse
from underfoot.quantities import counted

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from underfoot.devices.emulation.emulator import Emulator
    from underfoot.devices.emulation.faults import FaultInjector
    from underfoot.devices.force_source import ForceSource
    from underfoot.floor.layout import Floor

_SHARE = "share of the frames, 0 to 1"
_BATCH = 1 << 15


@dataclass(frozen=True)
class EmulateOptions:
    """Options of the command besides those of transports; None if not given."""

    floor: Path | None = option(
        "Floor JSON; by default 2 x 2 tiles. Found automatically beside a force CSV.", presets="floors"
    )
    tile: int | None = option("Send only this tile of the floor, counted from 0.")
    force: str | None = option(
        "Force CSV, recording, C3D file or preset walk, played once, or repeatedly for --seconds; by default a "
        "simulated walker.",
        presets="walks",
    )
    rate: float | None = option("Samples per second of every tile; by default 1000, or the file's rate.")
    sensors: Path | None = option('Simulated sensors instead of ideal ones: a parameter file, or "default".')
    acceleration: Path | None = option("WAV of acceleration in m/s^2, one channel per tile, to send with the forces.")
    full_scale: float = option("Full scale of the accelerometers, m/s^2.", 98.1, show_default=True)
    csv_lines: bool = option("Send lines of text instead of binary frames.", False)
    lost: float = option(f"Frames that are not sent: {_SHARE}.", 0.0)
    doubled: float = option(f"Frames that are sent twice: {_SHARE}.", 0.0)
    reordered: float = option(f"Frames sent behind the next of their tile: {_SHARE}.", 0.0)
    corrupted: float = option(f"Frames of which bytes are wrong: {_SHARE}.", 0.0)
    late: float = option(f"Frames sent behind 20 more of their tile: {_SHARE}.", 0.0)
    unplug: tuple[str, ...] = option("Unplug at second AT for FOR seconds; repeatable.", (), metavar="AT:FOR")
    drift: float = option("Lag of the tiles' clock, ppm.", 0.0)
    seed: int = option("Seed of walker, sensors and faults.", 1)
    seconds: float | None = shared(SECONDS)


def _senders() -> dict[str, type[Sender]]:
    """Return the emulator's ends by their arguments, each once: transports may share one. None takes another option."""
    found: dict[str, type[Sender]] = {}
    taken = {"help", *(field.name for field in fields(EmulateOptions))}
    for sender in dict.fromkeys(transport.sender for transport in TRANSPORTS.values()):
        argument = sender.option.replace("-", "_")
        if argument in taken:
            refuse(sender.__qualname__, f"emulate has an option --{sender.option} already")
        else:
            found[argument] = sender
            taken.add(argument)
    return found


_SENDERS = _senders()
SenderOptions = make_dataclass(
    "SenderOptions",
    [
        (argument, str | None, option(sender.help, metavar=sender.option_value))
        if sender.option_value
        else (argument, bool, option(sender.help, False))
        for argument, sender in _SENDERS.items()
    ],
    frozen=True,
)
"""The option of each transport; None or False if not given."""


@command(SenderOptions, EmulateOptions)
def emulate(of_senders: object, options: EmulateOptions) -> None:
    """Emulate tiles, until Ctrl-C or for --seconds.

    Ideal sensors read 1000 counts at rest and 20 counts per newton. Faults are counted, and reported at the end.
    """
    from underfoot.devices.emulation.emulator import Emulator, TileClock

    given = {name: value for name, value in vars(of_senders).items() if value not in (None, False)}
    if len(given) != 1:
        forms = ", ".join(f"--{sender.option} {sender.option_value}".strip() for sender in _SENDERS.values())
        raise BadValue(f"{len(given) or 'no'} transports are given; allowed: one of {forms}")
    require_seconds(options.seconds)
    if not abs(options.drift) < 20_000.0:
        raise BadValue(f"--drift is {options.drift:g}; allowed: -20000 to 20000 ppm")
    injector = _injector(options)
    source, length_s = _source(options)
    readings = _readings(options.sensors, source.floor, options.seed, options.rate or source.rate_hz)
    only, last = options.tile, len(source.floor.tiles) - 1
    if only is not None and not 0 <= only <= last:
        raise BadValue(f"--tile is {only}; allowed: 0 to {last}")
    ((name, value),) = given.items()
    sender = _SENDERS[name]
    emulator = Emulator(
        made(f"--{sender.option}", sender.of, str(value)), source, injector, seconds=options.seconds or length_s,
        readings=readings, clock=TileClock(drift_ppm=options.drift), only=only,
        acceleration=_acceleration(options, source),
    )  # fmt: skip
    ids = source.floor.ids
    _run(emulator, f"tiles 0 to {last} are {ids[0]} to {ids[-1]}" if only is None else f"tile {only} is {ids[only]}")


def _run(emulator: "Emulator", tiles: str) -> None:
    """Send until it is over, or until a signal; then say what was sent.

    The name is printed once samples are sent: whoever waits for it would else hear nothing while kernels are compiled.
    """
    from underfoot.devices.emulation.faults import KINDS

    with ExitStack() as stack:
        stack.callback(emulator.close)
        stop = threading.Event()
        stack.enter_context(ended_by_signals(stop.set))
        with report_compiling():
            emulator.start()
            while not (emulator.is_sending or emulator.is_finished or stop.wait(0.01)):
                pass
        print(emulator.sender.name, flush=True)
        tell(tiles)
        while not (stop.wait(0.05) or emulator.is_finished):
            pass
        stop.wait(0.2)  # whoever reads may be a moment behind
    counts = emulator.injector.counts
    faulty = ", ".join(f"{getattr(counts, kind)} {kind}" for kind in KINDS)
    frames, unheard = counted(counts.frames, "frame"), counted(emulator.undelivered, "sample")
    tell(f"{frames}, {faulty}; {unheard} unheard")
    if emulator.failure:
        raise DeviceError(emulator.failure)


def _injector(options: EmulateOptions) -> "FaultInjector":
    from underfoot.devices.emulation.faults import FaultInjector, Faults

    faults = Faults(
        options.lost, options.doubled, options.reordered, options.corrupted, options.late,
        unplugged=tuple(two_numbers("--unplug", one, "AT:FOR in seconds, as 5:0.5") for one in options.unplug),
    )  # fmt: skip
    return FaultInjector(faults, options.seed, options.csv_lines)


def _source(options: EmulateOptions) -> "tuple[ForceSource, float | None]":
    """Return the source of the tiles' forces, and its duration."""
    from underfoot.clock import RATE_HZ
    from underfoot.devices.replay import Replay
    from underfoot.devices.resampled import Resampled
    from underfoot.devices.simulated_floor import SimulatedFloor
    from underfoot.floor.forces import ForceSeries
    from underfoot.floor.layout import Floor, default_floor
    from underfoot.records.force_files import read_force_file

    source: ForceSource
    length_s = None
    floor = Floor.load(options.floor) if options.floor else None
    if options.force is None:
        source = SimulatedFloor(floor or default_floor(), RATE_HZ, options.seed)
    else:
        read, floor = read_force_file(options.force, floor)
        kept = read.is_whole
        if not kept.any():
            raise BadFile(f"{options.force} has no sample of all tiles at once, so that nothing can be sent")
        forces = ForceSeries(read.time_s[kept], read.force_n[kept], read.rate_hz)
        source = Replay(forces, floor, RATE_HZ, repeats=options.seconds is not None)
        length_s = forces.seconds
    if options.rate is not None and options.rate != source.rate_hz:
        source = Resampled(source, options.rate, RATE_HZ)
    return source, length_s


def _acceleration(options: EmulateOptions, source: "ForceSource") -> "NDArray[np.int64] | None":
    """Return the accelerometers' samples from the file of acceleration, four per force sample."""
    if options.acceleration is None:
        return None
    import numpy as np
    from scipy.io import wavfile
    from scipy.signal import resample_poly  # half a second

    from underfoot.devices.framing.wire_format import REST
    from underfoot.devices.link_acceleration import EACH

    if not 0.0 < options.full_scale <= 1e5:
        raise BadValue(f"--full-scale is {options.full_scale:g}; allowed: above 0, up to 1e5 m/s^2")
    try:
        rate_hz, m_s2 = wavfile.read(BytesIO(read_large_file(options.acceleration)))
    except ValueError as error:
        raise BadFile(f"{options.acceleration} cannot be read: {error}") from None
    tiles = len(source.floor.tiles)
    if m_s2.dtype.kind != "f" or m_s2.reshape(len(m_s2), -1).shape[1] != tiles:
        raise BadFile(f"{options.acceleration} is no WAV of floats with {tiles} channels, one a tile")
    slowly = resample_poly(m_s2.reshape(-1, tiles), round(EACH * source.rate_hz), round(rate_hz), axis=0)
    return np.clip(np.rint(slowly * (REST / options.full_scale)) + REST, 0, 2 * REST - 1).astype(np.int64)


def _readings(
    parameters: Path | None, floor: "Floor", seed: int, rate_hz: float
) -> "Callable[[NDArray[np.float64]], NDArray[np.int64]]":
    """Return the conversion from newtons to counts: that of ideal or of simulated sensors."""
    import numpy as np

    from underfoot.devices.conversion import nominal_readings
    from underfoot.floor.simulated_sensors import SimulatedSensors
    from underfoot.floor.tile_parameters import TileParameters

    if parameters is None:
        return nominal_readings
    made_of = TileParameters() if str(parameters) == "default" else TileParameters.load(parameters)
    sensing = SimulatedSensors(floor, made_of, seed, rate_hz, _BATCH)
    first = 0

    def readings(force_n: "NDArray[np.float64]") -> "NDArray[np.int64]":
        nonlocal first
        sensing.read(force_n, first, len(force_n))
        first += len(force_n)
        return sensing.counts[: len(force_n)].astype(np.int64)

    return readings
