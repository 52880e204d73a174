"""The line at the bottom of the window: messages for the person, and what the session plays on."""

from PySide6.QtCore import Qt, QTimer
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel

LETTER_MS, LEAST_MS, MOST_MS = 120, 5_000, 20_000
"""A message stays as long as it takes to read it: so long a letter, within these."""
NO_FORCE = "no force comes from the floor"


class StatusLine(QWidget):
    """A message, which goes away after a while, and the place of what the session does."""

    def __init__(self) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setFixedHeight(3 * theme.GRID)
        self._message = ElidedLabel()
        self._message.setAccessibleName("Message")
        self._session = ElidedLabel("small")
        self._text, self._reason, self._is_floor_silent = "", "", False
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * theme.GRID, 0, 2 * theme.GRID, 0)
        layout.setSpacing(theme.GRID)
        layout.addWidget(self._message, 1)
        layout.addWidget(self._session)
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(lambda: self.show_message(""))

    def show_message(self, text: str) -> None:
        """A line for the person, until there is another or it has been there for a while."""
        self._message.set_full_text(text)
        self._share_room()
        self._timer.start(min(max(LETTER_MS * len(text), LEAST_MS), MOST_MS))

    def withdraw(self, text: str) -> None:
        """This message is not so any more; another one that is shown instead stays."""
        if text == self.message:
            self.show_message("")

    def show_session(self, text: str, reason: str = "") -> None:
        """What the session does or plays on, and why it is not what was asked for."""
        self._text, self._reason = text, reason
        self._show()

    def show_floor(self, silent: bool) -> None:
        """Whether no force comes from the floor."""
        self._is_floor_silent = silent
        self._show()

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._share_room()

    def _share_room(self) -> None:
        """Let a message have the room that it wants, up to two thirds of it."""
        room = max(self.width() - 5 * theme.GRID, 0)  # without margins and spacing
        self._session.setMaximumWidth(max(room - self._message.sizeHint().width(), room // 3))

    def _show(self) -> None:
        reason = "; ".join(filter(None, (NO_FORCE if self._is_floor_silent else "", self._reason)))
        self._session.set_full_text(f"{self._text} ({reason})" if reason else self._text)

    @property
    def message(self) -> str:
        """The message that is shown, in full."""
        return self._message.full_text

    @property
    def session(self) -> str:
        """What the session does, in full."""
        return self._session.full_text
