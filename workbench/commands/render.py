"""`underfoot render`: patches, played offline: one here, several at once on all cores."""

import json
import sys
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from underfoot.clock import RATE_HZ
from underfoot.commands.compiling import compiling_told
from underfoot.commands.files import FILE, require_room
from underfoot.commands.options import grouped
from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.files import make_folder

if TYPE_CHECKING:
    from underfoot.engine.render import Rendered
    from underfoot.engine.requests import CompileRequest
    from underfoot.floor.simulated_plates import Heard

Summary = dict[str, Any]


@dataclass(frozen=True)
class RenderOptions:
    """What the command line says of a rendering; None is what was not given."""

    patches: tuple[Path, ...]
    output: Path | None
    seconds: float | None
    rate: float | None
    block: int
    seed: int | None
    force: str | None
    floor: Path | None
    profiles: Path | None
    simulation: Path | None
    measured: Path | None
    under_foot: Path | None
    as_json: bool

    @property
    def patch(self) -> Path:
        """The patch, where there is one."""
        return self.patches[0]

    @property
    def plates(self) -> "dict[Heard, Path]":
        """Where acceleration of simulated plates is taken, and the file that it goes to."""
        asked: dict[Heard, Path | None] = {"accelerometer": self.measured, "foot": self.under_foot}
        return {heard: path for heard, path in asked.items() if path is not None}


@click.command()
@click.argument("patches", metavar="PATCH...", type=FILE, nargs=-1, required=True)
@click.option(
    "-o", "--output", type=FILE, help="WAV file: float samples, one channel per tile. For several patches, a folder."
)
@click.option("--seconds", type=float, help="Length; by default the force's, or 5 s.")
@click.option("--rate", type=float, help=f"Frames per second; {RATE_HZ} by default.")
@click.option("--block", type=int, default=1024, show_default=True, help="Frames per block; the output is the same.")
@click.option("--seed", type=int, help="Seed instead of the patch's own.")
@click.option("--force", help='Force CSV, recording, C3D file, or "none" for an empty floor; else a walker walks.')
@click.option("--floor", type=FILE, help="Floor JSON; beside a force CSV it is found by itself.")
@click.option("--profiles", type=FILE, help="Folder of the tiles' calibration files: how each is driven.")
@click.option("--simulation", type=FILE, help="What simulated tiles are made of: a parameter file.")
@click.option("--measured", type=FILE, help="WAV file of what simulated accelerometers measure, m/s^2, one a tile.")
@click.option("--under-foot", type=FILE, help="WAV file of the simulated acceleration under the foot, m/s^2.")
@click.option("--json", "as_json", is_flag=True, help="Print peak, RMS, speed, and which nodes ran or slept, as JSON.")
@grouped(RenderOptions)
def render(options: RenderOptions) -> None:
    """Play PATCH (a patch, or a recording of a session) offline, as fast as it goes; several at once on all cores."""
    if len(options.patches) > 1:
        if options.plates:
            raise BadValue("--measured and --under-foot are for one patch at a time")
        _render_all(options)
        return
    from underfoot.records.recording import is_recording

    inputs = (options.patch, options.force, options.floor, options.simulation)
    require_room(options.output, *options.plates.values(), inputs=inputs)
    with compiling_told(None if is_recording(options.patch) else partial(compile_request, options.patch)):
        summary = _render_one(options)
    print(json.dumps(summary) if options.as_json else _line(summary))


def compile_request(patch: Path) -> "CompileRequest":
    """What another process is to compile while this one begins at the other end."""
    from underfoot.engine.requests import CompileRequest
    from underfoot.engine.target import Target
    from underfoot.floor.layout import default_floor

    return CompileRequest(0, patch.read_bytes(), Target(default_floor()), str(patch.parent))


def _render_one(options: RenderOptions) -> Summary:
    """Render the one patch, write what is to be written, and return the figures."""
    from underfoot.records.recording import is_recording
    from underfoot.records.wav import write_wav

    rendered = _replayed(options) if is_recording(options.patch) else _rendered(options)
    if options.output is not None:
        write_wav(options.output, rendered.samples, rendered.rate_hz)
    for heard, path in options.plates.items():
        write_wav(path, rendered.tiles[heard], rendered.rate_hz)
    return rendered.summary()


def _render_all(options: RenderOptions) -> None:
    """Render several patches, each into a file of its own in the folder; what fails is said, and the others go on."""
    from underfoot.engine.worker_pool import cores, in_parallel

    outputs = _outputs(options)
    jobs = [replace(options, patches=(patch,), output=out) for patch, out in zip(options.patches, outputs, strict=True)]
    found: dict[int, Summary] = {}
    failed = 0
    for done, (number, answer) in enumerate(in_parallel(_render_one, jobs, cores()), 1):
        patch = options.patches[number]
        if isinstance(answer, UnderfootError):
            failed += 1
            reason = str(answer).removeprefix(f"{patch}: ").removeprefix(f"{patch} ")
            found[number] = {"error": str(answer)}
            print(f"underfoot: {patch}: {reason}", file=sys.stderr)
            continue
        found[number] = answer
        print(f"underfoot: {done} of {len(jobs)}: {patch}", file=sys.stderr)
    if options.as_json:
        print(json.dumps([{"patch": str(patch)} | found[number] for number, patch in enumerate(options.patches)]))
    else:
        for number, patch in enumerate(options.patches):
            if "error" not in found[number]:
                print(f"{patch}: {_line(found[number])}")
    if failed:
        raise UnderfootError(f"{failed} of {len(jobs)} patches were not rendered")


def _outputs(options: RenderOptions) -> list[Path | None]:
    """The file of each patch, in the folder that was named."""
    if options.output is None:
        return [None] * len(options.patches)
    if options.output.is_file() or options.output.suffix == ".wav":
        raise BadFile(f"{options.output} is no folder; {len(options.patches)} patches need one to be written into")
    outputs = [options.output / f"{patch.stem}.wav" for patch in options.patches]
    twice = {out.name for out in outputs if outputs.count(out) > 1}
    if twice:
        raise BadFile(f"{', '.join(sorted(twice))} would be written twice; render them one by one")
    make_folder(options.output)
    require_room(*outputs, inputs=(*options.patches, options.force, options.floor))
    return list(outputs)


def _line(summary: Summary) -> str:
    return (
        f"{summary['seconds']:.3f} s, peak {summary['peak']:.4f}, RMS {summary['rms']:.5f} of full scale, "
        f"{summary['times_real_time']:.0f} times real time"
    )


def _replayed(options: RenderOptions) -> "Rendered":
    """A recording, played again."""
    from underfoot.engine.session_replay import replay
    from underfoot.nodes import REGISTRY

    of_a_patch = (options.rate, options.seed, options.force, options.floor, options.seconds, options.profiles)
    if any(given is not None for given in (*of_a_patch, options.simulation)):
        raise BadValue(
            f"{options.patch} is a recording; allowed with it: --output, --measured, --under-foot, --block and --json"
        )
    return replay(options.patch, REGISTRY, options.block, tuple(options.plates))


def _rendered(options: RenderOptions) -> "Rendered":
    """A patch, played on the force that was asked for."""
    from underfoot.devices.offline import offline_source
    from underfoot.engine.commands import equalisers_of
    from underfoot.engine.loop import LoopOptions
    from underfoot.engine.render import render as run
    from underfoot.floor.layout import Floor
    from underfoot.floor.profile import profiles_of
    from underfoot.floor.tile_parameters import TileParameters
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch

    patch = Patch.load(options.patch, REGISTRY)
    rate_hz = float(RATE_HZ if options.rate is None else options.rate)
    if not rate_hz.is_integer():
        raise BadValue(f"--rate is {rate_hz:g}; allowed: whole numbers, 8000 to 192000 Hz")
    seed = patch.seed if options.seed is None else options.seed
    simulation = TileParameters.load(options.simulation) if options.simulation else None
    floor = Floor.load(options.floor) if options.floor else None
    source, length_s = offline_source(options.force, floor, rate_hz, seed, simulation, options.profiles)
    profiles = profiles_of(options.profiles, source.floor) if options.profiles else {}
    how = LoopOptions(
        rate_hz=rate_hz,
        block=options.block,
        equalisers=equalisers_of(profiles),
        folder=options.patch.parent,
        seed=options.seed,
        plates=tuple(options.plates),
        simulation=simulation,
    )
    return run(patch, REGISTRY, source, length_s if options.seconds is None else options.seconds, how)
