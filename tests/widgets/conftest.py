"""What tests of widgets share: no screen, the theme, and nothing that outlives its test."""

import os

import pytest

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import QApplication


@pytest.fixture(scope="session")
def qapp(qapp):
    """The application, as `underfoot.__main__` opens it."""
    from underfoot.widgets import theme

    theme.apply(qapp)
    return qapp


@pytest.fixture(autouse=True)
def _no_leaked_widgets(qapp):
    """A window that a test leaves behind fails it."""
    before = set(QApplication.topLevelWidgets())
    yield
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    left = [w for w in QApplication.topLevelWidgets() if w not in before and not w.isHidden()]
    assert not left, f"left open: {left}"


@pytest.fixture
def workspace(qtbot):
    """A Design workspace on the screen, with a small patch of nodes that do nothing."""
    from design_samples import REGISTRY, sample
    from on_screen import show

    from underfoot.widgets.design.workspace import DesignWorkspace

    made = DesignWorkspace(REGISTRY)
    qtbot.addWidget(made)
    made.resize(1280, 748)
    show(qtbot, made)
    made.setPatch(sample())
    made.canvas.setFocus()
    return made


@pytest.fixture
def desk(qtbot, tmp_path):
    """The Calibrate workspace on the screen."""
    from calibrate_desk import Desk

    return Desk(qtbot, tmp_path)
