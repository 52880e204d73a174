"""Widgets are deleted in the window's thread, whichever thread makes garbage."""

import gc
import threading

from PySide6.QtCore import QObject
from PySide6.QtWidgets import QWidget

from underfoot.widgets.garbage_collection import collect_in_this_thread


class Knot(QWidget):
    """A widget that only garbage collection deletes: it refers to itself."""

    def __init__(self, deleted):
        super().__init__()
        self.itself = self
        self.destroyed.connect(deleted)


def make_garbage():
    for _ in range(20 * gc.get_threshold()[0]):
        knot = []
        knot.append(knot)


def test_another_thread_deletes_no_widget(qtbot):
    deleted_in = []

    def note(*_):
        deleted_in.append(threading.current_thread())

    owner = QObject()
    collect_in_this_thread(owner)
    Knot(note)
    other = threading.Thread(target=make_garbage, name="other")
    other.start()
    other.join()
    assert deleted_in == []
    qtbot.waitUntil(lambda: bool(deleted_in))
    assert deleted_in == [threading.main_thread()]
