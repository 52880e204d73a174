"""Simulating, analysing and measuring in a thread, so that the window goes on; each can be stopped."""

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal

from underfoot.errors import UnderfootError

STOPPED = "Stopped."


class Task:
    """What is computed, as whoever computes it sees it: it asks `is_stopped` now and then, and says how far it is."""

    def __init__(self, report: Callable[[str], object]) -> None:
        self._stopped = threading.Event()
        self._report = report

    def is_stopped(self) -> bool:
        """Whether nobody waits for it any more."""
        return self._stopped.is_set()

    def stop(self) -> None:
        """Let it end; what comes of it is not wanted."""
        self._stopped.set()

    def report(self, text: str) -> None:
        """Say how far it is."""
        if not self.is_stopped():
            self._report(text)


class BackgroundWorker(QObject):
    """Computes one thing at a time. `found` brings what came of it, `failed` why nothing did; `said` how far it is."""

    found = Signal(list)
    failed = Signal(str)
    notified = Signal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._task: Task | None = None
        self._threads: list[threading.Thread] = []

    @property
    def is_busy(self) -> bool:
        """Whether something is being computed that is still wanted."""
        return self._task is not None

    def compute(self, make: Callable[[Task], list[Any]]) -> None:
        """Compute this, unless something is being computed."""
        if self.is_busy:
            return
        task = self._task = Task(self.notified.emit)

        def work() -> None:
            signal: Any = self.found
            try:
                result: Any = make(task)
            except UnderfootError as error:
                signal, result = self.failed, str(error)
            if not task.is_stopped():
                self._task = None
                signal.emit(result)

        self._threads = [thread for thread in self._threads if thread.is_alive()]
        self._threads.append(threading.Thread(target=work, name="findings"))
        self._threads[-1].start()

    def stop(self) -> None:
        """Leave what is being computed: `failed` says that it was stopped."""
        if self._task is not None:
            self._task.stop()
            self._task = None
            self.failed.emit(STOPPED)

    def join(self) -> None:
        """Wait until nothing is computed."""
        for thread in self._threads:
            thread.join()
