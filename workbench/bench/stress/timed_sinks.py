"""Simulated sound cards with their own clocks: PulseAudio pipe sinks, read at a set rate.

A pipe sink plays as fast as its pipe is read, so its reader acts as the card's clock. Real cards need no processor
time, so server and reader run at real-time priority if the system permits.
"""

import os
import threading
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.bench.stress.null_sinks import NullSink
from underfoot.clock import RATE_HZ
from underfoot.devices.thread_priority import raise_thread_priority

_EVERY_S = 0.003
_START_S = 10.0


class TimedSink(NullSink):
    """A card whose clock is `ppm` fast; it keeps the output of its first channel.

    `starved_s` are the times, on the system's clock, at which no data were available because the server was late on a
    busy machine. The card then played silence, and is delayed from then on.
    """

    def __init__(self, folder: Path, name: str, channels: int, ppm: float) -> None:
        super().__init__(folder, name, channels)
        self.rate_hz = RATE_HZ * (1.0 + 1e-6 * ppm)
        self.module = f"module-pipe-sink file={self.folder / 'played'}"
        self.starved_s: list[float] = []
        self._began_s = 0.0
        self._samples: list[NDArray[np.float32]] = []
        self._over = threading.Event()
        self._clock = threading.Thread(target=self._read, name=f"clock of {name}")

    def start(self) -> None:
        super().start()
        end = time.perf_counter() + _START_S
        while not (self.folder / "played").exists() and time.perf_counter() < end:
            time.sleep(0.02)
        for thread in self.threads():
            raise_thread_priority(thread)
        self._clock.start()

    def stop(self) -> None:
        self._over.set()
        self._clock.join()
        super().stop()

    def samples(self) -> tuple[float, NDArray[np.float32]]:
        """Return the time of the first frame, in seconds of the system's clock, and the first channel (frames,)."""
        return self._began_s, np.concatenate([*self._samples, np.zeros(0, np.float32)])

    def _read(self) -> None:
        pipe, size = os.open(self.folder / "played", os.O_RDONLY | os.O_NONBLOCK), 4 * self.channels
        raise_thread_priority()
        read, part = 0, b""
        while not self._over.wait(_EVERY_S):
            if not read:  # the clock starts with the first output
                self._began_s = time.perf_counter() - _EVERY_S
            due = int((time.perf_counter() - self._began_s) * self.rate_hz) - read
            while due > 0:
                try:
                    data = part + os.read(pipe, due * size - len(part))
                except BlockingIOError:
                    break
                frames = len(data) // size
                part = data[frames * size :]
                self._samples.append(np.frombuffer(data, "<f4", frames * self.channels)[:: self.channels].copy())
                read, due = read + frames, due - frames
            if read and due > 0:
                # Without data, a card plays silence, and its clock goes on.
                self._samples.append(np.zeros(due, np.float32))
                self.starved_s.append(time.perf_counter())
                read += due
        os.close(pipe)
