"""Selection of the played signal: slot A or B, with matched levels; a single node; once, or in a loop."""

import math
from pathlib import Path

from msgspec import Struct
from PySide6.QtCore import QObject, QTimer, Signal

from underfoot.engine.commands import Play, Swap
from underfoot.engine.reports import CommandApplied, Started
from underfoot.patch.audition import attenuated, auditioned
from underfoot.patch.file_paths import with_files_kept
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.open_patch import SLOTS, OpenPatch

SILENCE_MS = 700
"""Silence before each presentation of a blind test: longer than the previous patch needs to decay."""


SETTLE_S = 0.25
"""Seconds for which a new patch runs silently, so that feet already standing trigger no steps."""


class AuditionedOutput(Struct, frozen=True):
    """The output that is played alone: of a node, on a tile ("" for all), and its peak in the preview."""

    node: str
    port: str = ""
    tile: str = ""
    peak: float = 1.0


class Listening(QObject):
    """Sets the patch that the session plays, whenever the selection changes."""

    changed = Signal()
    """The node played alone, or a slot's attenuation, has changed."""
    notified = Signal(str)
    """A line for the user."""

    def __init__(self, controller: SessionController, open_patch: OpenPatch, registry: Registry) -> None:
        super().__init__(controller)
        self._controller, self._open_patch, self._registry = controller, open_patch, registry
        self.auditioned_output: AuditionedOutput | None = None
        self.is_matched = True
        self.tile = ""
        self._levels: dict[str, float] = {}
        self._played: tuple[str, AuditionedOutput | None] = ("", None)
        self._stale = set(SLOTS)
        self._blind_slot = ""
        self._preset: Patch | None = None
        self._recorded: tuple[Patch, Path | None] | None = None
        self._blind_timer = QTimer(self, singleShot=True, interval=SILENCE_MS)
        self._blind_timer.timeout.connect(self._play_blind_slot)
        self._steps_when_swapped = False
        self._loop_s = 1.0
        self.is_looping = False
        controller.bridge.reported.connect(self._handle_reports)
        self._is_node_set_new = False
        open_patch.nodes.changed.connect(self._note_new_code)
        open_patch.patch_changed.connect(self._apply)
        open_patch.folder_changed.connect(self._apply)
        open_patch.opened.connect(lambda _: self.end_audition())
        open_patch.switched.connect(lambda *_: self.end_audition())
        controller.target_locked.connect(self._end_loop_of_lent)

    # --- loop ---

    def play_from_start(self) -> None:
        """Play from the start, with a step on the tile; a loop restarts with it."""
        if self._controller.refuses_lent():
            return
        if self.is_looping:
            self._controller.loop(self.tile, self._loop_s)
        else:
            self._controller.play_from_start(self.tile)

    def loop(self, on: bool) -> None:
        """Start or end the loop."""
        self.is_looping = on and not self._controller.refuses_lent()
        if self.is_looping:
            self.play_from_start()
        else:
            self._controller.end_loop()
        if self.is_looping != on:
            self.changed.emit()

    def _end_loop_of_lent(self, locked: bool) -> None:
        """End the loop when a study or a scene takes the session: it would start their patches, too."""
        if locked and self.is_looping:
            self.loop(False)
            self.changed.emit()

    def set_loop_length(self, seconds: float) -> None:
        """Set the period of the loop, from its next start on."""
        if seconds != self._loop_s:
            self._loop_s = seconds
            self._controller.set_loop_length(seconds)

    def play_recorded(self, patch: Patch, folder: Path | None) -> None:
        """Play the patch of a recording, whatever is edited, until `play_selected`, a node alone or a blind test."""
        self._recorded = (patch, folder)
        self._apply()

    def play_selected(self) -> None:
        """Play what is selected here, and no recording's patch."""
        self._recorded = None
        self._apply()

    # --- single nodes ---

    def audition(self, output: AuditionedOutput) -> None:
        """Play one output alone, until `end_audition`."""
        is_new = self.auditioned_output is None or self.auditioned_output.node != output.node
        self.auditioned_output, self._recorded = output, None
        text = self._apply()
        if is_new:
            self._steps_when_swapped = True
            if not self._controller.is_playing:
                self._controller.play()
            name = self._open_patch.patch.names(self._registry)[output.node]
            self.notified.emit(f"Auditioning {name} on {output.tile or 'all tiles'}: {text}. A, again, ends it.")
        self.changed.emit()

    def end_audition(self) -> None:
        """Play the whole patch again."""
        if self.auditioned_output is not None:
            self.auditioned_output = None
            self._apply()
            self.notified.emit("The whole patch plays again.")
            self.changed.emit()

    def play_preset(self, patch: Patch | None) -> None:
        """Play this preset from its start while it is previewed; None: play the open patch again."""
        if patch is None and self._preset is None:
            return
        self._preset = patch
        self._steps_when_swapped = patch is not None
        self._apply(anew=patch is not None)

    # --- A and B ---

    def set_level(self, slot: str, rms_m_s2: float | None) -> None:
        """Set the RMS of a slot in the felt band over the preview; None keeps the old value until it is known again."""
        if rms_m_s2 is None:
            self._stale.add(slot)
        else:
            self._stale.discard(slot)
            self._levels[slot] = rms_m_s2
            self._apply()
        self.changed.emit()

    def level(self, slot: str) -> float | None:
        """Return the RMS of a slot, m/s^2; None if unknown."""
        return None if slot in self._stale else self._levels.get(slot)

    def match_levels(self, on: bool) -> None:
        """Match the levels of both slots to the softer one, or play each unchanged."""
        self.is_matched = on
        self._apply()
        self.changed.emit()

    def gain(self, slot: str) -> float:
        """Return a slot's gain: at most 1, since the louder slot is attenuated and the other never amplified."""
        mine = self._levels.get(slot, 0.0)
        softest = min((self._levels.get(other, 0.0) for other in SLOTS), default=0.0)
        return softest / mine if self.is_matched and self._open_patch.other is not None and softest > 0.0 else 1.0

    def play_blind(self, slot: str) -> None:
        """Play a slot from its start, whichever is edited, until `end_blind`.

        A silence precedes it, always of the same length, so that timing reveals nothing.
        """
        self._blind_slot, self.auditioned_output, self._recorded = slot, None, None
        self.loop(False)
        self._controller.send(Play(False))
        self._apply(anew=True)
        self._blind_timer.start()

    def end_blind(self) -> None:
        """Play the slot that is edited."""
        self._blind_slot = ""
        self._blind_timer.stop()
        self._apply()
        if self._controller.is_playing:
            self._controller.send(Play(True))

    # --- internals ---

    def _note_new_code(self) -> None:
        """Have the next patch built again even if it is unchanged: its nodes may have changed."""
        self._is_node_set_new = True

    def _handle_reports(self, reports: list[object]) -> None:
        """Step on the tile once the patch for a single node plays; continue the loop in a new session."""
        if self.is_looping and any(isinstance(report, Started) for report in reports):
            self._controller.loop(self.tile, self._loop_s)
        swapped = any(isinstance(report, CommandApplied) and isinstance(report.command, Swap) for report in reports)
        if self._steps_when_swapped and swapped:
            self._steps_when_swapped = False
            QTimer.singleShot(round(1e3 * SETTLE_S), self._step)

    def _play_blind_slot(self) -> None:
        if self._controller.is_playing:
            self._controller.send(Play(True))
            self._controller.play_from_start(self.tile)

    def _step(self) -> None:
        output = self.auditioned_output
        if self._controller.is_playing and (output is not None or self._preset is not None):  # it may have ended
            self._controller.play_from_start((output.tile if output is not None else "") or self.tile)

    def _apply(self, _: object = None, *, anew: bool = False) -> str:
        """Set the patch of the session; return a description of how a node is played alone."""
        anew, self._is_node_set_new = anew or self._is_node_set_new, False
        instead = self._recorded if self._preset is None else (self._preset, None)
        if instead is not None:
            self._played = ("", None)
            self._controller.edit(*instead, anew=anew, settle_s=SETTLE_S, is_other=True)
            return ""
        slot = self._blind_slot or self._open_patch.slot
        open_patch, other = self._open_patch, self._open_patch.other
        chosen = other if slot != open_patch.slot and other is not None else open_patch.content
        patch, text = chosen.patch, ""
        if self.auditioned_output is not None:
            patch, text = self._auditioned_patch(patch, self.auditioned_output)
        patch = attenuated(patch, self._registry, self.gain(slot))
        patch = with_files_kept(patch, self._registry, chosen.folder, None)
        # An edit is played at once; a different selection, after a short delay.
        is_other, self._played = (slot, self.auditioned_output) != self._played, (slot, self.auditioned_output)
        self._controller.edit(patch, chosen.folder, anew=anew, settle_s=SETTLE_S if is_other else 0.0)
        return text

    def _auditioned_patch(self, patch: Patch, output: AuditionedOutput) -> tuple[Patch, str]:
        if not any(node.id == output.node for node in patch.nodes):
            self.auditioned_output = None
            self.changed.emit()
            return patch, ""
        found = auditioned(patch, self._registry, output.node, output.port, output.tile, output.peak)
        return found.patch, found.text


def gain_text(listening: Listening, slot: str) -> str:
    """Return the attenuation of a slot in dB; "" if unknown."""
    if listening.level(slot) is None:
        return ""
    db = 20.0 * math.log10(max(listening.gain(slot), 1e-6))
    return f"{db:z.1f} dB".replace("-", "−")
