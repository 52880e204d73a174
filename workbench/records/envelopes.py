"""Minimum and maximum of a recording's signals in bins, so that hours can be drawn without reading all samples.

They lie in a table beside the samples, written with them, at two levels: bins of 10 ms, and one for each block of
some 0.05 s. For a recording of an earlier version `records.survey` makes the same table in the cache folder.
"""

import json
import sqlite3
from functools import lru_cache

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple
from numpy.typing import NDArray

from underfoot.floor.tracking import TARE_N

SOURCES = ("force", "commanded", "measured")
"""The tables of a recording that have envelopes. Those of force are loads of tiles, and behind them their sum."""
FINE_FRAMES = 480
"""The length of a fine bin: 10 ms at the usual rate."""
FINE, COARSE = 0, 1
"""Levels: bins of `FINE_FRAMES`, and whole blocks."""
MOST_VALUES = 1 << 23
"""Most minima of an overview: 8 h of four tiles have a bin for every block, of 144 tiles one every 0.8 s."""
TABLE = """
create table if not exists envelope (
  source text not null, level integer not null, first integer not null, count integer not null, bin integer not null,
  tiles text not null, low blob not null, high blob not null, primary key (source, level, first)
) without rowid;
"""
_QUIET_SHARE, _LOWER_SHARE = 1.0, 10.0
"""Percentiles: of the bins in which a load varies least, and of their loads, for some stand on a tile as quietly."""
_PIECE = 4096  # blocks that are read at once
_PUT = "insert or replace into envelope values (?, ?, ?, ?, ?, ?, ?, ?)"


class Envelope(Struct, frozen=True):
    """Bins in order of time: each from session frame `begin` to before `end` (n,), with the least and the most of
    every column, float32 (n, columns)."""

    begin: NDArray[np.float64]
    end: NDArray[np.float64]
    low: NDArray[np.float32]
    high: NDArray[np.float32]

    def __len__(self) -> int:
        return len(self.begin)

    def between(self, edges: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return minimum and maximum between successive `edges` (m + 1,), in session frames: two arrays (m, columns),
        NaN in gaps.

        >>> values = np.arange(8, dtype=np.float32)[:, None]
        >>> eight = Envelope(np.arange(8.0), np.arange(1.0, 9.0), values, values)
        >>> low, high = eight.between(np.array([0.0, 4.0, 8.0, 12.0]))
        >>> low[:, 0], high[:, 0]
        (array([ 0.,  4., nan], dtype=float32), array([ 3.,  7., nan], dtype=float32))
        """
        return self._reduced(edges, self.low, np.fmin), self.most(edges)

    def most(self, edges: NDArray[np.float64]) -> NDArray[np.float32]:
        """Return the maximum between successive `edges`, as in `between`."""
        return self._reduced(edges, self.high, np.fmax)

    def coarser(self, factor: int) -> "Envelope":
        """Return these bins, merged by `factor`; none reaches across a gap longer than the bin before it.

        >>> values = np.zeros((4, 1), np.float32)
        >>> four = Envelope(np.array([0.0, 1.0, 9.0, 10.0]), np.array([1.0, 2.0, 10.0, 11.0]), values, values)
        >>> four.coarser(4).begin, four.coarser(4).end
        (array([0., 9.]), array([ 2., 11.]))
        """
        if not len(self):
            return self
        is_after_gap = self.begin[1:] - self.end[:-1] > self.end[:-1] - self.begin[:-1]
        first = np.union1d(np.arange(0, len(self), factor), 1 + np.flatnonzero(is_after_gap))
        last = np.append(first[1:], len(self)) - 1
        low, high = np.fmin.reduceat(self.low, first, axis=0), np.fmax.reduceat(self.high, first, axis=0)
        return Envelope(self.begin[first], self.end[last], low, high)

    def column(self, number: int) -> "Envelope":
        """Return one column."""
        chosen = slice(number, number + 1)
        return Envelope(self.begin, self.end, self.low[:, chosen], self.high[:, chosen])

    def _reduced(
        self, edges: NDArray[np.float64], values: NDArray[np.float32], reduce: np.ufunc
    ) -> NDArray[np.float32]:
        after = np.searchsorted(self.end, edges[:-1], side="right")
        before = np.searchsorted(self.begin, edges[1:], side="left")
        out = np.full((len(after), values.shape[1]), np.nan, np.float32)
        some = before > after
        if some.any():
            # Pairs of first and behind the last: every other stretch is what lies between, and is not wanted.
            pairs = np.column_stack([after[some], before[some]]).ravel()
            padded = values if pairs[-1] < len(values) else np.concatenate([values, values[-1:]])
            low, high = int(pairs.min()), int(pairs.max())
            out[some] = reduce.reduceat(padded[low : high + 1], pairs - low, axis=0)[::2]
        return out


def empty(columns: int) -> Envelope:
    """Return an envelope without bins, with this number of columns."""
    nothing = np.zeros((0, columns), np.float32)
    return Envelope(np.zeros(0), np.zeros(0), nothing, nothing)


def of_samples(begin: NDArray[np.float64], period: float, values: NDArray[np.float32]) -> Envelope:
    """Return samples (n, columns) from session frame `begin` on, one bin each."""
    return Envelope(begin, begin + period, values, values)


def loads(corners: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return each tile's load and then their sum, (n, tiles + 1), from corner forces (n, 4 tiles), not tared."""
    tiles = corners.reshape(len(corners), corners.shape[1] // 4, 4).sum(axis=2)
    return np.column_stack([tiles, np.nansum(tiles, axis=1)]).astype(np.float32)


def resting_n(force: Envelope) -> NDArray[np.float32]:
    """Return the unloaded reading of each column in N: what it reads while it varies least, and 0 if that is no tare.

    Where people walk all the time, a tile is unloaded for a few hundredths of it.
    """
    rest = np.zeros(force.low.shape[1], np.float32)
    for column in range(len(rest)):
        low, high = force.low[:, column], force.high[:, column]
        seen = np.isfinite(low) & np.isfinite(high)
        if seen.any():
            middle, spread = 0.5 * (low + high)[seen], (high - low)[seen]
            quiet = spread <= 2.0 * np.percentile(spread, _QUIET_SHARE)
            rest[column] = np.percentile(middle[quiet], _LOWER_SHARE)
    return np.where(rest > TARE_N, np.float32(0.0), rest)


def put(base: sqlite3.Connection, source: str, first: int, values: NDArray[np.float32], frames: float) -> None:
    """Write the envelopes of a block: `values` (n, columns), a row every `frames` frames from session frame `first`
    on. Columns in which nothing moved are left out."""
    size = max(1, round(FINE_FRAMES / frames))
    moving = np.flatnonzero(values.any(axis=0))
    kept, count = np.ascontiguousarray(values[:, moving]), max(1, round(len(values) * frames))
    said = json.dumps(moving.tolist(), separators=(",", ":"))
    for level, step in ((FINE, size), (COARSE, len(kept))):
        at = np.arange(0, len(kept), step)
        low, high = np.fmin.reduceat(kept, at, axis=0), np.fmax.reduceat(kept, at, axis=0)
        bin = max(1, round(step * frames))
        base.execute(_PUT, (source, level, first, count, bin, said, low.tobytes(), high.tobytes()))


def remove(base: sqlite3.Connection, source: str, begin: int, end: int) -> None:
    """Remove the envelopes of a source's blocks that begin from one session frame to before another."""
    where = "source = ? and level in (?, ?) and first >= ? and first < ?"  # by its key: it may be hours
    base.execute(f"delete from envelope where {where}", (source, FINE, COARSE, begin, end))


def read(
    base: sqlite3.Connection, source: str, level: int, columns: int, begin: float = -1e18, end: float = 1e18
) -> Envelope:
    """Return the bins of a source with `columns` columns, in blocks between two session frames."""
    (before,) = base.execute(
        "select max(first) from envelope where source = ? and level = ? and first <= ?", (source, level, begin)
    ).fetchone()
    rows = base.execute(
        "select first, count, bin, tiles, low, high from envelope "
        "where source = ? and level = ? and first >= ? and first < ? order by first",
        (source, level, begin if before is None else before, end),
    ).fetchall()
    rows = [row for row in rows if row[0] + row[1] > begin]
    if not rows:
        return empty(columns)
    first, count, bin = (np.array(column, np.float64) for column in list(zip(*rows, strict=True))[:3])
    bins = np.array([len(low) // (4 * len(_tiles(said))) if said != "[]" else 1 for *_, said, low, _ in rows])
    starts = np.cumsum(bins) - bins
    inside = np.arange(bins.sum()) - np.repeat(starts, bins)
    at = np.repeat(first, bins) + np.repeat(np.where(bins > 1, bin, count), bins) * inside
    behind = np.minimum(at + np.repeat(np.where(bins > 1, bin, count), bins), np.repeat(first + count, bins))
    least, most = (np.zeros((len(at), columns), np.float32) for _ in range(2))
    alike: dict[str, list[int]] = {}
    for number, row in enumerate(rows):
        alike.setdefault(row[3], []).append(number)
    for said, numbers in alike.items():
        tiles = _tiles(said)
        if len(tiles):
            places = np.concatenate([np.arange(starts[k], starts[k] + bins[k]) for k in numbers])
            for whole, column in ((least, 4), (most, 5)):
                data = np.frombuffer(b"".join(rows[k][column] for k in numbers), "<f4")
                whole[places[:, None], tiles] = data.reshape(-1, len(tiles))
    return Envelope(at, behind, least, most)


def read_overview(base: sqlite3.Connection, source: str, known: Envelope) -> Envelope:
    """Return the bins that are `known`, and behind them one for every block of a source that was added since.

    Bins are merged where all of them would not fit into memory.
    """
    parts, columns = [known], known.low.shape[1]
    factor, begin, end = 1, known.end[-1] if len(known) else -1e18, 0.0
    while end < 1e18:
        behind = base.execute(
            "select first from envelope where source = ? and level = ? and first > ? order by first limit 1 offset ?",
            (source, COARSE, begin, _PIECE),
        ).fetchone()
        end = float(behind[0]) if behind else 1e18
        parts.append(read(base, source, COARSE, columns, begin, end).coarser(factor))
        if sum(len(part) for part in parts) * columns > MOST_VALUES:
            parts, factor = [_joined(parts).coarser(2)], 2 * factor
        begin = end
    return _joined(parts)


def _joined(parts: list[Envelope]) -> Envelope:
    begin, end, low, high = (np.concatenate(column) for column in zip(*map(astuple, parts), strict=True))
    return Envelope(begin, end, low, high)


def end_of(base: sqlite3.Connection, source: str) -> int:
    """Return the session frame after a source's last block with an envelope; a number below all frames if there is
    none.
    """
    ask = "select first + count from envelope where source = ? and level = ? order by first desc limit 1"
    last = base.execute(ask, (source, COARSE)).fetchone()
    return int(last[0]) if last else -(1 << 62)


@lru_cache(maxsize=4096)
def _tiles(said: str) -> NDArray[np.intp]:
    return np.array(json.loads(said), np.intp)
