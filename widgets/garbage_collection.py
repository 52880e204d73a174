"""Python's garbage collection without long pauses: looking through everything that was ever loaded takes 80 ms."""

import gc

from PySide6.QtCore import SignalInstance


def freeze_loaded(*signals: SignalInstance) -> None:
    """Exempt all objects that there are from garbage collection: now, and again whenever one of `signals` is emitted.

    The signals are those after which much has been loaded that stays: modules, kernels, workspaces.
    """
    gc.freeze()
    for signal in signals:
        signal.connect(lambda *_: gc.freeze())
