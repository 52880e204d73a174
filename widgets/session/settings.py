"""What the window remembers between starts, and the copy of unsaved work that survives a crash."""

import base64
from dataclasses import dataclass
from pathlib import Path

import msgspec
from PySide6.QtCore import QLockFile

from underfoot.errors import UnderfootError
from underfoot.files import read_file, write_file
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

LOW_LEVEL_DB = -30.0
"""The output level of the very first start."""

_SLOTS = 16


class Settings(msgspec.Struct):
    """What the window remembers: the last target, sound device, level, and where things stood.

    `simulation` is the file of what simulated tiles are made of, "" for ideal ones. `sound` is "" for the default
    device, None for no sound, else a device's name. `references` are what each calibration is measured against on
    hardware. `projector_at` is where a tile's middle is shown on the floor, in metres right of and above the screen's.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> settings = Settings.load(folder)
    >>> settings.level_db
    -30.0
    >>> settings.level_db = -12.0
    >>> settings.save(folder)
    >>> Settings.load(folder).level_db
    -12.0
    """

    kind: str = "simulator"
    source: str = ""
    rows: int = 2
    columns: int = 2
    simulation: str = ""
    sound: str | None = ""
    rate: int = 48_000
    block: int = 128
    level_db: float = LOW_LEVEL_DB
    folder: str = ""
    references: dict[str, str] = {}
    projector_scale: float = 1.0
    projector_at: tuple[float, float] = (0.0, 0.0)
    geometry: str = ""
    recent: list[str] = []

    @staticmethod
    def load(folder: Path) -> "Settings":
        """The settings kept in `folder`; the defaults where there are none, or none that can be read."""
        try:
            return msgspec.json.decode(read_file(folder / "settings.json"), type=Settings)
        except (UnderfootError, msgspec.DecodeError, UnicodeDecodeError):
            return Settings()

    def save(self, folder: Path) -> None:
        """Keep the settings in `folder`, which is made where it is missing."""
        folder.mkdir(parents=True, exist_ok=True)
        write_file(folder / "settings.json", msgspec.json.format(msgspec.json.encode(self), indent=1))

    def remember_file(self, path: Path) -> None:
        """Put a file at the head of the recent ones."""
        self.folder = str(path.parent)
        self.recent = [str(path), *(known for known in self.recent if known != str(path))][:8]

    @property
    def window_bytes(self) -> bytes:
        """Size and place of the window, as Qt wrote them."""
        try:
            return base64.b64decode(self.geometry, validate=True)
        except ValueError:
            return b""

    @window_bytes.setter
    def window_bytes(self, data: bytes) -> None:
        self.geometry = base64.b64encode(data).decode()


@dataclass(frozen=True)
class Rescued:
    """Unsaved work of a window that did not close by itself, and the file that it belongs to, if any."""

    patch: Patch
    path: Path | None


class Autosave:
    """The copy of one window's unsaved work, in a file that no other window touches.

    Each window holds the lock of one slot. The lock of a window that died is free again, and the work in its slot is
    what `rescue` finds.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._lock: QLockFile | None = None
        slots = [folder / f"work-{slot}.json" for slot in range(_SLOTS)]
        for self._path in sorted(slots, key=lambda path: not path.exists()):
            lock = QLockFile(str(self._path.with_suffix(".lock")))
            lock.setStaleLockTime(0)
            if lock.tryLock(0):
                self._lock = lock
                return

    def keep(self, patch: Patch, path: Path | None) -> None:
        """Write the work down. Without a free slot (16 windows) nothing is kept."""
        if self._lock is not None:
            work = {"format": "underfoot-work", "path": str(path or ""), "patch": patch}
            write_file(self._path, msgspec.json.encode(work))

    def forget(self) -> None:
        """The work is saved elsewhere, or not wanted."""
        if self._lock is not None:
            self._path.unlink(missing_ok=True)

    def rescue(self, registry: Registry) -> Rescued | None:
        """What a window left in this slot when it died; None where that is nothing, or cannot be used."""
        if self._lock is None:
            return None
        try:
            work = msgspec.json.decode(read_file(self._path))
            patch = Patch.loads(msgspec.json.encode(work["patch"]), registry, str(self._path))
            return Rescued(patch, Path(work["path"]) if work["path"] else None)
        except (UnderfootError, msgspec.DecodeError, UnicodeDecodeError, KeyError, TypeError):
            return None

    def put_aside(self) -> None:
        """Let the work that was left here wait in another slot, for a later start."""
        free = (self._path.with_name(f"work-{slot}.json") for slot in range(_SLOTS))
        to = next((path for path in free if not path.exists() and not path.with_suffix(".lock").exists()), None)
        if to is not None and self._path.exists():
            self._path.replace(to)

    def close(self) -> None:
        """Give the slot free; what it holds stays."""
        if self._lock is not None:
            self._lock.unlock()
            self._lock = None
