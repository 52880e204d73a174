"""The session of the window: its target, whether its output is open, and its level."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from msgspec.structs import replace
from PySide6.QtCore import QObject, Signal

from underfoot.engine.child_process import ChildProcess
from underfoot.engine.commands import Command, Level, Tare, TileEqualiser
from underfoot.engine.reports import SOUND_CARD, OutputChanged, Started
from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.patch.effective import without_missing
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.widgets.session.bridge import Bridge
from underfoot.widgets.session.previews import Previews
from underfoot.widgets.session.profile_folder import profile_folder
from underfoot.widgets.session.session_opener import SessionOpener
from underfoot.widgets.session.session_recording import SessionRecording
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.session.target_settings import numbers_beside, target_text

if TYPE_CHECKING:
    from underfoot.engine.session import Session


class SessionController(QObject):
    """Owns the session, and opens another one when the target changes.

    The session's reports are emitted by `bridge`.
    """

    notified = Signal(str)
    """A line for the user."""
    opened = Signal(object)
    """The `Target` of the session that was just opened."""
    released = Signal()
    """The session is closed, and its devices are free."""
    playing_changed = Signal(bool)
    level_changed = Signal(float)
    """Output level in decibels of full scale."""
    target_locked = Signal(bool)
    """`target_is_locked`, which may have changed."""
    equaliser_changed = Signal(str)
    """Carries the tile whose calibration has changed, and with it the tile's response."""

    def __init__(
        self,
        registry: Registry,
        settings: Settings,
        target: Target,
        profiles: Path,
        parent: QObject | None = None,
        engine: ChildProcess | None = None,
    ) -> None:
        """Create the controller. `profiles` has a folder per floor; `engine` is a process started for the first
        session.
        """
        super().__init__(parent)
        self.bridge = Bridge(self)
        self.session: Session | None = None
        self.previews = Previews(self.bridge, lambda: self.session, registry, self)
        self.recording = SessionRecording(lambda: self.session, self)
        self._opener = SessionOpener(registry, engine, self)
        self._profiles = profiles
        self.target = self._with_profiles(target)
        self.is_playing = self.has_sound = True  # whether a card plays is known once the engine has started
        self._is_silent_start = False
        self._registry, self._settings = registry, settings
        self._patch = Patch()
        self._patch_folder: Path | None = None
        self.plays_other = False
        """Whether the patch is another than the window's, as a preset that is heard."""
        self.transform_patch: Callable[[Patch], Patch] = unchanged
        """The patch to play for the window's patch: with the requests of other programs."""
        self._opening_target: Target | None = self.target
        """As requested; the session's own target may have values of its profiles in addition. None if those changed."""
        self._last_target: tuple[Target, tuple[str, str, str]] | None = None
        """Of the last session that was opened, with kind, source and simulation in the settings."""
        self._failure = ""
        """Why the target that was wanted cannot be used, until another one is."""
        self._is_leaving = self._is_changing = self._is_released = False
        self._lent: Literal["", "patch", "all"] = ""
        """What of the session a study or a scene has."""
        self.is_blind = False
        """Whether a double-blind study has it, of which the main bar shows no vibration."""
        self._opener.noted.connect(self.notified)
        self._opener.closed.connect(self._open)
        self._opener.opened.connect(self._use_session)
        self._opener.failed.connect(self._fall_back)
        self._opener.recording_file_changed.connect(self.recording.take_file)
        self.bridge.recording_file_changed.connect(self.recording.take_file)
        self.recording.notified.connect(self.notified)
        self.bridge.started.connect(self._use_output)
        self.bridge.started.connect(self._end_silent_start)
        self.bridge.output_changed.connect(self._use_output)

    # --- lifecycle ---

    def start(self) -> None:
        """Open a session that plays the patch of the last `edit`: on a sound card silently, until `play`."""
        if self.target.sound is not None:
            self._set_playing(False)
            self._is_silent_start = True
        self._open()

    def edit(
        self, patch: Patch, folder: Path | None, *, anew: bool = False, settle_s: float = 0.0, is_other: bool = False
    ) -> None:
        """Play this patch from now on; relative paths of sound files refer to `folder`.

        `anew` plays it from its start; `settle_s` as in `Swap`. One that `is_other` than the window's is as it is
        whatever other programs request, which concerns that.
        """
        self._patch, self._patch_folder = without_missing(patch, self._registry), folder
        self.plays_other = is_other
        self.play_patch(anew=anew, settle_s=settle_s)

    def play_patch(self, *, anew: bool = False, settle_s: float = 0.0) -> None:
        """Play the patch of the last `edit`, as `transform_patch` now returns it."""
        if self.session is not None and not self._lent:
            self.session.folder = self._patch_folder
            patch = self._patch if self.plays_other else self.transform_patch(self._patch)
            self.session.edit(patch, anew=anew, settle_s=settle_s)

    @property
    def patch(self) -> Patch:
        """The patch of the last `edit`."""
        return self._patch

    @property
    def is_released(self) -> bool:
        """Whether the devices are free for something else, or about to be."""
        return self._is_released

    @property
    def is_lent(self) -> bool:
        """Whether a study uses the session."""
        return bool(self._lent)

    @property
    def target_is_locked(self) -> bool:
        """Whether the target must not change, because something else uses the session or its devices."""
        return self.is_lent or self._is_released

    def set_target(self, target: Target) -> None:
        """Close the session and open one on another target, without waiting for the old one to end.

        A session that is lent stays until it is taken back: whoever has it would wait for it forever.
        """
        self.target = self._with_profiles(target)
        self._is_changing |= self.session is not None
        if self._lent:
            self.notified.emit("The target changes when the study or the scene has ended.")
        elif self.session is not None:
            self.notified.emit("Changing the target…")
            self._drop(self.session)

    def use_sound(self, on: bool) -> None:
        """Use the sound device of the settings, or none; call before `start`."""
        kept = self._settings
        self.target = replace(self.target, sound=kept.sound if on else None, rate=kept.rate, block=kept.block)

    def release(self) -> None:
        """Close the session, so that its devices are free for something else; `released` follows."""
        self._is_released = True
        self.target_locked.emit(True)
        if self.session is not None:
            self._drop(self.session)
        elif not self._opener.is_busy:
            self.released.emit()

    def reopen(self) -> None:
        """Open a session again after `release`; an open one is reopened, and reads the profiles again."""
        if self._is_released:
            self._is_released = False
            self.target_locked.emit(False)
            self._open()
        else:
            self.set_target(self.target)

    def lend(self, *, only_patch: bool = False) -> "Session | None":
        """Hand the session to a study; edits, level, play and stop wait until `take_back`. None without a session.

        A scene takes `only_patch`: level, play and stop still act. Also None while somebody else has the session.
        """
        if self.refuses_lent():
            return None
        if self.session is not None:
            self._lent = "patch" if only_patch else "all"
        self.target_locked.emit(self.target_is_locked)
        return self.session

    def refuses_lent(self) -> bool:
        """Return whether a study or a scene has the session; if so, say that."""
        if self._lent:
            self.notified.emit("A study or a scene has the session; end that first.")
        return self.is_lent

    def take_back(self) -> None:
        """Restore the patch and level from before `lend`, with the changes made since."""
        if not self._lent:
            return
        lent, self._lent, self.is_blind = self._lent, "", False
        self.target_locked.emit(False)
        if self.session is not None:
            if lent == "all":
                self.session.send(Level(self._settings.level_db))
            self.play_patch()
            if lent == "all":
                (self.session.play if self.is_playing else self.session.stop)()
            if self._is_changing:
                self.set_target(self.target)

    def use_profile(self, profile: Profile, kind: str, folder: Path) -> None:
        """Have the engine use part `kind` of a profile that was just written."""
        if folder != Path(self.target.profiles or "."):
            self.target = replace(self.target, profiles=str(folder))
        if self.session is None and kind != "plate":
            self._opening_target = None  # a session that is being opened may have read the profile as it was
        if kind == "response":
            self.send(TileEqualiser.of_profile(profile.tile, profile))
            self.equaliser_changed.emit(profile.tile)
        elif kind in ("fsr", "centroid", "latency") and self.session is not None:
            self.reopen()

    def close(self) -> None:
        """End the session, and wait for it; say what that could not keep."""
        self._is_leaving = True
        self.bridge.detach()
        self._opener.close()
        session, self.session = self.session, None
        if session is not None:
            for line in session.close():
                self.notified.emit(line)

    @property
    def played_s(self) -> float:
        """Elapsed time of the session in seconds."""
        return self.session.played_s if self.session is not None else 0.0

    def _with_profiles(self, target: Target) -> Target:
        """Return a target with the profiles of its floor, if there are any."""
        folder = profile_folder(self._profiles, target.floor, target.simulation)
        return replace(target, profiles=str(folder)) if not target.profiles and folder.is_dir() else target

    def _open(self) -> None:
        """Open a session on the present target, unless the devices are to stay free."""
        if self._is_leaving:
            return
        if self._is_released:
            self.released.emit()
            return
        self.target = replace(self.target, beside=numbers_beside(self._settings.references))
        self._opening_target = self.target
        self._opener.open(self.target, self._patch, self._patch_folder, self._prepare)

    def _prepare(self, session: "Session") -> None:
        """Set a new session's level and output, in the opener's thread."""
        session.send(Level(self._settings.level_db))
        if not self.is_playing:
            session.stop()

    def _use_session(self, session: "Session") -> None:
        """Adopt the session that was created; send it the changes made meanwhile."""
        if self._is_leaving:
            return
        if self._opening_target != self.target or self._is_released:
            self._opener.end(session)
            return
        changed, self._is_changing = self._is_changing, False
        if changed and not self._failure:
            self.notified.emit(f"The target is now: {target_text(self.target)}")
        kept = self._settings
        self.session, self._last_target = session, (self.target, (kept.kind, kept.source, kept.simulation))
        if not self.is_playing:
            session.stop()
        session.send(Level(self._settings.level_db))
        if session.patch != self._patch:
            self.edit(self._patch, self._patch_folder)
        self.opened.emit(self.target)
        if self._failure:  # last, so that it stays to be read
            self.notified.emit(self._failure)
            self._failure = ""
        self.bridge.attach(session, self.target.floor, self.target.rate)

    def _fall_back(self, why: str) -> None:
        """Report that the target cannot be used, and return to the last one, or else to one that can."""
        self._failure, kept = why, self._settings
        if self.target.profiles:
            self.target = replace(self.target, profiles="")
        elif self._last_target is not None:
            self.target, (kept.kind, kept.source, kept.simulation) = self._last_target
            self._last_target = None  # that one may fail, too
        else:
            target = replace(self.target, floor=default_floor(), kind="simulator", source="", simulation="")
            if target == self.target:  # there is nothing left to try
                self.notified.emit(why)
                return
            self.target = target
            kept.kind, kept.source, kept.simulation = "simulator", "", ""
        self._open()

    def _drop(self, session: "Session") -> None:
        """Stop following a session, and end it."""
        self.recording.record(False)
        self.bridge.detach()
        self.session, self.transform_patch = None, unchanged
        self._opener.end(session)

    # --- playing ---

    def play(self) -> None:
        """Open the output, also after a panic."""
        self._set_playing(True)
        if self.session is not None and self._lent != "all":
            self.session.play()

    def play_from_start(self, tile: str) -> None:
        """Play the patch from its start, with a step on a tile as in the preview."""
        if not self.is_playing:
            self.play()
        if self.session is not None and not self._lent:
            self.session.restart(tile)

    def loop(self, tile: str, period_s: float) -> None:
        """Play the patch from its start in every period, on the engine's clock."""
        if not self.is_playing:
            self.play()
        if self.session is not None and not self._lent:
            self.session.repeats.begin(tile, period_s)

    def set_loop_length(self, period_s: float) -> None:
        """Set the period of the loop, from its next start on."""
        if self.session is not None:
            self.session.repeats.set_period(period_s)

    def end_loop(self) -> None:
        """End the loop."""
        if self.session is not None:
            self.session.repeats.end()

    def stop(self) -> None:
        """Ramp the output down; the session continues."""
        self._set_playing(False)
        if self.session is not None and self._lent != "all":
            self.session.stop()

    def play_or_stop(self) -> None:
        """Stop if it plays, otherwise play."""
        if self.is_playing:
            self.stop()
        else:
            self.play()

    def panic(self) -> None:
        """Silence the output at once."""
        if self.session is not None:
            self.session.panic()
        self._set_playing(False)
        self.notified.emit("Panic: the sound is off. Play turns it on again.")

    def set_level(self, db: float) -> None:
        """Set the output level in decibels of full scale, and keep it for the next start."""
        self._settings.level_db = db
        if self._lent != "all":
            self.send(Level(db))
        self.level_changed.emit(db)

    def send(self, command: Command) -> None:
        """Send a command to the engine; `Tare` also applies to the display."""
        if isinstance(command, Tare):
            self.bridge.tare()
        if self.session is not None:
            self.session.send(command)

    def _use_output(self, report: Started | OutputChanged) -> None:
        self.has_sound = report.where == SOUND_CARD

    def _end_silent_start(self, report: Started) -> None:
        """End the silent start: without a sound card, nobody is startled by sound."""
        if self._is_silent_start and not self.has_sound:
            self.play()
        elif self._is_silent_start:
            self._is_silent_start = False
            level = f"{self._settings.level_db:.0f} dB".replace("-", "−")
            self.notified.emit(f"The output is silent. Space plays, at {level}.")

    def _set_playing(self, playing: bool) -> None:
        self.is_playing, self._is_silent_start = playing, False
        self.playing_changed.emit(playing)


def unchanged(patch: Patch) -> Patch:
    """Return the window's patch unchanged: no other program has requests."""
    return patch
