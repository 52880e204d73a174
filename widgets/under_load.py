"""The window as a separate program that reports each second, for `bench --stress whole_floor`."""

import json
import time
from pathlib import Path

import numpy as np
from msgspec.structs import asdict
from PySide6.QtCore import QTimer
from PySide6.QtWidgets import QApplication

from underfoot.commands.ending import ended_by_signals
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
    window.resize(1280, 800)
    window.show()
    collect_in_this_thread(window)
    freeze_loaded(window.bridge.started, window.workspaces.loaded)
    window.workspaces.choose("Monitor")
    reporter = TickReporter(window)
    window.bridge.started.connect(reporter.begin)
    window.start()
    with ended_by_signals(lambda: QTimer.singleShot(0, window.leave)):
        app.exec()


class TickReporter(QTimer):
    """Prints a line of JSON a second: the engine's health, and how far apart the window's ticks were."""

    def __init__(self, window: MainWindow) -> None:
        super().__init__(window, interval=REPORT_MS)
        self._controller = window.controller
        self._ticks_s: list[float] = []
        self.timeout.connect(self._report)
        window.bridge.ticked.connect(self._note_tick)

    def begin(self) -> None:
        """Play, record and report from now on; where that is so already, as after another engine has started, go on."""
        if not self._controller.recording.is_on:
            self._controller.play()
            self._controller.recording.record(True)
            self.start()

    def _note_tick(self) -> None:
        self._ticks_s.append(time.perf_counter())

    def _report(self) -> None:
        session = self._controller.session
        if session is None:
            return
        ticks_ms = [round(1e3 * one, 2) for one in np.diff(self._ticks_s).tolist()]
        self._ticks_s = self._ticks_s[-1:]
        more = {"ticks_ms": ticks_ms, "pids": session.pids, "recording": str(session.recording or "")}
        print(json.dumps(asdict(session.health) | more), flush=True)
