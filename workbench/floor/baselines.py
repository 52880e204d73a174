"""Kernels that keep the baseline and the noise of each tile; `contacts.py` has the rules, `tracking.py` applies them.

Baselines use about 250 values a second, each the mean of the samples since the one before.
"""

import math

import numpy as np

from underfoot.floor.running_median import (
    begin,
    copy_latest,
    exchange,
    insert,
    median,
    median_deviation,
    running_median,
)
from underfoot.floor.tracker_memory import TrackerMemory
from underfoot.kernels import Floats, inlined, kernel


@kernel
def renew_all(memory: TrackerMemory) -> None:
    """Set all baselines to the readings of the last 0.1 s; contacts end with the next sample."""
    for k in range(len(memory.tiles)):
        _renew(memory, k, memory.stream[0].taken)


@kernel
def bring_up_noise(memory: TrackerMemory) -> None:
    """Compute the present noise of each tile."""
    for k in range(len(memory.tiles)):
        noise_n(memory, k)


@kernel
def weigh(tile: np.record, force_n: Floats) -> None:
    """Compute the load on the tile, and add the sample to the mean for the baseline."""
    total, load_n = force_n[0] + force_n[1] + force_n[2] + force_n[3], 0.0
    for sensor in range(4):
        load_n += force_n[sensor] - tile.base_n[sensor]
    tile.load_n = load_n
    if math.isfinite(total):
        for sensor in range(4):
            tile.sum_n[sensor] += force_n[sensor]
        tile.summed += 1


@kernel
def store_thinned(tile: np.record, slot: Floats, force_n: Floats) -> None:
    """Store the mean since the last thinned sample, and the sum of this sample, in a slot of the ring."""
    slot[4] = 0.0
    for sensor in range(4):
        slot[sensor] = tile.sum_n[sensor] / tile.summed if tile.summed > 0 else math.nan
        slot[4] += force_n[sensor]
        tile.sum_n[sensor] = 0.0
    tile.summed = 0


@kernel
def update_baselines(memory: TrackerMemory) -> None:
    """Count the present sample where it is quiet, and update the baselines of tiles without a contact."""
    stream, places, length = memory.stream[0], memory.ring.shape[1], memory.window.shape[2]
    newest = (stream.taken - stream.guard) % places  # enters the windows; the other leaves them
    oldest = (stream.taken - stream.guard - length) % places
    for k in range(len(memory.tiles)):
        tile = memory.tiles[k]
        if not tile.counts:
            continue
        tile.counts = False
        n = _slide_window(memory, k, newest, oldest)
        if tile.on or tile.quiet < tile.need:
            continue
        for sensor in range(memory.middles.shape[1]):
            tile.base_n[sensor] = running_median(
                memory.middles[k, sensor], memory.window[k, sensor], memory.ring[k, :, sensor], newest, n
            )
        tile.noise_of, tile.noise_at = n, newest
        tile.untared = False


@inlined
def _slide_window(memory: TrackerMemory, k: int, newest: int, oldest: int) -> int:
    """Count a quiet sample of tile k, and add the one that is `guard` older to the baseline; return its size."""
    tile, window = memory.tiles[k], memory.window[k]
    length = window.shape[1]
    had = min(tile.quiet - memory.stream[0].guard, length)
    tile.quiet += 1
    if had < 0:
        return 0
    for sensor in range(memory.middles.shape[1]):  # not a constant: the compiler would write it out four times
        middle, new, old = memory.middles[k, sensor], memory.ring[k, newest, sensor], memory.ring[k, oldest, sensor]
        if had < length:
            if had == 0:
                begin(middle)
            insert(middle, window[sensor], new)
        elif new != old:
            exchange(middle, window[sensor], old, new)
    return min(had + 1, length)


@kernel
def noise_n(memory: TrackerMemory, k: int) -> float:
    """Return the noise of tile k at the last update of its baseline."""
    tile, n = memory.tiles[k], memory.tiles[k].noise_of
    if n > 0:
        copy_latest(memory.ring[k, :, 4], tile.noise_at, memory.work, n)
        # Few samples may show less noise than there is.
        unsure = 1.0 + 2.0 / math.sqrt(n) if n < len(memory.work) else 1.0
        tile.noise_n = unsure * 1.4826 * median_deviation(memory.work, n)
        tile.noise_of = 0
    return tile.noise_n


@kernel
def forget_quiet(memory: TrackerMemory, k: int) -> None:
    """End the quiet time of tile k; its noise is computed now, while the ring has the values."""
    noise_n(memory, k)
    memory.tiles[k].quiet = 0


@kernel
def renew_now(memory: TrackerMemory, k: int, take: bool) -> None:
    """Renew the baseline, including the present sample, which the number of thinned samples does not include yet."""
    _renew(memory, k, memory.stream[0].taken + (1 if take else 0))
    memory.tiles[k].load_n = 0.0


@kernel
def _renew(memory: TrackerMemory, k: int, taken: int) -> None:
    """Set the baseline of tile k to its readings of the last 0.1 s; a contact on it ends with the next sample."""
    tile, ring, stream, values = memory.tiles[k], memory.ring[k], memory.stream[0], memory.work
    forget_quiet(memory, k)
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
