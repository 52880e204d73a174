"""Emulated tiles: what their firmware sends over a transport, with the faults of real connections.

A floor's tiles share one clock and one transport, as behind a hub. Where the transport powers them, as a serial port
does, unplugging cuts their power: when plugged in again, the tiles count from 0. Elsewhere only the connection is cut:
the tiles continue to count, and what they send is lost.
"""

import math
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.conversion import nominal_readings
from underfoot.devices.emulation.faults import FaultInjector
from underfoot.devices.force_source import ForceSource
from underfoot.devices.framing.wire_format import ACCELERATION, FORCES, FRAME_BYTES, SAMPLE
from underfoot.devices.link_acceleration import EACH
from underfoot.devices.transport import Sender, asked
from underfoot.errors import DeviceError, require

_RATE = 48_000.0
_AHEAD_S = 0.05  # samples are computed this far ahead: a delay in sending one would otherwise delay the next


@dataclass(frozen=True)
class TileClock:
    """The clock shared by emulated tiles: its initial value, and its drift."""

    start_us: int = 0
    drift_ppm: float = 0.0


class Emulator:
    """Sends the readings of the tiles of `source`, in a thread of its own from `start` to `close`.

    `readings` converts newtons (n, tiles, 4) to counts. The tiles' numbers are their rows, from 0; `only` selects one
    of them. Each sample is sent at its own time, together with those already late; `is_sending` is true from the first
    on, before which kernels are loaded or compiled. After `seconds` it ends by itself; `is_finished` is then true. If
    its sender fails, it ends, too; `failure` says why. `undelivered` counts samples that were not sent whole.
    `acceleration` are readings (n, tiles) of accelerometers, four for each sample of force, repeated from the first on.
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
        only: int | None = None,
        acceleration: NDArray[np.int64] | None = None,
    ) -> None:
        require(acceleration is None or not (injector and injector.csv), "acceleration", "given", "binary frames alone")
        self._acceleration = acceleration
        require(seconds is None or seconds > 0.0, "seconds", seconds, "above 0")
        self.sender, self.injector, self.undelivered, self.failure = sender, injector or FaultInjector(), 0, ""
        self.is_sending = False
        self._source, self._readings = source, readings
        self._seconds = math.inf if seconds is None else seconds
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
        """Start sending."""
        self._thread.start()

    @property
    def is_finished(self) -> bool:
        """Whether the last sample has been sent."""
        return self._thread.ident is not None and not self._thread.is_alive()

    def close(self) -> None:
        """Stop sending, and close the sender."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()
        asked(self.sender, self.sender.close)

    def samples(self, stamps: NDArray[np.float64], force_n: NDArray[np.float64]) -> NDArray[np.void]:
        """Return records of `wire_format.SAMPLE` for forces (n, tiles, 4) at these session frames (n,).

        There are n times the number of tiles, with all tiles of one instant together; with acceleration, each is
        followed by a frame of it.
        """
        count, tiles = len(stamps), len(self._tiles)
        samples = np.zeros((count, tiles), SAMPLE)
        samples["tile"] = self._tiles
        samples["sequence"] = ((self._sequence + np.arange(count)) & 0xFFFF)[:, None]
        time_us = np.rint((stamps - self._start_frame) * self._a_frame_us).astype(np.int64)
        samples["microseconds"] = ((self._start_us + time_us) & 0xFFFF_FFFF)[:, None]
        samples["readings"], samples["kind"] = self._readings(force_n)[:, self._tiles], FORCES
        if self._acceleration is not None:
            shaken, samples = samples.copy(), np.repeat(samples, 2, axis=1)
            last = EACH * (self._sequence + np.arange(count))
            places = (last[:, None] + np.arange(1 - EACH, 1)) % len(self._acceleration)
            shaken["readings"] = self._acceleration[places][:, :, self._tiles].swapaxes(1, 2)
            shaken["kind"] = ACCELERATION
            samples[:, 1::2] = shaken
        self._sequence += count
        return samples.reshape(-1)

    def _run(self) -> None:
        try:
            self._send_all()
        except DeviceError as error:
            self.failure = str(error)

    def _send_all(self) -> None:
        self._send_until(1.0 / _RATE, -math.inf)  # loads the source's kernels before timing matters
        self.is_sending = True
        began, end = time.perf_counter(), 0.0
        while end < self._seconds and self._wait_until(began + end - 0.5 * _AHEAD_S):
            cut = self._cuts[0][0] if self._cuts else math.inf
            end = min(end + _AHEAD_S, cut, self._seconds)
            self._send_until(end, began)
            if end == cut and self._wait_until(began + end):
                self._cut(*self._cuts.pop(0))
        self._put(self.injector.end(), 1)

    def _cut(self, at_s: float, plugs: bool) -> None:
        """Unplug the transport, or plug it in again."""
        if not plugs:
            asked(self.sender, self.sender.unplug)
            return
        asked(self.sender, self.sender.plug)
        if self.sender.powers_tiles:
            self._sequence, self._start_frame, self._start_us = 0, at_s * _RATE, 0

    def _send_until(self, end_s: float, began: float) -> None:
        """Send the samples before `end_s`, each at its own time after `began` (`time.perf_counter`)."""
        while count := self._source.pull(int(end_s * _RATE)):
            due = began + self._source.stamps[:count] / _RATE
            samples = self.samples(self._source.stamps[:count], self._source.forces[:count]).reshape(count, -1)
            at = 0
            while at < count and self._wait_until(due[at]):
                upto = max(at + 1, int(np.searchsorted(due, time.perf_counter(), "right")))
                self._put(self.injector.send(samples[at:upto].reshape(-1)), upto - at)
                at = upto
            if at < count:
                return

    def _wait_until(self, moment: float) -> bool:
        """Wait until this time of `time.perf_counter`; return False if it is time to stop."""
        wait = moment - time.perf_counter()
        if wait > 0.0:
            time.sleep(wait)  # more exact than waiting for an event
        return not self._stop.is_set()

    def _put(self, data: bytes, samples: int) -> None:
        if self.injector.csv:
            ends = [at + 1 for at, byte in enumerate(data) if byte == 10]
        else:
            ends = list(range(FRAME_BYTES, len(data) + 1, FRAME_BYTES))
        if data and not asked(self.sender, partial(self.sender.send, data, ends)):
            self.undelivered += samples
