"""When a sample was taken, on the session's clock, told from the device's own and from when its samples came.

A device's clock is even but goes at its own rate; what it sends is never early, but late by whatever buffers, radio and
schedulers take. So the line through the earliest arrivals is the device's clock on the host's: the lower convex hull
of the earliest arrival of each quarter of a second of the last ten (Moon, Skelly and Towsley 1999 fit it so too). The
session is a clock of the same kind: its blocks are asked for on time or late. Both lines together say which frame a
sample belongs to.

Samples are then set back by as much as nearly all are late, so that they are there when they are due and evenly spaced.
What they are set by moves by at most 5 % of the time that passes, and so never runs backwards; only a step of more than
50 ms is taken at once.
"""

from dataclasses import dataclass

import numpy as np

from underfoot.kernels import kernel

WINDOW_US, KEPT = 250_000.0, 40
"""The earliest arrival of each such stretch is kept, for this many of them."""
MOST_LATE_S = 0.020
"""Samples are not set back by more than a force is held in a gap (docs/contracts.md#signals-events-rows)."""
SLEW, JUMP_S = 0.05, 0.050
MOST_DRIFT = 0.02
"""Ceramic resonators are within half a percent; nothing that counts microseconds is worse than this."""

LIFE, ORIGIN, OPENED, LOW, LOW_AT, HIGH, COUNT, OFFSET, SLOPE, AT, LATE, ERROR, USED, USED_AT, HEARD, STATE = range(16)
"""What is known of a clock. Times `_AT` are microseconds since `ORIGIN`, all else is in frames; `LATE` is what samples
are to be set back by, and `HEARD` the host's frame in which something last came."""
_FEW = 4  # stretches from which a rate can be told
_LOWER = 0.7
_NEVER = -1.0


@dataclass(frozen=True)
class ClockFit:
    """A clock against the host's: how far its second is from ours, how well that is known, and how late samples come.

    `drift_ppm` is positive where the clock is slow (its second lasts longer), `error_s` the RMS distance of the
    earliest arrivals from the line, and `late_s` how far samples are set back so as to be there when they are due.
    """

    drift_ppm: float
    error_s: float
    late_s: float


class Clocks:
    """The clocks of `count` devices, on a host that counts `rate` frames a second.

    >>> clocks = Clocks(1, rate=48_000.0)
    >>> for i in range(5000):  # a device whose second lasts 1.0001 of ours, each sample 1 ms on its way
    ...     observe(clocks.state[0], clocks.windows[0], 0, 1000.0 * i, 48.0 * (1.0001 * i + 1.0), clocks.rate)
    >>> clocks.fit(0)
    ClockFit(drift_ppm=100.0, error_s=0.0, late_s=0.0)
    >>> round(float(arrival(clocks.state[0], 4_999_000.0, clocks.rate)) / 48.0, 6)
    5000.4999
    """

    def __init__(self, count: int, rate: float) -> None:
        self.rate = rate
        self.state = np.zeros((count, STATE))
        self.state[:, LIFE] = _NEVER
        self.windows = np.zeros((count, KEPT, 3))

    def fit(self, device: int) -> ClockFit | None:
        """What is known of a device's clock; None before the first second of it."""
        clock = self.state[device]
        if clock[COUNT] < _FEW:
            return None
        drift = round(float(clock[SLOPE] / self.rate * 1e12), 3)
        error, late = (round(float(frames / self.rate), 9) for frames in (clock[ERROR], clock[LATE]))
        return ClockFit(drift, error, late)


@kernel
def observe(clock, windows, life, microseconds, frame, rate):
    """What a device sent at this (unwrapped) time of its own was there in this frame of the host.

    Another `life` (0 or more) than before begins anew.
    """
    if clock[LIFE] != life:
        clock[:] = 0.0
        clock[LIFE], clock[ORIGIN] = life, microseconds
        clock[LOW] = clock[OFFSET] = clock[USED] = frame
        clock[USED_AT] = -np.inf
    x = microseconds - clock[ORIGIN]
    z = frame - x * rate * 1e-6
    clock[HEARD] = frame
    if abs(x - clock[OPENED]) >= WINDOW_US:
        if clock[LOW] - _line(clock, clock[LOW_AT]) > JUMP_S * rate:
            clock[COUNT] = 0.0  # all is later than it was: what was known before says nothing about now
        kept = windows[int(clock[COUNT]) % KEPT]
        kept[0], kept[1], kept[2] = clock[LOW_AT], clock[LOW], clock[HIGH]
        clock[COUNT] += 1.0
        _refit(clock, windows, rate)
        clock[OPENED] = clock[LOW_AT] = x
        clock[LOW], clock[HIGH] = z, 0.0
    if z < clock[LOW]:
        clock[LOW], clock[LOW_AT] = z, x
    beyond = z - _line(clock, x)
    if beyond < -JUMP_S * rate:  # what came so far was held up
        clock[COUNT] = clock[SLOPE] = 0.0
        clock[OPENED] = x
    clock[OFFSET] += min(beyond, 0.0)


@kernel
def arrival(clock, microseconds, rate):
    """The frame of the host in which what a device sends at this time of its own is there at the earliest."""
    x = microseconds - clock[ORIGIN]
    return x * rate * 1e-6 + _line(clock, x)


@kernel
def sent(clock, frame, rate):
    """The device's own time, in frames, of what is there in this frame of the host at the earliest."""
    a_us = rate * 1e-6
    x_frames = (frame - clock[OFFSET] + clock[SLOPE] * clock[AT]) / (1.0 + clock[SLOPE] / a_us)
    return clock[ORIGIN] * a_us + x_frames


@kernel
def note_late(clock, frames, rate):
    """A sample could be used this many frames after the one that it belongs to, and no sooner."""
    clock[HIGH] = max(clock[HIGH], frames)
    if clock[COUNT] < _FEW:
        clock[LATE] = min(max(clock[LATE], frames), MOST_LATE_S * rate)


@kernel
def settle(clock, microseconds, frame, rate):
    """Where a sample goes that is to go to `frame`, if it may not move faster than `SLEW` against those before."""
    x = microseconds - clock[ORIGIN]
    passed = x - clock[USED_AT]
    step = frame - x * rate * 1e-6 - clock[USED]
    most = SLEW * max(passed, 0.0) * rate * 1e-6
    if abs(step) <= JUMP_S * rate:
        step = min(max(step, -most), most)
    clock[USED] += step
    clock[USED_AT] = max(clock[USED_AT], x)
    return x * rate * 1e-6 + clock[USED]


@kernel
def _line(clock, x):
    return clock[OFFSET] + clock[SLOPE] * (x - clock[AT])


@kernel
def _refit(clock, windows, rate):
    """The lower hull of the earliest arrivals, where their middle lies; and how late the late ones come."""
    count = min(int(clock[COUNT]), KEPT)
    middle = 0.0
    for i in range(count):
        middle += windows[i, 0] / count
    lowest, slope = np.inf, 0.0
    for i in range(count):
        for j in range(count):
            before, behind = windows[i], windows[j]
            if before[0] <= middle < behind[0]:
                steep = (behind[1] - before[1]) / (behind[0] - before[0])
                height = before[1] + steep * (middle - before[0])
                if height < lowest:
                    lowest, slope = height, steep
    if lowest == np.inf:
        middle, lowest = windows[0, 0], windows[0, 1]
    steepest = MOST_DRIFT * rate * 1e-6 if count >= _FEW else 0.0
    clock[SLOPE] = min(max(slope, -steepest), steepest)
    clock[AT], clock[OFFSET] = middle, lowest
    squares, below = 0.0, 0.0
    for i in range(count):
        beyond = windows[i, 1] - _line(clock, windows[i, 0])
        below = min(below, beyond)
        squares += beyond * beyond
    clock[OFFSET] += below  # where the slope is not the hull's
    clock[ERROR] = np.sqrt(squares / count)
    late = _late(windows, count)
    if count >= _FEW and not _LOWER * clock[LATE] <= late <= clock[LATE]:  # what is moved for nothing is jitter too
        clock[LATE] = min(late, MOST_LATE_S * rate)


@kernel
def _late(windows, count):
    """The most by which a sample was late, but for the worst tenth of the stretches."""
    for i in range(count):
        worse = 0
        for j in range(count):
            if windows[j, 2] > windows[i, 2] or (windows[j, 2] == windows[i, 2] and j < i):
                worse += 1
        if worse == count // 10:
            return windows[i, 2]
    return 0.0
