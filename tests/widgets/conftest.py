"""What tests of widgets share: no screen, the theme, and nothing that outlives its test."""

import os
from functools import partial

import pytest

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import QApplication, QDialog

TIMEOUT_MS = 120_000
"""How long something is waited for where nothing else is said: a busy machine may take its time."""


@pytest.fixture(scope="session")
def qapp(qapp):
    """The application, as `underfoot.__main__` opens it, but for cursors: they do not blink in pictures."""
    from underfoot.widgets import theme

    theme.apply(qapp)
    qapp.setCursorFlashTime(0)
    return qapp


@pytest.fixture
def qtbot(qtbot):
    """As ever, with patience."""
    for name in ("waitUntil", "waitSignal", "waitSignals", "waitExposed", "waitActive"):
        setattr(qtbot, name, partial(getattr(qtbot, name), timeout=TIMEOUT_MS))
    return qtbot


@pytest.fixture(scope="session", autouse=True)
def _tracking_is_loaded():
    """The thread that loads the kernels of footsteps is the process's, not a test's: none is to find it at work."""
    from underfoot.floor.layout import default_floor
    from underfoot.widgets.session.footstep_tracker import FootstepTracker

    assert FootstepTracker(default_floor(), 48_000.0, 1000.0).wait_for_kernels(300.0)


@pytest.fixture(scope="session", autouse=True)
def _trash_of_tests(tmp_path_factory):
    """What tests delete goes to a trash of theirs, in a folder that is made when the first one is."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_DATA_HOME", str(tmp_path_factory.mktemp("home") / "share"))
        yield


@pytest.fixture(scope="session", autouse=True)
def _documents_of_tests(tmp_path_factory):
    """The documents of whoever runs the tests are neither shown nor written to."""
    folder = tmp_path_factory.mktemp("documents")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("platformdirs.user_documents_dir", lambda: str(folder))
        yield


@pytest.fixture(autouse=True)
def _no_leaked_widgets(qapp):
    """A window that a test leaves behind fails it."""
    before = set(QApplication.topLevelWidgets())
    yield
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    left = [w for w in QApplication.topLevelWidgets() if w not in before and not w.isHidden()]
    assert not left, f"left open: {left}"


@pytest.fixture(scope="module")
def design_workspace(qapp):
    """A Design workspace, shared by the tests of a file."""
    from design_samples import REGISTRY, shared_workspace

    yield from shared_workspace(REGISTRY)


@pytest.fixture
def workspace(design_workspace, qtbot):
    """The same workspace on the screen, with a small patch of nodes that do nothing, and nothing to undo."""
    from design_samples import sample
    from on_screen import show

    design_workspace.resize(1280, 748)
    show(qtbot, design_workspace)
    design_workspace.set_patch(sample())
    design_workspace.canvas.setFocus()
    yield design_workspace
    design_workspace.canvas.setFocus()  # with the focus goes what is said over a field


@pytest.fixture
def driver(qtbot, tmp_path):
    """The Calibrate workspace on the screen."""
    from calibrate_driver import CalibrateDriver

    return CalibrateDriver(qtbot, tmp_path)


@pytest.fixture(scope="module")
def experiment_window(playing):
    """A window that plays the simulated floor, with the Experiment workspace in front."""
    playing.main_bar.tabs["Experiment"].click()
    playing.workspaces["Experiment"].protocol_editor.copy.update()  # its thread lives for as long as the window
    return playing


@pytest.fixture
def bench(experiment_window, qtbot, tmp_path, monkeypatch):
    """Studies in that window, run by real clicks and keys; the test's study is left at its end."""
    from study_bench import SLOW_MS, Bench

    from underfoot.studies import floor_watch

    monkeypatch.setattr(floor_watch, "SILENT_S", SLOW_MS / 1000.0)  # a busy machine may stall the engine for a second
    made = Bench(experiment_window, qtbot, tmp_path)
    yield made
    made.workspace.running.leave()


@pytest.fixture(scope="module")
def patch_folder(tmp_path_factory):
    """A folder with a patch to open and room for what the window keeps."""
    from windows import noise_patch

    folder = tmp_path_factory.mktemp("window")
    noise_patch().save(folder / "hiss.json")
    return folder


@pytest.fixture(scope="module")
def playing(qapp, patch_folder):
    """A window whose session plays on the simulated floor, shared by the tests of a file."""
    from windows import end_window, play_on_simulator

    window = play_on_simulator(patch_folder)
    yield window
    end_window(window)


@pytest.fixture
def window(playing, patch_folder, qtbot):
    """The same window as it was at first: playing, its own patch open and saved, Design on the screen."""
    from on_screen import show

    show(qtbot, playing)
    yield playing
    for dialog in playing.findChildren(QDialog):
        dialog.close()
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    playing.open_patch.read(patch_folder / "hiss.json")
    playing.workspaces.choose("Design")
    playing.controller.play()
