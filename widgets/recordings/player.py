"""Playback of a range of a recording on the window's session: its forces, through its own patch or another."""

import math
from pathlib import Path

from msgspec.structs import replace
from PySide6.QtCore import QObject, Signal

from underfoot.engine.target import Target
from underfoot.errors import UnderfootError
from underfoot.floor.forces import longest_s
from underfoot.floor.layout import Floor
from underfoot.patch.custom_nodes import files_needed
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.widgets.recordings.reader import OpenedRecording
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.listening import Listening
from underfoot.widgets.session.open_patch import OpenPatch

LEAD_S = 0.1
"""Playback begins this long before the stretch: who is on a tile in its first sample counts as standing there, and the
landing of a step that is played alone would hardly be felt."""


class RecordingPlayer(QObject):
    """Replaces the controller's target during playback, and restores it afterwards."""

    moved = Signal(float)
    """Seconds of the recording that are played now; NaN when it has ended."""
    notified = Signal(str)

    def __init__(
        self, registry: Registry, controller: SessionController, open_patch: OpenPatch, listening: Listening
    ) -> None:
        super().__init__()
        self._registry, self._controller = registry, controller
        self._open_patch, self._listening = open_patch, listening
        self._target_before: Target | None = None
        self._was_silent = False
        """Whether nothing was played before: then nothing is played afterwards, either."""
        self._stretch_s, self._shown_from_s = (0.0, 0.0), 0.0
        self._target: Target | None = None
        self.loops = False
        controller.opened.connect(self._note_target)
        controller.bridge.ticked.connect(self._tick)

    @property
    def is_playing(self) -> bool:
        """Whether a recording is playing, or about to play."""
        return self._target_before is not None

    def play(self, opened: OpenedRecording, begin_s: float, end_s: float, *, recorded_patch: bool) -> None:
        """Play from `begin_s` to `end_s`, through the recording's patch, if it has one, or what is heard in Design."""
        if self._controller.target_is_locked:
            self.notified.emit("A study, a scene or a calibration has the floor: end that first.")
            return
        most_s = longest_s(float(opened.about["force_rate"]), len(opened.floor.tiles))
        self._shown_from_s, begin_s = begin_s, max(begin_s - LEAD_S, 0.0)
        self._stretch_s = (begin_s, min(end_s, begin_s + most_s))
        if self._stretch_s[1] < end_s:
            self.notified.emit(f"At most {most_s:.0f} s are played at once; select a stretch to play another one.")
        folder = Path(opened.about["folder"]) if opened.about.get("folder") else None
        try:
            used = Patch.unchecked(opened.about["patch"], str(opened.path)).types if recorded_patch else {}
            files = files_needed(used.values(), folder)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        if used:
            self._open_patch.nodes.when_files_allowed(
                opened.path.name, files, lambda: self._play_recorded(opened, folder)
            )
        else:
            self._listening.play_selected()
            self._start_replay(opened)

    def _play_recorded(self, opened: OpenedRecording, folder: Path | None) -> None:
        try:
            patch = Patch.loads(opened.about["patch"], self._registry, str(opened.path))
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        if missing := self._open_patch.nodes.missing_text(patch):
            self.notified.emit(f"{opened.path} is not played: {missing}")
            return
        self._listening.play_recorded(patch, folder)
        self._start_replay(opened)

    def _start_replay(self, opened: OpenedRecording) -> None:
        if self._target_before is None:
            self._target_before, self._was_silent = self._controller.target, not self._controller.is_playing
        self._target = self._replay_target(self._target_before, opened.path, opened.floor)
        self._controller.set_target(self._target)
        self._controller.play()

    def stop(self) -> None:
        """Restore the previous floor and patch, and its silence."""
        if self._target_before is not None:
            before = self._target_before
            self._end()
            self._controller.set_target(before)

    def _end(self) -> None:
        self._target_before = self._target = None
        if self._was_silent:
            self._controller.stop()
        self._listening.play_selected()
        self.moved.emit(math.nan)

    def _replay_target(self, target: Target, path: Path, floor: Floor) -> Target:
        plain = replace(target, kind="replay", source=str(path), floor=floor, simulation="", profiles="")
        return replace(plain, accelerometers=(), round_trip_frames=0, stretch_s=self._stretch_s)

    def _note_target(self, target: Target) -> None:
        """Keep a target that the user chose during playback."""
        if self._target_before is not None and (self._target is None or target.source != self._target.source):
            self._end()

    def _tick(self) -> None:
        session = self._controller.session
        if (
            self._target_before is None
            or session is None
            or session.target.source != (self._target or self._target_before).source
        ):
            return
        length_s = self._stretch_s[1] - self._stretch_s[0]
        if not self.loops and self._controller.played_s >= length_s:
            self.stop()
        else:
            at_s = self._stretch_s[0] + self._controller.played_s % max(length_s, 1e-3)
            self.moved.emit(max(at_s, self._shown_from_s))
