"""A line to hardware: one thread that reads it, finds the frames, and opens it again when it has gone away."""

import threading
import time
from collections import deque
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.device import Port
from underfoot.devices.framing.parser import Counts, Parser
from underfoot.errors import BadValue, DeviceError

AGAIN_S = 0.1
"""How often it is tried to open a line that is not there."""
SILENT_S = 0.5
"""A line on which nothing comes for this long is said to be silent."""
_GATHER_S = 0.0005  # what comes meanwhile is read at once: a thread that wakes for every byte holds up all others
_FLUENT = 512


class Link:
    """Reads `port` in a thread of its own from `start` to `close`, whatever becomes of it meanwhile.

    Each time frames came, `hear` is called in that thread with them, int64 (n, 8) as `Parser.feed` gives them, good
    until it returns, and with the time of their arrival by `time.monotonic`. `news` are lines for the person.
    """

    def __init__(self, port: Port, hear: Callable[[NDArray[np.int64], float], None], form: str = "auto") -> None:
        self.port = port
        self.news: deque[str] = deque(maxlen=100)
        self._parser = Parser(form)
        self._parser.feed(b"")  # loads the kernel before it is needed
        self._hear = hear
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"reads {port.name}", daemon=True)
        self.is_open = False

    def start(self) -> None:
        """Begin to read; returns at once, whether or not there is something to read."""
        self._thread.start()

    def close(self) -> None:
        """Stop reading, and let go of the port."""
        self._stop.set()
        if self._thread.ident is not None:
            self._thread.join()

    @property
    def counts(self) -> Counts:
        """What became of all frames so far."""
        return self._parser.counts

    def period_us(self, tile: int) -> int:
        """Microseconds between a tile's samples, by its own clock; 0 where that is not known yet."""
        return self._parser.period_us(tile)

    def _run(self) -> None:
        missed = silent = False
        while not self._stop.is_set():
            try:
                self.port.open()
            except DeviceError as error:
                if not missed:
                    self.news.append(f"{error}; waiting for it")
                missed = True
                self._stop.wait(AGAIN_S)
                continue
            if missed:
                self.news.append(f"{self.port.name} is back")
            self.is_open = True
            self._parser.cut()
            try:
                silent = self._read(silent)
            except DeviceError as error:
                self.news.append(f"{error}; waiting for it")
            self.is_open = False
            missed = True
            self.port.close()

    def _read(self, silent: bool) -> bool:
        """Read until told to stop; whether it was silent last. `DeviceError` when the line has gone away."""
        heard, unread = time.monotonic(), 0
        while not self._stop.is_set():
            data = self.port.read()
            now = time.monotonic()
            frames = self._parser.feed(data)
            if len(frames):
                if silent:
                    self.news.append(f"{self.port.name} sends again")
                heard, unread, silent = now, 0, False
                self._hear(frames, now)
            else:
                unread += len(data)
            if now - heard > SILENT_S and not silent:
                silent = True
                what = f"{unread} bytes came, but no frame" if unread >= _FLUENT else "nothing comes"
                self.news.append(f"{self.port.name}: {what}")
            if len(data):
                self._stop.wait(_GATHER_S)
        return silent


def port_of(kind: str, source: str) -> Port:
    """The port "serial" of `PORT` or `PORT@BAUD`, or "udp" of `HOST:PORT`; nothing is opened."""
    from underfoot.devices.transports.serial import SerialPort
    from underfoot.devices.transports.udp import UdpPort

    match kind:
        case "serial":
            return SerialPort.named(source)
        case "udp":
            return UdpPort.named(source)
    raise BadValue(f"kind is {kind!r}; allowed: serial, udp")
