"""Files that a patch refers to, and their paths when the patch moves to another folder."""

from collections.abc import Iterator
from pathlib import Path, PurePath

from underfoot.arguments import is_text
from underfoot.parameters import FilePath
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch


def files_of(patch: Patch, registry: Registry) -> Iterator[tuple[str, str, str]]:
    """Yield each file of the patch: the node's id, the parameter, and the path as stored in the patch."""
    for node in patch.nodes:
        for name, parameter in registry[node.type].parameters.items():
            if isinstance(parameter, FilePath) and node.parameters.get(name):
                yield node.id, name, node.parameters[name]


def named_from(folder: PurePath | None, file: PurePath) -> str:
    """Return a file's path as a patch in a folder stores it: relative if it lies below, with "/" on every system.

    >>> from pathlib import PureWindowsPath
    >>> named_from(PureWindowsPath("C:/study"), PureWindowsPath("C:/study/sounds/step.wav"))
    'sounds/step.wav'
    """
    return (file.relative_to(folder) if folder is not None and file.is_relative_to(folder) else file).as_posix()


def with_files_kept(patch: Patch, registry: Registry, before: Path | None, after: Path | None) -> Patch:
    """Return the patch moved from folder `before` to folder `after`, with paths to the same files.

    Paths of files below `after` become relative to it, others absolute; without `after` all become absolute. A relative
    path of a patch without a folder is kept, as it does not identify a file; so is one in a folder whose name is not
    UTF-8, as no patch can have it.
    """
    for id, name, named in files_of(patch, registry):
        if before is None and not Path(named).is_absolute():
            continue
        moved = named_from(after, Path(named) if before is None else before / named)
        if after is not None or is_text(moved):
            patch = patch.set(id, name, moved, registry)
    return patch


def text_with_files_kept(text: bytes, source: str, registry: Registry, before: Path, after: Path | None) -> bytes:
    """Return the text of a patch moved in the same way; as it is if it has no files, or nodes that are not known."""
    patch = Patch.unchecked(text, source)
    if any(node.type not in registry for node in patch.nodes):
        return text
    moved = with_files_kept(patch, registry, before, after)
    return text if moved == patch else moved.dumps()
