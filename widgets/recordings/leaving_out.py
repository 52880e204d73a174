"""Steps that a person leaves out of the open recording's means for a reason, or takes in again."""

from collections.abc import Callable, Sequence

from PySide6.QtWidgets import QInputDialog, QWidget

from underfoot.widgets.recordings.reader import RecordingReader
from underfoot.widgets.recordings.steps import RecordedSteps
from underfoot.widgets.recordings.timeline import Axis


class LeavingOut:
    """Leaves the chosen ones of `steps` out in the file of `reader`; dialogs are those of `owner`, and `notify` shows a
    line.
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

    def ask(self) -> None:
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
        dialog = QInputDialog(self._owner)
        dialog.setWindowTitle("Leave out of means")
        which = f"step {chosen[0].step}" if len(chosen) == 1 else f"{len(chosen)} steps"
        dialog.setLabelText(f"Why do means leave {which} out?")
        dialog.setTextValue(next((step.left_out for step in chosen if step.left_out), ""))
        dialog.textValueSelected.connect(lambda why: self._leave_out(places, why))
        dialog.finished.connect(dialog.deleteLater)
        dialog.open()

    def _leave_out(self, places: Sequence[tuple[int, str]], why: str) -> None:
        if why.strip():
            self._write(places, why)
        else:
            self._notify("Nothing is left out: it needs a reason, such as: stumbled.")

    def _write(self, places: Sequence[tuple[int, str]], why: str) -> None:
        self._reader.change(lambda recording: recording.leave_out(places, why))
