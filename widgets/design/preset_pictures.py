"""Pictures of presets: those that are not kept are computed in a background process of lowest priority."""

import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from PySide6.QtCore import QObject, Signal

from underfoot.engine.preset_pictures import PresetPicture, kept_picture, picture_in_background
from underfoot.engine.worker_pool import in_parallel
from underfoot.errors import BadFile

SETTLED_S = 1.5
"""Seconds after the window's start for which the processor is left to what the user waits for, before pictures that are
missing are computed."""


class PresetPictures(QObject):
    """Computes the pictures of files, or loads them from the cache. `close` waits for the process to end."""

    arrived = Signal(object, object)
    """A `Path` and its `PresetPicture`."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._leaving = threading.Event()
        self._begins = time.perf_counter() + SETTLED_S
        self._thread: threading.Thread | None = None
        self._asked: set[Path] = set()
        self._lock = threading.Lock()
        self._waiting: list[Path] = []
        self._is_computing = False

    def ask(self, paths: Sequence[Path]) -> None:
        """Request pictures of these files, unless requested before; none comes for a file that cannot be played."""
        new = [path for path in paths if path not in self._asked]
        self._asked.update(new)
        with self._lock:
            self._waiting += new
            if self._is_computing or not new:
                return
            self._is_computing = True
        self._thread = threading.Thread(target=self._compute_all, name="pictures of presets", daemon=True)
        self._thread.start()

    def forget(self, path: Path) -> None:
        """Allow a new request for a file that has changed."""
        self._asked.discard(path)

    def close(self) -> None:
        """End the running process."""
        self._leaving.set()
        if self._thread is not None:
            self._thread.join()

    def _compute_all(self) -> None:
        """Compute what waits, and what is asked for meanwhile."""
        while True:
            with self._lock:
                paths, self._waiting = self._waiting, []
                self._is_computing = bool(paths)
            if not paths:
                return
            self._compute(paths)

    def _compute(self, paths: Sequence[Path]) -> None:
        missing = [path for path in paths if not self._take_kept(path)]
        if not missing or self._leaving.wait(max(self._begins - time.perf_counter(), 0.0)):
            return
        pictures = in_parallel(picture_in_background, missing, 1, is_stopped=self._leaving.is_set)
        for number, picture in pictures:
            if self._leaving.is_set():
                break
            if isinstance(picture, PresetPicture):
                self.arrived.emit(missing[number], picture)
        pictures.close()  # ends its processes

    def _take_kept(self, path: Path) -> bool:
        """Show the picture of a file if it was computed before; return whether none is to be computed."""
        with suppress(BadFile):
            picture = kept_picture(path)
            if picture is not None and not self._leaving.is_set():
                self.arrived.emit(path, picture)
            return picture is not None or self._leaving.is_set()
        return True  # it is gone
