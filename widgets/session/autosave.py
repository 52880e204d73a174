"""Automatic copies of unsaved work, which survive a crash."""

from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct
from msgspec.structs import replace
from PySide6.QtCore import QLockFile

from underfoot.errors import UnderfootError
from underfoot.files import read_file, write_file
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

_SLOTS = 16

RegisterNodes = Callable[[Patch, Path | None], None]
"""Registers the nodes of a patch in a folder before the patch is checked."""


class RecoveredWork(Struct, frozen=True):
    """The open patch of a window that crashed or restarts, and its file, if any."""

    patch: Patch
    path: Path | None
    other: "RecoveredWork | None" = None
    """The work in the other slot, if any."""
    is_saved: bool = False
    """Whether it equals its file, or was never edited."""
    for_restart: bool = False
    """Whether the window was closed to be opened anew."""


class Autosave:
    """The copy of one window's unsaved work, in a file that no other window uses.

    Each window holds the lock of one slot. The lock of a window that died is free again, and `recover` finds the work
    in its slot.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._lock: QLockFile | None = None
        slots = [folder / f"work-{slot}.json" for slot in range(_SLOTS)]
        aside = sorted(set(folder.glob("work-*.json")) - set(slots))
        for self._path in sorted(slots + aside, key=lambda path: not path.exists()):
            lock = QLockFile(str(self._path.with_suffix(".lock")))
            lock.setStaleLockTime(0)
            if lock.tryLock(0):
                self._lock = lock
                return

    def write(self, work: RecoveredWork) -> None:
        """Write the copy. Without a free slot (16 windows) nothing is kept."""
        if self._lock is not None:
            fields = {"format": "underfoot-work", **_fields(work), "for_restart": work.for_restart}
            if work.other is not None:
                fields["other"] = _fields(work.other)
            write_file(self._path, msgspec.json.encode(fields))

    def remove(self) -> None:
        """Remove the copy: the work is saved elsewhere, or not wanted."""
        if self._lock is not None:
            self._path.unlink(missing_ok=True)

    def recover(
        self, registry: Registry, register_nodes: RegisterNodes = lambda patch, folder: None
    ) -> RecoveredWork | None:
        """Return the work that a crashed window left in this slot; None if there is none, or it cannot be read."""
        if self._lock is None:
            return None
        try:
            work = msgspec.json.decode(read_file(self._path))
            other = self._read(work["other"], registry, register_nodes) if "other" in work else None
            found = self._read(work, registry, register_nodes)
            return replace(found, other=other, for_restart=work.get("for_restart") is True)
        except (UnderfootError, msgspec.DecodeError, UnicodeDecodeError, KeyError, TypeError):
            return None

    def _read(self, work: dict[str, Any], registry: Registry, register_nodes: RegisterNodes) -> RecoveredWork:
        text, path = msgspec.json.encode(work["patch"]), Path(work["path"]) if work["path"] else None
        register_nodes(Patch.unchecked(text, str(self._path)), path.absolute().parent if path is not None else None)
        patch = Patch.loads(text, registry, str(self._path))
        return RecoveredWork(patch, path, is_saved=work.get("is_saved") is True)

    def put_aside(self) -> None:
        """Move the work left here to another slot, for a later start; to a further one if all are taken."""
        slots = (self._path.with_name(f"work-{slot}.json") for slot in count())
        to = next(path for path in slots if not path.exists() and not path.with_suffix(".lock").exists())
        if self._path.exists():
            self._path.replace(to)

    def close(self) -> None:
        """Release the slot, and keep its content."""
        if self._lock is not None:
            self._lock.unlock()
            self._lock = None


def _fields(work: RecoveredWork) -> dict[str, object]:
    return {"path": str(work.path or ""), "patch": work.patch, "is_saved": work.is_saved}
