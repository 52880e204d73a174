"""Paths of files that a patch names, when the patch comes to lie in another folder."""

from pathlib import Path

from underfoot.parameters import FilePath
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch


def with_files_kept(patch: Patch, registry: Registry, before: Path | None, after: Path) -> Patch:
    """The patch that names, from the folder `after`, the files that it named from the folder `before`.

    Paths of files below `after` become relative to it, others absolute. A relative path of a patch that had no folder
    stays as it is: only a folder says which file it is.
    """
    for node in patch.nodes:
        for name, parameter in registry[node.type].parameters.items():
            named = node.parameters.get(name, "")
            if not isinstance(parameter, FilePath) or not named or (before is None and not Path(named).is_absolute()):
                continue
            file = Path(named) if before is None else before / named
            told = file.relative_to(after) if file.is_relative_to(after) else file
            patch = patch.set(node.id, name, str(told), registry)
    return patch
