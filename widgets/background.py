"""What takes time, in a thread, so that the window stays responsive; each can be stopped."""

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal

from underfoot.errors import UnderfootError

STOPPED = "Stopped."


class Task:
    """The interface of a computation to its thread: the computation checks `is_stopped` and reports its progress."""

    def __init__(self, report: Callable[[str], object]) -> None:
        self._stopped = threading.Event()
        self._report = report

    def is_stopped(self) -> bool:
        """Return whether the result is no longer wanted."""
        return self._stopped.is_set()

    def stop(self) -> None:
        """Request the end of the computation; its result is discarded."""
        self._stopped.set()

    def report(self, text: str) -> None:
        """Report the progress."""
        if not self.is_stopped():
            self._report(text)


class BackgroundWorker(QObject):
    """Runs one computation at a time. `found` carries its result, `failed` its error, and `notified` its progress.

    The result of one that was stopped is not told, and the next one waits for its end: it may have the port that this
    one opens.
    """

    found = Signal(list)
    failed = Signal(str)
    notified = Signal(str)
    _ended = Signal(object, object, object)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._task: Task | None = None
        self._thread: threading.Thread | None = None
        self._ended.connect(self._end)

    @property
    def is_busy(self) -> bool:
        """Whether a computation is running whose result is still wanted."""
        return self._task is not None

    def compute(self, make: Callable[[Task], list[Any]], discard: Callable[[Any], object] = lambda _: None) -> None:
        """Start this computation, unless one is running. What it has made is given to `discard` if it was stopped."""
        if self.is_busy:
            return
        task, before = Task(self.notified.emit), self._thread

        def work() -> None:
            if before is not None:
                before.join()
            if task.is_stopped():
                return
            made: list[Any] | UnderfootError
            try:
                made = make(task)
            except UnderfootError as error:
                made = error
            if task.is_stopped():
                self._end(task, made, discard)
            else:
                self._ended.emit(task, made, discard)

        self._task, self._thread = task, threading.Thread(target=work, name="background", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Stop the computation; `failed` reports that it was stopped."""
        if self._task is not None:
            self._task.stop()
            self._task = None
            self.failed.emit(STOPPED)

    def join(self) -> None:
        """Wait until no computation is running."""
        if self._thread is not None:
            self._thread.join()

    def _end(self, task: Task, made: list[Any] | UnderfootError, discard: Callable[[Any], object]) -> None:
        """Tell what was made, in the window's thread, where nobody stops it meanwhile; or discard it."""
        if task.is_stopped():
            for one in made if isinstance(made, list) else ():
                discard(one)
            return
        self._task = None
        if isinstance(made, UnderfootError):
            self.failed.emit(str(made))
        else:
            self.found.emit(made)
