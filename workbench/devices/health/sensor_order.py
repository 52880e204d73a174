"""Detection of sensors with swapped wires, from the footsteps on a tile.

Of a tile's load, let u be the imbalance along x, v that along y (each -1 to 1), and d that between the diagonals. A
load at one point gives d = 0 on a rigid plate and d = u v on a flexible one: every tile is between the two. If two
adjacent sensors are swapped, u or v is exchanged with d, which is then far from that range; undoing the exchange fits.
That leaves two pairs, which are mirror images. If two opposite sensors are swapped, everything fits, mirrored at a
diagonal.

The direction in which feet roll resolves the mirror images: from the previous tile towards the next one. This needs
walks over three tiles in a line; on a single tile two pairs are reported, and an opposite swap is not found. A tile
that is turned shows only in that direction, too, while its diagonals balance. Where all walk along one line, two
opposite sensors and a quarter of a turn look the same, and both are reported.
"""

from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.kernels import kernel

CONTACT_N, LOADED_N = 20.0, 100.0
"""Least load of a contact, and least load at which its shares are evaluated."""
CONTACTS, WELL_CONTACTS, MISFIT, BETTER = 4, 12, 0.15, 3.0
"""Least number of contacts, and of those by which all is well again; least misfit of the diagonals; least factor by
which undoing the swap improves the fit.
"""
WALKS, RIGHT, WRONG = 6, 0.75, 0.4
"""Least number of steps between two other tiles; mean cosine between roll and walking direction above which it is
right, and below which wrong.
"""
APART_S = 1.5
"""Steps further apart in seconds belong to different walks."""
STRAIGHT = 0.7
"""Least cosine between the ways to a step and from it: where somebody turns, or they are of different people, a foot
does not roll from the tile before to the next one.
"""

_TURNS = ("90 degrees counter-clockwise", "180 degrees", "90 degrees clockwise")
_PAIRS = ((0, 1), (2, 3), (1, 2), (0, 3), (0, 2), (1, 3))
_AS_IS, _TRADED_X, _TRADED_Y = 0, 1, 2
_CONTACTS = 64  # most contacts that can end in one piece of a stream

_SUMS = np.dtype(
    [
        ("on", np.bool_),
        ("arrived_s", np.float64),
        ("began_s", np.float64),
        ("newest_s", np.float64),
        ("w", np.float64),
        ("wt", np.float64),
        ("wtt", np.float64),
        ("share", np.float64, (4,)),
        ("share_t", np.float64, (4,)),
        ("contacts", np.int64),
        ("time_s", np.float64),
        ("misfit", np.float64, (3,)),
        ("misfit_squared", np.float64, (3,)),
    ],
    align=True,
)
"""Sums of a tile. Of the present contact, the arrival of its first sample, and that sample's own time; over it, of the
time above the load: time (w), time times time since it began (wt), its square (wtt), and the same of each sensor's
share. Over all contacts: their number, the time, and the misfits of the diagonals with their squares: as is, with x
exchanged, and with y exchanged.
"""

_CONTACT = np.dtype([("tile", np.int64), ("arrived_s", np.float64), ("trend", np.float64, (4,))], align=True)
"""A completed contact; `trend` is the rate of change of each sensor's share of the load, per second."""


class _Contact(Struct, frozen=True):
    row: int
    arrived_s: float
    trend: NDArray[np.float64]


class _State(NamedTuple):
    """State of a floor's tiles."""

    sums: NDArray[np.void]  # (tiles,)
    corners: NDArray[np.float64]  # (tiles, 2, 4): side of the centre on which each sensor is, along x and y
    ended: NDArray[np.void]  # contacts that ended in the last stretch


class SensorOrder:
    """Monitors whether the sensors of `floor` are where its layout says."""

    def __init__(self, floor: Floor) -> None:
        self.floor = floor
        count = len(floor.tiles)
        self._state = _State(
            sums=np.zeros(count, _SUMS),
            corners=np.array([_corners(tile.sensors_m) for tile in floor.tiles]),
            ended=np.zeros(_CONTACTS, _CONTACT),
        )
        self._centres = np.array([tile.centre_m for tile in floor.tiles])
        self._steps: deque[_Contact] = deque(maxlen=3)
        self._cosines = np.zeros((count, 1 + len(_PAIRS) + len(_TURNS)))
        self._walks = np.zeros(count, np.int64)
        self._found = np.zeros(count, np.bool_)
        self._needs_walks = np.zeros(count, np.bool_)  # whether that shows in walks only
        self._news = set[int]()  # rows of which there is evidence that was not looked at

    def feed(
        self,
        tiles: NDArray[np.int64],
        time_s: NDArray[np.float64],
        arrived_s: NDArray[np.float64],
        load_n: NDArray[np.float64],
    ) -> None:
        """Process the next samples: tile rows (n,), the tiles' own times (n,), arrivals (n,), and the sensors' loads
        (n, 4).
        """
        at = 0
        while True:
            at, ended = _follow(tiles, time_s, arrived_s, load_n, at, self._state)
            for entry in self._state.ended[:ended]:
                self._take(_Contact(int(entry["tile"]), float(entry["arrived_s"]), entry["trend"].copy()))
            if at == len(tiles):
                break

    def take_found(self) -> Iterator[tuple[int, set[int], str]]:
        """Yield tiles with swapped sensors, or turned: its row, the sensors (0 to 3), and a line; each tile once.

        One that is well again, by the contacts since, has no sensors and no line.
        """
        news, self._news = self._news, set()
        for row in sorted(news):
            contacts = self._state.sums["contacts"][row]
            if contacts < CONTACTS:
                continue
            pairs, turns = self._swapped(row)
            swapped = " or ".join(f"{a + 1} and {b + 1}" for a, b in pairs)
            found = [f"sensors {swapped} are swapped"] if pairs else []
            found += [f"it is turned by {turn}" for turn in turns]
            was_found = self._found[row]
            if found:
                self.forget(row)
                self._found[row] = True
                self._needs_walks[row] = not pairs or _axes_apart(self._state.corners[row], pairs[0]) == "xy"
                if not was_found:
                    yield row, {*range(4)} if turns else {*sum(pairs, ())}, ", or ".join(found)
            elif was_found and contacts >= WELL_CONTACTS and (not self._needs_walks[row] or self._rolls_right(row)):
                self.forget(row)
                yield row, set(), ""

    def forget(self, row: int) -> None:
        """Begin anew with a tile: what comes from now on tells whether all is well."""
        self._found[row], self._walks[row], self._cosines[row] = False, 0, 0.0
        for name in ("contacts", "time_s", "misfit", "misfit_squared"):
            self._state.sums[name][row] = 0

    def is_swapped(self, row: int) -> bool:
        """Return whether sensors of the tile at this row were found to be swapped, or the tile turned."""
        return bool(self._found[row])

    def _rolls_right(self, row: int) -> bool:
        """Return whether feet roll as they walk, by enough walks."""
        return bool(self._walks[row] >= WALKS and self._cosines[row, 0] > RIGHT * self._walks[row])

    def _take(self, contact: _Contact) -> None:
        """Process a completed contact; the previous one is now between two others."""
        self._news.add(contact.row)
        if self._steps and contact.row == self._steps[-1].row:
            self._steps.clear()
        self._steps.append(contact)
        if len(self._steps) < 3:
            return
        before, middle, behind = self._steps
        near = middle.arrived_s - before.arrived_s <= APART_S and behind.arrived_s - middle.arrived_s <= APART_S
        came, went = np.diff(self._centres[[before.row, middle.row, behind.row]], axis=0)
        if not near or came @ went < STRAIGHT * np.hypot(*came) * np.hypot(*went):
            return
        direction = came + went
        tile = self.floor.tiles[middle.row]
        rolls = []
        for pair in (None, *_PAIRS):
            trend = middle.trend.copy()
            if pair:
                trend[list(pair)] = trend[list(pair[::-1])]
            rolls.append(trend @ np.array(tile.sensors_m) @ tile.axes)
        x, y = rolls[0]
        rolls += [np.array([-y, x]), np.array([-x, -y]), np.array([y, -x])]
        sizes = np.hypot(*np.transpose(rolls)) * np.hypot(*direction)
        self._cosines[middle.row] += np.array(rolls) @ direction / np.maximum(sizes, 1e-12)
        self._walks[middle.row] += 1
        self._news.add(middle.row)

    def _swapped(self, row: int) -> tuple[list[tuple[int, int]], list[str]]:
        """Return the pairs of which one may be swapped, and the turns that the tile may have made.

        Both are empty if all is well, or if it cannot be decided.
        """
        corners, sums = self._state.corners[row], self._state.sums[row]
        if not corners.any():
            return [], []
        # The misfit of sensors with unequal gains is nearly constant; that of swapped ones varies.
        mean, square = sums["misfit"] / sums["time_s"], sums["misfit_squared"] / sums["time_s"]
        as_is, traded_x, traded_y = np.sqrt(np.maximum(square - mean * mean, 0.0))
        walked = self._walks[row] >= WALKS
        cosines = self._cosines[row] / max(self._walks[row], 1)
        axes = ""
        if as_is > MISFIT and as_is > BETTER * traded_x and traded_y > BETTER * traded_x:
            axes = "x"
        elif as_is > MISFIT and as_is > BETTER * traded_y and traded_x > BETTER * traded_y:
            axes = "y"
        elif as_is > min(traded_x, traded_y) or not walked or cosines[0] >= WRONG:
            return [], []  # where an exchange of neighbours fits better, it may be that; it rolls as a turned tile can
        possible = [pair for pair in _PAIRS if _axes_apart(corners, pair) == (axes or "xy")]
        right = dict(zip((*_PAIRS, *_TURNS), cosines[1:] > RIGHT, strict=True))
        pairs = [pair for pair in possible if walked and right[pair]]
        if axes:
            return pairs or possible, []
        return pairs, [turn for turn in _TURNS if right[turn]]


def _corners(sensors_m: tuple[tuple[float, float], ...]) -> NDArray[np.float64]:
    """Return each sensor's side of the centre along x and y: (2, 4); zeros if they are not in corners."""
    places = np.array(sensors_m).T
    sides = np.sign(places - places.mean(axis=1, keepdims=True))
    return sides if len({*map(tuple, sides.T)} - {(0.0, 0.0)}) == 4 and sides.all() else np.zeros((2, 4))


def _axes_apart(corners: NDArray[np.float64], pair: tuple[int, int]) -> str:
    """Return the axes along which two sensors are apart: "x", "y" or "xy"."""
    apart = corners[:, pair[0]] != corners[:, pair[1]]
    return ("x" if apart[0] else "") + ("y" if apart[1] else "")


@kernel
def _follow(
    tiles: NDArray[np.int64],
    time_s: NDArray[np.float64],
    arrived_s: NDArray[np.float64],
    load_n: NDArray[np.float64],
    first: int,
    state: _State,
) -> tuple[int, int]:
    """Process samples from number `first` on; return how many were processed in all, and how many contacts ended."""
    at, count = first, 0
    while at < len(tiles) and count < len(state.ended):
        k, now_s = tiles[at], time_s[at]
        sums = state.sums[k]
        total_n = 0.0
        for j in range(4):
            total_n += load_n[at, j]
        if total_n >= CONTACT_N:
            if not sums.on:
                _begin(sums, now_s, arrived_s[at])
            step_s = now_s - sums.newest_s
            sums.newest_s = now_s
            if total_n >= LOADED_N and 0.0 < step_s < 0.04:
                _add(sums, state.corners[k], load_n[at], total_n, now_s - sums.began_s, step_s)
        elif sums.on:
            sums.on = False
            spread = sums.w * sums.wtt - sums.wt * sums.wt
            if sums.w > 0.1 and spread > 0.0:
                sums.contacts += 1
                entry = state.ended[count]
                entry.tile, entry.arrived_s = k, sums.arrived_s
                for j in range(4):
                    entry.trend[j] = (sums.w * sums.share_t[j] - sums.wt * sums.share[j]) / spread
                count += 1
        at += 1
    return at, count


@kernel
def _begin(sums: np.record, now_s: float, arrived_s: float) -> None:
    """Begin a contact."""
    sums.on = True
    sums.arrived_s = arrived_s
    sums.began_s = sums.newest_s = now_s
    sums.w = sums.wt = sums.wtt = 0.0
    for j in range(4):
        sums.share[j] = sums.share_t[j] = 0.0


@kernel
def _add(
    sums: np.record,
    corners: NDArray[np.float64],
    load_n: NDArray[np.float64],
    total_n: float,
    time_s: float,
    step_s: float,
) -> None:
    """Add a sample of a contact, `time_s` after its beginning, to the sums."""
    u, v, d = 0.0, 0.0, 0.0
    sums.w += step_s
    sums.wt += step_s * time_s
    sums.wtt += step_s * time_s * time_s
    for j in range(4):
        share = load_n[j] / total_n
        u += corners[0, j] * share
        v += corners[1, j] * share
        d += corners[0, j] * corners[1, j] * share
        sums.share[j] += step_s * share
        sums.share_t[j] += step_s * time_s * share
    sums.time_s += step_s
    _add_misfit(sums, _AS_IS, _beyond(d, u * v), step_s)
    _add_misfit(sums, _TRADED_X, _beyond(u, d * v), step_s)
    _add_misfit(sums, _TRADED_Y, _beyond(v, d * u), step_s)


@kernel
def _add_misfit(sums: np.record, kind: int, misfit: float, step_s: float) -> None:
    sums.misfit[kind] += step_s * misfit
    sums.misfit_squared[kind] += step_s * misfit * misfit


@kernel
def _beyond(value: float, end: float) -> float:
    """Return the distance of a value from the range between 0 and `end`."""
    return value - min(max(value, min(end, 0.0)), max(end, 0.0))
