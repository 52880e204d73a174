"""`underfoot convert`: patches to formats of other programs, and back."""

from dataclasses import dataclass
from functools import partial
from pathlib import Path

from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import interrupted_by_signals
from underfoot.commands.files import (
    RUN_CODE,
    FileName,
    require_folders_writable,
    require_outputs_writable,
)
from underfoot.commands.options import command, require_only
from underfoot.commands.render import compile_request
from underfoot.errors import BadValue
from underfoot.files import require_file_name
from underfoot.options import argument, option, shared
from underfoot.quantities import counted

PATCH_SUFFIX = ".json"


@dataclass(frozen=True)
class ConvertOptions:
    """Options of a conversion; None or "" if not given."""

    source: Path | None = argument("patches", metavar="IN")
    output_name: str | None = option(
        "Output file; its suffix selects the format. A patch ends in .json.", flag="-o --output", type=FileName()
    )
    format: str = option("Format, if the suffix is ambiguous.", "")
    tile: str = option("Write only this tile; by default all, or the one that moves most.", "")
    seconds: float | None = option("Length; by default until vibration ends, at most 5 s.")
    force: str | None = option('Force CSV, recording, C3D file, walk, or "none"; by default one step.', presets="walks")
    floor: Path | None = option("Floor JSON for a simulated walker; copied into a shared folder.", presets="floors")
    profiles: Path | None = option("Folder of the tiles' profiles, copied into a shared folder.")
    run_code: bool = shared(RUN_CODE)
    formats: bool = option("List the formats, with directions and losses.", False)


@command(ConvertOptions)
def convert(options: ConvertOptions) -> None:
    """Convert IN to -o OUT: a patch to another program's format, or another program's file to a patch."""
    if options.formats:
        print(_list())
        return
    if options.source is None or options.output_name is None:
        raise BadValue("IN or -o OUT is missing; `underfoot convert --formats` lists what there is")
    convert_one = _write if _is_patch(options.source, Path(options.output_name)) else _read
    convert_one(options, options.source, options.output_name)


def _is_patch(path: Path, output: Path) -> bool:
    """Return whether a file is a patch: it says so, or the output is none, and other programs' files only become
    patches.
    """
    from underfoot.files import read_file
    from underfoot.patch.patch import FORMAT

    if path.suffix.lower() != PATCH_SUFFIX:
        return False
    return output.suffix.lower() != PATCH_SUFFIX or f'"{FORMAT}"'.encode() in read_file(path)[:4096]


def _write(options: ConvertOptions, source: Path, output_name: str) -> None:
    from underfoot.exchange.format import Export
    from underfoot.exchange.formats import to_write
    from underfoot.exchange.losses import losses
    from underfoot.floor.layout import Floor
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch

    output = Path(output_name)
    format = to_write(output, options.format)
    if "" in format.suffixes and not (output.suffix and output.suffix.lower() in format.suffixes):
        require_folders_writable(output.parent)
    else:
        require_file_name(output_name)
        require_outputs_writable(output, inputs=(source, options.force, options.floor))
    patch = Patch.load(source, REGISTRY)
    export = Export(
        patch,
        source.absolute().parent,
        options.seconds,
        options.tile,
        options.force,
        Floor.load(options.floor) if options.floor else None,
        options.profiles,
    )
    assert format.write is not None
    with interrupted_by_signals(), report_compiling(partial(compile_request, source)):
        told = format.write(export, output)
    print("\n".join([f"{output}: {format.label}", *(f"  {line}" for line in told)]))
    _print_lost(losses(patch, format.carries))


def _read(options: ConvertOptions, source: Path, output_name: str) -> None:
    from underfoot.exchange.format import read_foreign_patch
    from underfoot.exchange.formats import to_read
    from underfoot.nodes import REGISTRY
    from underfoot.patch.file_paths import with_files_kept

    require_file_name(output_name)
    output = Path(output_name)
    require_only(options, f"{source}, which is no patch", "--output --format")
    if output.suffix.lower() != PATCH_SUFFIX:
        raise BadValue(
            f"--output is {output}; a patch is made of {source}: allowed: a name that ends in {PATCH_SUFFIX}"
        )
    format = to_read(source, options.format)
    require_outputs_writable(output, inputs=(source,))
    imported = read_foreign_patch(format, source)
    folder = output.absolute().parent
    patch = with_files_kept(imported.patch, REGISTRY, folder, folder)
    patch.save(output)
    print(f"{output}: a patch of {counted(len(patch.nodes), 'node')}, from {format.label}")
    _print_lost(imported.losses)


def _print_lost(lines: tuple[str, ...]) -> None:
    print("\n".join(["not kept:", *(f"  {line}" for line in lines)] if lines else ["all is kept"]))


def _list() -> str:
    """Return a description of the formats, a few lines each."""
    from underfoot.exchange.formats import FORMATS
    from underfoot.exchange.losses import KEPT

    lines = []
    for one in FORMATS.values():
        does = " and ".join(word for word, way in (("written", one.write), ("read", one.read)) if way)
        suffixes = ", ".join(suffix or "a folder" for suffix in one.suffixes)
        lines.append(f"{one.name:10} {one.label} ({suffixes}): {does}")
        if one.note:
            lines.append(f"{'':10} {one.note}")
        if one.write:
            lost = [name for name in KEPT if name not in one.carries]
            lines.append(f"{'':10} does not keep: {', '.join(lost) or 'nothing is lost'}")
    return "\n".join(lines)
