"""A rig of hardware: a tile that sends its readings, a person who presses it, and a load cell beside it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.rig import NO_READINGS, PressRequest, Readings, Sound
from underfoot.devices.device import Port
from underfoot.devices.framing.parser import LIFE
from underfoot.devices.framing.wire_format import MICROSECONDS, READINGS, TILE
from underfoot.devices.transports.reader import Link
from underfoot.errors import BadValue, DeviceError, require

_MOST_S = 30.0
"""Readings that nobody takes for this long are dropped, the oldest first."""
_KEPT_ARRIVALS = 50
"""Arrivals of the load cell's frames that are kept for the times of the tile's readings."""


@dataclass(frozen=True)
class LoadCell:
    """A load cell that sends frames as a tile does: on `port`, or on the tile's own line where that is None.

    It is channel `sensor` (0 to 3) of tile number `tile`; newtons are `newtons_per_count` times what is above `zero`.
    """

    tile: int
    sensor: int = 0
    newtons_per_count: float = 1.0
    zero: float = 0.0
    port: Port | None = None

    def __post_init__(self) -> None:
        require(0 <= self.tile <= 0xFFFF, "tile", self.tile, "0 to 65535")
        require(0 <= self.sensor <= 3, "sensor", self.sensor, "0 to 3")
        require(self.newtons_per_count != 0.0, "newtons_per_count", self.newtons_per_count, "not 0")


def load_cell_of(text: str) -> LoadCell:
    """A load cell on the tile's own line, `TILE.SENSOR:NEWTONS_A_COUNT:ZERO`, the sensor from 1.

    >>> load_cell_of("9.1:0.05:120")
    LoadCell(tile=9, sensor=0, newtons_per_count=0.05, zero=120.0, port=None)
    """
    place, _, scale = text.partition(":")
    tile, _, sensor = place.partition(".")
    newtons, _, zero = scale.partition(":")
    try:
        return LoadCell(int(tile), int(sensor) - 1, float(newtons), float(zero or "0"))
    except ValueError:
        raise BadValue(f"cell is {text!r}; allowed: TILE.SENSOR:NEWTONS_A_COUNT:ZERO, as 9.1:0.05:120") from None


class DeviceRig:
    """Reads tile number `tile` from `port`, and a load cell where there is one; a person presses.

    `read` never waits; where the line has gone away readings stop, and go on when it is back. After `silent_reads`
    calls without a reading, which is ten seconds of `procedure.run`, it raises `DeviceError`. Close it when done.
    """

    def __init__(self, port: Port, tile: int, cell: LoadCell | None = None, silent_reads: int = 2000) -> None:
        self._tile, self._cell, self._silent_reads = tile, cell, silent_reads
        self._lock = threading.Lock()
        self._frames: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = []
        self._forces: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []
        self._zero_s: dict[tuple[int, int], float] = {}
        self._last_s = -np.inf
        self._empty_reads = 0
        self._links = [Link(port, self._hear(port))]
        if cell is not None and cell.port is not None:
            self._links.append(Link(cell.port, self._hear(cell.port)))
        for link in self._links:
            link.start()

    def press(self, press: PressRequest | None) -> None:
        """Nothing: a person reads the page."""

    def read(self) -> Readings:
        """What came in since the last call; `DeviceError` when nothing has come for ten seconds."""
        with self._lock:
            frames, self._frames = self._frames, []
            cell = list(self._forces)
        if not frames:
            self._empty_reads += 1
            if self._empty_reads > self._silent_reads:
                raise DeviceError(f"nothing comes of tile {self._tile}: {self.news() or 'is it plugged in?'}")
            return NO_READINGS
        self._empty_reads = 0
        time_s = np.concatenate([times for _, times, _ in frames])
        values = np.concatenate([readings for _, _, readings in frames])
        later = time_s > self._last_s
        time_s, values = time_s[later], values[later]
        if time_s.size:
            self._last_s = float(time_s[-1])
        if self._cell is None or not cell:
            return Readings(time_s, values)
        cell_s = np.concatenate([times for times, _ in cell])
        cell_n = np.concatenate([newtons for _, newtons in cell])
        return Readings(time_s, values, np.interp(time_s, cell_s, cell_n))

    def news(self) -> str:
        """The latest events of the lines, in a sentence each."""
        return "; ".join(line for link in self._links for line in list(link.news)[-2:])

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """A tile's line carries no sound."""
        raise BadValue("a tile's line carries no sound; the response is measured through a sound card")

    def close(self) -> None:
        """Let the lines go."""
        for link in self._links:
            link.close()

    def _hear(self, port: Port) -> Callable[[NDArray[np.int64], float], None]:
        """The function that takes the frames of one line, in the line's thread."""
        is_tiles = self._cell is None or self._cell.port is None or port is not self._cell.port

        def hear(frames: NDArray[np.int64], now: float) -> None:
            with self._lock:
                if is_tiles:
                    mine = frames[frames[:, TILE] == self._tile]
                    if len(mine):
                        self._frames.append((now, self._times(0, mine, now), mine[:, READINGS:LIFE].astype(np.float64)))
                if self._cell is not None and (not is_tiles or self._cell.port is None):
                    cells = frames[frames[:, TILE] == self._cell.tile]
                    if len(cells):
                        counts = cells[:, READINGS + self._cell.sensor].astype(np.float64)
                        newtons = self._cell.newtons_per_count * (counts - self._cell.zero)
                        self._forces.append((self._times(1, cells, now), newtons))
                        del self._forces[:-_KEPT_ARRIVALS]
                while self._frames and self._frames[-1][0] - self._frames[0][0] > _MOST_S:
                    del self._frames[0]

        return hear

    def _times(self, line: int, frames: NDArray[np.int64], now: float) -> NDArray[np.float64]:
        """Device time on the host's clock: even, and set once for each life of a device, by its first arrival."""
        device_s = frames[:, MICROSECONDS] * 1e-6
        life = (line, int(frames[-1, LIFE]))
        zero = self._zero_s.setdefault(life, now - float(device_s[-1]))
        return np.asarray(device_s + zero)
