"""A window of its own that fills a screen: a projector's, or the participant's."""

from PySide6.QtCore import Qt, Signal
from PySide6.QtGui import QCloseEvent, QGuiApplication, QScreen
from PySide6.QtWidgets import QWidget

_DEFAULT_PX_PER_M = 96.0 / 0.0254
"""Of a screen that does not report its size."""


class FullScreenWindow(QWidget):
    """A window without a parent, which is deleted once it is closed.

    While the screen that it fills is away, as a projector that is switched off for the night, it is hidden: Qt would
    move it before all other windows, and leave it there when the screen is back.
    """

    closed = Signal()

    def __init__(self) -> None:
        super().__init__(None, Qt.WindowType.Window)
        self.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        self._missed = ""
        app = QGuiApplication.instance()
        assert isinstance(app, QGuiApplication)
        app.screenRemoved.connect(self._hide_without)
        app.screenAdded.connect(self._return_to)

    def show_on(self, screen: QScreen) -> None:
        """Fill this screen."""
        self._missed = ""
        self.setScreen(screen)
        self.setGeometry(screen.geometry())
        self.showFullScreen()
        self.activateWindow()

    @property
    def screen_px_per_m(self) -> float:
        """Pixels per metre, from the size that the screen reports."""
        width_mm = self.screen().physicalSize().width()
        return 1e3 * self.screen().geometry().width() / width_mm if width_mm > 0 else _DEFAULT_PX_PER_M

    def _hide_without(self, screen: QScreen) -> None:
        if self.isVisible() and self.isFullScreen() and screen == self.screen():
            self._missed = screen.name()
            self.hide()

    def _return_to(self, screen: QScreen) -> None:
        if self._missed and screen.name() == self._missed:
            self.show_on(screen)

    def closeEvent(self, event: QCloseEvent) -> None:
        super().closeEvent(event)
        self.closed.emit()
