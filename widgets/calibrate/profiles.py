"""Storage of a floor's profiles, read and written in a thread, because disks can be slow."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from msgspec.structs import replace
from PySide6.QtCore import QObject, Signal

from underfoot.calibration.files.plate_profiles import write_plate_file
from underfoot.calibration.result import Result
from underfoot.errors import BadValue, UnderfootError
from underfoot.files import make_folder
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile, load_for_tile
from underfoot.widgets.session.profile_folder import profile_folder, profiles_elsewhere


class Profiles(QObject):
    """The profiles of one floor, without blocking on the disk: `changed` follows when they are loaded."""

    changed = Signal()
    saved = Signal(str, str)
    """A tile's profile was written, with another part of this kind; "" where only its serial number is another."""
    not_saved = Signal(str)
    """A tile's profile could not be written: the reason."""
    notified = Signal(str)
    """A line about a file that cannot be read or written, or was written."""
    _read = Signal(object, object)
    _wrote = Signal(object, object, str, str)

    def __init__(self, root: Path, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._root = root
        self.folder = root
        self.by_tile: dict[str, Profile] = {}
        self._tiles: tuple[str, ...] = ()
        self._worker = ThreadPoolExecutor(1, "profiles")
        self._read.connect(self._set_all)
        self._wrote.connect(self._set_one)

    def of(self, tile: str) -> Profile:
        """Return a tile's profile; an empty one at first."""
        return self.by_tile.get(tile) or Profile(tile=tile)

    def follow(self, floor: Floor, folder: str = "", simulation: str = "") -> None:
        """Load the profiles of this floor, from its own folder or this one."""
        self.folder = Path(folder) if folder else profile_folder(self._root, floor, simulation)
        if not folder:
            self._submit(self._say_elsewhere, self.folder, floor, simulation)
        self.by_tile, self._tiles = {}, floor.ids
        self.changed.emit()
        self._submit(self._load, self.folder, self._tiles)

    def save(self, tile: str, result: Result) -> None:
        """Store a result in a tile's profile; the part it replaces goes into the history."""
        self._submit(self._write, self.folder, tile, result.kind, result.apply, f"The profile of {tile} is saved")

    def set_serial(self, tile: str, serial: str) -> None:
        """Store a tile's serial number in its profile."""
        text = f"{tile} has the serial number {serial or 'none'}"
        self._submit(self._write, self.folder, tile, "", lambda profile: replace(profile, serial=serial), text)

    def restore(self, tile: str, index: int) -> None:
        """Put `earlier[index]` of a tile's profile into use again.

        The file may have changed meanwhile, as by another window: it is that part also where it has another index now.
        """
        wanted = self.of(tile).earlier[index]

        def restored(profile: Profile) -> Profile:
            if wanted not in profile.earlier:
                raise BadValue(f"the profile of {tile} was changed elsewhere and lacks it; look at the list again")
            return profile.restored(profile.earlier.index(wanted))

        text = f"An earlier calibration of {tile} is in use again"
        self._submit(self._write, self.folder, tile, wanted.kind, restored, text)
        self._submit(self._load, self.folder, self._tiles)

    def do(self, work: Callable[[], str]) -> None:
        """Queue other work with the disk; its result or error is emitted by `notified`."""
        self._submit(self._do, work)

    def close(self) -> None:
        """Wait for pending writes."""
        self._worker.shutdown()

    def _submit(self, work: Callable[..., None], *arguments: object) -> None:
        self._worker.submit(work, *arguments).add_done_callback(lambda done: done.result())

    # --- in the thread ---

    def _load(self, folder: Path, tiles: tuple[str, ...]) -> None:
        found = {}
        for tile in tiles:
            path = folder / f"{tile}.json"
            try:
                if path.exists():
                    found[tile] = Profile.load(path)
            except (UnderfootError, OSError) as error:
                self.notified.emit(str(error))
        self._read.emit(folder, found)

    def _say_elsewhere(self, folder: Path, floor: Floor, simulation: str) -> None:
        """Say where profiles of the same tiles are, if this floor has none: it may have had another name."""
        try:
            elsewhere = [] if folder.is_dir() else profiles_elsewhere(folder, floor, simulation)
        except OSError as error:
            self.notified.emit(f"profiles cannot be looked for: {error}")
            return
        if elsewhere:
            name = floor.title or "This floor"
            self.notified.emit(
                f"{name} has no profiles; {elsewhere[0]} has some of the same tiles: if it was renamed, "
                f"rename that folder to {folder.name}"
            )

    def _write(self, folder: Path, tile: str, kind: str, change: Callable[[Profile], Profile], text: str) -> None:
        path = folder / f"{tile}.json"
        try:
            profile = change(load_for_tile(path, tile) if path.exists() else Profile(tile=tile))
            make_folder(folder)
            profile.save(path)
        except (UnderfootError, OSError) as error:
            self.not_saved.emit(f"Nothing is saved: {error}")
            return
        text = f"{text}: {path}"
        try:
            write_plate_file(profile, path)
        except (UnderfootError, OSError) as error:
            text += f"; but not the plate's own file, which studies use: {error}"
        self._wrote.emit(folder, profile, kind, text)

    def _do(self, work: Callable[[], str]) -> None:
        try:
            self.notified.emit(work())
        except (UnderfootError, OSError) as error:
            self.notified.emit(str(error))

    # --- in the window's thread ---

    def _set_all(self, folder: Path, found: dict[str, Profile]) -> None:
        if folder == self.folder:
            self.by_tile = found
            self.changed.emit()

    def _set_one(self, folder: Path, profile: Profile, kind: str, text: str) -> None:
        self.notified.emit(text)
        if folder == self.folder:
            self.by_tile[profile.tile] = profile
            self.changed.emit()
            self.saved.emit(profile.tile, kind)
