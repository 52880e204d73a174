"""The files that a patch names, and their paths when the patch comes to lie in another folder."""

from collections.abc import Iterator
from pathlib import Path

from underfoot.parameters import FilePath
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch


def files_of(patch: Patch, registry: Registry) -> Iterator[tuple[str, str, str]]:
    """Each file that the patch names: the node's id, the parameter, and the path as the patch has it."""
    for node in patch.nodes:
        for name, parameter in registry[node.type].parameters.items():
            if isinstance(parameter, FilePath) and node.parameters.get(name):
                yield node.id, name, node.parameters[name]


def with_files_kept(patch: Patch, registry: Registry, before: Path | None, after: Path | None) -> Patch:
    """The patch that names, from the folder `after`, the files that it named from the folder `before`.

    Paths of files below `after` become relative to it, others absolute; without `after` all do. A relative path of a
    patch that had no folder stays as it is: only a folder says which file it is.
    """
    for id, name, named in files_of(patch, registry):
        if before is None and not Path(named).is_absolute():
            continue
        file = Path(named) if before is None else before / named
        told = file.relative_to(after) if after is not None and file.is_relative_to(after) else file
        patch = patch.set(id, name, str(told), registry)
    return patch
