"""Hardware rig: a tile that sends its readings, a person who presses it, and other sensors beside it."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.rig import NO_READINGS, PressRequest, Readings, Sound
from underfoot.devices.device_clock import DeviceClocks, arrival_frame, observe, sent_frame
from underfoot.devices.transport import Transport
from underfoot.devices.transport_reader import SILENT_S, TransportReader
from underfoot.errors import BadValue, DeviceError, require

_MOST_S = 30.0
"""Longest time for which unread readings are kept; the oldest are dropped first."""


@dataclass(frozen=True)
class ReferenceSensor:
    """A load cell or displacement sensor that sends frames as a tile does: over `port`, or the tile's own transport.

    It is channel `sensor` (0 to 3) of tile number `tile`; its value, in newtons or millimetres, is `units_per_count`
    times the counts above `zero`.
    """

    tile: int
    sensor: int = 0
    units_per_count: float = 1.0
    zero: float = 0.0
    port: Transport | None = None

    def __post_init__(self) -> None:
        require(0 <= self.tile <= 0xFFFF, "tile", self.tile, "0 to 65535")
        require(0 <= self.sensor <= 3, "sensor", self.sensor, "0 to 3")
        require(self.units_per_count != 0.0, "units_per_count", self.units_per_count, "not 0")

    def scale(self, unit: str) -> str:
        """Return in words how its counts become values in `unit`."""
        return f"{self.units_per_count:g} {unit} a count, {self.zero:g} at rest"


CELL_FORM = "TILE.SENSOR:NEWTONS_PER_COUNT:ZERO, as 9.1:0.05:120"
DISPLACEMENT_FORM = "TILE.SENSOR:MM_PER_COUNT:ZERO, as 9.2:0.001:120"


def load_cell_of(text: str) -> ReferenceSensor:
    """Parse a load cell on the tile's own transport, in `CELL_FORM`; the sensor counts from 1.

    >>> load_cell_of("9.1:0.05:120")
    ReferenceSensor(tile=9, sensor=0, units_per_count=0.05, zero=120.0, port=None)
    """
    return _sensor_of("cell", text, CELL_FORM)


def displacement_of(text: str) -> ReferenceSensor:
    """Parse a displacement sensor on the tile's own transport, in `DISPLACEMENT_FORM`.

    >>> displacement_of("9.2:0.001").units_per_count
    0.001
    """
    return _sensor_of("displacement", text, DISPLACEMENT_FORM)


def sensor_names(cell: str, displacement: str = "") -> tuple[str, str]:
    """Return what a load cell and a displacement sensor are called in a report, with the scales that its figures rest
    on. They are in `CELL_FORM` and `DISPLACEMENT_FORM`, or "".

    >>> sensor_names("9.1:0.05:120", "9.2:0.001")
    ('load cell, 0.05 N a count, 120 at rest', 'displacement, 0.001 mm a count, 0 at rest')
    """
    return (
        f"load cell, {load_cell_of(cell).scale('N')}" if cell else "load cell",
        f"displacement, {displacement_of(displacement).scale('mm')}" if displacement else "",
    )


def _sensor_of(name: str, text: str, form: str) -> ReferenceSensor:
    place, _, scale = text.partition(":")
    tile, _, sensor = place.partition(".")
    units, _, zero = scale.partition(":")
    try:
        return ReferenceSensor(int(tile), int(sensor) - 1, float(units), float(zero or "0"))
    except ValueError:
        raise BadValue(f"{name} is {text!r}; allowed: {form}") from None


class TileClock:
    """The clock of a tile, by which sensors beside it are timed, whose boards have clocks and lines of their own.

    Its times are even, and the host's at the first arrival of each epoch of the tile. What a line carries may come late
    and is never early: the earliest arrivals tell how its clock goes.
    """

    def __init__(self) -> None:
        self._clocks, self._zero_s = DeviceClocks(3, rate=1.0).table, 0.0

    def times(self, line: int, samples: NDArray[np.void], now: float) -> NDArray[np.float64]:
        """Return times (n,) of samples, which came at `now`, of the tile (`line` 0) or a sensor beside it (1, 2)."""
        device_us, epoch = samples["microseconds"].astype(np.float64), int(samples["epoch"][-1])
        tile, own = self._clocks[0], self._clocks[line]
        if line == 0 and own["epoch"] != epoch:
            self._zero_s = now - 1e-6 * float(device_us[-1])
        observe(own, epoch, float(device_us[-1]), now, 1.0)
        if line == 0:
            return np.asarray(1e-6 * device_us + self._zero_s)
        ends_us = device_us[[0, -1]]
        ends_s = [sent_frame(tile, float(arrival_frame(own, at_us, 1.0)), 1.0) for at_us in ends_us.tolist()]
        return np.interp(device_us, ends_us, ends_s) + self._zero_s


class DeviceRig:
    """Rig that reads tile number `tile` from `port`, an optional load cell and displacement sensor; a person presses.

    `displacement` is on the tile's own transport, and gives mm for newtons. Readings are returned once the sensors
    beside the tile have values at their times, and left out where those were silent for longer than `SILENT_S`. A
    sensor that has sent nothing yet has none.

    `read` never waits. When the line is lost, readings stop until it is back. After every `silent_s` without a reading
    by `clock`, it raises `DeviceError`. Close it when done.
    """

    def __init__(
        self,
        port: Transport,
        tile: int,
        cell: ReferenceSensor | None = None,
        silent_s: float = 10.0,
        displacement: ReferenceSensor | None = None,
        clock: Callable[[], float] = time.perf_counter,
    ) -> None:
        self._tile, self._cell, self._silent_s, self._clock = tile, cell, silent_s, clock
        self._displacement = displacement
        self._lock = threading.Lock()
        self._frames: list[tuple[float, NDArray[np.float64], NDArray[np.float64]]] = []
        self._beside: tuple[_Arrivals, _Arrivals] = ([], [])
        self._tile_clock = TileClock()
        self._last_s = -np.inf
        self._heard_s = clock()
        self._readers = [TransportReader(port, self._sample_handler(port))]
        if cell is not None and cell.port is not None:
            self._readers.append(TransportReader(cell.port, self._sample_handler(cell.port)))
        for reader in self._readers:
            reader.start()

    def press(self, press: PressRequest | None) -> None:
        """Do nothing: a person reads the page."""

    def read(self) -> Readings:
        """Return the readings since the last call; `DeviceError` if there was none for `silent_s`."""
        with self._lock:
            for arrivals in self._beside:
                while len(arrivals) > 1 and arrivals[1][0][-1] <= self._last_s:
                    del arrivals[0]
            force, displacement = (list(arrivals) for arrivals in self._beside)
            beside = zip((self._cell, self._displacement), (force, displacement), strict=True)
            ends = [(float(arrivals[-1][0][-1]), sensor.tile) for sensor, arrivals in beside if sensor and arrivals]
            until_s, behind = min(ends, default=(np.inf, self._tile))
            # Later readings wait: what the sensors beside the tile measure then has not arrived.
            frames = list(takewhile(lambda frame: frame[1][-1] <= until_s, self._frames))
            del self._frames[: len(frames)]
            silent = behind if self._frames else self._tile
        if not frames:
            now_s = self._clock()
            if now_s - self._heard_s > self._silent_s:
                self._heard_s = now_s  # said, and said again after as long
                why = self._troubles() if silent == self._tile else ""
                raise DeviceError(f"nothing comes of tile number {silent}: {why or 'is it plugged in?'}")
            return NO_READINGS
        self._heard_s = self._clock()
        time_s = np.concatenate([times for _, times, _ in frames])
        values = np.concatenate([readings for _, _, readings in frames])
        later = (time_s > self._last_s) & _is_covered(time_s, force) & _is_covered(time_s, displacement)
        time_s, values = time_s[later], values[later]
        if time_s.size:
            self._last_s = float(time_s[-1])
        return Readings(time_s, values, _at(time_s, force), _at(time_s, displacement))

    def play(self, sound: Sound) -> NDArray[np.float64]:
        """Refuse: a tile's line carries no sound."""
        raise BadValue("a tile's line carries no sound; the response is measured through a sound card")

    def close(self) -> None:
        """Close the lines."""
        for reader in self._readers:
            reader.close()

    def _troubles(self) -> str:
        """Return what is wrong with the lines now."""
        return "; ".join(reader.trouble for reader in self._readers if reader.trouble)

    def _sample_handler(self, port: Transport) -> Callable[[NDArray[np.void], float], None]:
        """Return the function that takes the samples of one transport, in its thread."""
        is_tiles = self._cell is None or self._cell.port is None or port is not self._cell.port

        def take_samples(samples: NDArray[np.void], now: float) -> None:
            with self._lock:
                if is_tiles:
                    mine = samples[samples["tile"] == self._tile]
                    if len(mine):
                        self._frames.append(
                            (now, self._tile_clock.times(0, mine, now), mine["readings"].astype(np.float64))
                        )
                if not is_tiles or (self._cell is not None and self._cell.port is None):
                    self._take_beside(0, self._cell, samples, now)
                if is_tiles:
                    self._take_beside(1, self._displacement, samples, now)
                while self._frames and self._frames[-1][0] - self._frames[0][0] > _MOST_S:
                    del self._frames[0]

        return take_samples

    def _take_beside(self, place: int, sensor: ReferenceSensor | None, samples: NDArray[np.void], now: float) -> None:
        """Take samples of the load cell (`place` 0) or the displacement sensor (1)."""
        if sensor is None:
            return
        frames = samples[samples["tile"] == sensor.tile]
        if len(frames):
            counts = frames["readings"][:, sensor.sensor].astype(np.float64)
            arrivals = self._beside[place]
            times = self._tile_clock.times(1 + place, frames, now)
            if arrivals:  # its clock is known better and better, and may have been ahead
                times = np.maximum(times, arrivals[-1][0][-1])
            arrivals.append((times, sensor.units_per_count * (counts - sensor.zero)))
            while arrivals[-1][0][-1] - arrivals[0][0][-1] > _MOST_S:
                del arrivals[0]


_Arrivals = list[tuple[NDArray[np.float64], NDArray[np.float64]]]
"""Times and values, an entry per arrival."""


def _is_covered(time_s: NDArray[np.float64], arrivals: _Arrivals) -> NDArray[np.bool_]:
    """Return whether a sensor was not silent around these times; true if nothing has arrived at all."""
    if not arrivals:
        return np.ones(time_s.size, dtype=bool)
    at_s = np.concatenate([times for times, _ in arrivals])
    after = np.minimum(np.searchsorted(at_s, time_s), at_s.size - 1)
    return np.asarray(at_s[after] - at_s[np.maximum(after - 1, 0)] <= SILENT_S)


def _at(time_s: NDArray[np.float64], arrivals: _Arrivals) -> NDArray[np.float64] | None:
    """Return a sensor's values at these times; None if nothing has arrived."""
    if not arrivals:
        return None
    at_s, values = (np.concatenate(column) for column in zip(*arrivals, strict=True))
    return np.interp(time_s, at_s, values)
