"""A line of text that ends in an ellipsis if space is short."""

from PySide6.QtCore import QSize, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QLabel


class ElidedLabel(QLabel):
    """A label that uses the available width; the tooltip has the full text if it is elided, and details.

    A screen reader has the full text.
    """

    def __init__(self, role: str = "") -> None:
        super().__init__()
        self.full_text = self._details = ""
        self.setTextFormat(Qt.TextFormat.PlainText)
        if role:
            self.setProperty("role", role)

    def set_full_text(self, text: str, details: str = "") -> None:
        """Set the text, elided to the available width; `details` are in the tooltip only."""
        self.full_text, self._details = text, details
        self.setAccessibleName(text)
        self.updateGeometry()
        self._fit()

    def sizeHint(self) -> QSize:
        self.ensurePolished()
        return QSize(self.fontMetrics().horizontalAdvance(self.full_text) + 2, super().sizeHint().height())

    def minimumSizeHint(self) -> QSize:
        return QSize(0, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        shown = self.fontMetrics().elidedText(self.full_text, Qt.TextElideMode.ElideRight, self.contentsRect().width())
        self.setText(shown)
        self.setToolTip("\n".join(filter(None, (self.full_text if shown != self.full_text else "", self._details))))
