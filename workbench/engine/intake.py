"""Conversion of force samples into the signals of a program: tared, gated, and linearly interpolated.

From frame s to s + period the force ramps to the sample of frame s, so that the next sample is always known: the force
at audio rate is delayed by exactly one sample period, live and offline. A sample that arrives too late for that is
ramped to within one period of its arrival; of several that arrive together, only the newest is used. Where samples are
missing, on the whole floor or on a tile that is NaN, the last force is held for 20 ms and then ramped to 0 in 0.2 s. A
tile's signals are exactly 0 while nobody stands on it; its gate opens and closes in 5 ms. After a gap, and from a
tile's first sample on, the force changes no faster than a foot changes it until it is what is measured: by 10 kN/s
where somebody landed or left meanwhile, and in 0.2 s, as slowly as weight is shifted, where somebody stands who stood
there before. The signal `cut` is 1 in these 0.2 s: that is no landing. Who has shifted more meanwhile than 600 N in 0.2
s was landing or leaving.

Times are in session frames of the samples: the output at frame f depends on the samples of f - period.
"""

import math
from collections.abc import Callable
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.array_tables import B1, F1, F3, addresses, arrays_at
from underfoot.devices.force_source import MAX_SAMPLES, ForceSource
from underfoot.engine.simulated_step import StepAdder
from underfoot.floor import tracking
from underfoot.floor.contacts import ContactTracker
from underfoot.floor.layout import PLATE
from underfoot.floor.loss_concealment import LAST, LossConcealment, conceal
from underfoot.floor.tracker_memory import STREAM, TILE
from underfoot.kernels import Floats, block_kernel, call_at, inlined, kernel

HOLD_S = 0.020
"""Seconds for which a force is held in a gap."""
GATE_S, SHIFT_S = 0.005, 0.2
"""Seconds in which the gate opens or closes, and in which a force that is there fades in a gap and returns after it. A
faster change is a load that no foot makes: ground breaks under it, louder than under a landing
(docs/contracts.md#signals-events-rows).
"""
LANDING_N_S = 10_000.0
"""Rate of the force where a foot landed or left in a gap, N/s: that of walking (5.3 to 13.1 kN/s in measured
footsteps)."""

WEIGHT_N = 600.0
"""Weight of a person, in newtons, that is shifted in `SHIFT_S`. A load that changed faster in a gap was landing or
leaving."""

_LEAST_QUEUE = 1024  # samples of a tile that can wait, beside those of the block
_LONG_AGO = -1e18

SAMPLE = np.dtype(
    [
        ("from_frame", np.float64),
        ("at_frame", np.float64),
        ("values", np.float64, (3,)),
        ("contact", np.bool_),
        ("untared", np.bool_),
    ],
    align=True,
)
"""A tile's queued sample. The signals ramp to its `values` (force in newtons, then the centroid's x and y in metres,
tile frame) from `from_frame` to `at_frame`; `contact` is whether somebody stands on the tile (else x and y mean
nothing), `untared` whether since its first sample.
"""

SEGMENT = np.dtype(
    [
        ("from_frame", np.float64),
        ("from_values", np.float64, (3,)),
        ("at_frame", np.float64),
        ("at_values", np.float64, (3,)),
        ("gate", np.float64),
        ("gate_target", np.float64),
        ("force_n", np.float64),
        ("slew", np.float64),
        ("queue_head", np.int64),
        ("queue_tail", np.int64),
        ("last_frame", np.float64),
        ("zeros", np.int64),
        ("cut_end", np.int64),
    ],
    align=True,
)
"""Line segment that a tile's signals follow, its gate (0 to 1) and the gate's target, the last force that was written,
and by how much it may go up (down, if negative) per frame, until it is the line's: 0 for at once. Its queue: samples
removed and added since it was last empty, and the last `at_frame`. The first `zeros` frames of the block are zero.
Before frame `cut_end` the force rises that was there before the tile's first sample, or before a gap.
"""

TIMING = np.dtype(
    [(name, np.float64) for name in ("frame_s", "period", "hold", "gate", "shift", "landing")], align=True
)
"""Seconds per frame; the sample period, `HOLD_S`, `GATE_S` and `SHIFT_S` in frames; `LANDING_N_S` in N per frame."""


class IntakeMemory(NamedTuple):
    """All arrays that the kernels read and write, as `array_tables` passes them."""

    seconds: F1  # [sample]: stamps in seconds
    stamps: F1  # the source's, like arrivals and forces
    arrivals: F1
    forces: F3  # [sample, tile, sensor]
    absent: Annotated[np.ndarray, np.dtype(np.bool_), 2]  # [sample, tile]: no sample of its own
    last: Annotated[np.ndarray, LAST, 1]
    plates: Annotated[np.ndarray, PLATE, 1]  # the tracker's, like tiles and stream
    tiles: Annotated[np.ndarray, TILE, 1]
    stream: Annotated[np.ndarray, STREAM, 1]
    queue: Annotated[np.ndarray, SAMPLE, 2]  # [tile, place]
    segments: Annotated[np.ndarray, SEGMENT, 1]  # [tile]
    timing: Annotated[np.ndarray, TIMING, 1]  # [1]
    signals: F3  # [signal, tile, frame]
    zero_rows: B1  # [tile]


class Intake:
    """Turns the samples of `source` into the force and centroid (tile frame) of each tile, frame by frame.

    `signals`, float64 [signal, tile, frame], holds `block` frames: force in newtons, the centroid's x and y in metres,
    if they were asked for, and `cut`. Nothing else may write to it: zeros are not rewritten. `zero_rows` marks tiles
    whose signals are zero in all frames filled last. `on_samples` is called with the number of samples whenever some
    arrive, while the source still holds them as read, without the added `steps`.
    """

    def __init__(self, source: ForceSource, rate_hz: float, block: int) -> None:
        self.source = source
        self.signals = np.zeros((4, len(source.floor.tiles), block))
        self.zero_rows = np.ones(len(source.floor.tiles), np.uint8)
        self.tracker = ContactTracker(source.floor, source.rate_hz)
        self.on_samples: Callable[[int], None] = _ignore
        self.steps = StepAdder(rate_hz)
        self._concealment = LossConcealment(self.tracker, MAX_SAMPLES)
        tiles = len(source.floor.tiles)
        self._timing = np.zeros(1, TIMING)
        self._timing["frame_s"] = 1.0 / rate_hz
        self._timing["period"] = rate_hz / source.rate_hz
        self._timing["hold"] = HOLD_S * rate_hz
        self._timing["gate"], self._timing["shift"] = GATE_S * rate_hz, SHIFT_S * rate_hz
        self._timing["landing"] = LANDING_N_S / rate_hz
        # A power of two, so that indexing needs no division.
        waiting = 1 << math.ceil(math.log2(_LEAST_QUEUE + block * source.rate_hz / rate_hz))
        self._queue = np.zeros((tiles, waiting), SAMPLE)
        self._segments = np.zeros(tiles, SEGMENT)
        for name in ("from_frame", "at_frame", "last_frame"):
            self._segments[name] = _LONG_AGO
        followed = self.tracker.memory._replace(time_s=np.zeros(MAX_SAMPLES), force_n=source.forces)
        self._memory = IntakeMemory(
            followed.time_s, source.stamps, source.arrivals, source.forces,
            self._concealment.absent, self._concealment.last, followed.plates, followed.tiles, followed.stream,
            self._queue, self._segments, self._timing, self.signals, self.zero_rows,
        )  # fmt: skip
        self._where, self._followed = addresses(self._memory), addresses(followed)
        self._following = tracking.following().address, self._followed.ctypes.data
        self._take = _take.specialised(self._where, *self._following, 0, 0)
        self._fill = _fill.specialised(self._where, 0, 0, True)

    def take(self, end: int) -> None:
        """Take the samples before session frame `end` from the source, and track contacts through them."""
        count = MAX_SAMPLES
        while count == MAX_SAMPLES:
            count = self.source.pull(end)
            if count:
                self.on_samples(count)
                self.steps.add(self.source.stamps, self.source.forces, count)
                if self.tracker.opening:
                    self._open(count)
                else:
                    self._take(self._where, *self._following, 0, count)

    def fill(self, frame: int, n: int, with_centroid: bool = True) -> None:
        """Write `n` frames into `signals`, from session frame `frame` on; of x and y, without centroid, only zeros."""
        self._fill(self._where, frame, n, with_centroid)

    def tare(self) -> None:
        """Take the present reading of every tile as its zero."""
        self.tracker.tare()

    def _open(self, count: int) -> None:
        """Pass the stream's first samples to the tracker until it knows the initial state of each tile."""
        seconds, forces = self._memory.seconds, self.source.forces
        np.multiply(self.source.stamps, self._timing["frame_s"], out=seconds)
        self._concealment.fill(seconds, forces, count)
        begin = 0
        while self.tracker.opening and begin < count:
            self.tracker.feed(seconds[begin : begin + 1], forces[begin : begin + 1])
            begin += 1
        self._take(self._where, *self._following, begin, count)


_FARTHEST = 1 << 52  # frames: beyond this, float64 has no halves, and nearby sums are equal


def _ignore(count: int) -> None:
    """Ignore samples; the default of `on_samples`."""


_memory_at = arrays_at(IntakeMemory)


@block_kernel
def _take(where: NDArray[np.int64], follow: int, followed: int, begin: int, count: int) -> None:
    """Track contacts through the source's samples `begin` to `count`, and queue each tile's samples.

    `follow` is the address of `tracking.following`, `followed` that of the addresses of its memory. With `begin` 0,
    lost samples are concealed first.
    """
    m = _memory_at(where)
    if begin == 0:
        for i in range(count):
            m.seconds[i] = m.stamps[i] * m.timing[0].frame_s
        conceal(m.seconds, m.forces, count, m.tiles, m.stream, m.last, m.absent)
    for i in range(begin, count):
        call_at(follow, followed, i, i + 1)
        for k in range(len(m.tiles)):
            if not m.absent[i, k]:
                _enqueue(m.queue[k], m.segments[k], m.tiles[k], m.plates[k], m.stamps[i], m.arrivals[i], m.timing[0])


@kernel
def _enqueue(
    queue: NDArray[np.void],
    segment: np.record,
    tile: np.record,
    plate: np.record,
    stamp: float,
    arrival: float,
    timing: np.record,
) -> None:
    """Queue a tile's sample, or replace one that arrived at the same time.

    Where nobody stands, and nothing waits, one that is in time changes no frame before the next sample: it is taken at
    once, in place of being queued.
    """
    period, places = timing.period, queue.size - 1
    start = max(segment.last_frame, stamp - period, arrival - period)
    waiting = segment.queue_head < segment.queue_tail
    if not (tile.on or waiting) and stamp > start and _is_at_rest(segment):
        _rest(segment, start, stamp, tile.load_n)
        return
    sample = queue[(segment.queue_tail - 1) & places]
    waits = waiting and sample.from_frame >= arrival - period
    if stamp > start or not waits:
        sample = queue[segment.queue_tail & places]
        sample.from_frame = start
        sample.at_frame = stamp if stamp > start else start + period
        segment.queue_tail += 1
    sample.contact, sample.untared = tile.on, tile.untared
    sample.values[0] = tile.load_n
    dx, dy = tile.x_m - plate.centre_m[0], tile.y_m - plate.centre_m[1]
    sample.values[1] = plate.axes[0, 0] * dx + plate.axes[0, 1] * dy
    sample.values[2] = plate.axes[1, 0] * dx + plate.axes[1, 1] * dy
    segment.last_frame = sample.at_frame


@inlined
def _rest(segment: np.record, now: float, at_frame: float, load_n: float) -> None:
    """Do as `_next_segment` for a sample without contact on an empty tile, whose last segment is over."""
    for j in range(3):
        segment.from_values[j] += segment.at_values[j] - segment.from_values[j]
        segment.at_values[j] = load_n if j == 0 else segment.from_values[j]
    segment.from_frame, segment.at_frame = now, at_frame
    segment.last_frame = at_frame


@block_kernel
def _fill(where: NDArray[np.int64], frame: int, n: int, with_centroid: bool) -> None:
    """Write `n` frames of signals, tile by tile."""
    m = _memory_at(where)
    signals, queue, segments, timing = m.signals, m.queue, m.segments, m.timing
    places = queue.shape[1] - 1
    for k in range(len(segments)):
        segment = segments[k]
        begin = 0
        while begin < n:
            # One segment at a time, up to the frame at which the next sample's segment begins.
            end = n
            while segment.queue_head < segment.queue_tail:
                sample = queue[k, segment.queue_head & places]
                first = _first_frame(sample.from_frame, timing[0].period) - frame
                if first > begin:
                    end = min(n, first)
                    break
                _next_segment(segment, sample, timing[0])
            if _is_at_rest(segment):
                for j in range(4):
                    for i in range(max(begin, segment.zeros), end):
                        signals[j, k, i] = 0.0
                if begin <= segment.zeros < end:
                    segment.zeros = end
            else:
                force_n, x_m, y_m = signals[0, k, begin:end], signals[1, k, begin:end], signals[2, k, begin:end]
                if not with_centroid:
                    x_m, y_m = x_m[:0], y_m[:0]
                _write_frames(force_n, x_m, y_m, segment, timing[0], frame + begin)
                cut_end = min(max(segment.cut_end - frame, begin), end)
                signals[3, k, begin:cut_end] = 1.0
                signals[3, k, cut_end:end] = 0.0
                segment.zeros = min(segment.zeros, begin)
            begin = end
        m.zero_rows[k] = segment.zeros >= n
        if segment.queue_head == segment.queue_tail:
            segment.queue_head = segment.queue_tail = 0  # reuse the same few places: they are still in the cache


@inlined
def _is_at_rest(segment: np.record) -> bool:
    """Return whether the signals are 0 until the next sample with contact."""
    return segment.gate == 0.0 and segment.gate_target == 0.0 and segment.force_n == 0.0


@kernel
def _first_frame(start: float, period: float) -> int:
    """Return the first frame at least one period after `start`, whichever way the sum is rounded."""
    if not abs(start) < _FARTHEST:
        return _FARTHEST if start > 0.0 else -_FARTHEST
    frame = int(np.ceil(start + period))
    while frame - 1 - period >= start:
        frame -= 1
    while frame - period < start:
        frame += 1
    return frame


@kernel
def _next_segment(segment: np.record, sample: np.record, timing: np.record) -> None:
    """Begin the segment to a sample, from the present values of the signals."""
    now = sample.from_frame
    share = _share(segment, now)
    for j in range(3):
        segment.from_values[j] += (segment.at_values[j] - segment.from_values[j]) * share
        # Hold the centroid where there is no contact: ramping to 0, it would wander over the tile.
        segment.at_values[j] = sample.values[j] if j == 0 or sample.contact else segment.from_values[j]
        if j > 0 and segment.gate_target == 0.0 and sample.contact:
            segment.from_values[j] = sample.values[j]
    if not sample.contact:
        segment.cut_end = 0
    if now - segment.at_frame > timing.hold:  # the slew takes the place of the line
        pace, moved = timing.landing, abs(sample.values[0] - segment.from_values[0])
        shifting = max(sample.values[0], WEIGHT_N) / timing.shift
        stood = segment.gate_target == 1.0 or (sample.untared and segment.at_frame == _LONG_AGO)
        if sample.contact and stood and moved <= shifting * (sample.at_frame - segment.at_frame):
            pace, segment.cut_end = shifting, _first_frame(sample.at_frame + timing.shift, timing.period)
        segment.slew = pace if sample.values[0] > segment.force_n else -pace
        segment.from_values[0] = sample.values[0]
    segment.from_frame, segment.at_frame = now, sample.at_frame
    segment.gate_target = 1.0 if sample.contact else 0.0
    segment.queue_head += 1


@kernel
def _share(segment: np.record, now: float) -> float:
    """Return the share of the segment that has passed: 0 to 1."""
    if now >= segment.at_frame:  # most often; spares a division
        return 1.0
    length = segment.at_frame - segment.from_frame
    return min(max((now - segment.from_frame) / length, 0.0), 1.0) if length > 0.0 else 1.0


@kernel
def _held(segment: np.record, now: float, timing: np.record) -> float:
    """Return the gain of a force without newer samples: 1 while held, then a ramp to 0."""
    over = now - segment.at_frame - timing.hold
    return max(1.0 - over / timing.shift, 0.0) if over > 0.0 else 1.0


@kernel
def _write_frames(force_n: Floats, x_m: Floats, y_m: Floats, segment: np.record, timing: np.record, frame: int) -> None:
    """Write a tile's signals, all on one segment, from session frame `frame` on; empty ones are not wanted."""
    last = frame + force_n.size - 1 - timing.period
    if segment.gate == segment.gate_target == 1.0 and segment.slew == 0.0 and _held(segment, last, timing) == 1.0:
        _write_frames_ungated(force_n, x_m, y_m, segment, timing.period, frame)
        segment.force_n = force_n[force_n.size - 1]
        return
    start, target, step = segment.from_values, segment.at_values, 1.0 / timing.gate
    for i in range(force_n.size):
        now = frame + i - timing.period
        share, held = _share(segment, now), _held(segment, now, timing)
        goal = segment.gate_target if held > 0.0 else 0.0
        gate = segment.gate
        gate = min(gate + step, goal) if gate < goal else max(gate - step, goal)
        segment.gate = gate
        now_n = (start[0] + (target[0] - start[0]) * share) * held * gate if gate != 0.0 else 0.0
        limit_n = segment.force_n + segment.slew
        if now_n > limit_n if segment.slew > 0.0 else now_n < limit_n and segment.slew < 0.0:
            now_n = limit_n
        else:
            segment.slew = 0.0
        segment.force_n = force_n[i] = now_n
        if x_m.size:
            x_m[i] = start[1] + (target[1] - start[1]) * share if gate != 0.0 or now_n != 0.0 else 0.0
            y_m[i] = start[2] + (target[2] - start[2]) * share if gate != 0.0 or now_n != 0.0 else 0.0


@kernel
def _write_frames_ungated(
    force_n: Floats, x_m: Floats, y_m: Floats, segment: np.record, period: float, frame: int
) -> None:
    """Do as `_write_frames`, bit for bit, where the gate is open and the force is not ramped: no tests per frame."""
    _draw_line(force_n, 0, segment, period, frame)
    _draw_line(x_m, 1, segment, period, frame)
    _draw_line(y_m, 2, segment, period, frame)


@kernel
def _draw_line(out: Floats, signal: int, segment: np.record, period: float, frame: int) -> None:
    """Write one signal of a segment."""
    since, length = segment.from_frame, segment.at_frame - segment.from_frame
    start, step = segment.from_values[signal], segment.at_values[signal] - segment.from_values[signal]
    if not length > 0.0:
        for i in range(out.size):
            out[i] = start + step
        return
    first = float(frame)
    for i in range(out.size):  # the sum is exact; of 64 bits, `i` is converted number by number, in twice the time
        out[i] = start + step * min(max((first + np.int32(i) - period - since) / length, 0.0), 1.0)
