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
        self.ending = threading.Lock()
        """Held while it is decided whether the result is still wanted."""

    def is_stopped(self) -> bool:
        """Return whether the result is no longer wanted."""
        return self._stopped.is_set()

    def stop(self) -> None:
        """Request the end of the computation; its result is discarded."""
        with self.ending:
            self._stopped.set()

    def report(self, text: str) -> None:
        """Report the progress."""
        if not self.is_stopped():
            self._report(text)


class BackgroundWorker(QObject):
    """Runs one computation at a time. `found` carries its result, `failed` its error, and `notified` its progress."""

    found = Signal(list)
    failed = Signal(str)
    notified = Signal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._task: Task | None = None
        self._threads: list[threading.Thread] = []

    @property
    def is_busy(self) -> bool:
        """Whether a computation is running whose result is still wanted."""
        return self._task is not None

    def compute(self, make: Callable[[Task], list[Any]], discard: Callable[[Any], object] | None = None) -> None:
        """Start this computation, unless one is running. What it has made is given to `discard` if it was stopped.

        One with `discard` waits for those that were stopped before: they may have the port that it opens.
        """
        if self.is_busy:
            return
        task = self._task = Task(self.notified.emit)
        before = self._threads if discard is not None else []

        def work() -> None:
            made: list[Any] = []
            signal: Any = self.found
            for thread in before:
                thread.join()
            if task.is_stopped():
                return
            try:
                result: Any = make(task)
                made = result
            except UnderfootError as error:
                signal, result = self.failed, str(error)
            with task.ending:
                if not task.is_stopped():
                    self._task, made = None, []
                    signal.emit(result)
            if discard is not None:
                for one in made:
                    discard(one)

        self._threads = [thread for thread in self._threads if thread.is_alive()]
        self._threads.append(threading.Thread(target=work, name="background", daemon=True))
        self._threads[-1].start()

    def stop(self) -> None:
        """Stop the computation; `failed` reports that it was stopped."""
        if self._task is not None:
            self._task.stop()
            self._task = None
            self.failed.emit(STOPPED)

    def join(self) -> None:
        """Wait until no computation is running."""
        for thread in self._threads:
            thread.join()
