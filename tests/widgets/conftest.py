"""What tests of widgets share: no screen, the theme, and nothing that outlives its test."""

import gc
import os

import pytest

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")

from PySide6.QtCore import QCoreApplication, QEvent
from PySide6.QtWidgets import QApplication


@pytest.fixture(scope="session")
def qapp(qapp):
    """The application, as `workbench.__main__` opens it."""
    from widgets import theme

    theme.apply(qapp)
    return qapp


@pytest.fixture(autouse=True)
def _no_leaked_widgets(qapp):
    """A window that a test leaves behind fails it."""
    before = set(QApplication.topLevelWidgets())
    yield
    QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
    gc.collect()
    left = [w for w in QApplication.topLevelWidgets() if w not in before and not w.isHidden()]
    assert not left, f"left open: {left}"
