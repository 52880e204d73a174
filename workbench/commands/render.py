"""`underfoot render`: patches, played offline: one here, several or a grid at once on all cores or a cluster."""

import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence, Sized
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from underfoot.clock import RATE_HZ
from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import interrupted_by_signals
from underfoot.commands.files import (
    FORCES_FLOOR,
    RUN_CODE,
    FileName,
    require_outputs_writable,
)
from underfoot.commands.options import command, require_only
from underfoot.commands.telling import tell
from underfoot.errors import BadFile, BadValue, UnderfootError
from underfoot.files import make_folder, read_file, require_file_name
from underfoot.options import argument, option, shared

if TYPE_CHECKING:
    from underfoot.engine.bulk import Job
    from underfoot.engine.offline import RenderJob
    from underfoot.engine.parameter_grid import Values
    from underfoot.engine.requests import CompileRequest
    from underfoot.floor.simulated_plates import PlateOutput
    from underfoot.patch.patch import Patch

Summary = dict[str, Any]


@dataclass(frozen=True)
class RenderOptions:
    """Options of a rendering; None if not given."""

    patches: tuple[Path, ...] = argument("patches", metavar="PATCH...")
    output_name: str | None = option(
        "WAV file: float samples, one channel per tile. For several, a folder.", flag="-o --output", type=FileName()
    )
    seconds: float | None = option("Length; by default the force's, or 5 s.")
    rate: float | None = option(f"Frames per second; {RATE_HZ} by default.")
    block: int = option("Frames per block; the output is the same.", 1024)
    seed: int | None = option("Seed instead of the patch's own.")
    force: str | None = option(
        'Force CSV, recording, C3D file, a preset walk, or "none" for an empty floor; by default a simulated walker.',
        presets="walks",
    )
    floor: Path | None = shared(FORCES_FLOOR)
    profiles: Path | None = option("Folder of the tiles' profiles: how each is driven.")
    simulation: Path | None = option("Parameter file of the simulated tiles.", presets="simulations")
    measured: Path | None = option(
        "WAV file of simulated accelerometers, m/s^2, one channel per tile.", is_written=True
    )
    under_foot: Path | None = option("WAV file of the simulated acceleration under the foot, m/s^2.", is_written=True)
    settings: tuple[str, ...] = option(
        "Values instead of the patch's own. Several values make one file each, several --set every combination.",
        (),
        "--set",
        metavar="NODE.PARAMETER=VALUE,...",
    )
    cluster: str | None = option("Scheduler of a Dask cluster for several renderings.", metavar="TCP://HOST:PORT")
    outside_files: bool = option("Let patches read sound files outside their own folders.", False)
    run_code: bool = shared(RUN_CODE)
    as_json: bool = option("Print peak, RMS, speed, and which nodes ran or slept, as JSON.", False, "--json")

    @property
    def output(self) -> Path | None:
        """The file to write, or the folder of several; None if not given."""
        return None if self.output_name is None else Path(self.output_name)

    @property
    def patch(self) -> Path:
        """The patch, where there is one."""
        return self.patches[0]

    @property
    def plates(self) -> "dict[PlateOutput, Path]":
        """Where acceleration of simulated plates is taken, and the file that it goes to."""
        outputs_by_place: dict[PlateOutput, Path | None] = {"accelerometer": self.measured, "foot": self.under_foot}
        return {plate_output: path for plate_output, path in outputs_by_place.items() if path is not None}


@command(RenderOptions)
def render(options: RenderOptions) -> None:
    """Render PATCH (a patch file, a preset's name, or a recording) offline; several on all cores.

    If PATCH is a folder, all its patches are rendered. Several results go into a folder, with a manifest.
    """
    from underfoot.engine.parameter_grid import grid_of

    grid, patches = grid_of(options.settings), _patches(options)
    if len(patches) * len(grid) > 1 or os.path.isdir(options.patch):
        if options.plates:
            raise BadValue("--measured and --under-foot are for one patch at a time")
        with interrupted_by_signals(), _folder_only_with_files(options.output):
            _render_all(options, patches, grid)
    elif options.cluster is not None:
        raise BadValue("--cluster is for several patches, or several values of --set")
    else:
        with interrupted_by_signals():
            _render_one(options, grid[0])


def _render_one(options: RenderOptions, values: "Values") -> None:
    """Render the one patch, write what is to be written, and say the figures."""
    from underfoot.records.recording import is_recording
    from underfoot.records.wav import require_wav

    inputs = (options.patch, options.force, options.floor, options.simulation)
    files: dict[str, Path] = {}
    if options.output_name is not None:
        require_file_name(options.output_name)
        files[""] = Path(options.output_name)
    files |= options.plates.items()
    require_outputs_writable(*files.values(), inputs=inputs)
    for path in files.values():
        require_wav(path)
    with report_compiling(None if is_recording(options.patch) else partial(compile_request, options.patch)):
        (job,) = _jobs_of(options, options.patch, [values])
        summary = job.run(files).summary()
    print(json.dumps(summary) if options.as_json else line_of(summary))


def compile_request(patch: Path) -> "CompileRequest":
    """Return what another process compiles, while this one begins at the other end of the list."""
    from underfoot.engine.requests import CompileRequest
    from underfoot.engine.target import Target
    from underfoot.floor.layout import default_floor

    return CompileRequest(0, read_file(patch), Target(default_floor()), patch.parent)


def _patches(options: RenderOptions) -> list[Path]:
    """Return the given files, and the files in given folders."""
    found = []
    for path in options.patches:
        inside = sorted(path.glob("*.json")) if os.path.isdir(path) else [path]
        if not inside:
            raise BadFile(f"{path} cannot be read: there is no patch in it; allowed: a folder of .json files")
        found += inside
    return found


@contextmanager
def _folder_only_with_files(folder: Path | None) -> Iterator[None]:
    """Remove a folder that the block has made and put nothing into, as where Ctrl-C comes before the first file."""
    was_there = folder is None or folder.exists()
    try:
        yield
    finally:
        if folder is not None and not was_there:
            with suppress(OSError):  # it has files, or was not made
                folder.rmdir()


def _render_all(options: RenderOptions, patches: Sequence[Path], grid: "Sequence[Values]") -> None:
    """Render several, each into a file of its own in the folder; what fails is said, and the others go on."""
    from underfoot.engine.bulk import MANIFEST, Item, Manifest, file_names, rendered

    names = file_names([(path.stem, values) for path in patches for values in grid])
    outputs = _outputs(options, patches, [f"{name}.wav" for name in names])
    folder = options.output
    files = [(str(path), values) for path in patches for values in grid]
    manifest = Manifest(folder / MANIFEST, files) if folder is not None else None
    settings = ["".join(f" {name}={value}" for name, value in values.items()) for values in grid]
    told = [f"{_shown(path)}{setting}" for path in patches for setting in settings]
    found: dict[int, Summary | UnderfootError] = {}
    items: dict[int, Item] = {}
    for k, path in enumerate(patches):
        places = range(k * len(grid), (k + 1) * len(grid))
        said = set[str]()
        for at, job, values in zip(places, _jobs_or_errors(options, path, grid), grid, strict=True):
            if not isinstance(job, UnderfootError):
                items[at] = Item(job, str(path), values, outputs[at])
                continue
            found[at] = job
            if manifest is not None:
                manifest.add_error(at, job)
            if str(job) not in said:  # what many combinations share is said once
                said.add(str(job))
                _tell_failure(_shown(path), path, job)
    order, began = list(items), time.perf_counter()
    try:
        for number, answer in rendered(list(items.values()), options.cluster):
            at = order[number]
            found[at] = answer
            if manifest is not None:
                if isinstance(answer, UnderfootError):
                    manifest.add_error(at, answer)
                else:
                    manifest.add(at, items[at], answer)
            if isinstance(answer, UnderfootError):
                _tell_failure(told[at], patches[at // len(grid)], answer)
            else:
                tell(f"{len(found)} of {len(told)}: {told[at]}{_time_left(found, told, began)}")
    finally:
        if manifest is not None:
            manifest.write()
    _say_all(options, told, found)


def _time_left(found: Sized, told: Sequence[str], began: float) -> str:
    """Return the estimated time left in words; "" if it is short."""
    left_s = (time.perf_counter() - began) / len(found) * (len(told) - len(found))
    return f" ({left_s:.0f} s left)" if left_s >= 2.0 else ""


def _shown(path: Path) -> str:
    """Return the name of a preset, or the path of any other file."""
    from underfoot.patch import preset_files

    return path.stem if preset_files.patches().get(path.stem) == path else str(path)


def _tell_failure(what: str, path: Path, error: UnderfootError) -> None:
    reason = str(error).removeprefix(f"{path}: ").removeprefix(f"{path} ")
    tell(f"{what}: {reason}")


def _say_all(options: RenderOptions, told: Sequence[str], found: Mapping[int, Summary | UnderfootError]) -> None:
    """Print the figures of all renderings in order; raise an error if some failed."""
    failed = sum(isinstance(answer, UnderfootError) for answer in found.values())
    if options.as_json:
        as_data = [{"error": str(a)} if isinstance(a, UnderfootError) else a for _, a in sorted(found.items())]
        print(json.dumps([{"patch": name} | one for name, one in zip(told, as_data, strict=True)]))
    else:
        for number, name in enumerate(told):
            if not isinstance(answer := found[number], UnderfootError):
                print(f"{name}: {line_of(answer)}")
    if failed:
        raise UnderfootError(f"{failed} of {len(told)} patches were not rendered")


def _outputs(options: RenderOptions, patches: Sequence[Path], names: Sequence[str]) -> list[Path | None]:
    """Return the output file of each rendering in the given folder."""
    if options.output is None:
        return [None] * len(names)
    if options.output.is_file() or options.output.suffix == ".wav":
        what = "is a file" if options.output.is_file() else "is the name of a sound file"
        given = [_shown(path) for path in options.patches]
        told = " ".join(given) if len(given) <= 3 else f"{len(given)} patches"
        raise BadFile(
            f"--output {options.output} {what}; allowed for {told}, which makes "
            f"{len(names)} file{'s' if len(names) > 1 else ''}: a folder, as {options.output.with_suffix('')}"
        )
    outputs = [options.output / name for name in names]
    twice = {out.name for out in outputs if outputs.count(out) > 1}
    if twice:
        raise BadFile(f"{', '.join(sorted(twice))} would be written twice; render them one by one")
    make_folder(options.output)
    require_outputs_writable(*outputs, inputs=(*patches, options.force, options.floor))
    return list(outputs)


def line_of(summary: Summary) -> str:
    """Return the line on a rendered file: length in seconds, peak and RMS in shares of full scale, and speed."""
    times = summary["times_real_time"]
    return (
        f"{summary['seconds']:.3f} s, peak {summary['peak']:.4f}, RMS {summary['rms']:.5f} of full scale, "
        f"{f'{times:.0f}' if times >= 9.95 else f'{times:#.2g}'} times real time"
    )


def _jobs_or_errors(options: RenderOptions, path: Path, grid: "Sequence[Values]") -> "Sequence[Job | UnderfootError]":
    """Return a job for each combination of the grid's values, or why there is none."""
    try:
        return _jobs_of(options, path, grid)
    except UnderfootError as error:
        if len(grid) == 1:
            return [error]
        return [one for values in grid for one in _jobs_or_errors(options, path, [values])]


def _jobs_of(options: RenderOptions, path: Path, grid: "Sequence[Values]") -> "Sequence[Job]":
    """Return a job for each combination of the grid's values; a recording takes no values."""
    from underfoot.nodes import REGISTRY
    from underfoot.patch.outside_files import require_inside
    from underfoot.patch.patch import Patch
    from underfoot.records.recording import is_recording

    if is_recording(path):
        from underfoot.engine.session_replay import ReplayJob

        of_others = "--cluster --outside-files --run-code"  # patches that are rendered beside it
        require_only(options, f"{path}, a recording", f"--output --measured --under-foot --block --json {of_others}")
        return [ReplayJob(path, options.block, tuple(options.plates))]
    patch = Patch.load(path)
    if not options.outside_files:
        require_inside(patch, REGISTRY, path)
    return [_job(options, path, patch, values) for values in grid]


def _job(options: RenderOptions, path: Path, patch: "Patch", values: "Values") -> "RenderJob":
    """Return the job that renders a patch with these values on the given force."""
    from underfoot.engine.loop import LoopOptions
    from underfoot.engine.offline import RenderJob
    from underfoot.floor.layout import Floor, default_floor
    from underfoot.floor.profile import profiles_of
    from underfoot.floor.tile_parameters import TileParameters
    from underfoot.records.forces import read_forces

    for name, value in values.items():
        node, _, parameter = name.partition(".")
        patch = patch.set(node, parameter, value)
    loop_options = LoopOptions(
        rate_hz=float(RATE_HZ if options.rate is None else options.rate),
        block=options.block,
        seed=options.seed,
        plates=tuple(options.plates),
        simulation=TileParameters.load(options.simulation) if options.simulation else None,
        folder=path.parent,
    )
    forces = None if options.force in (None, "none") else read_forces(options.force, options.floor)
    if forces is not None:
        floor = forces.floor
    else:
        floor = Floor.load(options.floor) if options.floor else default_floor()
    profiles = profiles_of(options.profiles, floor)
    return RenderJob(patch, forces, floor, options.force is None, options.seconds, profiles, loop_options)
