"""`underfoot render`: a patch, played offline."""

import json
import os
from pathlib import Path
from typing import Any

import click

from underfoot.clock import RATE_HZ
from underfoot.commands.files import FILE, require_room
from underfoot.errors import BadFile, BadValue


@click.command()
@click.argument("patch", type=FILE)
@click.option("-o", "--output", type=FILE, help="WAV to write: float, one channel a tile.")
@click.option("--seconds", type=float, help="Length; by default the force's, or 5 s.")
@click.option("--rate", type=float, help=f"Frames a second; {RATE_HZ} by default.")
@click.option("--block", type=int, default=1024, show_default=True, help="Frames a block; the output is the same.")
@click.option("--seed", type=int, help="Seed instead of the patch's own.")
@click.option("--force", help='Force CSV, or "none" for an empty floor; by default a walker walks.')
@click.option("--floor", type=FILE, help="Floor JSON; beside a force CSV it is found by itself.")
@click.option("--profiles", type=FILE, help="Folder of the tiles' calibration files: how each is driven.")
@click.option("--json", "as_json", is_flag=True, help="Print peak, RMS, speed and what slept as JSON.")
def render(
    patch: Path,
    output: Path | None,
    seconds: float | None,
    rate: float | None,
    block: int,
    seed: int | None,
    force: str | None,
    floor: Path | None,
    profiles: Path | None,
    as_json: bool,
) -> None:
    """Play PATCH (a patch, or a recording of a session) offline, as fast as it goes."""
    from underfoot.engine.correction import corrections_of
    from underfoot.engine.render import render as run
    from underfoot.engine.render import write_wav
    from underfoot.engine.replayed import is_recording, replay
    from underfoot.floor.profile import profiles_of
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch

    require_room(output, inputs=(patch, force, floor))
    if is_recording(patch):
        if any(given is not None for given in (rate, seed, force, floor, seconds, profiles)):
            raise BadValue(f"{patch} is a recording; allowed with it: --output, --block and --json")
        rendered = replay(patch, REGISTRY, block)
    else:
        document = Patch.load(patch, REGISTRY)
        hz = float(RATE_HZ if rate is None else rate)
        if not hz.is_integer():
            raise BadValue(f"--rate is {hz:g}; allowed: whole numbers, 8000 to 192000 Hz")
        source, length = _force_source(force, floor, hz, document.seed if seed is None else seed)
        rendered = run(
            document,
            REGISTRY,
            source,
            seconds if seconds is not None else length,
            rate=hz,
            block=block,
            seed=seed,
            folder=patch.parent,
            corrections=corrections_of(profiles_of(profiles, source.floor)) if profiles else (),
        )
    if output is not None:
        write_wav(output, rendered.samples, rendered.rate_hz)
    summary = rendered.summary()
    if as_json:
        print(json.dumps(summary))
    else:
        print(
            f"{summary['seconds']:.3f} s, peak {summary['peak']:.4f}, RMS {summary['rms']:.5f} of full scale, "
            f"{summary['times_real_time']:.0f} times real time"
        )


def _force_source(force: str | None, floor: Path | None, rate: float, seed: int) -> tuple[Any, float]:
    """Where the force of a rendering comes from, and how long it is."""
    from underfoot.devices.replay import Replay
    from underfoot.devices.simulated_floor import SimulatedFloor
    from underfoot.floor.forces import read_forces
    from underfoot.floor.layout import Floor, default_floor

    if force is None or force == "none":
        layout = Floor.load(floor) if floor else default_floor()
        return SimulatedFloor(layout, rate, seed, walking=force is None), 5.0
    layout = Floor.load(floor or _floor_of(Path(force)))
    forces = read_forces(force, layout)
    return Replay(forces, layout, rate), float(forces.time_s[-1] - forces.time_s[0]) + 0.5


def _floor_of(csv: Path) -> Path:
    """The floor beside a force CSV."""
    from underfoot.floor.forces import floor_beside

    if not os.path.isfile(csv):
        raise BadFile(f"{csv} cannot be read: no such file")
    beside = floor_beside(csv)
    if not beside.is_file():
        raise BadFile(f"{csv} has no floor beside it ({beside.name}); say --floor FILE")
    return beside
