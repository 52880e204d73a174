"""From force samples to the signals that a program reads: tared, gated, linear between samples.

The force goes to the sample of frame s from frame s to s + period, so that the next one is always known: the force at
audio rate is delayed by exactly one sample period, live and offline. A sample that comes too late for that is gone to
within a period of its arrival, and where several came at once, only the newest. Where samples are missing the last
force is held for 20 ms and then ramped to 0 in 20 ms: on the whole floor, or on a tile that is NaN in them. A tile's
signals are exactly 0 while nobody stands on it; between, a gate opens or closes in 5 ms.
"""

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.force_source import MAX_SAMPLES, ForceSource
from underfoot.floor import tracking
from underfoot.floor.contacts import GAP_S, ContactTracker
from underfoot.kernels import kernel

HOLD_S = 0.020
"""How long a force is held in a gap, and how long it then takes to 0."""
GATE_S = 0.005
"""How long the gate takes to open or to close."""

_QUEUE = 1024
_SIGNALS = 3
# A queued sample: from which frame it is gone to, at which frame it is reached, force, x, y, in contact or not.
_FROM, _TO, _FORCE, _X, _Y, _ON, _ENTRY = range(7)
# A row: the two ends of its present line (frame, then force, x, y), its gate, where the gate goes, head and tail.
_T0, _V0, _T1, _V1, _GATE, _OPEN, _HEAD, _TAIL, _LAST, _ROW = 0, 1, 4, 5, 8, 9, 10, 11, 12, 13


class Missing:
    """Fills in what a floor's tracker is to see of tiles of which no sample came (NaN), so that it need not begin anew.

    A tile stays as it was for 40 ms, the time in which its force goes to 0, and then reads as it does when nobody
    stands on it; one that was never heard stays NaN. One that is first heard after the stream's opening is tared with
    what it reads then, unless that is a load.
    """

    def __init__(self, tracker: ContactTracker, most: int) -> None:
        _, _, tiles, self._clock, *_ = tracker.memory
        self._tiles = tiles
        self._last = np.zeros((len(tiles), 4))
        self._since = np.full(len(tiles), -np.inf)
        self.absent = np.zeros((most, len(tiles)), np.bool_)
        """Which tiles of the samples that were filled in had none of their own."""

    def fill(self, time_s: NDArray[np.float64], force_n: NDArray[np.float64], count: int) -> None:
        """Fill in the first `count` samples of `force_n` (n, tiles, 4). Allocates nothing."""
        _fill_in(time_s, force_n, count, self._tiles, self._clock, self._last, self._since, self.absent)


class Intake:
    """Turns the samples of `source` into force and centroid (tile frame) of each tile, frame by frame."""

    def __init__(self, source: ForceSource, rate: float) -> None:
        self.source = source
        self.tracker = ContactTracker(source.floor, source.rate_hz)
        self._memory = self.tracker.memory
        self._missing = Missing(self.tracker, MAX_SAMPLES)
        tiles = len(source.floor.tiles)
        self._seconds = np.zeros(MAX_SAMPLES)
        self._rate = rate
        self._period = rate / source.rate_hz
        self._queue = np.zeros((tiles, _QUEUE, _ENTRY))
        self._rows = np.zeros((tiles, _ROW))
        self._rows[:, [_T0, _T1, _LAST]] = -1e18
        self.hear = _nobody

    def take(self, end: int) -> None:
        """Take the samples before session frame `end` from the source, and tell `hear` how many it holds each time."""
        count = MAX_SAMPLES
        while count == MAX_SAMPLES:
            count = self.source.pull(end)
            if count:
                self.hear(count)
                np.multiply(self.source.stamps, 1.0 / self._rate, out=self._seconds)
                self._missing.fill(self._seconds, self.source.forces, count)
                self._follow(count)

    def _follow(self, count: int) -> None:
        begin = 0
        while self.tracker.opening and begin < count:
            self.tracker.feed(self._seconds[begin : begin + 1], self.source.forces[begin : begin + 1])
            begin += 1
        source = self.source
        _follow(
            begin, count, self._seconds, source.stamps, source.arrivals, source.forces, self._missing.absent,
            *self._memory, self._queue, self._rows, self._period,
        )  # fmt: skip

    def fill(self, force_n: np.ndarray, x_m: np.ndarray, y_m: np.ndarray, frame: int, n: int) -> None:
        """Write `n` frames from session frame `frame` on: three float64 arrays [tile, frame]."""
        _fill(
            force_n, x_m, y_m, self._queue, self._rows, frame, n, self._period, HOLD_S * self._rate,
            1.0 / (GATE_S * self._rate),
        )  # fmt: skip

    def tare(self) -> None:
        """Take what every tile reads now as its zero."""
        self.tracker.tare()


def _nobody(count: int) -> None:
    """Who hears of samples until someone else does."""


@kernel
def _fill_in(time_s, force_n, count, tiles, clock, last, since, absent):
    for i in range(count):
        for k in range(len(tiles)):
            total = 0.0
            for sensor in range(4):
                total += force_n[i, k, sensor]
            absent[i, k] = not np.isfinite(total)
            if not absent[i, k]:
                if since[k] == -np.inf and clock[0].count > 0:
                    tiles[k].untared = total >= tracking.TARE_N
                    for sensor in range(4):
                        tiles[k].base_n[sensor] = 0.0 if tiles[k].untared else force_n[i, k, sensor]
                since[k] = time_s[i]
                for sensor in range(4):
                    last[k, sensor] = force_n[i, k, sensor]
            elif since[k] > -np.inf:
                held = time_s[i] - since[k] <= GAP_S
                for sensor in range(4):
                    force_n[i, k, sensor] = last[k, sensor] if held else tiles[k].base_n[sensor]


@kernel
def _follow(
    begin, count, seconds, stamps, arrivals, forces, absent, plates, gaps_m, tiles, clock, ring, window, rows, events,
    queue, lines, period,
):  # fmt: skip
    for i in range(begin, count):
        tracking.follow(seconds[i : i + 1], forces[i : i + 1], plates, gaps_m, tiles, clock, ring, window, rows, events)
        for k in range(len(tiles)):
            tile, plate, line = tiles[k], plates[k], lines[k]
            if absent[i, k]:
                continue
            start = max(line[_LAST], stamps[i] - period, arrivals[i] - period)
            entry = queue[k, int(line[_TAIL] - 1.0) % queue.shape[1]]
            waits = line[_HEAD] < line[_TAIL] and entry[_FROM] >= arrivals[i] - period
            if stamps[i] > start or not waits:
                entry = queue[k, int(line[_TAIL]) % queue.shape[1]]
                entry[_FROM] = start
                entry[_TO] = stamps[i] if stamps[i] > start else start + period
                line[_TAIL] += 1.0
            entry[_FORCE] = tile.load_n
            dx, dy = tile.x_m - plate.centre_m[0], tile.y_m - plate.centre_m[1]
            entry[_X] = plate.axes[0, 0] * dx + plate.axes[0, 1] * dy if tile.on else 0.0
            entry[_Y] = plate.axes[1, 0] * dx + plate.axes[1, 1] * dy if tile.on else 0.0
            entry[_ON] = 1.0 if tile.on else 0.0
            line[_LAST] = entry[_TO]


@kernel
def _fill(force_n, x_m, y_m, queue, lines, frame, n, period, hold, step):
    for k in range(len(lines)):
        line = lines[k]
        begin = 0
        while begin < n:
            # One straight stretch at a time: up to the frame at which the next sample's line begins.
            end = n
            while line[_HEAD] < line[_TAIL]:
                entry = queue[k, int(line[_HEAD]) % queue.shape[1]]
                first = _first_frame(entry[_FROM], period) - frame
                if first > begin:
                    end = min(n, first)
                    break
                _next_line(line, entry, hold)
            if line[_GATE] == 0.0 and line[_OPEN] == 0.0:
                for i in range(begin, end):
                    force_n[k, i] = 0.0
                    x_m[k, i] = 0.0
                    y_m[k, i] = 0.0
            else:
                _draw(force_n[k], x_m[k], y_m[k], line, frame, begin, end, period, hold, step)
            begin = end


@kernel
def _first_frame(start, period):
    """The first frame that lies no less than a period behind `start`, whichever way the sum is rounded."""
    frame = int(np.ceil(start + period))
    while frame - 1 - period >= start:
        frame -= 1
    while frame - period < start:
        frame += 1
    return frame


@kernel
def _next_line(line, entry, hold):
    """Go on from where the signals are as the entry's line begins."""
    share = _share(line, entry[_FROM])
    held = _held(line, entry[_FROM], hold)
    for j in range(_SIGNALS):
        line[_V0 + j] += (line[_V1 + j] - line[_V0 + j]) * share
        # A centroid is held where there is no contact: on its way to 0 it would wander over the tile.
        line[_V1 + j] = entry[_FORCE + j] if j == 0 or entry[_ON] != 0.0 else line[_V0 + j]
        if j > 0 and line[_OPEN] == 0.0 and entry[_ON] != 0.0:
            line[_V0 + j] = entry[_FORCE + j]
    line[_V0] *= held
    line[_T0], line[_T1] = entry[_FROM], entry[_TO]
    line[_OPEN] = entry[_ON]
    line[_HEAD] += 1.0


@kernel
def _share(line, now):
    return min(max((now - line[_T0]) / (line[_T1] - line[_T0]), 0.0), 1.0) if line[_T1] > line[_T0] else 1.0


@kernel
def _held(line, now, hold):
    """What is left of a force that no sample has renewed: 1, then down to 0 over as long again."""
    return min(max(2.0 - (now - line[_T1]) / hold, 0.0), 1.0)


@kernel
def _draw(force, x, y, line, frame, begin, end, period, hold, step):
    for i in range(begin, end):
        now = frame + i - period
        share, held = _share(line, now), _held(line, now, hold)
        target = line[_OPEN] if held > 0.0 else 0.0
        gate = line[_GATE]
        gate = min(gate + step, target) if gate < target else max(gate - step, target)
        line[_GATE] = gate
        if gate == 0.0:
            force[i], x[i], y[i] = 0.0, 0.0, 0.0
            continue
        force[i] = (line[_V0] + (line[_V1] - line[_V0]) * share) * held * gate
        x[i] = line[_V0 + 1] + (line[_V1 + 1] - line[_V0 + 1]) * share
        y[i] = line[_V0 + 2] + (line[_V1 + 2] - line[_V0 + 2]) * share
