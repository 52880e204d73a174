"""Tiles that are not there: their firmware on a pseudo-terminal or behind UDP, with the faults of real lines.

A floor's tiles share one clock and one line, as behind a hub. On a pseudo-terminal unplugging takes the power with it:
the port's name goes away, and when it is back the tiles count from 0 again. Behind UDP only the line is cut: the tiles
count on, and nobody hears them.
"""

import os
import select
import socket
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.conversion import nominal_readings
from underfoot.devices.device import ForceSource
from underfoot.devices.emulation.faults import FaultyLine
from underfoot.devices.framing.wire_format import FRAME
from underfoot.errors import DeviceError, require

BATCH_S = 0.002
"""Samples go out this often; a real tile sends each at once, but a desktop cannot wake up so often in time."""
DATAGRAM = 1400
"""Bytes that a datagram holds at most: what an Ethernet frame carries."""
_RATE = 48_000.0
_PATIENCE_S = 0.05


class Way(Protocol):
    """Where the bytes go."""

    name: str
    """What whoever reads has to open."""

    def send(self, data: bytes, packets: list[int]) -> bool:
        """Send bytes, of which packets end at these places; whether all went out."""
        ...

    def plug(self, on: bool) -> bool:
        """Take the line away or put it back; whether the tiles begin anew with it."""
        ...

    def close(self) -> None:
        """Let go of all."""
        ...


class PtyWay:
    """A pseudo-terminal under a name that stays, as a real port's does when it is plugged in again."""

    def __init__(self) -> None:
        try:
            import tty

            self._raw = tty.setraw
        except ImportError:
            raise DeviceError("there are no pseudo-terminals on this system; use --udp") from None
        self._folder = tempfile.TemporaryDirectory(prefix="underfoot-")
        self.name = str(Path(self._folder.name) / "tile")
        self._ends: tuple[int, int] | None = None
        self._flows = True
        self.plug(True)

    def send(self, data: bytes, packets: list[int]) -> bool:
        """Wait a moment for a reader that is behind; where none reads, the data is lost, as on a wire."""
        if self._ends is None:
            return False
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[os.write(self._ends[0], rest) :]
            except BlockingIOError:
                if not (self._flows and select.select([], [self._ends[0]], [], _PATIENCE_S)[1]):
                    self._flows = False
                    return False
            except OSError:
                return False
        self._flows = True
        return True

    def plug(self, on: bool) -> bool:
        """Open a new pseudo-terminal under the same name, or close it."""
        if self._ends is not None:
            Path(self.name).unlink()
            for end in self._ends:
                os.close(end)
            self._ends = None
        if on:
            try:
                self._ends = os.openpty()
            except OSError as error:
                raise DeviceError(f"no pseudo-terminal: {error}") from None
            self._raw(self._ends[1])
            os.set_blocking(self._ends[0], False)
            os.symlink(os.ttyname(self._ends[1]), self.name)
        return on

    def close(self) -> None:
        """Take the port away for good."""
        self.plug(False)
        self._folder.cleanup()


class UdpWay:
    """Datagrams to `host` and `port`, each of whole frames."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"{host}:{port}"
        try:
            self._to = socket.getaddrinfo(host or "127.0.0.1", port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(self._to[0], socket.SOCK_DGRAM)
        except OSError as error:
            raise DeviceError(f"udp:{self.name} cannot be sent to: {(error.strerror or str(error)).lower()}") from None
        self._is_plugged = True

    def send(self, data: bytes, packets: list[int]) -> bool:
        """Send datagrams that end where packets end, as many packets in each as it holds."""
        if not self._is_plugged:
            return False
        begin = end = 0
        for place in (*packets, None):
            if place is None or (place - begin > DATAGRAM and end > begin):
                with suppress(OSError):  # nobody listens, which a tile does not mind
                    self._socket.sendto(data[begin:end], self._to[4])
                begin = end
            end = end if place is None else place
        return True

    def plug(self, on: bool) -> bool:
        """Let datagrams through, or not; the tiles go on."""
        self._is_plugged = on
        return False

    def close(self) -> None:
        """Send no more."""
        self._socket.close()


class Emulator:
    """Sends what the tiles of `source` read, in a thread of its own from `start` to `close`.

    `readings` turns newtons (n, tiles, 4) into counts. Device time begins at `microseconds` and is `drift_ppm` slow;
    the tiles' numbers are their rows, from 0 on. After `seconds` it ends by itself; `over` is then true. Without `pace`
    it sends as fast as the line takes it. `only` sends one tile of the floor. `unheard` counts samples that did not go
    out whole.
    """

    def __init__(
        self,
        way: Way,
        source: ForceSource,
        line: FaultyLine | None = None,
        *,
        seconds: float | None = None,
        readings: Callable[[NDArray[np.float64]], NDArray[np.int64]] = nominal_readings,
        microseconds: int = 0,
        drift_ppm: float = 0.0,
        pace: bool = True,
        only: int | None = None,
    ) -> None:
        require(seconds is None or seconds > 0.0, "seconds", seconds, "above 0")
        self.way, self.line, self.unheard = way, line or FaultyLine(), 0
        self._source, self._readings, self._pace = source, readings, pace
        self._seconds = seconds
        self._time = microseconds
        self._a_frame_us = 1e6 / _RATE / (1.0 + drift_ppm * 1e-6)
        tiles = len(source.floor.tiles)
        require(only is None or 0 <= only < tiles, "tile", only, f"0 to {tiles - 1}")
        self._tiles = np.arange(tiles) if only is None else np.array([only])
        self._sequence = 0
        self._zero = 0.0
        self._cuts = sorted(
            (at, on) for begin, length in self.line.faults.unplugged for at, on in ((begin, 0), (begin + length, 1))
        )
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"emulates {way.name}", daemon=True)

    def start(self) -> None:
        """Begin to send."""
        self._thread.start()

    @property
    def over(self) -> bool:
        """Whether the last sample was sent."""
        return self._thread.ident is not None and not self._thread.is_alive()

    def close(self) -> None:
        """Stop sending, and take the line away."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()
        self.way.close()

    def frames(self, stamps: NDArray[np.float64], force_n: NDArray[np.float64]) -> NDArray[np.int64]:
        """What the tiles send of samples at these session frames: (n tiles, 7), all tiles of a sample together."""
        count, tiles = len(stamps), len(self._tiles)
        rows = np.empty((count, tiles, 7), np.int64)
        rows[:, :, 0] = self._tiles
        rows[:, :, 1] = ((self._sequence + np.arange(count)) & 0xFFFF)[:, None]
        time_us = np.rint((stamps - self._zero) * self._a_frame_us).astype(np.int64)
        rows[:, :, 2] = ((self._time + time_us) & 0xFFFF_FFFF)[:, None]
        rows[:, :, 3:] = self._readings(force_n)[:, self._tiles]
        self._sequence += count
        return rows.reshape(-1, 7)

    def _run(self) -> None:
        self._send_until(1.0 / _RATE)  # which loads what the source needs, before time counts
        began, now = time.monotonic(), 0.0
        while not self._stop.is_set() and (self._seconds is None or now < self._seconds):
            now = time.monotonic() - began if self._pace else now + BATCH_S
            now = now if self._seconds is None else min(now, self._seconds)
            while self._cuts and self._cuts[0][0] <= now:
                at, on = self._cuts.pop(0)
                self._send_until(at)
                if self.way.plug(bool(on)):
                    self._sequence, self._zero, self._time = 0, at * _RATE, 0
            self._send_until(now)
            if self._pace:
                self._stop.wait(BATCH_S)
        self._put(self.line.end(), 1)

    def _send_until(self, now: float) -> None:
        while (count := self._source.pull(int(now * _RATE))) and not self._stop.is_set():
            data = self.line.send(self.frames(self._source.stamps[:count], self._source.forces[:count]))
            self._put(data, count)

    def _put(self, data: bytes, samples: int) -> None:
        if self.line.csv:
            ends = [at + 1 for at, byte in enumerate(data) if byte == 10]
        else:
            ends = list(range(FRAME, len(data) + 1, FRAME))
        if data and not self.way.send(data, ends):
            self.unheard += samples
