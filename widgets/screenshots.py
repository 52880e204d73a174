"""Pictures of every workspace, saved by `--screenshot`."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from PySide6.QtCore import QObject, QTimer, Signal
from PySide6.QtWidgets import QWidget

SIZES = ((1280, 800), (1920, 1080))


@dataclass(frozen=True)
class WaitTimes:
    """Waiting times before pictures."""

    play_s: float = 5.0
    """Seconds of the session that go by before the first picture, so that there is something on it."""

    settle_ms: int = 1000
    """From a change of the window to its picture."""

    timeout_ms: int = 180_000
    """For a session that does not start: kernels may have to be compiled."""

    poll_ms: int = 100
    """Between two looks at the session."""


class ScreenshotTaker(QObject):
    """Waits until the session has played for a while, saves pictures of every workspace in every size, and is done."""

    finished = Signal()

    def __init__(
        self,
        window: QWidget,
        workspaces: Mapping[str, Callable[[], object]],
        played_s: Callable[[], float],
        folder: Path,
        waits: WaitTimes | None = None,
    ) -> None:
        """`workspaces` gives by name what brings each to the screen; `played_s` how much of the session went by."""
        super().__init__(window)
        self._window, self._folder, self._waits = window, folder, waits or WaitTimes()
        self._workspaces, self._played_s = workspaces, played_s
        self._waited_ms = 0
        self._pictures = self._take_all()

    def start(self) -> None:
        """Begin."""
        list(self._workspaces.values())[-1]()
        self._window.resize(*SIZES[0])
        QTimer.singleShot(self._waits.poll_ms, self._poll)

    def _poll(self) -> None:
        self._waited_ms += self._waits.poll_ms
        if self._played_s() >= self._waits.play_s or self._waited_ms >= self._waits.timeout_ms:
            self._next()
        else:
            QTimer.singleShot(self._waits.poll_ms, self._poll)

    def _next(self) -> None:
        """Save the picture that the window is ready for, and make it ready for the next."""
        if next(self._pictures, None) is None:
            self.finished.emit()
        else:
            QTimer.singleShot(self._waits.settle_ms, self._next)

    def _take_all(self) -> Iterator[str]:
        """Take all pictures, and yield whenever the window needs time to draw; the visible workspace comes first."""
        for workspace, show in reversed(list(self._workspaces.items())):
            for width, height in SIZES:
                show()
                self._window.resize(width, height)
                name = f"{workspace.lower()}-{width}x{height}.png"
                yield name
                self._window.grab().save(str(self._folder / name))
