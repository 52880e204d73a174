"""Options of commands that name files, and the check that outputs can be written."""

import os
import stat
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from difflib import get_close_matches
from glob import escape, glob
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from underfoot.errors import BadFile
from underfoot.files import names_file, reason_of, require_file_name, require_replaceable
from underfoot.options import option

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class FileName(click.Path):
    """The name of a file or folder. `-` is none: a file of that name would be written for what was to be piped."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ANN401 - Click's
        if value in ("", "-"):
            raise BadFile(f"{value!r} cannot be read or written; allowed: a file's name")
        return super().convert(value, param, ctx)


class _Input(FileName):
    """A file or folder to read. What comes through a pipe, as from the shell's `<(zcat trials.csv.gz)`, is kept in a
    file while the command runs: only there can it be read twice, and by other processes. The window waits for no pipe.
    """

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ANN401 - Click's
        if ctx is not None and ctx.parent is not None and not ctx.resilient_parsing and _is_pipe(value):
            value = _kept(value, ctx.find_root())
        return super().convert(value, param, ctx)


def _is_pipe(name: str) -> bool:
    """Return whether this is the name of a pipe; one that no file can have is refused where the file is read."""
    with suppress(OSError, ValueError):
        return stat.S_ISFIFO(os.stat(name).st_mode)
    return False


def _kept(pipe: str, ctx: click.Context) -> str:
    """Return the name of a file with all that is written to a pipe, which is removed with the context."""
    from shutil import copyfileobj
    from tempfile import TemporaryDirectory

    folder = ctx.with_resource(TemporaryDirectory(prefix="underfoot-pipe-"))
    copy = os.path.join(folder, os.path.basename(pipe))
    try:  # to open it in the usual way would wait for somebody who writes
        with open(os.open(pipe, os.O_RDONLY | os.O_NONBLOCK), "rb") as source, open(copy, "wb") as target:
            os.set_blocking(source.fileno(), True)
            copyfileobj(source, target)
    except OSError as error:
        raise BadFile(f"{pipe} cannot be read: {reason_of(error)}") from None
    if not os.path.getsize(copy):
        raise BadFile(f"{pipe} cannot be read: it is a pipe, and nothing was written to it")
    return copy


FILE = _Input(path_type=Path)
"""A file or folder that is named on the command line."""


class _Output(FileName):
    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ANN401 - Click's
        require_file_name(str(value))
        return super().convert(value, param, ctx)


OUTPUT = _Output(path_type=Path)
"""A file to write, and never a folder."""


class FileOrPreset(_Input):
    """A file, or the name of a preset if there is no such file; `kind` is the function of `preset_files` for these.

    If its value is a str, it may also be other words, which stay as they are.
    A folder that is called as a preset, such as one for what is rendered of it, does not hide that; `gravel/` names it.
    """

    def __init__(self, kind: str, path_type: type = Path) -> None:
        super().__init__(path_type=path_type)
        self._kind = kind

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:  # noqa: ANN401 - Click's
        named = super().convert(value, param, ctx)
        text = str(value)
        if names_file(text) and not os.path.isdir(text):
            return named
        from underfoot.patch import preset_files

        presets = getattr(preset_files, self._kind)()
        if text in presets:
            return self.coerce_path_result(presets[text])
        if self.type is Path and not os.path.exists(text):
            like = get_close_matches(text.lower(), presets, 1, 0.7)
            allowed = f"did you mean {like[0]}?" if like else f"allowed: a file, or {', '.join(presets)}"
            raise BadFile(f"{text} cannot be read: no such file or preset; {allowed}")
        return named

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        """Return that the shell has the files, and the presets that begin so."""
        return complete_presets(self._kind)(ctx, param, incomplete)


Completes = Callable[[click.Context, click.Parameter, str], "list[CompletionItem]"]


def complete_names(names: Callable[[], Iterable[str]]) -> Completes:
    """Return what Tab completes to those of these names that begin so."""

    def found(ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        from click.shell_completion import CompletionItem

        return [CompletionItem(name) for name in names() if name.startswith(incomplete)]

    return found


def scene_names() -> Iterable[str]:
    """Return the names of all scenes."""
    from underfoot.scenes import discover

    return discover()


def live_targets() -> Iterable[str]:
    """Return the simulator, and the targets that the transports suggest, such as the serial ports that are there."""
    from underfoot.devices.transports import TRANSPORTS

    found = ["simulator"]
    for scheme, kind in TRANSPORTS.items():
        with suppress(Exception):  # a plug-in's list can raise anything; what else there is is offered
            found += [f"{scheme}:{one}" for one in kind.suggestions()]
    return found


def complete_presets(kind: str) -> Completes:
    """Return what Tab completes to files and to presets; `kind` as for `FileOrPreset`."""
    return complete_files_and(lambda: _presets(kind))


def complete_sources() -> Completes:
    """Return what Tab completes to files, preset walks and live targets."""
    return complete_files_and(lambda: [*_presets("walks"), *live_targets()])


def complete_files_and(names: Callable[[], Iterable[str]]) -> Completes:
    """Return what Tab completes to files and to these names.

    bash drops what comes before the files, and has no files if anything comes after: it is offered the names where no
    file begins so.
    """

    def found(ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        named = complete_names(names)(ctx, param, incomplete)
        files = click.Path().shell_complete(ctx, param, incomplete)
        return [*named, *files] if glob(f"{escape(incomplete)}*") else [*files, *named]

    return found


def _presets(kind: str) -> Iterable[str]:
    from underfoot.patch import preset_files

    presets: Iterable[str] = getattr(preset_files, kind)()
    return presets


FORCES_FLOOR: Path | None = option("Floor JSON; found automatically beside a force CSV.", presets="floors")
"""The floor of forces that are named."""


def _agree(context: click.Context, parameter: click.Parameter, is_given: bool) -> bool:
    if is_given:
        from underfoot.patch.custom_nodes import allow_all_node_files

        context.with_resource(allow_all_node_files())
    return is_given


RUN_CODE: bool = option(
    "Run node files beside a patch (nodes/TYPE.py). They are programs with your permissions.",
    False,
    callback=_agree,
)
"""The option of every command that reads patches."""


def require_outputs_writable(*outputs: Path | None, inputs: Sequence[str | Path | None] = ()) -> None:
    """Raise `BadFile` before the work, and not after it, for outputs that cannot be written.

    No output may be a folder, one of `inputs`, or another output.
    """
    taken = {os.path.realpath(path) for path in inputs if path is not None}
    for path in outputs:
        if path is None:
            continue
        if os.path.isdir(path):
            raise BadFile(f"{path} cannot be written: it is a folder")
        if not os.path.isdir(path.parent):
            raise BadFile(f"{path} cannot be written: there is no folder {path.parent}")
        require_replaceable(path)
        _require_writable(path, path.parent)
        if os.path.realpath(path) in taken:
            raise BadFile(f"{path} is given twice; what comes out needs a file of its own")
        taken.add(os.path.realpath(path))


def require_folders_writable(*folders: Path | None) -> None:
    """Raise `BadFile` before the work for folders of outputs that cannot be made, or written into."""
    for path in folders:
        if path is None:
            continue
        there = next(one for one in (path, *path.parents) if one.exists())  # which raises for a name too long
        if not there.is_dir():
            raise BadFile(f"{there} is not a folder")
        _require_writable(path, there)


def _require_writable(path: Path, folder: Path) -> None:
    if not os.access(folder, os.W_OK):
        raise BadFile(f"{path} cannot be written: permission denied")
