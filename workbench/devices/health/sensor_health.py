"""Sensors that are dead, saturated or loose, told from what they read while people walk; swapped ones in
`sensor_order`.

Four sensors that carry a rigid plate say one thing more than force and place: the two diagonals carry alike, or as the
product of what lies along and across where a plate bends. So each sensor can be expected from the other three.

- *Dead*: it stays at rest while the other three carry a load of which it should have a part.
- *Saturated*: it stays at one reading, at the top of the range or below it, while the load on its tile changes.
- *Loose*: again and again it falls to rest from one sample to the next while the others go on, and comes back.

A sensor is named when nothing else explains what was seen; a walk that shows too little names none.
"""

from collections import deque

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.health.sensor_order import SensorOrder
from underfoot.floor.layout import Floor
from underfoot.kernels import kernel

CONTACT_N, LOADED_N = 20.0, 100.0
"""A tile is stepped on from the one on; what it reads says something of its sensors from the other on."""
DEAD_S, DEAD_N, ALIVE_N = 1.0, 0.3, 1.0
"""For how long a sensor must have been seen dead, which is to carry less than the one; the other is a sign of life."""
FLAT_S, FLAT_SAMPLES, FLAT_SHARE = 0.020, 8, 0.15
"""One reading for this long, in this many samples, while the others' load changes by this share, is no chance."""
FALL_N, FALLS, WITHIN_S, BACK_S = 40.0, 3, 60.0, 0.3
"""A loose sensor loses at least this much at once, and is back within `BACK_S`; so often within `WITHIN_S`."""

_DEAD, _SATURATED, _LOOSE = 1, 2, 4
# What is known of a sensor: its rest, its newest force and reading; how long it has been flat, in how many samples, and
# the others' load as that began; how long it was seen dead; when it fell, from what, how often, and since when.
_REST, _FORCE, _READING, _FLAT, _SAME, _BEGAN_N, _SEEN_DEAD, _FELL, _FROM, _FALLS, _FIRST, _SENSOR = range(12)
_TIME, _SEEN, _TILE = range(3)
_REST_SHARE = 0.002


class SensorHealth:
    """Watches the sensors of `floor`, each tile of which sends about `rate_hz` samples a second.

    >>> from underfoot.floor.layout import default_floor
    >>> health = SensorHealth(default_floor(1, 1), 1000.0)
    >>> time_s = np.arange(2000) / 1000.0
    >>> force_n = np.where((time_s > 0.5) & (time_s < 1.8), 150.0, 0.0)[:, None] * [1, 0, 1, 1]
    >>> health.feed(np.zeros(2000, int), time_s, (20 * force_n).astype(int), force_n)
    >>> health.news()
    ['tile t1: sensor 2 is dead (reads 0 while its neighbours carry 450 N)']
    """

    def __init__(self, floor: Floor, rate_hz: float) -> None:
        self.floor = floor
        count = len(floor.tiles)
        self._period = 1.0 / rate_hz
        self._sensors = np.zeros((count, 4, _SENSOR))
        self._sensors[:, :, [_FELL, _FIRST]] = -np.inf
        self._tiles = np.zeros((count, _TILE))
        self._balance = np.array([_balance(tile.sensors_m) for tile in floor.tiles])
        self._found = np.zeros((count, 4), np.int64)
        self._named = np.zeros((count, 4), np.int64)
        self._order = SensorOrder(floor)
        self._news: deque[str] = deque(maxlen=100)
        self.feed(np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 4), np.int64), np.zeros((0, 4)))

    def feed(
        self,
        rows: NDArray[np.int64],
        time_s: NDArray[np.float64],
        readings: NDArray[np.int64],
        force_n: NDArray[np.float64],
    ) -> None:
        """The next samples: the tile's row (n,), its own time (n,), readings (n, 4) and what they are in newtons."""
        rows, readings = np.ascontiguousarray(rows), np.ascontiguousarray(readings)
        loads_n = np.empty((len(rows), 4))
        at = 0
        while True:
            at = _watch(
                rows, time_s, readings, force_n, loads_n, at, self._period, self._sensors, self._tiles, self._balance,
                self._found,
            )  # fmt: skip
            if at == len(rows):
                break
            self._name(int(rows[at - 1]), loads_n[at - 1])
        self._order.feed(rows, time_s, loads_n)
        for row, line in self._order.found():
            if not self._found[row].any():  # a sensor that is dead looks like much else
                self._news.append(f"tile {self.floor.tiles[row].id}: {line}")

    def news(self) -> list[str]:
        """What was found since the last call, one line a sensor."""
        lines = []
        while self._news:
            lines.append(self._news.popleft())
        return lines

    def _name(self, row: int, loads_n: NDArray[np.float64]) -> None:
        """Say what was found with the newest sample of a tile."""
        for sensor in range(4):
            reads = self._sensors[row, sensor, _READING]
            new = self._found[row, sensor] & ~self._named[row, sensor]
            others = loads_n.sum() - loads_n[sensor]
            falls = self._sensors[row, sensor, _FALLS]
            for fault, what in (
                (_DEAD, f"dead (reads {reads:.0f} while its neighbours carry {others:.0f} N)"),
                (_SATURATED, f"saturated (stays at {reads:.0f} while the load on its tile changes)"),
                (_LOOSE, f"loose (fell to nothing {falls:.0f} times while its tile was loaded)"),
            ):
                if new & fault and not (fault == _DEAD and self._order.is_wrong(row)):
                    self._news.append(f"tile {self.floor.tiles[row].id}: sensor {sensor + 1} is {what}")
            self._named[row, sensor] = self._found[row, sensor]


def _balance(sensors_m: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """The combination of four forces on a plane plate that is always 0: (1, -1, 1, -1) round a rectangle."""
    places = np.array([[1.0, x, y] for x, y in sensors_m]).T
    nothing = np.linalg.svd(places)[2][-1]
    return nothing / np.abs(nothing).max()


@kernel
def _watch(rows, time_s, readings, force_n, loads_n, at, period, sensors, tiles, balance, found):
    """Follow samples from number `at` on, up to one that shows something new: how many were followed in all."""
    while at < len(rows):
        k = rows[at]
        tile, mine, known = tiles[k], sensors[k], found[k].sum()
        step = time_s[at] - tile[_TIME]
        if tile[_SEEN] == 0.0 or not 0.0 < step < 2.5 * period:
            step = 0.0
        load = _weigh(tile, mine, force_n[at], loads_n[at])
        if load >= LOADED_N:
            _dead(mine, loads_n[at], load, balance[k], step, found[k])
        for j in range(4):
            _saturated(mine[j], readings[at, j], loads_n[at, j], load - loads_n[at, j], step, found[k], j)
            if step > 0.0:
                _loose(mine, force_n[at], time_s[at], j, found[k])
        tile[_TIME], tile[_SEEN] = time_s[at], 1.0
        for j in range(4):
            mine[j, _FORCE], mine[j, _READING] = force_n[at, j], readings[at, j]
        at += 1
        if found[k].sum() != known:
            break
    return at


@kernel
def _weigh(tile, mine, force_n, loads_n):
    """What a tile's sensors carry, and its sum; off contact, what they read at rest is followed."""
    load = 0.0
    for j in range(4):
        if tile[_SEEN] == 0.0:
            mine[j, _REST] = mine[j, _FORCE] = force_n[j]
        loads_n[j] = force_n[j] - mine[j, _REST]
        load += loads_n[j]
    if load < CONTACT_N:
        share = _REST_SHARE if load > -CONTACT_N else 1.0  # it was loaded when its rest was taken
        for j in range(4):
            mine[j, _REST] += share * loads_n[j]
    return load


@kernel
def _dead(mine, loads_n, load, balance, step, found):
    for j in range(4):
        plane, product, across = 0.0, 1.0, 1.0
        for i in range(4):
            if i == j:
                continue
            plane -= balance[i] * loads_n[i] / balance[j]
            if balance[i] * balance[j] < 0.0:
                product *= max(loads_n[i], 0.0)
            else:
                across = max(loads_n[i], 1.0)
        expected = min(plane, product / across)
        if abs(loads_n[j]) > ALIVE_N:
            mine[j, _SEEN_DEAD] = 0.0
        elif abs(loads_n[j]) < DEAD_N and expected > max(0.05 * (load - loads_n[j]), CONTACT_N):
            mine[j, _SEEN_DEAD] += step
            if mine[j, _SEEN_DEAD] >= DEAD_S:
                found[j] |= _DEAD


@kernel
def _saturated(sensor, reading, own, others, step, found, j):
    if reading != sensor[_READING] or step == 0.0 or own < CONTACT_N:
        sensor[_SAME] = sensor[_FLAT] = 0.0
        sensor[_BEGAN_N] = others
        return
    sensor[_SAME] += 1.0
    sensor[_FLAT] += step
    changes = abs(others - sensor[_BEGAN_N]) > max(FLAT_SHARE * max(others, sensor[_BEGAN_N]), CONTACT_N)
    if sensor[_SAME] >= FLAT_SAMPLES and sensor[_FLAT] >= FLAT_S and changes:
        found[j] |= _SATURATED


@kernel
def _loose(mine, force_n, now, j, found):
    own = mine[j]
    moved, others = force_n[j] - own[_FORCE], 0.0
    for i in range(4):
        if i != j:
            others += abs(force_n[i] - mine[i, _FORCE])
    before, after = own[_FORCE] - own[_REST], force_n[j] - own[_REST]
    if others > 0.25 * abs(moved):
        return
    if before >= FALL_N and after < 0.2 * before:
        own[_FELL], own[_FROM] = now, before
    elif now - own[_FELL] <= BACK_S and abs(before) < 0.2 * own[_FROM] and after > 0.5 * own[_FROM]:
        own[_FELL] = -np.inf
        if now - own[_FIRST] > WITHIN_S:
            own[_FALLS], own[_FIRST] = 0.0, now
        own[_FALLS] += 1.0
        if own[_FALLS] >= FALLS:
            found[j] |= _LOOSE
