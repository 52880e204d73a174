"""Windows of tests, and the patch that they open."""

from on_screen import show

from underfoot.engine.session import Target
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.widgets.window import MainWindow

LONG_MS = 120_000
"""A first run compiles kernels."""


def hiss(title="Hiss"):
    """A patch of noise on every tile."""
    patch = Patch(title=title).add("noise", REGISTRY).add("tile-output", REGISTRY, at=(240.0, 0.0))
    return patch.connect("noise.out", "tile-output.acceleration", REGISTRY)


def quiet_window(qtbot, folder, path=None):
    """A window without a session."""
    made = MainWindow(folder, Target(default_floor()), path)
    qtbot.addWidget(made, before_close_func=lambda w: w.leave())
    show(qtbot, made)
    return made


def dialog_of(window, kind):
    """The dialog of a kind that is open."""
    return next(dialog for dialog in window.findChildren(kind) if dialog.isVisible())
