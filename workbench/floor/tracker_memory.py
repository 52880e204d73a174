"""Memory of the contact tracker: the state of each tile and of the stream, and what is written per sample."""

import math
from typing import Annotated, NamedTuple

import numpy as np

from underfoot.array_tables import F1, F3
from underfoot.floor.layout import PLATE, Floor
from underfoot.floor.running_median import MIDDLE

GUARD_S, WINDOW_S, RENEW_S, RECENT_S, MINIMUM_S = 0.2, 2.0, 0.5, 0.1, 0.1
"""A baseline excludes the last `GUARD_S`, and uses `WINDOW_S` before that, at least `MINIMUM_S`. After a contact it
waits for `RENEW_S` of quiet. A manual tare uses the last `RECENT_S`."""

TILE = np.dtype(
    [
        ("base_n", np.float64, (4,)),
        ("sum_n", np.float64, (4,)),
        ("summed", np.int64),
        ("noise_n", np.float64),
        ("noise_of", np.int64),
        ("noise_at", np.int64),
        ("load_n", np.float64),
        ("silent", np.bool_),
        ("x_m", np.float64),
        ("y_m", np.float64),
        ("untared", np.bool_),
        ("began_untared", np.bool_),
        ("quiet", np.int64),
        ("need", np.int64),
        ("counts", np.bool_),
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
A tile is `untared` from a first sample under a load until it has been quiet, and `began_untared` for good.
`quiet` is the number of consecutive quiet thinned samples, and `need` the number that a baseline requires; if it
`counts`, the present sample is a further one. Of a `silent` tile the last sample is missing. During a contact, `token`
is the number of the load among those of all tiles, which since `steady_s` stayed between `low_n` and `high_n`."""

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


def tracker_memory(floor: Floor, rate_hz: float, most: int, gap_s: float) -> TrackerMemory:
    """Return memory for up to `most` samples at once of a stream that begins; `gap_s` without a sample is a gap."""
    count = len(floor.tiles)
    every = max(1, round(rate_hz / 250.0))

    def taken(seconds: float) -> int:
        return max(5, math.ceil(seconds * rate_hz / every))

    stream = np.zeros(1, STREAM)
    stream["every"] = every
    stream["guard"] = taken(GUARD_S)
    stream["first"] = taken(GUARD_S) + taken(MINIMUM_S)
    stream["renewal"] = max(taken(RENEW_S), taken(GUARD_S) + taken(MINIMUM_S))
    stream["recent"] = taken(RECENT_S)
    stream["gap_s"] = gap_s
    tiles = np.zeros(count, TILE)
    tiles["need"] = stream["first"]
    tiles["negative_s"] = math.nan
    return TrackerMemory(
        time_s=np.zeros(most),
        force_n=np.zeros((most, count, 4)),
        plates=floor.plates(),
        tiles=tiles,
        stream=stream,
        ring=np.zeros((count, taken(GUARD_S) + taken(WINDOW_S) + 1, 5)),
        window=np.zeros((count, 4, taken(WINDOW_S))),
        middles=np.zeros((count, 4), MIDDLE),
        work=np.zeros(taken(WINDOW_S)),
        rows=np.zeros(most * count, ROW),
        events=np.zeros(2 * most * count, EVENT),
    )
