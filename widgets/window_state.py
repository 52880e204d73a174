"""Stored layout of the window: size, position, and splitters of workspaces.

Only splitters with an object name are remembered.
"""

from base64 import b64decode, b64encode

from PySide6.QtCore import QSize
from PySide6.QtWidgets import QMainWindow, QSplitter, QStyle, QWidget

from underfoot.widgets.session.settings import Settings

MINIMUM_SIZE = QSize(1024, 640)
"""The window is no smaller than this where the screen is not."""
DEFAULT_SIZE = QSize(1440, 900)
_BORDER_PX = 4


def restore_window(window: QMainWindow, settings: Settings) -> None:
    """Give the window its size and place of last time; never more than the screen has, nor beside it."""
    screen = window.screen().availableGeometry()
    title_px = window.style().pixelMetric(QStyle.PixelMetric.PM_TitleBarHeight)
    room = screen.size() - QSize(2 * _BORDER_PX, title_px + _BORDER_PX)
    window.setMinimumSize(MINIMUM_SIZE.boundedTo(room))
    if not window.restoreGeometry(settings.window_bytes):
        window.resize(DEFAULT_SIZE.boundedTo(room))
        return
    if not window.isMaximized() and not window.isFullScreen():
        window.resize(window.size().boundedTo(room))
    if not screen.contains(window.geometry().center()):
        window.move(screen.topLeft())


def save_window(window: QMainWindow, settings: Settings) -> None:
    """Store size and position of the window."""
    settings.window_bytes = bytes(window.saveGeometry().data())


def restore_splitters(widget: QWidget, settings: Settings) -> None:
    """Put the splitters of a workspace where they were."""
    for splitter in _named_splitters(widget):
        try:
            splitter.restoreState(b64decode(settings.splitters.get(splitter.objectName(), ""), validate=True))
        except ValueError:
            continue


def save_splitters(widget: QWidget, settings: Settings) -> None:
    """Store the splitter positions of a workspace."""
    for splitter in _named_splitters(widget):
        settings.splitters[splitter.objectName()] = b64encode(bytes(splitter.saveState().data())).decode()


def _named_splitters(widget: QWidget) -> list[QSplitter]:
    return [splitter for splitter in widget.findChildren(QSplitter) if splitter.objectName()]
