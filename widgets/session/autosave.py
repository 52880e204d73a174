"""Automatic copies of unsaved work, which survive a crash."""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from itertools import count
from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct
from msgspec.structs import replace
from PySide6.QtCore import QLockFile, QObject, QTimer, Signal

from underfoot.errors import BadFile, UnderfootError
from underfoot.files import read_file, write_file, written
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

AUTOSAVE_MS = 1000
"""Time after the last edit at which unsaved work is copied."""

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


class WorkSlot:
    """The file of one window's unsaved work, such as `work-0.json`, that no other window uses.

    Each window holds the lock of one slot. The lock of a window that died is free again, and the next window finds the
    work in its slot.
    """

    def __init__(self, folder: Path, stem: str, suffix: str) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._lock: QLockFile | None = None
        slots = [folder / f"{stem}-{slot}{suffix}" for slot in range(_SLOTS)]
        aside = sorted(set(folder.glob(f"{stem}*{suffix}")) - set(slots))
        for self.path in sorted(slots + aside, key=lambda path: not path.exists()):
            lock = QLockFile(str(self.path.with_suffix(".lock")))
            lock.setStaleLockTime(0)
            if lock.tryLock(0):
                self._lock = lock
                return

    @property
    def is_own(self) -> bool:
        """Whether this window has a slot: 16 windows do, where their folder can be written."""
        return self._lock is not None

    def write_bytes(self, data: bytes) -> None:
        """Write the file; `BadFile` if it cannot be written, or there is no free slot."""
        if not self.is_own:
            raise BadFile(f"{self.path.parent} takes no more files of unsaved work; close other windows")
        write_file(self.path, data)

    def remove(self) -> None:
        """Remove the file: the work is saved elsewhere, or not wanted."""
        if self.is_own:
            with written(self.path):
                self.path.unlink(missing_ok=True)

    def keep_unreadable(self) -> str:
        """Move the file, which cannot be read, where no copy replaces it; return a line that says where."""
        names = (self.path.with_name(f"unreadable-{number}{self.path.suffix}") for number in count(1))
        to = next(name for name in names if not name.exists())
        with written(to):
            self.path.replace(to)
        return f"{self.path} cannot be read; it is kept as {to.name}"

    def close(self) -> None:
        """Release the slot, and keep its content."""
        if self._lock is not None:
            self._lock.unlock()
            self._lock = None


class CopyWriter(QObject):
    """Writes copies of unsaved work in a thread, because disks can be slow."""

    _failed = Signal()

    def __init__(self, notify: Callable[[str], object], timer: QTimer) -> None:
        """`notify` takes a line for the user, in the thread.

        `timer` writes a copy when it ends: it is started where there is none, as a disk may be full for a while.
        """
        super().__init__(timer)
        self._notify, self._timer = notify, timer
        self._thread = ThreadPoolExecutor(1, "autosave")
        self._no_copy = ""  # why the last copy could not be written
        self._is_closed = False
        self._failed.connect(self._write_again)

    def submit(self, work: Callable[..., None], *given: object) -> "Future[None]":
        """Do this after what was submitted before."""
        done = self._thread.submit(work, *given)
        done.add_done_callback(self._note_copy)
        return done

    def _note_copy(self, done: "Future[None]") -> None:
        """Say once that there is no copy, until there is one again."""
        error = done.exception()
        if error is not None and not isinstance(error, UnderfootError | OSError):
            raise error
        if error is not None:
            self._failed.emit()
        before, self._no_copy = self._no_copy, "" if error is None else str(error)
        if self._no_copy and not before:
            self._notify(f"Unsaved work would not survive a crash: {self._no_copy}")

    def _write_again(self) -> None:
        if not self._is_closed and not self._timer.isActive():
            self._timer.start()

    def close(self) -> None:
        """Return when all is done."""
        self._is_closed = True
        self._thread.shutdown()


class Autosave(WorkSlot):
    """The copy of one window's open patches."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder, "work", ".json")

    def write(self, work: RecoveredWork) -> None:
        """Write the copy."""
        fields = {"format": "underfoot-work", **_fields(work), "for_restart": work.for_restart}
        if work.other is not None:
            fields["other"] = _fields(work.other)
        self.write_bytes(msgspec.json.encode(fields))

    def recover(
        self, registry: Registry, register_nodes: RegisterNodes = lambda patch, folder: None
    ) -> RecoveredWork | None:
        """Return the work that a crashed window left in this slot, if any.

        `BadFile` if it cannot be read, as that of another version: it is moved where no copy replaces it.
        """
        if not self.is_own or not self.path.exists():
            return None
        try:
            work = msgspec.json.decode(read_file(self.path))
            other = self._read(work["other"], registry, register_nodes) if "other" in work else None
            found = self._read(work, registry, register_nodes)
            return replace(found, other=other, for_restart=work.get("for_restart") is True)
        except (UnderfootError, msgspec.DecodeError, UnicodeDecodeError, KeyError, TypeError):
            raise BadFile(self.keep_unreadable()) from None

    def _read(self, work: dict[str, Any], registry: Registry, register_nodes: RegisterNodes) -> RecoveredWork:
        text, path = msgspec.json.encode(work["patch"]), Path(work["path"]) if work["path"] else None
        register_nodes(Patch.unchecked(text, str(self.path)), path.absolute().parent if path is not None else None)
        patch = Patch.loads(text, registry, str(self.path))
        return RecoveredWork(patch, path, is_saved=work.get("is_saved") is True)

    def put_aside(self) -> None:
        """Move the work left here to another slot, for a later start; to a further one if all are taken."""
        slots = (self.path.with_name(f"work-{slot}.json") for slot in count())
        to = next(path for path in slots if not path.exists() and not path.with_suffix(".lock").exists())
        if self.path.exists():
            self.path.replace(to)


def _fields(work: RecoveredWork) -> dict[str, object]:
    return {"path": str(work.path or ""), "patch": work.patch, "is_saved": work.is_saved}
