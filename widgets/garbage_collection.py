"""Python's garbage collection in the window's thread only, and without long pauses.

A widget that nothing refers to is deleted where it is collected, and Qt crashes if that is another thread: so no other
thread collects. To look through everything that was ever loaded would take 80 ms: it is exempt.
"""

import gc

from PySide6.QtCore import QObject, QTimer, SignalInstance

_INTERVAL_MS = 50


def collect_in_this_thread(owner: QObject) -> None:
    """Collect garbage only in this thread from now on, while the event loop of `owner` runs."""
    gc.disable()
    timer = QTimer(owner, interval=_INTERVAL_MS)
    timer.timeout.connect(_collect)
    timer.start()


def freeze_loaded(*signals: SignalInstance) -> None:
    """Exempt all objects that there are from garbage collection: now, and again whenever one of `signals` is emitted.

    The signals are those after which much has been loaded that stays: modules, kernels, workspaces.
    """
    gc.freeze()
    for signal in signals:
        signal.connect(lambda *_: gc.freeze())


def _collect() -> None:
    """Collect the oldest generation that is due by Python's own thresholds."""
    counts, thresholds = gc.get_count(), gc.get_threshold()
    due = [generation for generation in range(3) if counts[generation] > thresholds[generation]]
    if due:
        gc.collect(due[-1])
