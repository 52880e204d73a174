"""A folder or zip to pass on: the patch, the files that it plays, the floor and its profiles."""

import os
import tempfile
import zipfile
from collections.abc import Collection, Iterator
from pathlib import Path

from underfoot.errors import BadFile
from underfoot.exchange.format import Export, Format
from underfoot.exchange.losses import KEPT
from underfoot.files import make_folder, read_large_file, replaced, write_file, written
from underfoot.floor.profile import profiles_of
from underfoot.nodes import REGISTRY
from underfoot.patch.file_paths import files_of
from underfoot.version import __version__

PATCH, FLOOR, README = "patch.json", "floor.json", "README.txt"
FILES, PROFILES = "files", "profiles"
_BEGAN = (1980, 1, 1, 0, 0, 0)
"""Time stamp of all files in a zip: the same patch gives the same bytes."""


def write(export: Export, path: Path) -> tuple[str, ...]:
    """Write the folder, which must be new or empty, or the zip."""
    parts = dict(_parts(export))
    if path.suffix.lower() == ".zip":
        with replaced(path) as part, written(path), zipfile.ZipFile(part, "w", zipfile.ZIP_DEFLATED) as file:
            for name, data in parts.items():
                entry = zipfile.ZipInfo(f"{path.stem}/{name}", _BEGAN)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                file.writestr(entry, data)
    else:
        _write_folder(parts, path)
    return (f"{len(parts)} files: {', '.join(parts)}",)


def _write_folder(parts: dict[str, bytes], path: Path) -> None:
    """Write to a temporary place, and move the folder when it is complete."""
    with written(path):
        if os.path.exists(path) and (not path.is_dir() or any(path.iterdir())):
            raise BadFile(f"{path} is there already; allowed: a new or an empty folder")
        folder = make_folder(path.absolute().parent)
        with tempfile.TemporaryDirectory(prefix=f".{path.name}.", dir=folder) as holder:
            whole = Path(holder, "whole")
            for name, data in parts.items():
                make_folder((whole / name).parent)
                write_file(whole / name, data)
            whole.chmod(0o755)
            if path.is_dir():  # an empty one, in place of which Windows moves no folder
                path.rmdir()
            whole.replace(path)


def _parts(export: Export) -> Iterator[tuple[str, bytes]]:
    """Yield each file's path in the folder, and its content."""
    patch = export.patch
    names: dict[Path, str] = {}
    for id, parameter, named in list(files_of(patch, REGISTRY)):
        file = Path(named) if export.folder is None else export.folder / named
        if file not in names:
            names[file] = _free(file.name, names.values())
        patch = patch.set(id, parameter, names[file], REGISTRY)
    lines = [
        "A patch for vibrotactile floors. Open patch.json with Underfoot, or: underfoot render patch.json -o out.wav"
    ]
    yield PATCH, patch.dumps()
    for file, name in names.items():
        yield name, read_large_file(file)
    if names:
        lines.append(f"{FILES}/ has the sounds that it plays.")
    if export.floor is not None:
        yield FLOOR, export.floor.dumps()
        lines.append(f"{FLOOR} is the floor that it was made on: --floor {FLOOR}")
        if export.profiles is not None:
            for tile, profile in profiles_of(export.profiles, export.floor).items():
                yield f"{PROFILES}/{tile}.json", profile.dumps()
            lines.append(f"{PROFILES}/ has how its tiles were calibrated: --profiles {PROFILES}")
    lines.append(f"Written by Underfoot {__version__}.")
    yield README, ("\n".join(lines) + "\n").encode()


def _free(name: str, taken: Collection[str]) -> str:
    """Return a path in the folder of files that is not taken, nor by another case: many systems make no difference."""
    stem, suffix = Path(name).stem, Path(name).suffix
    candidates = (f"{FILES}/{stem}{f'-{k}' if k else ''}{suffix}" for k in range(10_000))
    lower = {path.lower() for path in taken}
    return next(path for path in candidates if path.lower() not in lower)


FORMAT = Format(
    "share",
    "Folder to hand on",
    ("", ".zip"),
    frozenset(KEPT),
    write,
    note="the patch with the files that it plays, the floor and its profiles; a zip where the name ends in .zip",
)
