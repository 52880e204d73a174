"""What a person notes of the open recording's steps: those that means leave out, and body weights."""

import math
from collections.abc import Callable, Sequence

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from underfoot.errors import BadValue
from underfoot.floor.footsteps import Step
from underfoot.records.notes import body_weight_n
from underfoot.records.standing import WHY, Standing, standing_phase
from underfoot.widgets.background import BackgroundWorker
from underfoot.widgets.controls.question import ask_text
from underfoot.widgets.recordings.reader import OpenedRecording, RecordingReader
from underfoot.widgets.recordings.steps import RecordedSteps
from underfoot.widgets.recordings.timeline import Axis
from underfoot.widgets.recordings.tracks import RecordingContent


class StepNotes(QObject):
    """Asks for notes on the chosen ones of `steps`, or their people, and writes them into the file of `reader`; dialogs
    are those of `owner`, and `notify` shows a line.
    """

    def __init__(
        self,
        axis: Axis,
        steps: RecordedSteps,
        reader: RecordingReader,
        owner: QWidget,
        notify: Callable[[str], object],
    ) -> None:
        super().__init__(owner)
        self._axis, self._steps, self._reader, self._owner, self._notify = axis, steps, reader, owner, notify
        self._search = BackgroundWorker(self)
        self._search.found.connect(lambda found: self._ask_weight(*found))

    def leave_out(self) -> None:
        """Ask why the chosen steps are left out; if all are, take them in again."""
        chosen = self._steps.chosen_steps()
        if self._axis.content is None or not chosen:
            self._notify("No step is chosen: click one, or press . for the next.")
            return
        places = _places(self._axis.content.opened, chosen)
        if all(step.left_out for step in chosen):
            self._write(places, "")
            return
        which = f"step {chosen[0].step}" if len(chosen) == 1 else f"{len(chosen)} steps"
        before = next((step.left_out for step in chosen if step.left_out), "")
        question = f"Why do means leave {which} out?"
        ask_text(self._owner, "Leave out of means", question, lambda why: self._leave_out(places, why), before)

    def weigh(self) -> None:
        """Ask for the body weight of the person whose steps are shown, or of all, once it is known where one stands."""
        content = self._axis.content
        if content is None or not content.steps:
            self._notify("No step is found yet; a body weight is that of who made them.")
            return
        balance = content.balance
        self._search.compute(lambda _: [content, standing_phase(balance)])

    def close_down(self) -> None:
        """Wait for what is being looked for."""
        self._search.join()

    def _ask_weight(self, content: RecordingContent, found: Standing | None) -> None:
        if content is not self._axis.content:
            return  # another recording was opened meanwhile
        person = self._steps.shown_person
        known = next((one for one in content.opened.notes.body_weights if one.person == person), None)
        of_found = f"{found.weight_n:.1f} N" if found else ""
        stand = [one.step for one in content.steps if found and found.is_in(one.step)]
        hint = f"Somebody stands still: {of_found}, {found}." if found else "Nobody stands still for 2 s here."
        if stand:
            hint += f"\nLeft out of means with it, as {WHY}: step {', '.join(str(step.step) for step in stand)}."
        whose = f"person {person}" if person else "who walks"
        question = f"Body weight of {whose}, in kg or N; empty: unknown.\n{hint}"
        text = f"{known.weight_n:.1f} N" if known else of_found

        def take(typed: str) -> None:
            if found is None or typed != of_found:
                self._weigh(person, typed, "typed")
                return
            self._weigh(person, typed, str(found))
            if stand:
                self._write(_places(content.opened, stand), WHY)

        ask_text(self._owner, "Body weight", question, take, text)

    def _leave_out(self, places: Sequence[tuple[int, str]], why: str) -> None:
        if not why.strip():
            raise BadValue("nothing is left out without a reason; allowed: one, such as stumbled")
        self._write(places, why)

    def _weigh(self, person: int, text: str, source: str) -> None:
        weight_n = body_weight_n(text) if text.strip() else math.nan
        self._reader.change(lambda recording: recording.note_body_weight(person, weight_n, source))

    def _write(self, places: Sequence[tuple[int, str]], why: str) -> None:
        self._reader.change(lambda recording: recording.leave_out(places, why))


def _places(opened: OpenedRecording, steps: Sequence[Step]) -> list[tuple[int, str]]:
    """Return session frames and tiles at which steps began."""
    return [(opened.first + round(step.start_s * opened.rate), step.tile) for step in steps]
