"""Faults of tiles that show in their frames: wrong numbers, times or rates, and frames that are lost or damaged.

Shares are found over the last minute. Over all frames since the start, a fault that begins after a day would take hours
to show, or days. What is said is the share of the newest frames, where that is larger: of a fault that begins late, the
minute has seen the first seconds only.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.framing.parser import WINDOW, Parser
from underfoot.floor.layout import Floor
from underfoot.quantities import counted

FRAMES = 1000
"""Fewest frames of which shares are told."""
LATELY_S, RESTARTS_S = 60.0, 3600.0
"""Time of which shares are told, and the restarts of a tile; half of it at least."""
_NEWEST_S = 5.0  # of which the share is said, half of it at least
_WRONG_RATE = 0.1
_STRANGE = 10  # times as many frames of strangers as of its own: it has no address of its own
_MUCH, _OFTEN = 0.05, 3  # share of a tile's frames, and number of its restarts, from which it is named


class _Fault(NamedTuple):
    """A present fault: its name, and the line that reports it; for one of a share of frames, this share, and the one in
    the line."""

    name: str
    line: str
    share: float = 0.0
    said: float = 0.0


class _Named(NamedTuple):
    """A reported fault of a tile: the share of frames in the report, and when the fault was last there."""

    share: float
    seen_s: float


class FrameFaults:
    """Faults of the tiles of `floor`, which should send `rate_hz` samples a second, in what `parser` read of `line`.

    `doubt` is the transport's, of frames that are corrupted.
    """

    def __init__(self, parser: Parser, floor: Floor, rate_hz: float, line: str, doubt: str) -> None:
        self._parser, self._floor, self._rate_hz, self._line, self._doubt = parser, floor, rate_hz, line, doubt
        self._frames, self._restarts, self._all = _Lately(LATELY_S), _Lately(RESTARTS_S), _Lately(LATELY_S)
        self._newest, self._newest_of_all = _Lately(_NEWEST_S), _Lately(_NEWEST_S)
        self._named = dict[tuple[str, int], _Named]()
        self._named_s = dict[str, float]()

    def take_notices(self, now_s: float) -> list[str]:
        """Return a line for each fault that is new on some tile at `now_s`; other tiles with it are named in the line.

        A fault of a tile is named again if its share has doubled, or after an hour without it. The next tiles with it
        are named a minute later at the soonest.
        """
        self._named = {key: one for key, one in self._named.items() if now_s - one.seen_s < RESTARTS_S}
        found = dict[str, list[tuple[int, _Fault]]]()
        for row, fault in self._found(now_s):
            known = self._named.get((fault.name, row))
            if known is not None:
                self._named[fault.name, row] = known = known._replace(seen_s=now_s)
            is_new = known is None or fault.share > 2.0 * known.share
            if is_new and now_s - self._named_s.get(fault.name, -np.inf) >= LATELY_S:
                found.setdefault(fault.name, []).append((row, fault))
        for name, tiles in found.items():
            self._named_s[name] = now_s
            self._named.update(((name, row), _Named(fault.said, now_s)) for row, fault in tiles)
        return [tiles[0][1].line + self._others([row for row, _ in tiles[1:]]) for tiles in found.values()]

    def _others(self, rows: list[int]) -> str:
        return f"; likewise {', '.join(self._floor.ids[row] for row in rows)}" if rows else ""

    def _found(self, now_s: float) -> Iterator[tuple[int, _Fault]]:
        """Yield each fault that is there, with the tile's row, 0 for the whole line's."""
        counts = self._parser.counts
        both = np.array([counts.accepted, counts.corrupted])
        (accepted, corrupted), newest = self._all.since(both, now_s), self._newest_of_all.since(both, now_s)
        if accepted + corrupted >= FRAMES and corrupted > _MUCH * (accepted + corrupted):
            share, said = _shares(corrupted, accepted, newest[1], newest[0])
            words = f"{self._line}: {said:.0%} of the frames are corrupted; {self._doubt}"
            yield 0, _Fault("corrupted", words, share, said)
        totals = self._parser.tile_counts(len(self._floor.tiles))
        restarts = self._restarts.since(totals[:, -1], now_s)
        tiles = zip(self._frames.since(totals, now_s), self._newest.since(totals, now_s), strict=True)
        for row, (lately, newest) in enumerate(tiles):
            yield from ((row, one) for one in self._of_tile(row, lately.tolist(), newest.tolist(), int(restarts[row])))

    def _of_tile(self, row: int, lately: list[int], newest: list[int], restarts: int) -> Iterator[_Fault]:
        """Yield the faults of a tile, from its counts in `LATELY_S`, the newest, and its `restarts` in `RESTARTS_S`."""
        accepted, missed, refused, foreign, began = lately
        parser, tile = self._parser, f"tile {self._floor.ids[row]}"
        period_us = parser.period_us(row)
        is_out_of_order = refused > WINDOW + 4 * accepted
        falls = accepted >= WINDOW and 2 * began > accepted
        if is_out_of_order:
            yield _Fault("order", f"{tile} sends frame numbers that do not rise, so its frames are taken for old ones")
        elif parser.stands_still(row):
            yield _Fault("still", f"{tile} sends the same microseconds in all frames, so its samples have no time")
        elif falls:
            words = f"{tile} sends microseconds that fall from frame to frame, so its samples have no time"
            yield _Fault("falls", words)
        elif accepted >= FRAMES and missed == 0 and parser.only_leaps(row):
            rise = "and must rise by 1 with each of its samples; are their bytes swapped?"
            yield _Fault("leaps", f"{tile} sends frame numbers that leap by {WINDOW} or more, {rise}")
        elif period_us > 0 and abs(period_us * 1e-6 * self._rate_hz - 1.0) > _WRONG_RATE:
            sends = f"{tile} sends {1e6 / period_us:.0f} samples a second by its microseconds"
            yield _Fault("rate", f"{sends}, not {self._rate_hz:.0f}")
        if foreign > 2 * FRAMES and foreign > _STRANGE * accepted and not parser.is_contested(row):
            must = "address and port from which it sends must stay the same"
            yield _Fault("ports", f"{tile}: nearly all of its frames are left out: {must}")
        if restarts >= _OFTEN and not falls and ("falls", row) not in self._named:
            steady = "is its power steady, and do its numbers go up to 65535, its microseconds to 4294967295?"
            yield _Fault("restarts", f"{tile} began anew {counted(restarts, 'time')}; {steady}")
        elif missed + accepted + refused < FRAMES:
            return
        elif missed > _MUCH * (missed + accepted):
            rise = "which must rise by 1 with each of its samples"
            share, said = _shares(missed, accepted, newest[1], newest[0])
            yield _Fault("lost", f"{tile}: {said:.0%} of its frames are lost, by their numbers, {rise}", share, said)
        elif refused > _MUCH * (accepted + refused) and not is_out_of_order:
            why = f"their numbers are not new; are they sent twice, or by others as tile {row}?"
            share, said = _shares(refused, accepted, newest[2], newest[0])
            yield _Fault("refused", f"{tile}: {said:.0%} of its frames are left out: {why}", share, said)


def _shares(bad: int, good: int, newest_bad: int, newest_good: int) -> tuple[float, float]:
    """Return the share of bad frames lately, and the one to say.

    >>> _shares(7, 93, 3, 6), _shares(7, 93, 0, 0)
    ((0.07, 0.3333333333333333), (0.07, 0.07))
    """
    share = bad / (bad + good)
    return share, max(share, newest_bad / max(newest_bad + newest_good, 1))


class _Lately:
    """Counts of the last `length_s`, half of it at least, from counts since the start."""

    def __init__(self, length_s: float) -> None:
        self._before = self._next = np.zeros(1, np.int64)
        self._half_s, self._began_s = 0.5 * length_s, np.inf

    def since(self, totals: NDArray[np.int64], now_s: float) -> NDArray[np.int64]:
        """Return the counts lately, of these `totals` at `now_s`."""
        self._began_s = min(self._began_s, now_s)
        if now_s - self._began_s >= self._half_s:
            self._before, self._next, self._began_s = self._next, totals, now_s
        return totals - self._before
