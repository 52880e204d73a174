"""Tiles that are not there: what their firmware sends over a transport, with the faults of real connections.

A floor's tiles share one clock and one transport, as behind a hub. Where the transport powers them, as a serial port
does, unplugging takes the power with it: when it is plugged in again the tiles count from 0 again. Elsewhere only the
connection is cut: the tiles count on, and what they send is lost.
"""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.conversion import nominal_readings
from underfoot.devices.emulation.faults import FaultInjector
from underfoot.devices.force_source import ForceSource
from underfoot.devices.framing.wire_format import FRAME_BYTES, SAMPLE
from underfoot.devices.transport import Sender
from underfoot.errors import require

BATCH_S = 0.002
"""Samples go out this often; a real tile sends each at once, but a desktop cannot wake up so often in time."""
_RATE = 48_000.0


@dataclass(frozen=True)
class TileClock:
    """The clock that emulated tiles share: what it shows first, and by how much it is slow."""

    start_us: int = 0
    drift_ppm: float = 0.0


class Emulator:
    """Sends what the tiles of `source` read, in a thread of its own from `start` to `close`.

    `readings` turns newtons (n, tiles, 4) into counts. The tiles' numbers are their rows, from 0 on; `only` sends one
    of them. After `seconds` it ends by itself; `over` is then true. Without `pace` it sends as fast as the transport
    takes it. `unheard` counts samples that did not go out whole.
    """

    def __init__(
        self,
        sender: Sender,
        source: ForceSource,
        injector: FaultInjector | None = None,
        *,
        seconds: float | None = None,
        readings: Callable[[NDArray[np.float64]], NDArray[np.int64]] = nominal_readings,
        clock: TileClock | None = None,
        pace: bool = True,
        only: int | None = None,
    ) -> None:
        require(seconds is None or seconds > 0.0, "seconds", seconds, "above 0")
        self.sender, self.injector, self.unheard = sender, injector or FaultInjector(), 0
        self._source, self._readings, self._pace = source, readings, pace
        self._seconds = seconds
        clock = clock or TileClock()
        self._start_us = clock.start_us
        self._a_frame_us = 1e6 / _RATE / (1.0 + clock.drift_ppm * 1e-6)
        tiles = len(source.floor.tiles)
        require(only is None or 0 <= only < tiles, "tile", only, f"0 to {tiles - 1}")
        self._tiles = np.arange(tiles) if only is None else np.array([only])
        self._sequence = 0
        self._start_frame = 0.0
        unplugged = self.injector.faults.unplugged
        self._cuts = sorted(
            (at, plugs) for begin, length in unplugged for at, plugs in ((begin, False), (begin + length, True))
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"emulates {sender.name}", daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    @property
    def over(self) -> bool:
        """Whether the last sample was sent."""
        return self._thread.ident is not None and not self._thread.is_alive()

    def close(self) -> None:
        """Stop sending, and close the sender."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()
        self.sender.close()

    def samples(self, stamps: NDArray[np.float64], force_n: NDArray[np.float64]) -> NDArray[np.void]:
        """What the tiles send of forces (n, tiles, 4) at these session frames (n,): records of `wire_format.SAMPLE`.

        There are n times the tiles, all tiles of a moment together.
        """
        count, tiles = len(stamps), len(self._tiles)
        samples = np.zeros((count, tiles), SAMPLE)
        samples["tile"] = self._tiles
        samples["sequence"] = ((self._sequence + np.arange(count)) & 0xFFFF)[:, None]
        time_us = np.rint((stamps - self._start_frame) * self._a_frame_us).astype(np.int64)
        samples["microseconds"] = ((self._start_us + time_us) & 0xFFFF_FFFF)[:, None]
        samples["readings"] = self._readings(force_n)[:, self._tiles]
        self._sequence += count
        return samples.reshape(-1)

    def _run(self) -> None:
        self._send_until(1.0 / _RATE)  # which loads what the source needs, before time counts
        began, now = time.monotonic(), 0.0
        while not self._stop.is_set() and (self._seconds is None or now < self._seconds):
            now = time.monotonic() - began if self._pace else now + BATCH_S
            now = now if self._seconds is None else min(now, self._seconds)
            while self._cuts and self._cuts[0][0] <= now:
                self._cut(*self._cuts.pop(0))
            self._send_until(now)
            if self._pace:
                self._stop.wait(BATCH_S)
        self._put(self.injector.end(), 1)

    def _cut(self, at_s: float, plugs: bool) -> None:
        """Unplug the transport, or plug it in again."""
        self._send_until(at_s)
        if not plugs:
            self.sender.unplug()
            return
        self.sender.plug()
        if self.sender.powers_tiles:
            self._sequence, self._start_frame, self._start_us = 0, at_s * _RATE, 0

    def _send_until(self, now_s: float) -> None:
        while (count := self._source.pull(int(now_s * _RATE))) and not self._stop.is_set():
            samples = self.samples(self._source.stamps[:count], self._source.forces[:count])
            self._put(self.injector.send(samples), count)

    def _put(self, data: bytes, samples: int) -> None:
        if self.injector.csv:
            ends = [at + 1 for at, byte in enumerate(data) if byte == 10]
        else:
            ends = list(range(FRAME_BYTES, len(data) + 1, FRAME_BYTES))
        if data and not self.sender.send(data, ends):
            self.unheard += samples
