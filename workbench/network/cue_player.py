"""Carries out cues in a running session, and answers each with the frame at which it took effect.

A cue never edits the document: the floor's own patch is played with the changes that cues requested (`cue_patch.py`).
Everything goes to the engine as commands, so that recordings have it. Cues take effect in the order of their arrival: a
strike waits for the preset that was requested before it.
"""

import time
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path

from underfoot.engine.commands import Command, Mark, Panic, Strike, Swap
from underfoot.engine.reports import CommandApplied, PatchRefused, Report, SensorFaults, Started
from underfoot.engine.session import Session
from underfoot.errors import UnderfootError, require
from underfoot.network.cue_patch import CuedChanges, require_settable, with_cues
from underfoot.network.cues import ALL, MarkCue, PanicCue, PlayCue, SetCue, StopCue, StrikeCue
from underfoot.network.server import NetworkServer, Received
from underfoot.patch.patch import Patch

_REMEMBERED = 1 << 14  # patches that may still be swapped in: a first compilation takes half a minute, edits go on


@dataclass
class _Pending:
    """Cues that wait for their answer: until a `command` takes effect, or the swap to edit `edit` or a later one.

    With both, whichever is first. `before` holds the changes that were requested before an edit; they remain if it is
    refused. `held` are strikes that are not sent before the edits that wait before them have taken effect; the last one
    is the `command`.
    """

    cues: list[Received]
    command: Command | None = None
    edit: int = 0
    before: CuedChanges = field(default_factory=CuedChanges)
    held: Sequence[Strike] = ()


class CuePlayer:
    """Plays the cues that a server received. `tick` never waits; call it with all reports of the session.

    `panic` silences the output; the default silences the session, and a window also displays it. Cues play the
    presets of Underfoot, and the patches in the folder `own`.
    """

    def __init__(
        self,
        session: Session,
        server: NetworkServer,
        base: Patch,
        panic: Callable[[], None] | None = None,
        own: Path | None = None,
    ) -> None:
        self.session, self.server, self._base = session, server, base
        self._panic, self._own = panic or session.panic, own
        self.cued = CuedChanges()
        """The changes that cues have requested so far."""
        self._made: tuple[CuedChanges, Patch] | None = None  # composed last: with a preset, it was read from its file
        self._tiles = session.target.floor.ids
        self._edits = 0
        self._texts: deque[tuple[int, int]] = deque(maxlen=_REMEMBERED)  # numbers of edits, and hashes of their patches
        self._pending: list[_Pending] = []  # in the order in which they came

    def set_base_patch(self, base: Patch) -> Patch:
        """Set the floor's own patch; return the patch to play. Changes by cues end if they do not fit the new patch."""
        self._base, self._made = base, None
        self._restore(self.cued)
        played = self._composed(self.cued)
        self._note(played)
        return played

    def release(self, ends: Iterable[tuple[str, str]]) -> bool:
        """End what cues set of these parameters, by node and name; return whether there was anything.

        The floor's own values play from the next `set_base_patch` on.
        """
        before, self.cued = self.cued, self.cued.without_values(ends)
        return len(self.cued.values) < len(before.values)

    def tick(self, reports: Iterable[Report], refusal: str = "") -> None:
        """Take the session's reports, and carry out the received cues; with a `refusal`, only marks and panic."""
        for report in reports:
            self._take_report(report)
        self._strike_all_due()
        received = self.server.cues()
        panics = [one for one in received if isinstance(one.cue, PanicCue)]
        if panics:
            is_silent = self.session.memory.status.panic
            self._panic()
            waiting = [one for one in self._pending if isinstance(one.command, Panic)]
            if waiting:
                waiting[-1].cues += panics
            elif is_silent:  # the engine applies no other one
                self._answer(panics, self.session.health.frame)
            else:
                self._pending.append(_Pending(panics, Panic()))
        others = [one for one in received if one not in panics]
        if not self.session.health.running:
            refusal, refused = "the engine has not started yet; ask again", others
        else:
            refused = [one for one in others if refusal and not isinstance(one.cue, MarkCue)]
        for one in refused:
            self.server.answer_refused(one, refusal)
        self._carry_out([one for one in others if one not in refused])

    # --- carrying out ---

    def _carry_out(self, received: Sequence[Received]) -> None:
        """Carry out the cues of one tick: successive edits as one; a strike after the edits before it."""
        cued, edits = self.cued, list[Received]()
        for one in received:
            try:
                match one.cue:
                    case StrikeCue(tile, strength):
                        self._edit(cued, edits)
                        edits = []
                        strikes = [Strike("", row, strength) for row in self._rows(tile)]
                        self._pending.append(_Pending([one], strikes[-1], held=strikes))
                        self._strike_all_due()
                    case MarkCue(text):
                        ago_s = 0.0 if one.at_s is None else time.perf_counter() - one.at_s
                        mark = Mark(text, ago_s)
                        self.session.send(mark)
                        self._pending.append(_Pending([one], mark))
                    case cue:
                        cued = self._with_cue(cued, cue)
                        edits.append(one)
            except UnderfootError as error:
                self.server.answer_refused(one, str(error))
        self._edit(cued, edits)

    def _with_cue(self, cued: CuedChanges, cue: object) -> CuedChanges:
        """Return the changes with those of a cue added; `UnderfootError` if it cannot be carried out."""
        registry = self.session.registry
        match cue:
            case PlayCue(preset, tile, gain_db):
                cued = cued.playing(self._rows(tile), preset, gain_db)
            case StopCue(tile):
                cued = cued.stopped(self._rows(tile))
            case SetCue(node, parameter, value):  # only that node: faders send hundreds a second
                before = self._composed(cued)
                checked = require_settable(before, node, parameter, value, registry)
                cued = cued.setting(node, parameter, checked)
                self._made = cued, before.set(node, parameter, checked, registry)
        self._composed(cued)  # raises what is wrong with this cue
        return cued

    def _edit(self, cued: CuedChanges, cues: list[Received]) -> None:
        """Play the requested changes; the cues are answered when these take effect."""
        if not cues:
            return
        before, self.cued = self.cued, cued
        played = self._composed(cued)
        moved = self.session.moved_numbers(played)
        is_new = moved is None or not self.session.is_compiled  # a number may be of a node that does not play yet
        waiting = [pending for pending in self._pending if pending.edit]
        self._note(played)
        self.session.edit(played)
        if is_new or moved:
            edit = self._edits if is_new or waiting else 0
            self._pending.append(_Pending(cues, moved[-1] if moved and not is_new else None, edit, before))
        elif waiting:
            waiting[-1].cues += cues
        else:
            self._answer(cues, self.session.health.frame)

    def _strike_all_due(self) -> None:
        """Send the strikes before which no edit waits: behind them one may wait as long as a fader moves."""
        for one in takewhile(lambda one: not one.edit, self._pending):
            for strike in one.held:
                self.session.send(strike)
            one.held = ()

    def _composed(self, cued: CuedChanges) -> Patch:
        if self._made is None or self._made[0] is not cued:
            self._made = cued, with_cues(self._base, cued, self._tiles, self.session.registry, self._own)
        return self._made[1]

    def _restore(self, cued: CuedChanges) -> None:
        """Go on with changes that were requested earlier, or with none if they do not fit the floor's own patch."""
        try:
            self._composed(cued)
        except UnderfootError:
            cued = CuedChanges()
        self.cued = cued

    def _note(self, played: Patch) -> None:
        self._edits += 1
        self._texts.append((self._edits, hash(played.dumps())))

    def _rows(self, tile: str) -> tuple[str, ...]:
        require(tile == ALL or tile in self._tiles, "tile", tile, f"{ALL}, {', '.join(self._tiles)}")
        return self._tiles if tile == ALL else (tile,)

    # --- answering ---

    def _take_report(self, report: Report) -> None:
        match report:
            case CommandApplied(frame, Swap(patch)):
                edit = max((number for number, text in self._texts if text == hash(patch)), default=0)
                self._answer(self._taken(lambda one: 0 < one.edit <= edit), frame)
            case CommandApplied(frame, command):
                if isinstance(command, Mark):
                    marked = command.frame(frame, self.session.target.rate)
                    self.server.send_mark(command.text, marked, self._ago_s(marked))
                done = next((one for one in self._pending if one.command == command and not one.held), None)
                if done is not None:
                    self._answer(self._taken(lambda one: one is done), frame)
            case PatchRefused(text):
                refused = next((one for one in self._pending if one.edit), None)
                if refused is not None:
                    self._restore(refused.before)
                self._refuse(lambda one: one.edit > 0 or bool(one.held), text)
            case SensorFaults():
                self.server.floor_trouble = report.in_words
            case Started():
                # A panic holds in every engine: the new one answers it.
                again = "the engine was started again; ask again"
                self._refuse(lambda one: not isinstance(one.command, Panic), again)

    def _taken(self, holds: Callable[[_Pending], bool]) -> list[Received]:
        """Return the waiting cues of which something holds; they wait no longer."""
        taken = [cue for one in self._pending if holds(one) for cue in one.cues]
        self._pending = [one for one in self._pending if not holds(one)]
        return taken

    def _refuse(self, holds: Callable[[_Pending], bool], reason: str) -> None:
        """Refuse waiting cues of which something holds."""
        for one in self._taken(holds):
            self.server.answer_refused(one, reason)

    def _answer(self, cues: Iterable[Received], frame: int) -> None:
        for cue in cues:
            self.server.answer_played(cue, frame, self._ago_s(frame))

    def _ago_s(self, frame: int) -> float:
        """Return the time since a frame was computed; negative for a future one."""
        return (self.session.health.frame - frame) / self.session.target.rate
