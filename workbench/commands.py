"""The commands that need no screen."""

import json
import os
import signal
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import click

from workbench.clock import RATE_HZ
from workbench.errors import BadFile, BadValue, UnderfootError

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

    _require_room(output)
    if is_recording(patch):
        if rate is not None or seed is not None or force is not None or floor is not None or seconds is not None:
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
    _require_room(steps, contacts, record)
    stream = monitoring.open_stream(source, floor, seconds, pace, record, patch)
    with ExitStack() as stack:
        stack.callback(stream.close)
        for number in (signal.SIGINT, signal.SIGTERM):
            stack.callback(signal.signal, number, signal.signal(number, lambda *_: stream.stop()))
        write_steps = stack.enter_context(step_table(steps)) if steps else None
        write_contacts = stack.enter_context(contact_table(contacts, stream.floor)) if contacts else None
        for found in stream:
            if write_contacts:
                write_contacts(found.rows)
            if write_steps:
                write_steps(found.steps)
            for step in found.steps:
                print(json.dumps(monitoring.figures(step)) if as_json else monitoring.line(step), flush=True)
            for line in found.news:
                print(f"underfoot: {line}", file=sys.stderr, flush=True)
    for warning in stream.warnings():
        print(f"underfoot: {warning}", file=sys.stderr)
    if stream.failure:
        raise BadFile(stream.failure)


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


@click.command()
@click.option("--quick", is_flag=True, help="About a minute instead of hours.")
@click.option("--report", type=_FILE, help="Folder for a page with pictures, the figures as JSON, and what failed.")
@click.option("--seed", type=int, default=1, show_default=True, help="Of the random points and patches.")
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
def bench(quick: bool, report: Path | None, seed: int, as_json: bool) -> None:
    """Run time against error beside naive methods, cost of a large floor, and stability under stress."""
    from workbench.bench.report import text, write
    from workbench.bench.whole import run

    if seed < 0:
        raise BadValue(f"--seed is {seed}; allowed: 0 or more")
    if report is not None and report.exists() and not report.is_dir():
        raise BadFile(f"{report} is not a folder")
    found = run(quick, seed, lambda line: print(f"underfoot: {line}", file=sys.stderr))
    if report is not None:
        write(found, report)
    print(json.dumps(found.data()) if as_json else text(found))
    if found.stability.failures:
        raise UnderfootError(f"stability: {len(found.stability.failures)} failures")


def _require_room(*outputs: Path | None) -> None:
    """Say before the work, and not after it, that what comes of it cannot be written."""
    for path in outputs:
        if path is not None and os.path.isdir(path):
            raise BadFile(f"{path} cannot be written: it is a folder")
        if path is not None and not os.path.isdir(path.parent):
            raise BadFile(f"{path} cannot be written: there is no folder {path.parent}")


def _force_source(force: str | None, floor: Path | None, rate: float, seed: int) -> tuple[Any, float]:
    """Where the force of a rendering comes from, and how long it is."""
    from workbench.devices.replay import Replay
    from workbench.devices.simulated import SimulatedFloor
    from workbench.floor.forces import read_forces
    from workbench.floor.layout import Floor, default_floor

    if force is None or force == "none":
        layout = Floor.load(floor) if floor else default_floor()
        return SimulatedFloor(layout, rate, seed, walking=force is None), 5.0
    layout = Floor.load(floor or _floor_of(Path(force)))
    forces = read_forces(force, layout)
    return Replay(forces, layout, rate), float(forces.time_s[-1] - forces.time_s[0]) + 0.5


def _floor_of(csv: Path) -> Path:
    """The floor beside a force CSV."""
    from workbench.floor.forces import floor_beside

    if not os.path.isfile(csv):
        raise BadFile(f"{csv} cannot be read: no such file")
    beside = floor_beside(csv)
    if not beside.is_file():
        raise BadFile(f"{csv} has no floor beside it ({beside.name}); say --floor FILE")
    return beside
