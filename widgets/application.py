"""The application: opens the window and stays until it is closed."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path

import platformdirs
from PySide6.QtCore import QMessageLogContext, QTimer, QtMsgType, qInstallMessageHandler, qWarning
from PySide6.QtWidgets import QApplication

from underfoot.commands.ending import ended_by_signals
from underfoot.commands.files import require_folders_writable
from underfoot.commands.telling import no_window, tell
from underfoot.engine.child_process import ChildProcess
from underfoot.engine.target import Target
from underfoot.errors import BadFile
from underfoot.files import make_folder
from underfoot.widgets.garbage_collection import collect_in_this_thread, freeze_loaded
from underfoot.widgets.recolour import choose_colours
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.window import MainWindow

SCALE_VARIABLE = "QT_SCALE_FACTOR"
"""Environment variable with the factor of all sizes in Qt."""
SETTLED_MS = 1500
"""Time after the engine's start at which the hidden workspaces are made: by then the processor is mostly free."""


def run(
    target: Target | None = None,
    patch_path: Path | None = None,
    screenshot_dir: Path | None = None,
    engine: ChildProcess | None = None,
    file: Path | None = None,
    restart_options: Sequence[str] = (),
    scene: tuple[str, Mapping[str, object]] | None = None,
) -> int:
    """Open the window, and return the exit status when it is closed.

    `engine` is a process for the first session. `file` is opened in the workspace for its suffix. `restart_options` are
    the options of the command line that give `target` again after a restart. `scene`, with its parameters, plays and
    is shown on the floor once the session is open.

    With `screenshot_dir` the window plays for a while, saves a picture of every workspace there, and closes. It makes
    no sound and stores no settings.
    """
    with ExitStack() as stack:
        app = application(Settings() if screenshot_dir else Settings.load(data_folder()))
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory())) if screenshot_dir else data_folder()
        window = MainWindow(folder, target, patch_path, engine)
        window.settings.first_steps_done |= screenshot_dir is not None
        # Later: the signal may interrupt code that reads the session, which closing ends.
        stack.enter_context(ended_by_signals(lambda: QTimer.singleShot(0, window.leave)))
        window.controller.use_sound(screenshot_dir is None)
        window.show()
        if file is not None:
            window.open_file(file)
        if scene is not None:
            window.perform(*scene)
        collect_in_this_thread(window)
        freeze_loaded(window.bridge.started, window.workspaces.loaded)
        window.painted.connect(window.start)
        window.bridge.started.connect(lambda: QTimer.singleShot(SETTLED_MS, window.workspaces.create_next))
        if screenshot_dir is not None:
            _take_screenshots(window, screenshot_dir)
        status = app.exec()
    if window.is_restarting:
        _restart(restart_options if _has_same_forces(window.controller.target, target) else ())
    return status


def data_folder() -> Path:
    """Return the user's folder of settings and unsaved work, made if missing; `BadFile` if it cannot be written."""
    folder = Path(platformdirs.user_data_dir("underfoot"))
    try:
        require_folders_writable(folder)
        return make_folder(folder)
    except BadFile as error:
        needed = "make it writable, or on Linux name another place in XDG_DATA_HOME"
        raise BadFile(f"{error}; the window keeps settings and unsaved work there: {needed}") from None


def application(settings: Settings) -> QApplication:
    """Return the application with the chosen colours and text size; the size applies only if it is created here."""
    made = QApplication.instance()
    if made is None:
        given = os.environ.get(SCALE_VARIABLE)
        if settings.text_size != 100:
            os.environ[SCALE_VARIABLE] = f"{float(given or 1) * settings.text_size / 100:g}"
        made = _new_application()
        os.environ.pop(SCALE_VARIABLE, None)
        if given is not None:
            os.environ[SCALE_VARIABLE] = given
    assert isinstance(made, QApplication)
    made.setApplicationName("Underfoot")
    made.setDesktopFileName("underfoot")
    choose_colours(made, settings)
    return made


def _new_application() -> QApplication:
    """Return an application. Where there is no display, Qt would say so in ten lines and abort: one line is told.

    A framebuffer that is not there Qt takes for no screens, which no window can be on.
    """
    messages: list[str] = []

    def fail(why: str) -> None:
        tell(no_window((messages or [why])[0].strip()))
        os._exit(1)

    def receive(kind: QtMsgType, _: QMessageLogContext, text: str) -> None:
        if kind == QtMsgType.QtFatalMsg:
            fail(text)  # on the return from here Qt aborts
        messages.append(text)

    before = qInstallMessageHandler(receive)
    made = QApplication(["underfoot"])
    qInstallMessageHandler(before)
    if not made.screens():
        fail(f"{made.platformName()} has no screen")
    for text in messages:
        qWarning(text)
    return made


def _has_same_forces(now: Target, given: Target | None) -> bool:
    """Return whether the forces are still those of the command line; another choice is in the settings."""
    if given is None:
        return False
    return (now.floor, now.kind, now.source, now.simulation) == (
        given.floor, given.kind, given.source, given.simulation,
    )  # fmt: skip


def _restart(options: Sequence[str]) -> None:
    """Open the window again, in place of this process if the system allows that."""
    command = [sys.executable, *([] if getattr(sys, "frozen", False) else ["-m", "underfoot"]), *options]
    if os.name == "posix":
        os.execv(command[0], command)
    subprocess.Popen(command)


def _take_screenshots(window: MainWindow, folder: Path) -> None:
    """Save a picture of every workspace, and then close the window."""
    from underfoot.widgets.screenshots import ScreenshotTaker

    shows = {name: partial(window.workspaces.choose, name) for name in window.workspaces.names}
    taker = ScreenshotTaker(window, shows, lambda: window.controller.played_s, folder)
    taker.finished.connect(window.leave)
    taker.start()
