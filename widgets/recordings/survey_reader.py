"""Reads the steps of several recordings: from the cache in a thread, else in a process, one after the other."""

from collections.abc import Sequence
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from underfoot.engine.survey_process import Progress
from underfoot.errors import UnderfootError
from underfoot.records.recording import Recording
from underfoot.records.survey import Stance, Survey, load_cached_steps
from underfoot.widgets.background import BackgroundWorker, Task
from underfoot.widgets.recordings.surveyor import Surveyor


class SurveyReader(QObject):
    """Reads the steps of some recordings; a later request takes the place of the one before."""

    read = Signal(object, object)
    """The `Path` of a recording, and a list of its `Stance`s."""
    failed = Signal(object, str)
    """The `Path` of a recording, and why its steps cannot be found."""
    progressed = Signal(str)
    """What is being done; "" if nothing is."""

    def __init__(self, parent: QObject) -> None:
        super().__init__(parent)
        self._cached = BackgroundWorker(self)
        self._surveyor = Surveyor(self)
        self._left: list[Path] = []
        """Recordings whose steps have to be looked for; the first is being surveyed."""
        self._cached.found.connect(self._take)
        self._surveyor.found.connect(self._end_one)
        self._surveyor.failed.connect(self._fail_one)
        self._surveyor.progressed.connect(self._tell)

    def begin(self, paths: Sequence[Path]) -> None:
        """Read the steps of these recordings."""
        self.stop()
        if paths:
            self.progressed.emit("looking for steps…")
            self._cached.compute(lambda task: _cached_steps(task, paths))

    def stop(self) -> None:
        """Read no more."""
        self._left = []
        self._cached.stop()
        self._surveyor.stop()
        self.progressed.emit("")

    def close(self) -> None:
        """Stop for good."""
        self.stop()
        self._surveyor.close()
        self._cached.join()

    def _take(self, found: list[tuple[Path, list[Stance] | str | None]]) -> None:
        for path, steps in found:
            if isinstance(steps, list):
                self.read.emit(path, steps)
            elif steps is not None:
                self.failed.emit(path, steps)
        self._left = [path for path, steps in found if steps is None]
        self._begin_next()

    def _begin_next(self) -> None:
        if self._left:
            self._surveyor.begin(self._left[0])
        else:
            self.progressed.emit("")

    def _end_one(self, survey: Survey) -> None:
        if survey.whole and self._left:
            steps: list[Stance] = survey.steps
            self.read.emit(self._left.pop(0), steps)
            self._begin_next()

    def _fail_one(self, why: str) -> None:
        if self._left:
            self.failed.emit(self._left.pop(0), why)
            self._begin_next()

    def _tell(self, progress: Progress) -> None:
        if self._left and progress.text:
            self.progressed.emit(f"{100.0 * progress.share:.0f} %  ·  {self._left[0].stem}: {progress.text}")


def _cached_steps(task: Task, paths: Sequence[Path]) -> list[tuple[Path, list[Stance] | str | None]]:
    """Return the steps of each recording, None if they were not looked for yet, or why it cannot be read."""
    found: list[tuple[Path, list[Stance] | str | None]] = []
    for path in paths:
        if task.is_stopped():
            break
        try:
            with Recording(path) as recording:
                found.append((path, load_cached_steps(recording)))
        except UnderfootError as error:
            found.append((path, str(error)))
    return found
