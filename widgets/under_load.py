"""The window as a separate program that reports each second, for `bench --stress whole_floor`."""

import json
import signal
import time
from pathlib import Path

import numpy as np
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from underfoot.engine.target import Target
from underfoot.floor.layout import Floor
from underfoot.widgets import theme
from underfoot.widgets.garbage_collection import collect_in_this_thread, freeze_loaded
from underfoot.widgets.window import MainWindow

REPORT_MS = 1000


def run(folder: str, kind: str, source: str, sound: str | None, tiles: str) -> None:
    """Open the window on a target of `folder`/floor.json, play patch.json, record, and tell until a signal ends it.

    `kind`, `source` and `sound` are as in `Target`; what tiles do is computed of the parameters in the file `tiles`.
    """
    app = QApplication(["underfoot"])
    theme.apply(app)
    here = Path(folder)
    target = Target(Floor.load(here / "floor.json"), kind, source, sound, block=256, simulation=tiles)
    window = MainWindow(here / "kept", target, here / "patch.json")
    window.settings.first_steps_done = True
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: window.leave())
    window.resize(1280, 800)
    window.show()
    collect_in_this_thread(window)
    freeze_loaded(window.bridge.started, window.workspaces.loaded)
    window.workspaces.choose("Monitor")
    reporter = TickReporter(window)
    window.bridge.started.connect(reporter.begin)
    window.start()
    app.exec()


class TickReporter:
    """Counts how far apart the window's ticks are, and prints a line of JSON a second."""

    def __init__(self, window: MainWindow) -> None:
        self._window = window
        self._ticks_s: list[float] = []
        self._timer = QTimer(window, interval=REPORT_MS)
        self._timer.timeout.connect(self._report)
        window.bridge.ticked.connect(lambda: self._ticks_s.append(time.perf_counter()))

    def begin(self) -> None:
        """Play, record and report from now on."""
        controller = self._window.controller
        if controller.session is not None and not controller.recording.is_on:
            controller.play()
            controller.recording.record(True)
            self._timer.start()

    def _report(self) -> None:
        session = self._window.controller.session
        if session is None:
            return
        health = session.health
        intervals_s = np.diff(self._ticks_s)
        self._ticks_s = self._ticks_s[-1:]
        figures = {name: getattr(health, name) for name in health.__struct_fields__}
        recording = str(session.recording or "")
        ticks_ms = [round(1e3 * one, 2) for one in intervals_s.tolist()]
        print(json.dumps(figures | {"ticks_ms": ticks_ms, "pids": session.pids, "recording": recording}), flush=True)
