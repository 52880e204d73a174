"""Sensors whose wires are exchanged, told from the footsteps on a tile.

Of a tile's load, let u be the share that lies along x, v that along y (each -1 to 1), and d what one diagonal carries
more than the other. A load at one point of a plate gives d = 0 where the plate is stiff, d = u v where it gives way:
between the two lies every tile. Exchange two sensors beside each other, and u or v trades places with d, which then
lies far from there while the trade undone fits. That leaves two pairs, which mirror each other; exchange two sensors
across from each other, and all fits, mirrored at a diagonal.

What is mirrored is told by the way that feet roll: from the tile before towards the tile behind. So it takes walks over
three tiles; on a tile of its own a pair of pairs is named, and an exchange across is not found.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.kernels import kernel

CONTACT_N, LOADED_N = 20.0, 100.0
"""A contact lasts while a tile carries the one; its shares are taken above the other."""
CONTACTS, MISFIT, BETTER = 4, 0.15, 3.0
"""From so many contacts on; the diagonals must be so far off, and the exchange undone so many times better."""
WALKS, RIGHT, WRONG = 6, 0.75, 0.4
"""From so many steps between two other tiles on; the mean cosine between roll and way if right, and if not."""
APART_S = 1.5
"""Steps further apart are of different walks."""

_EXCHANGES = ((0, 1), (2, 3), (1, 2), (0, 3), (0, 2), (1, 3))
# Sums over a contact: its beginning, its newest time, time above the load, time times time, shares, time times shares;
# and over all contacts: how many, time, and misfits and their squares, as it is, with x traded, and with y traded.
_SINCE, _NEWEST, _W, _WT, _WTT, _S, _ST, _ON, _KNOWN = 0, 1, 2, 3, 4, 5, 9, 13, 14
_COUNT, _TIME, _AS_IS, _TRADED_X, _TRADED_Y, _TILE = 14, 15, 16, 18, 20, 22
_ROW, _BEGAN, _ENDED, _TREND, _CONTACT = 0, 1, 2, 3, 7


@dataclass(frozen=True)
class _Contact:
    row: int
    began_s: float
    ended_s: float
    trend: NDArray[np.float64]
    """How each sensor's share of the load changes in a second."""


class SensorOrder:
    """Watches whether the sensors of `floor` stand where they are said to stand."""

    def __init__(self, floor: Floor) -> None:
        self.floor = floor
        count = len(floor.tiles)
        self._corners = np.array([_corners(tile.sensors_m) for tile in floor.tiles])
        self._centres = np.array([tile.centre_m for tile in floor.tiles])
        self._sums = np.zeros((count, _TILE))
        self._ended = np.zeros((64, _CONTACT))
        self._steps: deque[_Contact] = deque(maxlen=3)
        self._cosines = np.zeros((count, 1 + len(_EXCHANGES)))
        self._walks = np.zeros(count, np.int64)
        self._told = np.zeros(count, np.bool_)

    def feed(self, rows: NDArray[np.int64], time_s: NDArray[np.float64], loads_n: NDArray[np.float64]) -> None:
        """The next samples: the tile's row (n,), its own time (n,), and what its sensors carry (n, 4)."""
        at = 0
        while True:
            at, ended = _follow(rows, time_s, loads_n, at, self._sums, self._corners, self._ended)
            for entry in self._ended[:ended]:
                self._take(_Contact(int(entry[_ROW]), entry[_BEGAN], entry[_ENDED], entry[_TREND:].copy()))
            if at == len(rows):
                break

    def found(self) -> Iterator[tuple[int, str]]:
        """Tiles whose sensors are exchanged, and which: each once."""
        for row in np.flatnonzero(~self._told & (self._sums[:, _COUNT] >= CONTACTS)):
            pairs = self._exchanged(int(row))
            if pairs:
                self._told[row] = True
                names = " or ".join(f"{a + 1} and {b + 1}" for a, b in pairs)
                yield int(row), f"sensors {names} are swapped"

    def is_wrong(self, row: int) -> bool:
        """Whether the sensors of a tile were found to be exchanged."""
        return bool(self._told[row])

    def _take(self, contact: _Contact) -> None:
        """A contact that is over; the one before it lies between two others by now."""
        if self._steps and contact.row == self._steps[-1].row:
            self._steps.clear()
        self._steps.append(contact)
        if len(self._steps) < 3:
            return
        before, middle, behind = self._steps
        near = middle.began_s - before.began_s <= APART_S and behind.began_s - middle.began_s <= APART_S
        way = self._centres[behind.row] - self._centres[before.row]
        if not near or np.hypot(*way) < 0.1:
            return
        tile = self.floor.tiles[middle.row]
        cosines = []
        for pair in (None, *_EXCHANGES):
            trend = middle.trend.copy()
            if pair:
                trend[list(pair)] = trend[list(pair[::-1])]
            roll = trend @ np.array(tile.sensors_m) @ tile.axes
            cosines.append(float(roll @ way) / max(float(np.hypot(*roll) * np.hypot(*way)), 1e-12))
        self._cosines[middle.row] += cosines
        self._walks[middle.row] += 1

    def _exchanged(self, row: int) -> list[tuple[int, int]]:
        """The pairs of which one must be exchanged; none where all is well, or where it is open."""
        corners = self._corners[row]
        if not corners.any():
            return []
        # Sensors of unlike gain are off by much the same all the time; what is exchanged wanders.
        mean, square = (self._sums[row, _AS_IS:].reshape(3, 2) / self._sums[row, _TIME]).T
        as_is, along, across = np.sqrt(np.maximum(square - mean * mean, 0.0))
        walked = self._walks[row] >= WALKS
        cosines = self._cosines[row] / max(self._walks[row], 1)
        kinds = [_kind(corners, pair) for pair in _EXCHANGES]
        traded = ""
        if as_is > MISFIT and as_is > BETTER * along and across > BETTER * along:
            traded = "x"
        elif as_is > MISFIT and as_is > BETTER * across and along > BETTER * across:
            traded = "y"
        elif not walked:
            return []
        possible = [i for i, kind in enumerate(kinds) if kind == (traded or "xy")]
        if not walked:
            return [_EXCHANGES[i] for i in possible]
        best = max(possible, key=lambda i: cosines[1 + i])
        if traded:
            clear = cosines[1 + best] > RIGHT
            return [_EXCHANGES[best]] if clear else [_EXCHANGES[i] for i in possible]
        return [_EXCHANGES[best]] if cosines[1 + best] > RIGHT and cosines[0] < WRONG else []


def _corners(sensors_m: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """On which side of the middle each sensor lies, along x and y: (2, 4); zeros where they do not stand in corners."""
    places = np.array(sensors_m).T
    sides = np.sign(places - places.mean(axis=1, keepdims=True))
    return sides if len({*map(tuple, sides.T)} - {(0.0, 0.0)}) == 4 and sides.all() else np.zeros((2, 4))


def _kind(corners: NDArray[np.float64], pair: tuple[int, int]) -> str:
    """Along which axes two sensors lie apart: "x", "y" or "xy"."""
    apart = corners[:, pair[0]] != corners[:, pair[1]]
    return ("x" if apart[0] else "") + ("y" if apart[1] else "")


@kernel
def _follow(rows, time_s, loads_n, at, tiles, corners, ended):
    """Follow samples from number `at` on: how many were followed in all, and how many contacts ended meanwhile."""
    count = 0
    while at < len(rows) and count < len(ended):
        k = rows[at]
        sums, now = tiles[k], time_s[at]
        load = 0.0
        for j in range(4):
            load += loads_n[at, j]
        if load >= CONTACT_N:
            if sums[_ON] == 0.0:
                sums[:_KNOWN] = 0.0
                sums[_SINCE] = sums[_NEWEST] = now
                sums[_ON] = 1.0
            step = now - sums[_NEWEST]
            sums[_NEWEST] = now
            if load >= LOADED_N and 0.0 < step < 0.04:
                _add(sums, corners[k], loads_n[at], load, now - sums[_SINCE], step)
        elif sums[_ON] == 1.0:
            sums[_ON] = 0.0
            spread = sums[_W] * sums[_WTT] - sums[_WT] * sums[_WT]
            if sums[_W] > 0.1 and spread > 0.0:
                sums[_COUNT] += 1.0
                entry = ended[count]
                entry[_ROW], entry[_BEGAN], entry[_ENDED] = k, sums[_SINCE], sums[_NEWEST]
                for j in range(4):
                    entry[_TREND + j] = (sums[_W] * sums[_ST + j] - sums[_WT] * sums[_S + j]) / spread
                count += 1
        at += 1
    return at, count


@kernel
def _add(sums, corners, loads_n, load, time_s, step):
    u, v, d = 0.0, 0.0, 0.0
    sums[_W] += step
    sums[_WT] += step * time_s
    sums[_WTT] += step * time_s * time_s
    for j in range(4):
        share = loads_n[j] / load
        u += corners[0, j] * share
        v += corners[1, j] * share
        d += corners[0, j] * corners[1, j] * share
        sums[_S + j] += step * share
        sums[_ST + j] += step * time_s * share
    sums[_TIME] += step
    _note(sums, _AS_IS, _beyond(d, u * v), step)
    _note(sums, _TRADED_X, _beyond(u, d * v), step)
    _note(sums, _TRADED_Y, _beyond(v, d * u), step)


@kernel
def _note(sums, kind, misfit, step):
    sums[kind] += step * misfit
    sums[kind + 1] += step * misfit * misfit


@kernel
def _beyond(value, end):
    """How far a value is from the stretch between 0 and `end`."""
    return value - min(max(value, min(end, 0.0)), max(end, 0.0))
