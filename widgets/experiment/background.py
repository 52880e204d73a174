"""Simulating, analysing and measuring in a thread, so that the window goes on."""

import threading
from collections.abc import Callable
from typing import Any

from PySide6.QtCore import QObject, Signal

from underfoot.errors import UnderfootError


class Background(QObject):
    """Computes one thing at a time. `found` brings what came of it, `failed` why nothing did."""

    found = Signal(list)
    failed = Signal(str)

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._thread: threading.Thread | None = None

    @property
    def is_busy(self) -> bool:
        """Whether something is being computed."""
        return self._thread is not None and self._thread.is_alive()

    def compute(self, make: Callable[[], list[Any]]) -> None:
        """Compute this, unless something is being computed."""
        if self.is_busy:
            return

        def work() -> None:
            try:
                self.found.emit(make())
            except UnderfootError as error:
                self.failed.emit(str(error))

        self._thread = threading.Thread(target=work, name="findings")
        self._thread.start()

    def join(self) -> None:
        """Wait until nothing is computed."""
        if self._thread is not None:
            self._thread.join()
