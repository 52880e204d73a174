"""Spares the window Python's long collections: a look through everything that was ever loaded holds it for 80 ms."""

import gc
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from underfoot.widgets.window import MainWindow


def spare(window: "MainWindow") -> None:
    """Let what is loaded now, with the session's kernels, and for a calibration be looked through no more."""
    gc.freeze()
    window.bridge.started.connect(lambda _: gc.freeze())
    window.calibrate.wizard.ready.connect(gc.freeze)
