"""Kernels that follow the load on each tile: baselines, thresholds, centroids. The rules are those of `contacts.py`.

Samples are processed one by one, so that the result does not depend on how a stream is split into chunks. All state is
in a `TrackerMemory`. Baselines use about 250 values a second, each the mean of the samples since the one before.
"""

import math
from functools import cache
from typing import TYPE_CHECKING, Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.array_tables import F1, F3, borrow
from underfoot.floor.layout import PLATE
from underfoot.floor.running_median import (
    MIDDLE,
    begin,
    copy_latest,
    exchange,
    insert,
    median,
    median_deviation,
    running_median,
)
from underfoot.kernels import Floats, callback, inlined, intrinsic, kernel, part

if TYPE_CHECKING:
    from numba.core.ccallback import CFunc

    from underfoot.emission import Emission, Type, TypingContext


ON_N, ON_SIGMAS, OFF_SHARE = 20.0, 5.0, 0.5
"""A contact begins at the larger of `ON_N` and `ON_SIGMAS` times the noise, and ends below `OFF_SHARE` of that."""

GUARD_S, WINDOW_S, RENEW_S, RECENT_S, MINIMUM_S = 0.2, 2.0, 0.5, 0.1, 0.1
"""A baseline excludes the last `GUARD_S`, and uses `WINDOW_S` before that, at least `MINIMUM_S`. After a contact it
waits for `RENEW_S` of quiet. A manual tare uses the last `RECENT_S`."""

BLIP_S = 0.05
"""A contact shorter than this does not end a quiet stretch: it may be noise that is larger than estimated so far."""

TARE_N, SETTLED_S, SETTLED_N, SETTLED_SIGMAS, NEGATIVE_S = 100.0, 0.5, 10.0, 8.0, 0.1
"""No tare exceeds `TARE_N`. A load within `SETTLED_N` or `SETTLED_SIGMAS` times the noise for `SETTLED_S` is steady;
one below minus the on-threshold for `NEGATIVE_S` is not real."""

TILE = np.dtype(
    [
        ("base_n", np.float64, (4,)),
        ("sum_n", np.float64, (4,)),
        ("summed", np.int64),
        ("noise_n", np.float64),
        ("noise_of", np.int64),
        ("noise_at", np.int64),
        ("load_n", np.float64),
        ("x_m", np.float64),
        ("y_m", np.float64),
        ("untared", np.bool_),
        ("quiet", np.int64),
        ("need", np.int64),
        ("unladen", np.bool_),
        ("negative_s", np.float64),
        ("on", np.bool_),
        ("off_n", np.float64),
        ("onset_s", np.float64),
        ("token", np.int64),
        ("steady_s", np.float64),
        ("low_n", np.float64),
        ("high_n", np.float64),
    ],
    align=True,
)
"""State of a tile. `noise_n` is computed only when it is needed: if `noise_of` is not 0, it is that of this many values
of the ring, which end at index `noise_at`. `sum_n` is the sum of the `summed` samples since the last thinned one.
`quiet` is the number of consecutive quiet thinned samples, and `need` the number that a baseline requires; the present
sample of an `unladen` tile is not counted yet. During a contact, `token` is the number of the load among those of all
tiles, which since `steady_s` stayed between `low_n` and `high_n`."""

STREAM = np.dtype(
    [
        ("count", np.int64),
        ("taken", np.int64),
        ("every", np.int64),
        ("guard", np.int64),
        ("first", np.int64),
        ("renewal", np.int64),
        ("recent", np.int64),
        ("gap_s", np.float64),
        ("time_s", np.float64),
        ("tokens", np.int64),
        ("rows", np.int64),
        ("events", np.int64),
    ],
    align=True,
)
"""State of the stream: number of samples, and time of the last one; `gap_s` without a sample is a gap. Samples are
thinned for baselines, one of `every`; `taken` is their number so far, and `guard`, `first`, `renewal` and `recent` are
times in thinned samples. `tokens` is the number of loads so far; `rows` and `events` are what was last written."""

ROW = np.dtype(
    [
        ("sample", np.int64),
        ("time_s", np.float64),
        ("tile", np.int64),
        ("token", np.int64),
        ("x_m", np.float64),
        ("y_m", np.float64),
        ("force_n", np.float64),
    ],
    align=True,
)
"""A tile in contact at one sample; position in the floor's frame."""

BEGAN, ENDED = 0, 1
EVENT = np.dtype(
    [
        ("kind", np.int64),
        ("sample", np.int64),
        ("token", np.int64),
        ("tile", np.int64),
        ("time_s", np.float64),
        ("load_n", np.float64),
        ("cut", np.bool_),
    ],
    align=True,
)
"""Beginning or end of a tile's load: time and load of the sample before it began, or time of its last sample."""


class TrackerMemory(NamedTuple):
    """Everything that the kernels read and write, as `array_tables` passes it."""

    time_s: F1  # [sample]: the samples to be followed
    force_n: F3  # [sample, tile, sensor]
    plates: Annotated[np.ndarray, PLATE, 1]  # [tile]
    tiles: Annotated[np.ndarray, TILE, 1]
    stream: Annotated[np.ndarray, STREAM, 1]  # [1]
    ring: F3  # [tile, place, 5]: thinned values of the four sensors, and the sum of one sample, for noise
    window: F3  # [tile, sensor, n]: the values of the baseline, the middle ones in ascending order
    middles: Annotated[np.ndarray, MIDDLE, 2]  # [tile, sensor]
    work: F1  # [n]: working memory for medians
    rows: Annotated[np.ndarray, ROW, 1]  # written by `follow`: room for one of each sample and tile
    events: Annotated[np.ndarray, EVENT, 1]  # written by `follow`: room for twice as many


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


@intrinsic
def _memory_at(context: "TypingContext", where: "Type") -> "Emission":
    """Return the arrays at these addresses as `TrackerMemory`."""
    return borrow(context, where, TrackerMemory)


@part
def _follow(memory: TrackerMemory, begin: int, end: int) -> None:
    """Follow the samples `begin` to `end`; write rows and events from the first place on.

    A gap ends a contact, and may begin the next. A lost sample, which is not finite, leaves the load as it was.
    """
    written, happened = 0, 0
    plates, tiles, ring, rows, force_n = memory.plates, memory.tiles, memory.ring, memory.rows, memory.force_n
    stream = memory.stream[0]
    for i in range(begin, end):
        now_s = memory.time_s[i]
        gap = stream.count > 0 and now_s - stream.time_s > stream.gap_s
        take = stream.count % stream.every == 0
        newest, oldest = _window_ends(memory)
        for k in range(len(tiles)):
            tile = tiles[k]
            before_n = tile.load_n
            _weigh(tile, force_n[i, k])
            if take:
                _store(tile, ring[k, stream.taken % ring.shape[1]], force_n[i, k])
            lost = not math.isfinite(tile.load_n)
            if lost:
                tile.load_n = before_n
                _forget_quiet(memory, k)
                if not gap:
                    continue
            if tile.on:  # does the contact end?
                settled = not gap and _is_settled(tile, now_s)
                if gap or settled or tile.load_n < tile.off_n:
                    happened = _end(memory, k, tile.steady_s if settled else stream.time_s, gap, happened)
                    if settled:
                        _renew_now(memory, k, take)
                elif now_s - tile.onset_s >= BLIP_S:  # a foot
                    tile.quiet = 0
                elif take and tile.quiet > 0:  # maybe noise
                    _slide(memory, k, newest, oldest)
            if not tile.on:  # does one begin?
                on_n = ON_N
                if not abs(tile.load_n) < ON_N:  # only then the noise matters
                    on_n = max(ON_N, ON_SIGMAS * _noise_n(memory, k))
                if tile.load_n >= on_n:
                    happened = _begin(memory, k, now_s, before_n, on_n, gap, happened)
                    if take and tile.quiet > 0:  # no gap in the quiet samples, if this is no foot
                        _slide(memory, k, newest, oldest)
                elif not lost and tile.load_n <= -on_n:
                    _renew_if_negative(memory, k, now_s, take)
                elif not lost:  # most samples: passing all memory to a function would cost more than all else
                    tile.negative_s = math.nan
                    tile.unladen = take
            if tile.on and not lost:
                _locate(tile, plates[k], force_n[i, k])
        if take:
            _update_baselines(memory, newest, oldest)
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
def renew_all(memory: TrackerMemory) -> None:
    """Set all baselines to the readings of the last 0.1 s; contacts end with the next sample."""
    for k in range(len(memory.tiles)):
        _renew(memory, k, memory.stream[0].taken)


@kernel
def bring_up_noise(memory: TrackerMemory) -> None:
    """Compute the present noise of each tile."""
    for k in range(len(memory.tiles)):
        _noise_n(memory, k)


@part
def _weigh(tile: np.record, force_n: Floats) -> None:
    """Compute the load on the tile, and add the sample to the mean for the baseline."""
    total, load_n = force_n[0] + force_n[1] + force_n[2] + force_n[3], 0.0
    for sensor in range(4):
        load_n += force_n[sensor] - tile.base_n[sensor]
    tile.load_n = load_n
    if math.isfinite(total):
        for sensor in range(4):
            tile.sum_n[sensor] += force_n[sensor]
        tile.summed += 1


@part
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


@part
def _store(tile: np.record, slot: Floats, force_n: Floats) -> None:
    """Store the mean since the last thinned sample, and the sum of this sample, in a slot of the ring."""
    slot[4] = 0.0
    for sensor in range(4):
        slot[sensor] = tile.sum_n[sensor] / tile.summed if tile.summed > 0 else math.nan
        slot[4] += force_n[sensor]
        tile.sum_n[sensor] = 0.0
    tile.summed = 0


@part
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


@part
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
    return _log(memory, k, BEGAN, stream.time_s, math.nan if cut else before_n, cut, happened)


@part
def _end(memory: TrackerMemory, k: int, last_s: float, cut: bool, happened: int) -> int:
    """End the contact on tile k; return the new number of events."""
    tile, stream = memory.tiles[k], memory.stream[0]
    tile.on = False
    if tile.quiet == 0:
        tile.need = stream.first if tile.untared else stream.renewal
    tile.negative_s = math.nan
    return _log(memory, k, ENDED, last_s, math.nan, cut, happened)


@part
def _is_settled(tile: np.record, now_s: float) -> bool:
    """Return whether a load too small for a foot has been steady for `SETTLED_S`, so that it must be a residue."""
    steady_n = max(SETTLED_N, SETTLED_SIGMAS * tile.noise_n)
    low_n, high_n = min(tile.low_n, tile.load_n), max(tile.high_n, tile.load_n)
    if high_n - low_n > steady_n or high_n >= (TARE_N if tile.untared else tile.off_n / OFF_SHARE):
        tile.low_n = tile.high_n = tile.load_n
        tile.steady_s = now_s
        return False
    tile.low_n, tile.high_n = low_n, high_n
    return now_s - tile.steady_s >= SETTLED_S


@part
def _renew_if_negative(memory: TrackerMemory, k: int, now_s: float, take: bool) -> None:
    """Set the baseline of tile k, which has a negative load, after `NEGATIVE_S`."""
    tile = memory.tiles[k]
    _forget_quiet(memory, k)
    if math.isnan(tile.negative_s):
        tile.negative_s = now_s
    elif now_s - tile.negative_s >= NEGATIVE_S:
        _renew_now(memory, k, take)


@part
def _update_baselines(memory: TrackerMemory, newest: int, oldest: int) -> None:
    """Update the baselines of unladen tiles with the present sample."""
    for k in range(len(memory.tiles)):
        tile = memory.tiles[k]
        if not tile.unladen:
            continue
        tile.unladen = False
        n = _slide(memory, k, newest, oldest)
        if tile.quiet < tile.need:
            continue
        for sensor in range(4):
            tile.base_n[sensor] = running_median(
                memory.middles[k, sensor], memory.window[k, sensor], memory.ring[k, :, sensor], newest, n
            )
        tile.noise_of, tile.noise_at = n, newest
        tile.untared = False


@inlined
def _window_ends(memory: TrackerMemory) -> tuple[int, int]:
    """Return the indices in the rings of the values that enter and leave the windows with the present sample."""
    stream, places = memory.stream[0], memory.ring.shape[1]
    newest = stream.taken - stream.guard
    return newest % places, (newest - memory.window.shape[2]) % places


@inlined
def _slide(memory: TrackerMemory, k: int, newest: int, oldest: int) -> int:
    """Count a quiet sample of tile k, and add the one that is `guard` older to the baseline; return its size."""
    tile, window = memory.tiles[k], memory.window[k]
    length = window.shape[1]
    had = min(tile.quiet - memory.stream[0].guard, length)
    tile.quiet += 1
    if had < 0:
        return 0
    for sensor in range(4):
        middle, new, old = memory.middles[k, sensor], memory.ring[k, newest, sensor], memory.ring[k, oldest, sensor]
        if had < length:
            if had == 0:
                begin(middle)
            insert(middle, window[sensor], new)
        elif new != old:
            exchange(middle, window[sensor], old, new)
    return min(had + 1, length)


@part
def _noise_n(memory: TrackerMemory, k: int) -> float:
    """Return the noise of tile k at the last update of its baseline."""
    tile, n = memory.tiles[k], memory.tiles[k].noise_of
    if n > 0:
        copy_latest(memory.ring[k, :, 4], tile.noise_at, memory.work, n)
        # Few samples may show less noise than there is.
        unsure = 1.0 + 2.0 / math.sqrt(n) if n < len(memory.work) else 1.0
        tile.noise_n = unsure * 1.4826 * median_deviation(memory.work, n)
        tile.noise_of = 0
    return tile.noise_n


@part
def _forget_quiet(memory: TrackerMemory, k: int) -> None:
    """End the quiet time of tile k; its noise is computed now, while the ring has the values."""
    _noise_n(memory, k)
    memory.tiles[k].quiet = 0


@part
def _renew_now(memory: TrackerMemory, k: int, take: bool) -> None:
    """Renew the baseline, including the present sample, which the number of thinned samples does not include yet."""
    _renew(memory, k, memory.stream[0].taken + (1 if take else 0))
    memory.tiles[k].load_n = 0.0


@part
def _renew(memory: TrackerMemory, k: int, taken: int) -> None:
    """Set the baseline of tile k to its readings of the last 0.1 s; a contact on it ends with the next sample."""
    tile, ring, stream, values = memory.tiles[k], memory.ring[k], memory.stream[0], memory.work
    _forget_quiet(memory, k)
    for sensor in range(4):
        n = 0
        for age in range(1, min(stream.recent, taken) + 1):
            value = ring[(taken - age) % len(ring), sensor]
            if math.isfinite(value):
                values[n] = value
                n += 1
        if n > 0:
            tile.base_n[sensor] = median(values, n)
    tile.need = stream.first
    tile.negative_s = math.nan
    tile.untared = False


@part
def _log(memory: TrackerMemory, k: int, kind: int, time_s: float, load_n: float, cut: bool, happened: int) -> int:
    """Write an event of tile k at the present sample after the first `happened`; return the new number."""
    event, tile = memory.events[happened], memory.tiles[k]
    event.kind, event.sample, event.token = kind, memory.stream[0].count, tile.token
    event.tile, event.time_s, event.load_n, event.cut = k, time_s, load_n, cut
    return happened + 1
