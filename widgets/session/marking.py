"""Marks set during a session: at once by a key, or with a text that is asked for."""

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from underfoot.engine.commands import Mark
from underfoot.network.cues import LONGEST_TEXT
from underfoot.widgets.controls.question import ask_text
from underfoot.widgets.session.controller import SessionController


class Marking(QObject):
    """Sends marks to the session, and reports all marks, whether set here or over the network."""

    def __init__(self, controller: SessionController, window: QWidget) -> None:
        super().__init__(window)
        self._controller, self._window = controller, window
        controller.bridge.marked.connect(self._notify)

    def mark(self) -> None:
        """Mark this moment."""
        self._controller.send(Mark())

    def ask(self) -> None:
        """Mark this moment with a text; the time is now, however long typing takes."""
        at_s = self._controller.played_s
        question = f"What is at {at_s:.1f} s of the session?"
        ask_text(self._window, "A mark", question, lambda text: self._mark(text, at_s))

    def _mark(self, text: str, at_s: float) -> None:
        self._controller.send(Mark(text[:LONGEST_TEXT], max(self._controller.played_s - at_s, 0.0)))

    def _notify(self, text: str, at_s: float) -> None:
        name = f' "{text}"' if text else ""
        where = ", also in the recording" if self._controller.recording.is_on else "; nothing is being recorded"
        self._controller.notified.emit(f"Marked{name} at {at_s:.2f} s of the session{where}.")
