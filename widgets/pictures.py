"""Pictures of every workspace: what `--screenshot` leaves behind."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtCore import QObject, QTimer, Signal

if TYPE_CHECKING:
    from underfoot.widgets.window import MainWindow

SIZES = ((1280, 800), (1920, 1080))
PLAY_S = 5.0
"""Seconds of the session that go by before the first picture, so that there is something on it."""

SETTLE_MS = 1000
PATIENCE_MS = 180_000
"""How long to wait for a session that does not start: kernels may have to be compiled."""

_LOOK_MS = 100


class Photographer(QObject):
    """Waits until the session has played for a while, takes every workspace in every size, and says that it is done."""

    done = Signal()

    def __init__(self, window: "MainWindow", folder: Path) -> None:
        super().__init__(window)
        self._window, self._folder = window, folder
        self._waited_ms = 0
        self._poses = self._walk()

    def start(self) -> None:
        """Begin."""
        self._window.show_workspace(len(self._window.workspaces) - 1)
        self._window.resize(*SIZES[0])
        QTimer.singleShot(_LOOK_MS, self._look)

    def _look(self) -> None:
        session = self._window.player.session
        played_s = session.health.frame / session.target.rate if session is not None else 0.0
        self._waited_ms += _LOOK_MS
        if played_s >= PLAY_S or self._waited_ms >= PATIENCE_MS:
            self._next()
        else:
            QTimer.singleShot(_LOOK_MS, self._look)

    def _next(self) -> None:
        """Take the picture that was posed for, and pose for the next."""
        if next(self._poses, None) is None:
            self.done.emit()
        else:
            QTimer.singleShot(SETTLE_MS, self._next)

    def _walk(self) -> Iterator[str]:
        """Stops wherever the window needs time to draw. The last workspace, which is on the screen, comes first."""
        window = self._window
        for index in reversed(range(len(window.workspaces))):
            for width, height in SIZES:
                window.show_workspace(index)
                window.resize(width, height)
                name = f"{window.workspaces[index].lower()}-{width}x{height}.png"
                yield name
                window.grab().save(str(self._folder / name))
