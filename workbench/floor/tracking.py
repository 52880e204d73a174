"""The kernels that follow contacts: baselines, thresholds, and which tiles carry one foot. `contacts.py` says what
they do.

Everything here goes sample by sample, so that the result does not depend on how a stream is cut into chunks. State is
in arrays of records: one `TILE` a tile, one `CLOCK` in all. For baselines about 250 values a second are taken, each the
mean of the samples since the one before; `ring` (tiles, length, 5) holds the latest of them, four sensors and the sum
of the last sample alone, whose noise is asked for, and `window` (tiles, 5, n) those that count, each row in ascending
order.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.floor.running_median import exchange, insert, median, spread
from underfoot.kernels import kernel

ON_N, ON_SIGMAS, OFF_SHARE = 20.0, 5.0, 0.5
"""On at `max(ON_N, ON_SIGMAS` times the noise`)`, off at `OFF_SHARE` of that (SCIENCE 14)."""

GUARD_S, WINDOW_S, RENEW_S, RECENT_S, MINIMUM_S = 0.2, 2.0, 0.5, 0.1, 0.1
"""A baseline leaves out the last `GUARD_S` and is of `WINDOW_S` before that, of `MINIMUM_S` at least; after a contact
it waits for `RENEW_S` of quiet; begun anew it is of the last `RECENT_S`."""

BLIP_S = 0.05
"""A contact shorter than this is no end of quiet: noise that has been thought too small must not keep itself so."""

TARE_N, SETTLED_S, SETTLED_N, SETTLED_SIGMAS, NEGATIVE_S = 100.0, 0.5, 10.0, 8.0, 0.1
"""No tare exceeds `TARE_N`. A load within `SETTLED_N` or `SETTLED_SIGMAS` times the noise for `SETTLED_S` is steady;
one below minus the on-threshold for `NEGATIVE_S` is not real."""

GAP_M, EDGE_M, APART_M, ONSETS_S, DECIDED_N = 0.030, 0.15, 0.20, 0.4, 50.0
"""One foot or two (CONTRACTS): tiles at most `GAP_M` apart, centroids at most `EDGE_M` from the shared edge and
`APART_M` from each other, onsets within `ONSETS_S`; decided once the later contact has reached `DECIDED_N`, or is
`ONSETS_S` old."""

PLATE = np.dtype(
    [
        ("sensors_m", np.float64, (4, 2)),
        ("centre_m", np.float64, (2,)),
        ("axes", np.float64, (2, 2)),
        ("half_m", np.float64, (2,)),
    ],
    align=True,
)
"""Where a tile lies, as `layout.Tile` has it."""

TILE = np.dtype(
    [
        ("base_n", np.float64, (4,)),
        ("sum_n", np.float64, (4,)),
        ("summed", np.int64),
        ("noise_n", np.float64),
        ("load_n", np.float64),
        ("x_m", np.float64),
        ("y_m", np.float64),
        ("untared", np.bool_),
        ("quiet", np.int64),
        ("need", np.int64),
        ("negative_s", np.float64),
        ("on", np.bool_),
        ("off_n", np.float64),
        ("onset_s", np.float64),
        ("onset", np.int64),
        ("token", np.int64),
        ("foot", np.int64),
        ("partner", np.int64),
        ("impulse_ns", np.float64),
        ("steady_s", np.float64),
        ("low_n", np.float64),
        ("high_n", np.float64),
    ],
    align=True,
)
"""What is known of a tile. `sum_n` is of `summed` samples, those since the last that was taken for baselines. `quiet`
counts its thinned quiet samples in a row and `need` is how many a baseline wants. In contact: `token` numbers its
contacts, `foot` is 0 until decided, `partner` the tile it shares a foot with or -1, and from `steady_s` on its load
stayed between `low_n` and `high_n`."""

CLOCK = np.dtype(
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
        ("feet", np.int64),
    ],
    align=True,
)
"""Samples so far; those `taken` for baselines, each `every`th, and lengths in them; tokens and feet given out."""

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
"""A tile in contact at one sample; places in the floor's frame."""

BEGAN, DECIDED, ENDED = 0, 1, 2
EVENT = np.dtype(
    [
        ("kind", np.int64),
        ("sample", np.int64),
        ("token", np.int64),
        ("tile", np.int64),
        ("foot", np.int64),
        ("time_s", np.float64),
        ("value", np.float64),
        ("cut", np.bool_),
    ],
    align=True,
)
"""A tile's contact began (time and load of the sample before), was decided, or ended (its last time, its impulse)."""


def plates(floor: Floor) -> NDArray[np.void]:
    """Where the tiles lie, as kernels read it: shape (tiles,) of `PLATE`."""
    table = np.zeros(len(floor.tiles), PLATE)
    for plate, tile in zip(table, floor.tiles, strict=True):
        plate["sensors_m"], plate["centre_m"], plate["axes"] = tile.sensors_m, tile.centre_m, tile.axes
        plate["half_m"] = np.array(tile.size_m) / 2.0
    return table


@kernel
def follow(time_s, force_n, plates, gaps_m, tiles, clock, ring, window, rows, events):
    """Follow n samples, `time_s` (n,) and `force_n` (n, tiles, 4).

    Returns how many rows and events were written, and the sample (the count of those before it) up to which all is
    decided. `rows` must hold n times the tiles, and `events` four times that.
    """
    written, happened = 0, 0
    at = clock[0]
    for i in range(len(time_s)):
        now = time_s[i]
        gap = at.count > 0 and now - at.time_s > at.gap_s
        take = at.count % at.every == 0
        for k in range(len(tiles)):
            tile = tiles[k]
            before_n = tile.load_n
            _weigh(tile, plates[k], force_n[i, k])
            _gather(tile, force_n[i, k])
            if take:
                _keep(tile, ring[k, at.taken % ring.shape[1]], force_n[i, k])
            if not math.isfinite(tile.load_n):
                tile.load_n = before_n
                tile.quiet = 0
                if not gap:
                    continue
            if tile.on:
                tile.impulse_ns += 0.0 if gap else 0.5 * (before_n + tile.load_n) * (now - at.time_s)
                settled = not gap and _is_settled(tile, now)
                if gap or settled or tile.load_n < tile.off_n:
                    happened = _end(tiles, k, at, tile.steady_s if settled else at.time_s, gap, events, happened)
                    if settled:
                        _begin_anew(tile, ring[k], window[k], at, 1 if take else 0)
                elif now - tile.onset_s >= BLIP_S:
                    tile.quiet = 0
                elif take and tile.quiet > 0:
                    _slide(tile, ring[k], window[k], at)
            if not tile.on:
                on_n = max(ON_N, ON_SIGMAS * tile.noise_n)
                if tile.load_n >= on_n:
                    cut = gap or tile.untared or at.count == 0
                    _begin(tile, at, now, on_n)
                    lead_n = math.nan if cut else before_n
                    happened = _tell(events, happened, BEGAN, at.count, tile, k, at.time_s, lead_n, cut)
                else:
                    _rest(tile, ring[k], window[k], at, now, on_n, take)
        happened = _decide(plates, gaps_m, tiles, at, now, events, happened)
        for k in range(len(tiles)):
            if tiles[k].on:
                row = rows[written]
                row.sample, row.time_s, row.tile, row.token = at.count, now, k, tiles[k].token
                row.x_m, row.y_m, row.force_n = tiles[k].x_m, tiles[k].y_m, tiles[k].load_n
                written += 1
        at.taken += 1 if take else 0
        at.count += 1
        at.time_s = now
    decided = at.count
    for k in range(len(tiles)):
        if tiles[k].on and tiles[k].foot == 0:
            decided = min(decided, tiles[k].onset)
    return written, happened, decided


@kernel
def join(rows, feet, time_s, contact, x_m, y_m, force_n, on_tile):
    """Merge rows of tiles, whose feet are `feet` (n,), into rows of feet; returns how many there are.

    The rest are written: shape (n,), and (n, tiles) for `on_tile`, which must come in as all False.
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
def end_all(tiles, clock, events):
    """End every contact as the stream ends, out of sight; returns how many events that made."""
    happened = 0
    for k in range(len(tiles)):
        if tiles[k].on:
            happened = _end(tiles, k, clock[0], clock[0].time_s, True, events, happened)
    return happened


@kernel
def renew(tile, ring, window, at):
    """Take what a tile read in the last 0.1 s as its baseline; a contact on it ends with the next sample."""
    kept = min(at.recent, at.taken)
    for channel in range(4):
        n = 0
        for age in range(1, kept + 1):
            value = ring[(at.taken - age) % ring.shape[0], channel]
            if math.isfinite(value):
                insert(window[channel], n, value)
                n += 1
        if n > 0:
            tile.base_n[channel] = median(window[channel], n)
    tile.quiet = 0
    tile.need = at.first
    tile.negative_s = math.nan
    tile.untared = False


@kernel
def renew_all(tiles, clock, ring, window):
    """Take what every tile read in the last 0.1 s as its baseline."""
    for k in range(len(tiles)):
        renew(tiles[k], ring[k], window[k], clock[0])


@kernel
def _weigh(tile, plate, force_n):
    """The tile's load and its centroid in the floor's frame."""
    total, x, y = 0.0, 0.0, 0.0
    for sensor in range(4):
        force = force_n[sensor] - tile.base_n[sensor]
        total += force
        x += plate.sensors_m[sensor, 0] * force
        y += plate.sensors_m[sensor, 1] * force
    tile.load_n = total
    if total > 0.0:
        x /= total
        y /= total
        tile.x_m = plate.centre_m[0] + plate.axes[0, 0] * x + plate.axes[1, 0] * y
        tile.y_m = plate.centre_m[1] + plate.axes[0, 1] * x + plate.axes[1, 1] * y


@kernel
def _gather(tile, force_n):
    total = force_n[0] + force_n[1] + force_n[2] + force_n[3]
    if math.isfinite(total):
        for sensor in range(4):
            tile.sum_n[sensor] += force_n[sensor]
        tile.summed += 1


@kernel
def _keep(tile, slot, force_n):
    slot[4] = 0.0
    for sensor in range(4):
        slot[sensor] = tile.sum_n[sensor] / tile.summed if tile.summed > 0 else math.nan
        slot[4] += force_n[sensor]
        tile.sum_n[sensor] = 0.0
    tile.summed = 0


@kernel
def _begin(tile, at, now, on_n):
    tile.on = True
    tile.off_n = OFF_SHARE * on_n
    tile.onset_s = tile.steady_s = now
    tile.onset = at.count
    tile.low_n = tile.high_n = tile.load_n
    tile.impulse_ns = 0.0
    tile.token = at.tokens
    tile.foot, tile.partner = 0, -1
    at.tokens += 1


@kernel
def _end(tiles, k, at, last_s, cut, events, happened):
    """End the contact of tile k; whatever waited for it is decided as it last stood."""
    for other in range(len(tiles)):
        if tiles[other].on and tiles[other].foot == 0 and tiles[other].partner == k:
            happened = _settle(tiles, other, at, events, happened)
    if tiles[k].foot == 0:
        happened = _settle(tiles, k, at, events, happened)
    tile = tiles[k]
    tile.on = False
    if tile.quiet == 0:
        tile.need = at.first if tile.untared else at.renewal
    tile.negative_s = math.nan
    return _tell(events, happened, ENDED, at.count, tile, k, last_s, tile.impulse_ns, cut)


@kernel
def _is_settled(tile, now):
    """Whether a load too small for a foot has been steady for so long that it must be a residue."""
    steady_n = max(SETTLED_N, SETTLED_SIGMAS * tile.noise_n)
    low_n, high_n = min(tile.low_n, tile.load_n), max(tile.high_n, tile.load_n)
    if high_n - low_n > steady_n or high_n >= (TARE_N if tile.untared else tile.off_n / OFF_SHARE):
        tile.low_n = tile.high_n = tile.load_n
        tile.steady_s = now
        return False
    tile.low_n, tile.high_n = low_n, high_n
    return now - tile.steady_s >= SETTLED_S


@kernel
def _rest(tile, ring, window, at, now, on_n, take):
    """A sample off contact: into the baseline, unless the tile reads less than nothing."""
    if tile.load_n <= -on_n:
        tile.quiet = 0
        if math.isnan(tile.negative_s):
            tile.negative_s = now
        elif now - tile.negative_s >= NEGATIVE_S:
            _begin_anew(tile, ring, window, at, 1 if take else 0)
        return
    tile.negative_s = math.nan
    if not take:
        return
    n = _slide(tile, ring, window, at)
    if tile.quiet >= tile.need:
        for sensor in range(4):
            tile.base_n[sensor] = median(window[sensor], n)
        # Few samples may show less noise than there is.
        unsure = 1.0 + 2.0 / math.sqrt(n) if n < window.shape[1] else 1.0
        tile.noise_n = unsure * 1.4826 * spread(window[4], n)
        tile.untared = False


@kernel
def _slide(tile, ring, window, at):
    """Count a quiet sample, and let the one that is `guard` older into the baseline; returns how many that has."""
    tile.quiet += 1
    length = window.shape[1]
    had = min(tile.quiet - 1 - at.guard, length)
    if had < 0:
        return 0
    comes = ring[(at.taken - at.guard) % ring.shape[0]]
    goes = ring[(at.taken - at.guard - length) % ring.shape[0]]
    for channel in range(5):
        if had == length:
            exchange(window[channel], goes[channel], comes[channel])
        else:
            insert(window[channel], had, comes[channel])
    return min(had + 1, length)


@kernel
def _begin_anew(tile, ring, window, at, newest):
    """Renew the baseline with the present sample, which the count of taken samples may not hold yet."""
    at.taken += newest
    renew(tile, ring, window, at)
    at.taken -= newest
    tile.load_n = 0.0


@kernel
def _decide(plates, gaps_m, tiles, at, now, events, happened):
    """Settle the contacts that can be settled: who shares a foot with whom."""
    waiting = False
    for k in range(len(tiles)):
        if tiles[k].on and tiles[k].foot == 0:
            waiting = True
            _choose(plates, gaps_m, tiles, k)
    if waiting:
        for k in range(len(tiles)):
            tile = tiles[k]
            if tile.on and tile.foot == 0:
                ripe = tile.load_n >= DECIDED_N or now - tile.onset_s >= ONSETS_S or tile.partner == -2
                if ripe:
                    tile.partner = max(tile.partner, -1)
                    happened = _settle(tiles, k, at, events, happened)
    return happened


@kernel
def _choose(plates, gaps_m, tiles, k):
    """The nearest earlier contact that tile k's may share a foot with: -1 if none may now, -2 if none ever can."""
    tile = tiles[k]
    tile.partner = -2
    nearest_m = APART_M
    for other in range(len(tiles)):
        earlier = tiles[other]
        if not earlier.on or earlier.token >= tile.token or tile.onset_s - earlier.onset_s > ONSETS_S:
            continue
        gap_m = gaps_m[k, other]
        if gap_m > GAP_M:
            continue
        tile.partner = max(tile.partner, -1)
        apart_m = math.hypot(tile.x_m - earlier.x_m, tile.y_m - earlier.y_m)
        reach_m = max(_beyond(plates[other], tile.x_m, tile.y_m), _beyond(plates[k], earlier.x_m, earlier.y_m)) - gap_m
        if apart_m <= nearest_m and reach_m <= EDGE_M:
            nearest_m = apart_m
            tile.partner = other


@kernel
def _beyond(plate, x_m, y_m):
    """How far a point of the floor is from a tile."""
    x, y = x_m - plate.centre_m[0], y_m - plate.centre_m[1]
    along = abs(plate.axes[0, 0] * x + plate.axes[0, 1] * y) - plate.half_m[0]
    across = abs(plate.axes[1, 0] * x + plate.axes[1, 1] * y) - plate.half_m[1]
    return math.hypot(max(along, 0.0), max(across, 0.0))


@kernel
def _settle(tiles, k, at, events, happened):
    """Give tile k, and the undecided contacts that it hangs on, their foot: the first one's, or a new one."""
    root = k
    while tiles[root].foot == 0 and tiles[root].partner >= 0:
        root = tiles[root].partner
    foot = tiles[root].foot
    if foot == 0:
        at.feet += 1
        foot = at.feet
    while tiles[k].foot == 0:
        tile = tiles[k]
        tile.foot = foot
        happened = _tell(events, happened, DECIDED, at.count, tile, k, 0.0, 0.0, False)
        if tile.partner >= 0:
            k = tile.partner
    return happened


@kernel
def _tell(events, happened, kind, sample, tile, k, time_s, value, cut):
    event = events[happened]
    event.kind, event.sample, event.token, event.tile, event.foot = kind, sample, tile.token, k, tile.foot
    event.time_s, event.value, event.cut = time_s, value, cut
    return happened + 1
