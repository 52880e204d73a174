"""Files that a patch reads from outside its folder, which needs the user's consent."""

from pathlib import Path

from underfoot.errors import BadFile
from underfoot.files import is_within
from underfoot.patch.file_paths import files_of
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch


def outside_files(patch: Patch, registry: Registry, folder: Path | None) -> tuple[Path, ...]:
    """Return the files of a patch in `folder` that do not lie in or below it; without a folder, all of them.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("wav-player", REGISTRY, file="../secret.wav").add("wav-player", REGISTRY, file="a.wav")
    >>> [str(path) for path in outside_files(patch, REGISTRY, Path("patches"))]
    ['patches/../secret.wav']
    """
    named = ((folder or Path()) / path for _, _, path in files_of(patch, registry))
    return tuple(dict.fromkeys(path for path in named if folder is None or not is_within(path, folder)))


def require_inside(patch: Patch, registry: Registry, path: Path) -> None:
    """Raise `BadFile` if the patch in the file `path` reads files outside its folder."""
    outside = outside_files(patch, registry, path.parent)
    if outside:
        raise BadFile(
            f"{path} reads {', '.join(map(str, outside[:3]))}, outside its folder; "
            "allowed: files beside the patch or below, or others with --outside-files"
        )
