"""Accelerometers whose samples come over the link with the forces: m/s^2 per tile at session frames.

A tile's device has one clock, which maps its samples of force and acceleration to the session. Values between samples
are interpolated by Lagrange's polynomial through six. Output is delayed by `LAG_S`: by then all samples that are not
lost have arrived; lost ones count as rest.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.accelerometers import Accelerometer
from underfoot.devices.framing.wire_format import REST
from underfoot.devices.row_assembly import Assembly, session_frame
from underfoot.floor.layout import Floor
from underfoot.kernels import kernel
from underfoot.models.filtering.resampling import BEFORE, BEHIND, lagrange_weights

LAG_S = 0.1
"""Delay in seconds of the output behind its frame."""
EACH = 4
"""Samples per frame of the wire."""
_QUEUE = 1 << 14
_KEPT = 1 << 13  # samples of a tile
_MOST_LOST = 64  # frames: after more lost ones, a tile starts again
_TURN_US = 2.0**32  # after which a device's microseconds begin anew
_EASE = 1.0 / 32.0  # weight of a frame in the running estimate of the sample spacing

QUEUED = np.dtype(
    [
        ("tile", np.int64),
        ("epoch", np.int64),
        ("sequence", np.int64),
        ("time_us", np.float64),
        ("m_s2", np.float64, (EACH,)),
    ],
    align=True,
)
"""A queued frame of the wire."""
TILE = np.dtype(
    [
        ("epoch", np.int64),
        ("sequence", np.int64),
        ("time_us", np.float64),
        ("period_us", np.float64),
        ("newest", np.int64),
    ],
    align=True,
)
"""State of a tile: epoch (-1: none yet), sequence and time of its newest frame, microseconds between two frames, and
the number of its newest sample, which is of the same time.
"""


class LinkAcceleration:
    """Receives acceleration in a reading thread by `receive`, and delivers it to the output callback by `fill`.

    `assembly` has the clocks of the device's floor. Tiles not in `accelerometers` are ignored.
    """

    def __init__(self, accelerometers: tuple[Accelerometer, ...], floor: Floor, assembly: Assembly) -> None:
        self._scale = np.zeros(len(floor.tiles))
        for accelerometer in accelerometers:
            self._scale[floor.index(accelerometer.tile)] = accelerometer.m_s2_per_unit / REST
        self._queue = np.zeros(_QUEUE, QUEUED)
        self._tiles = np.zeros(len(floor.tiles), TILE)
        self._tiles["epoch"] = -1
        self._values = np.zeros((len(floor.tiles), _KEPT))
        self._weights = np.zeros(BEFORE + 1 + BEHIND)
        self._parts = tuple(assembly)
        self._queued = self._taken = 0  # written by the reading thread, and by `fill`
        self.fill(np.zeros((1, len(floor.tiles)), np.float32), 0, 1)  # loads the kernel in advance

    def receive(self, samples: NDArray[np.void]) -> None:
        """Queue frames of the wire, records of `wire_format.SAMPLE` of kind `ACCELERATION`. In the reading thread."""
        is_heard = self._scale[samples["tile"]] > 0.0
        samples = samples[is_heard][: _QUEUE - (self._queued - self._taken)]
        places = (self._queued + np.arange(len(samples))) % _QUEUE
        for name in ("tile", "epoch", "sequence"):
            self._queue[name][places] = samples[name]
        self._queue["time_us"][places] = samples["microseconds"]
        scale = self._scale[samples["tile"], None]
        self._queue["m_s2"][places] = (samples["readings"] - REST) * scale
        self._queued += len(samples)

    def fill(self, rows: NDArray[np.float32], frame: int, n: int) -> None:
        """Write the acceleration of `n` session frames from `frame` on into `rows` [frame, tile]. Allocates nothing."""
        head = self._queued
        _fill(self._parts, self._queue, (self._taken, head), self._tiles, self._values, self._weights, rows, (frame, n))
        self._taken = head


@kernel
def _fill(
    assembly_parts: tuple[Any, ...],
    queue: NDArray[np.void],
    waiting: tuple[int, int],
    tiles: NDArray[np.void],
    values: NDArray[np.float64],
    weights: NDArray[np.float64],
    rows: NDArray[np.float32],
    stretch: tuple[int, int],
) -> None:
    """Implement `LinkAcceleration.fill`; the queue's numbers `waiting` are new."""
    assembly = Assembly(*assembly_parts)
    for i in range(waiting[0], waiting[1]):
        entry = queue[i % len(queue)]
        _take(tiles[entry.tile], values[entry.tile], entry)
    frame, n = stretch
    for k in range(len(tiles)):
        tile = tiles[k]
        clock = assembly.clocks[assembly.tiles[k].clock]
        if tile.epoch < 0 or tile.period_us <= 0.0 or clock.epoch < 0:
            rows[:n, k] = 0.0
            continue
        a_value_us = tile.period_us / EACH
        # Microseconds are unwrapped for each kind of frame: after a long silence they may be turns apart.
        turns = np.round((clock.origin_us + clock.opened_us - tile.time_us) / _TURN_US)
        newest_us = tile.time_us + turns * _TURN_US
        newest = session_frame(assembly, clock, newest_us)
        spacing = (newest - session_frame(assembly, clock, newest_us - 1e5)) / 1e5 * a_value_us
        for i in range(n):
            place = tile.newest - (newest - (frame + i)) / spacing
            whole = int(np.floor(place))
            total = 0.0
            if tile.newest - _KEPT // 2 < whole <= tile.newest - BEHIND:
                lagrange_weights(place - whole, weights)
                for j in range(len(weights)):
                    total += weights[j] * values[k, (whole - BEFORE + j) % _KEPT]
            rows[i, k] = total


@kernel
def _take(tile: np.record, values: NDArray[np.float64], entry: np.record) -> None:
    """Store the samples of a frame of the wire; samples lost before them are set to rest."""
    ahead = ((entry.sequence - tile.sequence + 0x8000) & 0xFFFF) - 0x8000
    if tile.epoch != entry.epoch or abs(ahead) > _MOST_LOST:
        tile.epoch, tile.period_us = entry.epoch, 0.0
        values[:] = 0.0
        ahead = 1
    elif ahead > 0:
        period_us = (entry.time_us - tile.time_us) / ahead
        tile.period_us += (period_us - tile.period_us) * (_EASE if tile.period_us > 0.0 else 1.0)
        for lost in range(EACH * (ahead - 1)):
            values[(tile.newest + 1 + lost) % _KEPT] = 0.0
    last = tile.newest + EACH * ahead
    for i in range(EACH):
        values[(last - EACH + 1 + i) % _KEPT] = entry.m_s2[i]
    if ahead > 0:
        tile.sequence, tile.time_us = entry.sequence, entry.time_us
        tile.newest = last
