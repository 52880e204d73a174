"""What a person notes of the open recording's steps: those that means leave out, and body weights."""

import math
from collections.abc import Callable, Sequence

from PySide6.QtWidgets import QWidget

from underfoot.errors import UnderfootError
from underfoot.records.notes import body_weight_n
from underfoot.records.standing import standing_phase
from underfoot.widgets.controls.question import ask_text
from underfoot.widgets.recordings.reader import RecordingReader
from underfoot.widgets.recordings.steps import RecordedSteps
from underfoot.widgets.recordings.timeline import Axis


class StepNotes:
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
        self._axis, self._steps, self._reader, self._owner, self._notify = axis, steps, reader, owner, notify

    def leave_out(self) -> None:
        """Ask why the chosen steps are left out; if all are, take them in again."""
        chosen = self._steps.chosen_steps()
        if self._axis.content is None or not chosen:
            self._notify("No step is chosen: click one, or press . for the next.")
            return
        opened = self._axis.content.opened
        places = [(opened.first + round(step.start_s * opened.rate), step.tile) for step in chosen]
        if all(step.left_out for step in chosen):
            self._write(places, "")
            return
        which = f"step {chosen[0].step}" if len(chosen) == 1 else f"{len(chosen)} steps"
        before = next((step.left_out for step in chosen if step.left_out), "")
        question = f"Why do means leave {which} out?"
        ask_text(self._owner, "Leave out of means", question, lambda why: self._leave_out(places, why), before)

    def weigh(self) -> None:
        """Ask for the body weight of the person whose steps are shown, or of all."""
        content = self._axis.content
        if content is None or not content.steps:
            self._notify("No step is found yet; a body weight is that of who made them.")
            return
        person = self._steps.shown_person
        known = next((one for one in content.opened.notes.body_weights if one.person == person), None)
        found = standing_phase(content.contacts)
        of_found = f"{found.weight_n:.1f} N" if found else ""
        hint = f"Somebody stands still: {of_found}, {found}." if found else "Nobody stands still for 2 s here."
        whose = f"person {person}" if person else "who walks"
        question = f"Body weight of {whose}, in kg or N; empty: unknown.\n{hint}"
        text = f"{known.weight_n:.1f} N" if known else of_found

        def take(typed: str) -> None:
            self._weigh(person, typed, str(found) if typed == of_found else "typed")

        ask_text(self._owner, "Body weight", question, take, text)

    def _leave_out(self, places: Sequence[tuple[int, str]], why: str) -> None:
        if why.strip():
            self._write(places, why)
        else:
            self._notify("Nothing is left out: it needs a reason, such as: stumbled.")

    def _weigh(self, person: int, text: str, source: str) -> None:
        try:
            weight_n = body_weight_n(text) if text.strip() else math.nan
        except UnderfootError as error:
            self._notify(f"{error}.")
        else:
            self._reader.change(lambda recording: recording.note_body_weight(person, weight_n, source))

    def _write(self, places: Sequence[tuple[int, str]], why: str) -> None:
        self._reader.change(lambda recording: recording.leave_out(places, why))
