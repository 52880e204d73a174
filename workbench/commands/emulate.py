"""`underfoot emulate`: a tile's firmware, or a floor's, without a tile."""

import signal
import sys
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from underfoot.commands.files import FILE
from underfoot.errors import BadFile, BadValue

if TYPE_CHECKING:
    from underfoot.devices.device import ForceSource
    from underfoot.devices.emulation.emulator import Way
    from underfoot.floor.layout import Floor

_SHARE = "share of the frames, 0 to 1"


@click.command()
@click.option("--pty", is_flag=True, help="On a pseudo-terminal; its name is printed.")
@click.option("--udp", metavar="[HOST:]PORT", help="Datagrams to this port, of this machine by default.")
@click.option("--floor", type=FILE, help="Floor JSON; 2 x 2 tiles by default. Beside a force CSV it finds itself.")
@click.option("--tile", type=int, help="Send only this tile of the floor, counted from 0.")
@click.option("--force", type=FILE, help="Force CSV, once, or over and over for --seconds; by default a walker walks.")
@click.option("--rate", type=float, help="Samples a second of every tile; 1000 or the file's by default.")
@click.option("--sensors", type=FILE, help='Simulated sensors instead of ideal ones: a parameter file, or "default".')
@click.option("--csv-lines", is_flag=True, help="Lines of text instead of binary frames.")
@click.option("--lost", type=float, default=0.0, help=f"Frames that are not sent: {_SHARE}.")
@click.option("--doubled", type=float, default=0.0, help=f"Frames that are sent twice: {_SHARE}.")
@click.option("--reordered", type=float, default=0.0, help=f"Frames sent behind the next of their tile: {_SHARE}.")
@click.option("--corrupted", type=float, default=0.0, help=f"Frames of which bytes are wrong: {_SHARE}.")
@click.option("--late", type=float, default=0.0, help=f"Frames sent behind 20 more of their tile: {_SHARE}.")
@click.option("--unplug", multiple=True, metavar="AT:FOR", help="Unplug at this second, for so many; may be repeated.")
@click.option("--drift", type=float, default=0.0, help="By how many ppm the tiles' clock is slow.")
@click.option("--seed", type=int, default=1, show_default=True, help="Seed of walker, sensors and faults.")
@click.option("--seconds", type=float, help="Stop after this long.")
def emulate(
    pty: bool,
    udp: str | None,
    floor: Path | None,
    tile: int | None,
    force: Path | None,
    rate: float | None,
    sensors: Path | None,
    csv_lines: bool,
    lost: float,
    doubled: float,
    reordered: float,
    corrupted: float,
    late: float,
    unplug: tuple[str, ...],
    drift: float,
    seed: int,
    seconds: float | None,
) -> None:
    """Send what tiles send, as hardware does, until Ctrl-C or for --seconds.

    Ideal sensors read 1000 counts at rest and 20 counts a newton. Faults are counted, and said at the end.
    """
    from underfoot.devices.emulation.emulator import Emulator, PtyWay, UdpWay
    from underfoot.devices.emulation.faults import KINDS, Faults, FaultyLine
    from underfoot.devices.transports.udp import address

    if pty == (udp is not None):
        raise BadValue("where to is not said; allowed: --pty, or --udp PORT")
    if seconds is not None and not seconds > 0.0:
        raise BadValue(f"--seconds is {seconds:g}; allowed: above 0")
    if not abs(drift) < 20_000.0:
        raise BadValue(f"--drift is {drift:g}; allowed: -20000 to 20000 ppm")
    faults = Faults(lost, doubled, reordered, corrupted, late, unplugged=tuple(map(_stretch, unplug)))
    source, length = _source(force, floor, rate, seed, repeats=seconds is not None)
    line = FaultyLine(faults, seed, csv_lines)
    readings = _sensors(sensors, source.floor, seed, rate or source.rate_hz)
    last = len(source.floor.tiles) - 1
    if tile is not None and not 0 <= tile <= last:
        raise BadValue(f"--tile is {tile}; allowed: 0 to {last}")
    with ExitStack() as stack:
        way: Way = PtyWay() if udp is None else UdpWay(*address(udp))
        emulator = Emulator(way, source, line, seconds=seconds or length, drift_ppm=drift, only=tile, **readings)
        stack.callback(emulator.close)
        stop = threading.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            stack.callback(signal.signal, number, signal.signal(number, lambda *_: stop.set()))
        print(way.name, flush=True)
        ids = source.floor.ids
        whose = f"tiles 0 to {last} are {ids[0]} to {ids[-1]}" if tile is None else f"tile {tile} is {ids[tile]}"
        print(f"underfoot: {whose}", file=sys.stderr)
        emulator.start()
        while not (stop.wait(0.05) or emulator.over):
            pass
        stop.wait(0.2)  # whoever reads may be a moment behind
    made = line.made
    faulty = ", ".join(f"{getattr(made, kind)} {kind}" for kind in KINDS)
    print(f"underfoot: {made.frames} frames, {faulty}; {emulator.unheard} samples unheard", file=sys.stderr)


def _stretch(text: str) -> tuple[float, float]:
    at, _, length = text.partition(":")
    try:
        return float(at), float(length)
    except ValueError:
        raise BadValue(f"--unplug is {text!r}; allowed: AT:FOR in seconds, as 5:0.5") from None


def _source(
    force: Path | None, floor: Path | None, rate_hz: float | None, seed: int, repeats: bool
) -> "tuple[ForceSource, float | None]":
    """What the tiles feel, and how long that lasts."""
    from underfoot.clock import RATE_HZ
    from underfoot.devices.replay import Replay
    from underfoot.devices.resampled import Resampled
    from underfoot.devices.simulated_floor import SimulatedFloor
    from underfoot.floor.forces import floor_beside, read_forces
    from underfoot.floor.layout import Floor, default_floor

    source: ForceSource
    length = None
    if force is None:
        source = SimulatedFloor(Floor.load(floor) if floor else default_floor(), RATE_HZ, seed)
    else:
        beside = floor_beside(force)
        if floor is None and not beside.is_file():
            raise BadFile(f"{force} has no floor beside it ({beside.name}); say --floor FILE")
        forces = read_forces(force, Floor.load(floor or beside))
        source = Replay(forces, Floor.load(floor or beside), RATE_HZ, repeats=repeats)
        length = float(forces.time_s[-1] - forces.time_s[0]) + 1.0 / forces.rate_hz
    if rate_hz is not None and rate_hz != source.rate_hz:
        source = Resampled(source, rate_hz, RATE_HZ)
    return source, length


def _sensors(parameters: Path | None, floor: "Floor", seed: int, rate_hz: float) -> dict:
    """How newtons become counts: as the emulator does it by itself, or as simulated sensors do."""
    import numpy as np

    from underfoot.floor.simulated_sensors import SimulatedSensors
    from underfoot.floor.tile_parameters import TileParameters

    if parameters is None:
        return {}
    made_of = TileParameters() if str(parameters) == "default" else TileParameters.load(parameters)
    most = 1 << 15
    sensing = SimulatedSensors(floor, made_of, seed, rate_hz, most)
    first = 0

    def readings(force_n: np.ndarray) -> np.ndarray:
        nonlocal first
        sensing.read(force_n, first, len(force_n))
        first += len(force_n)
        return sensing.counts[: len(force_n)].astype(np.int64)

    return {"readings": readings}
