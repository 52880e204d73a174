"""The commands that need no screen."""

import json
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from workbench.clock import RATE_HZ
from workbench.errors import BadFile, BadValue

_FILE = click.Path(path_type=Path)


@click.command()
@click.argument("patch", type=_FILE)
@click.option("-o", "--output", type=_FILE, help="WAV to write: float, one channel a tile.")
@click.option("--seconds", type=float, help="Length; by default the force's, or 5 s.")
@click.option("--rate", type=float, help=f"Frames a second; {RATE_HZ} by default.")
@click.option("--block", type=int, default=1024, show_default=True, help="Frames a block; the output is the same.")
@click.option("--seed", type=int, help="Seed instead of the patch's own.")
@click.option("--force", help='Force CSV, or "none" for an empty floor; by default a walker walks.')
@click.option("--floor", type=_FILE, help="Floor JSON; beside a force CSV it is found by itself.")
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
    as_json: bool,
) -> None:
    """Play PATCH (a patch, or a recording of a session) offline, as fast as it goes."""
    from workbench.engine.render import render as run
    from workbench.engine.render import write_wav
    from workbench.engine.replayed import is_recording, replay
    from workbench.nodes import REGISTRY
    from workbench.patch.patch import Patch

    if is_recording(patch):
        if rate is not None or seed is not None or force is not None or floor is not None or seconds is not None:
            raise BadValue(f"{patch} is a recording; allowed with it: --output, --block and --json")
        rendered = replay(patch, REGISTRY, block)
    else:
        document = Patch.load(patch, REGISTRY)
        hz = float(rate or RATE_HZ)
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


@click.command()
@click.argument("source")
@click.option("--floor", type=_FILE, help="Floor JSON; beside a force CSV it is found by itself.")
@click.option("--steps", type=_FILE, help="CSV of the footsteps.")
@click.option("--contacts", type=_FILE, help="CSV of every contact at every sample.")
@click.option("--patch", type=_FILE, help="Patch that the session plays meanwhile.")
@click.option("--record", type=_FILE, help="Record the session to this file.")
@click.option("--seconds", type=float, help="Stop after this long.")
@click.option("--pace", is_flag=True, help="Play a file back in real time instead of as fast as it goes.")
@click.option("--json", "as_json", is_flag=True, help="Print each footstep as a line of JSON.")
def monitor(
    source: str,
    floor: Path | None,
    steps: Path | None,
    contacts: Path | None,
    patch: Path | None,
    record: Path | None,
    seconds: float | None,
    pace: bool,
    as_json: bool,
) -> None:
    """Print footsteps as they happen. SOURCE is "simulator", a force CSV, or a recording."""
    from workbench import monitoring
    from workbench.records.tables import contact_table, step_table

    if seconds is not None and not seconds > 0.0:
        raise BadValue(f"--seconds is {seconds:g}; allowed: above 0")
    stream = monitoring.open_stream(source, floor, seconds, pace, record, patch)
    with ExitStack() as stack:
        write_steps = stack.enter_context(step_table(steps)) if steps else None
        write_contacts = stack.enter_context(contact_table(contacts, stream.floor)) if contacts else None
        for found in stream:
            if write_contacts:
                write_contacts(found.rows)
            if write_steps:
                write_steps(found.steps)
            for step in found.steps:
                print(json.dumps(monitoring.figures(step)) if as_json else monitoring.line(step), flush=True)
    for warning in stream.warnings():
        print(f"underfoot: {warning}", file=sys.stderr)


@click.command()
@click.argument("type", required=False)
@click.option("--json", "as_json", is_flag=True, help="All of it as JSON.")
def nodes(type: str | None, as_json: bool) -> None:
    """The node reference: every node with its ports and parameters, or one TYPE."""
    from workbench.nodes import REGISTRY
    from workbench.patch.reference import reference, text

    if type is not None and type not in REGISTRY:
        raise BadValue(f"there is no node {type!r}; allowed: {', '.join(sorted(REGISTRY))}")
    chosen = {type: REGISTRY[type]} if type else REGISTRY
    print(json.dumps(reference(chosen), indent=1) if as_json else text(chosen))


def _force_source(force: str | None, floor: Path | None, rate: float, seed: int) -> tuple[Any, float]:
    """Where the force of a rendering comes from, and how long it is."""
    from workbench.devices.replay import Replay
    from workbench.devices.simulated import SimulatedFloor
    from workbench.floor.forces import floor_beside, read_forces
    from workbench.floor.layout import Floor, default_floor

    if force is None or force == "none":
        layout = Floor.load(floor) if floor else default_floor()
        return SimulatedFloor(layout, rate, seed, walking=force is None), 5.0
    layout = Floor.load(floor or _need_floor(Path(force), floor_beside(force)))
    forces = read_forces(force, layout)
    return Replay(forces, layout, rate), float(forces.time_s[-1] - forces.time_s[0]) + 0.5


def _need_floor(csv: Path, beside: Path) -> Path:
    if not beside.is_file():
        if not csv.is_file():
            raise BadFile(f"{csv} cannot be read: no such file or directory")
        raise BadFile(f"{csv} has no floor beside it ({beside.name}); say --floor FILE")
    return beside
