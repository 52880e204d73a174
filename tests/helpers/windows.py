"""Windows of tests, the patch that they open, and what they play."""

import threading
from contextlib import contextmanager

import numpy as np
from live import LONG_BLOCK
from on_screen import show
from polling import Poll
from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import QFileDialog, QLineEdit, QWidget

from underfoot.engine.target import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.session.open_patch import OpenPatch
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.window import MainWindow

LONG_MS = 120_000
"""Timeout in milliseconds that allows for compiling kernels."""


def noise_patch(title="Hiss"):
    """Return a patch of noise on every tile."""
    patch = Patch(title=title).add("noise", REGISTRY).add("tile-output", REGISTRY, at=(240.0, 0.0))
    return patch.connect("noise.out", "tile-output.acceleration", REGISTRY)


def quiet_window(qtbot, folder, path=None):
    """Return a window without a session, with the first workspace; the others are made when they are shown."""
    made = MainWindow(folder, Target(default_floor()), path)
    made.settings.first_steps_done = True
    qtbot.addWidget(made, before_close_func=lambda w: w.leave())
    show(qtbot, made)
    return made


@contextmanager
def started_patch(folder, path=None):
    """The open patch of a start with `path`, without a window, and what it says. What is unsaved at its end is kept."""
    over, said = QWidget(), []
    made = OpenPatch(REGISTRY, Settings(), folder / "unsaved", over)
    made.notified.connect(said.append)
    made.restore_or_open(path, Patch())
    try:
        yield made, said
    finally:
        made.keeps_autosave = True
        made.close()
        over.deleteLater()


def play_on_simulator(folder):
    """Return a window that plays the patch in `folder` on the simulated floor."""
    window = MainWindow(folder / "kept", Target(default_floor(), block=LONG_BLOCK), folder / "hiss.json")
    window.settings.first_steps_done = True
    window.resize(1280, 800)
    window.show()
    window.workspaces.create_all()
    window.start()
    window.open_patch.write_autosave()
    wait_until_playing(window)
    wait_until_kept(window, folder / "kept")
    assert window.bridge.wait_for_kernels(LONG_MS / 1000)
    return window


def end_window(window):
    """End a window for good: one that is only closed keeps its widgets, and later tests would style and time them."""
    window.leave()
    window.deleteLater()
    delete_widgets()


def delete_widgets():
    """Delete the widgets that are to be deleted later."""
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)


def wait_until_playing(window):
    """Wait until the engine runs. By then the compiler has started where the patch has an output, which is drawn."""

    def plays():
        QCoreApplication.processEvents()
        return window.controller.session is not None and "Playing on" in window.status.session

    Poll()(plays, "the engine runs", seconds=LONG_MS / 1000)


def wait_until_kept(window, folder):
    """Wait until the settings are written for the first time: from then on there is a thread, which no test leaves."""

    def kept():
        QCoreApplication.processEvents()
        return Settings.load(folder).first_steps_done == window.settings.first_steps_done

    Poll()(kept, "the settings are kept", seconds=LONG_MS / 1000)


def choose_file(window, path, open_dialog):
    """Type a file's name into the dialog that `open_dialog` opens.

    Without the focus in its line the dialog takes the selection of its list, and a new dialog may get the focus late.
    """
    open_dialog()
    dialog = dialog_of(window, QFileDialog)
    line = dialog.findChild(QLineEdit, "fileNameEdit")

    def has_focus():
        dialog.activateWindow()
        line.setFocus()
        QCoreApplication.processEvents()
        return line.hasFocus()

    Poll()(has_focus, "the line has the focus", seconds=LONG_MS / 1000)
    line.setText(str(path))
    assert dialog.selectedFiles() == [str(path)]
    dialog.accept()


class VibrationRecorder:
    """The newest vibration of a window's session."""

    def __init__(self, window):
        self._window, self._samples = window, np.zeros((0, 0))
        window.bridge.vibration_read.connect(self._keep_samples)
        window.bridge.wants_vibration = True

    def _keep_samples(self, first, samples):
        self._samples = samples

    def any(self):
        """Whether any tile vibrated."""
        return bool(self._samples.any())

    def tiles(self):
        """Return the tiles that vibrated."""
        return [self._window.controller.target.floor.ids[i] for i in self._samples.any(axis=0).nonzero()[0]]


def threads_that_make(kind, monkeypatch):
    """Return the names of the threads in which objects of a class are made from now on, in a list that grows."""
    names, make = [], kind.__init__

    def note(*given):
        names.append(threading.current_thread().name)
        make(*given)

    monkeypatch.setattr(kind, "__init__", note)
    return names


def design(window):
    """Return the Design workspace of a window."""
    return window.workspaces["Design"]


def monitor(window):
    """Return the Monitor workspace of a window."""
    return window.workspaces["Monitor"]


def calibrate(window):
    """Return the Calibrate workspace of a window."""
    return window.workspaces["Calibrate"]


def dialog_of(window, kind):
    """Return the open dialog of a kind."""
    return next(dialog for dialog in window.findChildren(kind) if dialog.isVisible())
