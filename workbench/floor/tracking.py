"""Kernels that follow the load on each tile: thresholds, beginnings and ends, centroids, by the rules of `contacts.py`.

Samples are processed one by one, so that the result does not depend on how a stream is split into chunks. All state is
in a `TrackerMemory`; `baselines.py` keeps what an empty tile reads.
"""

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from underfoot.array_tables import arrays_at
from underfoot.floor.baselines import (
    forget_quiet,
    noise_n,
    renew_now,
    store_thinned,
    update_baselines,
    weigh,
)
from underfoot.floor.tracker_memory import BEGAN, ENDED, TrackerMemory
from underfoot.kernels import Floats, callback, kernel

if TYPE_CHECKING:
    from numba.core.ccallback import CFunc


ON_N, ON_SIGMAS, OFF_SHARE = 20.0, 5.0, 0.5
"""A contact begins at the larger of `ON_N` and `ON_SIGMAS` times the noise, and ends below `OFF_SHARE` of that."""

BLIP_S = 0.05
"""A contact shorter than this does not end a quiet stretch: it may be noise that is larger than estimated so far."""

TARE_N, SETTLED_S, SETTLED_N, NEGATIVE_S = 100.0, 0.5, 10.0, 0.1
"""No tare exceeds `TARE_N`. On an untared tile a load within `SETTLED_N` for `SETTLED_S` is steady; one below minus the
on-threshold for `NEGATIVE_S` is not real."""


def follow(memory: TrackerMemory, where: NDArray[np.int64], count: int) -> tuple[int, int]:
    """Follow the first `count` samples; return how many rows and events were written.

    `where` has the memory's `array_tables.addresses`.
    """
    from underfoot.compilation import IS_DISABLED

    if IS_DISABLED:
        _follow(memory, 0, count)
    else:
        following().ctypes(where.ctypes.data, 0, count)
    return int(memory.stream[0]["rows"]), int(memory.stream[0]["events"])


@cache
def following() -> "CFunc":
    """Return the compiled `_follow`, which the engine's intake calls by its address, sample by sample.

    Compiled into its callers, it would take a tenth of the first start again.
    """
    return callback("void(int64, int64, int64)", _follow_at)


def _follow_at(where: int, begin: int, end: int) -> None:
    _follow(_memory_at(where), begin, end)


_memory_at = arrays_at(TrackerMemory)


@kernel
def _follow(memory: TrackerMemory, begin: int, end: int) -> None:
    """Follow the samples `begin` to `end`; write rows and events from the first place on.

    A gap ends a contact, and may begin the next: of all tiles, or of one whose sample is not finite.
    """
    written, happened = 0, 0
    plates, tiles, ring, rows, force_n = memory.plates, memory.tiles, memory.ring, memory.rows, memory.force_n
    stream = memory.stream[0]
    for i in range(begin, end):
        now_s = memory.time_s[i]
        pause = stream.count > 0 and now_s - stream.time_s > stream.gap_s
        take = stream.count % stream.every == 0
        place = stream.taken % ring.shape[1]
        for k in range(len(tiles)):
            tile = tiles[k]
            before_n = tile.load_n
            weigh(tile, force_n[i, k])
            if take:
                store_thinned(tile, ring[k, place], force_n[i, k])
            lost = not math.isfinite(tile.load_n)
            gap = pause or lost or tile.silent
            tile.silent = lost
            if lost:
                tile.load_n = 0.0
                forget_quiet(memory, k)
            if tile.on:  # does the contact end?
                settled = not gap and _is_settled(tile, now_s)
                if gap or settled or tile.load_n < tile.off_n:
                    happened = _end(memory, k, tile.steady_s if settled else stream.time_s, gap, happened)
                    if settled:
                        renew_now(memory, k, take)
                elif now_s - tile.onset_s >= BLIP_S:  # a foot
                    tile.quiet = 0
            if not tile.on:  # does one begin?
                on_n = ON_N
                if not abs(tile.load_n) < ON_N:  # only then the noise matters
                    on_n = max(ON_N, ON_SIGMAS * noise_n(memory, k))
                if tile.load_n >= on_n:
                    happened = _begin(memory, k, now_s, before_n, on_n, gap, happened)
                elif not lost and tile.load_n <= -on_n:
                    _renew_if_negative(memory, k, now_s, take)
                elif not lost:  # most samples: passing all memory to a function would cost more than all else
                    tile.negative_s = math.nan
                    tile.counts = take
            if tile.on:
                tile.counts = take and tile.quiet > 0  # no gap in the quiet samples, if this is noise and no foot
                _locate(tile, plates[k], force_n[i, k])
        if take:
            update_baselines(memory)
        written = _write_rows(tiles, stream, now_s, rows, written)
        stream.taken += 1 if take else 0
        stream.count += 1
        stream.time_s = now_s
    stream.rows, stream.events = written, happened


@kernel
def join(
    rows: NDArray[np.void],
    feet: NDArray[np.int64],
    time_s: Floats,
    contact: NDArray[np.int64],
    x_m: Floats,
    y_m: Floats,
    force_n: Floats,
    on_tile: NDArray[np.bool_],
) -> int:
    """Merge rows of tiles, with the feet `feet` (n,), into rows of feet; return their number.

    The other arguments are outputs: (n,), and (n, tiles) for `on_tile`, which must be all False.
    """
    written, begin, first = 0, 0, 0
    for i in range(len(rows)):
        if rows[i].sample != rows[begin].sample:
            begin = i
        if i == begin:
            first = written
        place = first
        while place < written and contact[place] != feet[i]:
            place += 1
        if place == written:
            time_s[place], contact[place] = rows[i].time_s, feet[i]
            x_m[place], y_m[place], force_n[place] = 0.0, 0.0, 0.0
            written += 1
        total = force_n[place] + rows[i].force_n
        share = rows[i].force_n / total
        x_m[place] += share * (rows[i].x_m - x_m[place])
        y_m[place] += share * (rows[i].y_m - y_m[place])
        force_n[place] = total
        on_tile[place, rows[i].tile] = True
    return written


@kernel
def end_all(memory: TrackerMemory) -> int:
    """End all contacts at the end of the stream, as cut; return the number of events."""
    happened = 0
    for k in range(len(memory.tiles)):
        if memory.tiles[k].on:
            happened = _end(memory, k, memory.stream[0].time_s, True, happened)
    return happened


@kernel
def _locate(tile: np.record, plate: np.record, force_n: Floats) -> None:
    """Compute the centroid of the tile's load, in the floor's frame."""
    x, y = 0.0, 0.0
    for sensor in range(4):
        force = force_n[sensor] - tile.base_n[sensor]
        x += plate.sensors_m[sensor, 0] * force
        y += plate.sensors_m[sensor, 1] * force
    x /= tile.load_n
    y /= tile.load_n
    tile.x_m = plate.centre_m[0] + plate.axes[0, 0] * x + plate.axes[1, 0] * y
    tile.y_m = plate.centre_m[1] + plate.axes[0, 1] * x + plate.axes[1, 1] * y


@kernel
def _write_rows(tiles: NDArray[np.void], stream: np.record, now_s: float, rows: NDArray[np.void], written: int) -> int:
    """Append a row for each tile in contact to the first `written`; return the new number."""
    for k in range(len(tiles)):
        tile = tiles[k]
        if tile.on:
            row = rows[written]
            row.sample, row.time_s, row.tile, row.token = stream.count, now_s, k, tile.token
            row.x_m, row.y_m, row.force_n = tile.x_m, tile.y_m, tile.load_n
            written += 1
    return written


@kernel
def _begin(memory: TrackerMemory, k: int, now_s: float, before_n: float, on_n: float, gap: bool, happened: int) -> int:
    """Begin a contact on tile k, whose load was `before_n` one sample ago; return the new number of events."""
    tile, stream = memory.tiles[k], memory.stream[0]
    cut = gap or tile.untared or stream.count == 0
    tile.on = True
    tile.off_n = OFF_SHARE * on_n
    tile.onset_s = tile.steady_s = now_s
    tile.low_n = tile.high_n = tile.load_n
    tile.token = stream.tokens
    stream.tokens += 1
    began_s = stream.time_s if stream.count > 0 else now_s  # which can be before 0
    return _log(memory, k, BEGAN, began_s, math.nan if cut else before_n, cut, happened)


@kernel
def _end(memory: TrackerMemory, k: int, last_s: float, cut: bool, happened: int) -> int:
    """End the contact on tile k; return the new number of events."""
    tile, stream = memory.tiles[k], memory.stream[0]
    tile.on = False
    if tile.quiet == 0:
        tile.need = stream.first if tile.untared else stream.renewal
    tile.negative_s = math.nan
    return _log(memory, k, ENDED, last_s, math.nan, cut, happened)


@kernel
def _is_settled(tile: np.record, now_s: float) -> bool:
    """Return whether a load too small for a foot has been steady for `SETTLED_S`, so that it must be a residue."""
    low_n, high_n = min(tile.low_n, tile.load_n), max(tile.high_n, tile.load_n)
    # On a tared tile it is between the thresholds, which is steady enough.
    moves = high_n >= TARE_N or high_n - low_n > SETTLED_N if tile.untared else high_n >= tile.off_n / OFF_SHARE
    if moves:
        tile.low_n = tile.high_n = tile.load_n
        tile.steady_s = now_s
        return False
    tile.low_n, tile.high_n = low_n, high_n
    return now_s - tile.steady_s >= SETTLED_S


@kernel
def _renew_if_negative(memory: TrackerMemory, k: int, now_s: float, take: bool) -> None:
    """Set the baseline of tile k, which has a negative load, after `NEGATIVE_S`."""
    tile = memory.tiles[k]
    forget_quiet(memory, k)
    if math.isnan(tile.negative_s):
        tile.negative_s = now_s
    elif now_s - tile.negative_s >= NEGATIVE_S:
        renew_now(memory, k, take)


@kernel
def _log(memory: TrackerMemory, k: int, kind: int, time_s: float, load_n: float, cut: bool, happened: int) -> int:
    """Write an event of tile k at the present sample after the first `happened`; return the new number."""
    event, tile = memory.events[happened], memory.tiles[k]
    event.kind, event.sample, event.token = kind, memory.stream[0].count, tile.token
    event.tile, event.time_s, event.load_n, event.cut = k, time_s, load_n, cut
    return happened + 1
