"""The line at the bottom of the window: messages for the user, and the state of the session."""

from collections import deque
from datetime import datetime

from PySide6.QtCore import QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.announcing import announce
from underfoot.widgets.controls.elided_label import ElidedLabel

LETTER_MS, LEAST_MS, MOST_MS = 120, 5_000, 20_000
"""Reading time of a message per letter, with its minimum and maximum."""
KEPT = 30
"""Messages that can be read again: a fault of one of many tiles is told once."""
NO_FORCE = "no force has come from the floor since {:%Y-%m-%d %H:%M}"


class StatusLine(QWidget):
    """Shows a message until it can be read, the last ones under the mouse, and the state of the session."""

    def __init__(self) -> None:
        super().__init__()
        theme.fill(self, "panel")
        self.setFixedHeight(3 * theme.GRID)
        self._message = ElidedLabel()
        self._session = ElidedLabel("small")
        self._text, self._reason, self._no_force = "", "", ""
        self._told = deque[str](maxlen=KEPT)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * theme.GRID, 0, 2 * theme.GRID, 0)
        layout.setSpacing(theme.GRID)
        layout.addWidget(self._message, 1)
        layout.addWidget(self._session)
        self._timer = QTimer(self, singleShot=True)
        self._timer.timeout.connect(lambda: self.show_message(""))

    def show_message(self, text: str) -> None:
        """Show a message until the next one, or for the time it takes to read."""
        if text:
            self._told.append(f"{datetime.now():%H:%M:%S}  {text}")
        self._message.set_full_text(text, "\n".join(self._told))
        announce(self._message, text)
        self._share_room()
        if text:
            self._timer.start(min(max(LETTER_MS * len(text), LEAST_MS), MOST_MS))
        else:
            self._timer.stop()

    def withdraw(self, text: str) -> None:
        """Remove this message if it is still shown."""
        if text == self.message:
            self.show_message("")

    def show_session(self, text: str, reason: str = "") -> None:
        """Show the session's state or output, and the reason if that is not what was requested."""
        self._text, self._reason = text, reason
        self._show()

    def show_floor(self, silent: bool) -> None:
        """Show whether, and since when, the floor has sent no force: nobody may look at it for days."""
        self._no_force = NO_FORCE.format(datetime.now()) if silent else ""
        self._show()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._share_room()

    def _share_room(self) -> None:
        """Give a message the width that it needs, up to two thirds."""
        room = max(self.width() - 5 * theme.GRID, 0)  # without margins and spacing
        self._session.setMaximumWidth(max(room - self._message.sizeHint().width(), room // 3))

    def _show(self) -> None:
        reason = "; ".join(filter(None, (self._no_force, self._reason)))
        self._session.set_full_text(f"{self._text} ({reason})" if reason else self._text)

    @property
    def message(self) -> str:
        """The present message, not elided."""
        return self._message.full_text

    @property
    def session(self) -> str:
        """The state of the session, not elided."""
        return self._session.full_text
