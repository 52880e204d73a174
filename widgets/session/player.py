"""The session that the window plays: on which target, whether sound is let out, at what level, and into which file."""

import threading
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Any

import platformdirs
from PySide6.QtCore import QObject, Signal

from underfoot.devices.transports import TRANSPORTS
from underfoot.engine.correction import correction_of
from underfoot.engine.messages import Command, Level, Tare
from underfoot.engine.session import Session, Target
from underfoot.engine.target import require_source
from underfoot.errors import UnderfootError
from underfoot.floor.forces import floor_beside
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import TileParameters
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.widgets.calibrate.profiles import folder_of
from underfoot.widgets.session.bridge import Bridge
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.session.targets import words_of


class Player(QObject):
    """Holds the session, and opens another one when the target changes. What the session says, `bridge` tells."""

    said = Signal(str)
    """A line for the person."""
    retargeted = Signal(object)
    """The `Target` of the session that was opened just now."""
    playing_changed = Signal(bool)
    recording_changed = Signal(object)
    """The `Path` that is recorded to, or None."""
    released = Signal()
    """The session is closed, and what it played on is free."""
    _closed = Signal()
    _made = Signal(object)
    _failed = Signal(str)

    def __init__(
        self, registry: Registry, settings: Settings, target: Target | None, profiles: Path, parent: QObject
    ) -> None:
        """`profiles` has a folder for each floor."""
        super().__init__(parent)
        self.bridge = Bridge(self)
        self.session: Session | None = None
        self._unclaimed: Session | None = None
        self._profiles = profiles
        self.target = self._calibrated(target or remembered_target(settings))
        self.playing = True
        self._registry, self._settings = registry, settings
        self._patch, self._patch_folder = Patch(), None  # type: tuple[Patch, Path | None]
        self._worker: threading.Thread | None = None
        self._is_leaving = self._is_changing = self._is_released = False
        self._closed.connect(self._open)
        self._made.connect(self._take)
        self._failed.connect(self._fall_back)

    # --- life ---

    def start(self, patch: Patch, folder: Path | None) -> None:
        """Open a session that plays `patch`, whose sounds are looked for in `folder`."""
        self._patch, self._patch_folder = patch, folder
        self._open()

    def edit(self, patch: Patch, folder: Path | None) -> None:
        """Play this patch from now on."""
        self._patch, self._patch_folder = patch, folder
        if self.session is not None:
            self.session.folder = folder
            self.session.edit(patch)

    def set_target(self, target: Target) -> None:
        """Close the session and open one on another target. Nobody waits for the old one to end."""
        self.target = self._calibrated(target)
        if self.session is not None:
            self._is_changing = True
            self.said.emit("Changing the target…")
            self._let_go(self.session)

    def release(self) -> None:
        """Close the session, so that something else can have what it plays on; `released` tells when that is free."""
        self._is_released = True
        if self.session is not None:
            self._let_go(self.session)
        elif self._worker is None or not self._worker.is_alive():
            self.released.emit()

    def reopen(self) -> None:
        """Open a session again after `release`; one that is open is opened anew, and reads the profiles anew."""
        if self._is_released:
            self._is_released = False
            self._open()
        else:
            self.set_target(self.target)

    def use_profile(self, profile: Profile, kind: str, folder: Path) -> None:
        """Part `kind` of a profile was written: the engine is to use it at once."""
        if folder != Path(self.target.profiles or "."):
            self.target = replace(self.target, profiles=str(folder))
        if kind == "response":
            self.send(correction_of(profile.tile, profile))
        elif kind == "fsr" and self.session is not None:
            self.reopen()

    def close(self) -> None:
        """End the session, and wait for it."""
        self._is_leaving = True
        self.bridge.leave()
        if self._worker is not None:
            self._worker.join()
        session, self.session = self.session or self._unclaimed, None
        if session is not None:
            session.close()

    def _calibrated(self, target: Target) -> Target:
        """A target with the profiles of its floor, where there are any."""
        folder = folder_of(self._profiles, target.floor, target.simulation)
        return replace(target, profiles=str(folder)) if not target.profiles and folder.is_dir() else target

    def _open(self) -> None:
        """Make a session in a thread: loading its kernels and starting its processes takes longer than a frame."""
        if self._is_leaving:
            return
        if self._is_released:
            self.released.emit()
            return
        target, patch, folder = self.target, self._patch, self._patch_folder

        def make() -> None:
            try:
                self._unclaimed = session = Session(target, patch, self._registry, folder)
            except UnderfootError as error:
                self._failed.emit(str(error))
                return
            session.send(Level(self._settings.level_db))
            session.start()
            self._made.emit(session)

        self._worker = threading.Thread(target=make, name="open session")
        self._worker.start()

    def _take(self, session: Session) -> None:
        """The session has been made; what was changed meanwhile is made good."""
        if self._is_leaving:
            return
        self._unclaimed = None
        if session.target != self.target or self._is_released:
            self._end(session)
            return
        if self._is_changing:
            self._is_changing = False
            self.said.emit(f"Now on: {in_words(self.target)}")
        self.session = session
        if not self.playing:
            session.stop()
        session.send(Level(self._settings.level_db))
        if session.patch != self._patch:
            self.edit(self._patch, self._patch_folder)
        self.retargeted.emit(self.target)
        self.bridge.follow(session, self.target.floor, self.target.rate)

    def _fall_back(self, why: str) -> None:
        """The target cannot be played on: say so, and go back to one that can."""
        self.said.emit(why)
        if self.target.profiles:
            self.target = replace(self.target, profiles="")
            self._open()
            return
        self.target = replace(self.target, floor=default_floor(), kind="simulator", source="", simulation="")
        self._settings.kind = "simulator"
        self._settings.source = self._settings.simulation = ""
        self._open()

    def _let_go(self, session: Session) -> None:
        """Follow a session no more, and end it."""
        self.record(False)
        self.bridge.leave()
        self.session = None
        self._end(session)

    def _end(self, session: Session) -> None:
        """Close a session in a thread, and open the next one after it: they may want the same card."""

        def close() -> None:
            session.close()
            self._closed.emit()

        self._worker = threading.Thread(target=close, name="close session")
        self._worker.start()

    # --- hands ---

    def play(self) -> None:
        """Let sound out, also after a panic."""
        self._set_playing(True)
        if self.session is not None:
            self.session.play()

    def stop(self) -> None:
        """Ramp the sound down; the session goes on."""
        self._set_playing(False)
        if self.session is not None:
            self.session.stop()

    def play_or_stop(self) -> None:
        if self.playing:
            self.stop()
        else:
            self.play()

    def panic(self) -> None:
        """Silence at once."""
        if self.session is not None:
            self.session.panic()
        self._set_playing(False)
        self.said.emit("Panic: the sound is off. Play lets it out again.")

    def set_level(self, db: float) -> None:
        """Output level in decibels of full scale; kept for the next start."""
        self._settings.level_db = db
        self.send(Level(db))

    def send(self, command: Command) -> None:
        """One command to the engine; `Tare` holds for what the window shows, too."""
        if isinstance(command, Tare):
            self.bridge.tare()
        if self.session is not None:
            self.session.send(command)

    def record(self, on: bool) -> None:
        """Begin a recording in the documents' folder, or end the one that runs."""
        session = self.session
        if session is None:
            self.recording_changed.emit(None)
            return
        path = session.recording
        if on and path is None:
            try:
                session.record(_recording_path())
            except (UnderfootError, OSError) as error:
                self.said.emit(f"Nothing is recorded: {error}")
            else:
                self.said.emit(f"Recording to {session.recording}")
        elif not on and path is not None:
            session.end_recording()
            self.said.emit(f"The recording is {path}")
        self.recording_changed.emit(session.recording)

    def set_sound(self, sound: str | None, rate: int, block: int) -> None:
        """Play on this device (None: none, "": the default one), at this rate, in blocks of so many frames."""
        self._settings.sound, self._settings.rate, self._settings.block = sound, rate, block
        self.set_target(replace(self.target, sound=sound, rate=rate, block=block))

    def use_sound(self, on: bool) -> None:
        """Before `start`: play on the sound device that is remembered, or on none."""
        kept = self._settings
        self.target = replace(self.target, sound=kept.sound if on else None, rate=kept.rate, block=kept.block)

    def set_floor(self, rows: int, columns: int) -> None:
        """Play on a simulated floor of so many tiles."""
        self._settings.rows, self._settings.columns = rows, columns
        self._retarget("simulator", "", default_floor(rows, columns))

    def use_floor(self, path: Path) -> None:
        """Play on a simulated floor as the file has it; `BadFile` where it cannot be read."""
        self._retarget("simulator", str(path), Floor.load(path))

    def use_simulation(self, path: Path | None) -> None:
        """Let simulated tiles be made of what the file says, and be read by sensors that err; None for ideal ones.

        The floor stays as it is where it is simulated, else it is the last one that was. `BadFile` where the file
        cannot be read.
        """
        if path is not None:
            TileParameters.load(path)
        self._settings.simulation = "" if path is None else str(path)
        if self.target.kind == "simulator":
            self._settings.kind = "simulator"
            self.set_target(_target(self._settings, "simulator", "", self.target.floor))
        else:
            self._retarget("simulator", "", default_floor(self._settings.rows, self._settings.columns))

    def use_forces(self, path: Path) -> None:
        """Play back the forces in a CSV file, whose floor lies beside it; `BadFile` where one cannot be read."""
        self._retarget("replay", str(path), Floor.load(floor_beside(path)))

    def use_transport(self, scheme: str, address: str) -> None:
        """Play on hardware on a transport, laid out as the present floor; `UnderfootError` where it cannot be opened.

        It is not remembered: the next start may find nothing there.
        """
        target = _target(self._settings, scheme, address, self.target.floor)
        require_source(target)
        self.set_target(target)

    def _retarget(self, kind: str, source: str, floor: Floor) -> None:
        self._settings.kind, self._settings.source = kind, source
        self.set_target(_target(self._settings, kind, source, floor))

    def _set_playing(self, playing: bool) -> None:
        self.playing = playing
        self.playing_changed.emit(playing)


def remembered_target(settings: Settings) -> Target:
    """The last target; the simulated floor of four ideal tiles where its file is gone."""
    try:
        if settings.kind == "replay":
            return _target(settings, "replay", settings.source, Floor.load(floor_beside(settings.source)))
        floor = Floor.load(settings.source) if settings.source else default_floor(settings.rows, settings.columns)
        if settings.simulation:
            TileParameters.load(settings.simulation)
    except UnderfootError:
        floor, settings.simulation = default_floor(), ""
    return _target(settings, "simulator", "", floor)


def in_words(target: Target) -> str:
    """What a target is, for the person.

    >>> in_words(Target(default_floor(2, 3)))
    'Simulated floor  2 × 3'
    >>> in_words(Target(default_floor(2, 3), simulation="presets/plywood-tile.json"))
    'Plywood tile  2 × 3'
    """
    if target.kind == "replay":
        return f"Recorded forces  {Path(target.source).stem}"
    if target.kind in TRANSPORTS:
        return f"{TRANSPORTS[target.kind].label}  {target.source}"
    what = words_of(Path(target.simulation)) if target.simulation else "Simulated floor"
    count = len(target.floor.tiles)
    for rows in range(1, 33):
        if count % rows == 0 and count // rows <= 32 and target.floor == default_floor(rows, count // rows):
            return f"{what}  {rows} × {count // rows}"
    return f"{what}  {target.floor.title or f'{count} tiles'}"


def _target(settings: Settings, kind: str, source: str, floor: Floor) -> Target:
    sound: dict[str, Any] = {"sound": settings.sound, "rate": settings.rate, "block": settings.block}
    if kind == "simulator":
        return Target(floor=floor, kind=kind, simulation=settings.simulation, **sound)
    return Target(floor=floor, kind=kind, source=source, **sound)


def _recording_path() -> Path:
    folder = Path(platformdirs.user_documents_dir()) / "Underfoot"
    folder.mkdir(parents=True, exist_ok=True)
    return folder / f"{datetime.now():%Y-%m-%d %H.%M.%S}.underfoot"
