"""The line at the bottom of the window: messages for the person, and what the session plays on."""

from PySide6.QtCore import Qt, QTimer
from PySide6.QtWidgets import QHBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel

LETTER_MS, LEAST_MS, MOST_MS = 120, 5_000, 20_000
"""A message stays as long as it takes to read it: so long a letter, within these."""
MAX_REASON_LETTERS = 64
"""So many letters of a reason are shown."""
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
        self._session = theme.label("", "small")
        self._text, self._reason, self._is_floor_silent = "", "", False
        layout = QHBoxLayout(self)
        layout.setContentsMargins(2 * theme.GRID, 0, 2 * theme.GRID, 0)
        layout.addWidget(self._message, 1)
        layout.addWidget(self._session)
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.timeout.connect(lambda: self.show_message(""))

    def show_message(self, text: str) -> None:
        """A line for the person, until there is another or it has been there for a while."""
        self._message.set_full_text(text)
        self._timer.start(min(max(LETTER_MS * len(text), LEAST_MS), MOST_MS))

    def withdraw(self, text: str) -> None:
        """This message is not so any more; another one that is shown instead stays."""
        if text == self.message:
            self.show_message("")

    def show_session(self, text: str, reason: str = "") -> None:
        """What the session does or plays on, and why it is not what was asked for; in full in the tooltip."""
        self._text, self._reason = text, reason
        self._show()

    def show_floor(self, silent: bool) -> None:
        """Whether no force comes from the floor."""
        self._is_floor_silent = silent
        self._show()

    def _show(self) -> None:
        reason = "; ".join(filter(None, (NO_FORCE if self._is_floor_silent else "", self._reason)))
        short = f"{reason[:MAX_REASON_LETTERS]}…" if len(reason) > MAX_REASON_LETTERS else reason
        self._session.setText(f"{self._text} ({short})" if reason else self._text)
        self._session.setToolTip(reason)

    @property
    def message(self) -> str:
        """The message that is shown, in full."""
        return self._message.full_text

    @property
    def session(self) -> str:
        """What is shown of the session."""
        return self._session.text()
