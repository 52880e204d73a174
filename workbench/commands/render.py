"""`underfoot render`: a patch, played offline."""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from underfoot.clock import RATE_HZ
from underfoot.commands.files import FILE, require_room
from underfoot.commands.options import grouped
from underfoot.errors import BadFile, BadValue

if TYPE_CHECKING:
    from underfoot.devices.force_source import ForceSource
    from underfoot.engine.render import Rendered

DEFAULT_S = 5.0
"""Seconds that are rendered where no file of forces says how long."""
TAIL_S = 0.5
"""Seconds that are rendered behind the last sample of a file of forces."""


@dataclass(frozen=True)
class RenderOptions:
    """What the command line says of a rendering; None is what was not given."""

    patch: Path
    output: Path | None
    seconds: float | None
    rate: float | None
    block: int
    seed: int | None
    force: str | None
    floor: Path | None
    profiles: Path | None
    as_json: bool


@click.command()
@click.argument("patch", type=FILE)
@click.option("-o", "--output", type=FILE, help="WAV file to write: float samples, one channel per tile.")
@click.option("--seconds", type=float, help="Length; by default the force's, or 5 s.")
@click.option("--rate", type=float, help=f"Frames per second; {RATE_HZ} by default.")
@click.option("--block", type=int, default=1024, show_default=True, help="Frames per block; the output is the same.")
@click.option("--seed", type=int, help="Seed instead of the patch's own.")
@click.option("--force", help='Force CSV, or "none" for an empty floor; by default a walker walks.')
@click.option("--floor", type=FILE, help="Floor JSON; beside a force CSV it is found by itself.")
@click.option("--profiles", type=FILE, help="Folder of the tiles' calibration files: how each is driven.")
@click.option("--json", "as_json", is_flag=True, help="Print peak, RMS, speed, and which nodes ran or slept, as JSON.")
@grouped(RenderOptions)
def render(options: RenderOptions) -> None:
    """Play PATCH (a patch, or a recording of a session) offline, as fast as it goes."""
    from underfoot.records.recording import is_recording
    from underfoot.records.wav import write_wav

    require_room(options.output, inputs=(options.patch, options.force, options.floor))
    rendered = _replayed(options) if is_recording(options.patch) else _rendered(options)
    if options.output is not None:
        write_wav(options.output, rendered.samples, rendered.rate_hz)
    summary = rendered.summary()
    if options.as_json:
        print(json.dumps(summary))
    else:
        print(
            f"{summary['seconds']:.3f} s, peak {summary['peak']:.4f}, RMS {summary['rms']:.5f} of full scale, "
            f"{summary['times_real_time']:.0f} times real time"
        )


def _replayed(options: RenderOptions) -> "Rendered":
    """A recording, played again."""
    from underfoot.engine.session_replay import replay
    from underfoot.nodes import REGISTRY

    of_a_patch = (options.rate, options.seed, options.force, options.floor, options.seconds, options.profiles)
    if any(given is not None for given in of_a_patch):
        raise BadValue(f"{options.patch} is a recording; allowed with it: --output, --block and --json")
    return replay(options.patch, REGISTRY, options.block)


def _rendered(options: RenderOptions) -> "Rendered":
    """A patch, played on the force that was asked for."""
    from underfoot.engine.commands import equalisers_of
    from underfoot.engine.loop import LoopOptions
    from underfoot.engine.render import render as run
    from underfoot.floor.profile import profiles_of
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch

    patch = Patch.load(options.patch, REGISTRY)
    rate_hz = float(RATE_HZ if options.rate is None else options.rate)
    if not rate_hz.is_integer():
        raise BadValue(f"--rate is {rate_hz:g}; allowed: whole numbers, 8000 to 192000 Hz")
    seed = patch.seed if options.seed is None else options.seed
    source, length_s = _force_source(options.force, options.floor, rate_hz, seed)
    profiles = profiles_of(options.profiles, source.floor) if options.profiles else {}
    how = LoopOptions(
        rate_hz=rate_hz,
        block=options.block,
        equalisers=equalisers_of(profiles),
        folder=options.patch.parent,
        seed=options.seed,
    )
    return run(patch, REGISTRY, source, length_s if options.seconds is None else options.seconds, how)


def _force_source(force: str | None, floor: Path | None, rate_hz: float, seed: int) -> tuple["ForceSource", float]:
    """Where the force of a rendering comes from, and how many seconds there are of it."""
    from underfoot.devices.replay import Replay
    from underfoot.devices.simulated_floor import SimulatedFloor
    from underfoot.floor.forces import read_forces
    from underfoot.floor.layout import Floor, default_floor

    if force is None or force == "none":
        layout = Floor.load(floor) if floor else default_floor()
        return SimulatedFloor(layout, rate_hz, seed, walking=force is None), DEFAULT_S
    layout = Floor.load(floor or _floor_of(Path(force)))
    forces = read_forces(force, layout)
    return Replay(forces, layout, rate_hz), float(forces.time_s[-1] - forces.time_s[0]) + TAIL_S


def _floor_of(csv: Path) -> Path:
    """The floor beside a force CSV."""
    from underfoot.floor.forces import floor_beside

    if not os.path.isfile(csv):
        raise BadFile(f"{csv} cannot be read: no such file")
    beside = floor_beside(csv)
    if not beside.is_file():
        raise BadFile(f"{csv} has no floor beside it ({beside.name}); say --floor FILE")
    return beside
