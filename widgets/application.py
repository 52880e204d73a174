"""The application: opens the window and stays until it is closed."""

import signal
import tempfile
from functools import partial
from pathlib import Path

import platformdirs
from PySide6.QtWidgets import QApplication

from underfoot.engine.child_process import ChildProcess
from underfoot.engine.target import Target
from underfoot.widgets import theme
from underfoot.widgets.garbage_collection import freeze_loaded
from underfoot.widgets.window import MainWindow


def run(
    target: Target | None = None,
    patch_path: Path | None = None,
    screenshot_dir: Path | None = None,
    engine: ChildProcess | None = None,
    file: Path | None = None,
) -> int:
    """Open the window and stay until it is closed; the exit status. `engine` is a process for its first session;
    `file` is opened in the workspace that opens such files.

    With `screenshot_dir` the window plays for a while, saves a picture of every workspace there, and closes; it
    neither makes a sound nor remembers anything.
    """
    app = QApplication.instance() or QApplication(["underfoot"])
    assert isinstance(app, QApplication)
    app.setApplicationName("Underfoot")
    app.setDesktopFileName("underfoot")
    theme.apply(app)
    with tempfile.TemporaryDirectory() as passing:
        folder = Path(passing if screenshot_dir else platformdirs.user_data_dir("underfoot"))
        window = MainWindow(folder, target, patch_path, engine)
        window.settings.first_steps_done |= screenshot_dir is not None
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: window.leave())
        window.controller.use_sound(screenshot_dir is None)
        window.show()
        if file is not None:
            window.open_file(file)
        freeze_loaded(window.bridge.started, window.loaded)
        window.painted.connect(window.start)
        window.controller.opened.connect(window.make_next_workspace)
        if screenshot_dir is not None:
            _take_screenshots(window, screenshot_dir)
        return app.exec()


def _take_screenshots(window: MainWindow, folder: Path) -> None:
    """Save a picture of every workspace, and then close the window."""
    from underfoot.widgets.screenshots import ScreenshotTaker

    shows = {name: partial(window.show_workspace, name) for name in window.workspace_names}
    taker = ScreenshotTaker(window, shows, lambda: window.controller.played_s, folder)
    taker.done.connect(window.leave)
    taker.start()
