"""When a sample was taken, on the session's clock, told from the device's own clock and from when its samples arrived.

A device's clock is even but goes at its own rate; what it sends is never early, but late by whatever buffers, radio and
schedulers take. So the line through the earliest arrivals is the device's clock on the host's: the lower convex hull
of the earliest arrival of each quarter of a second of the last ten (Moon, Skelly and Towsley 1999 fit it so too). The
session is a clock of the same kind: its blocks are asked for on time or late. Both lines together say which frame a
sample belongs to.

Samples are then set back by a playout delay, so that they are there when they are due, and evenly spaced: by as much
as 99 of 100 arrivals need. What arrives at once is one arrival, as late as its oldest sample: a link that always sends
many samples together gets the hold that it needs, but a moment's stall, of which everything suffers, is one among a
hundred. The quantile is followed as from a stream (Robbins and Monro 1951): an arrival that is later moves it up by 1 %
of itself (at 1 kHz), any other down by a 99th of that, 10 % in a second; in a clock's first ten seconds faster. The
mapping that is applied is slewed by at most 5 % of the time that passes, and so never runs backwards; only a step of
more than 50 ms is taken at once.
"""

from dataclasses import dataclass

import numpy as np

from underfoot.kernels import kernel

WINDOW_US, WINDOWS = 250_000.0, 40
"""The earliest arrival of each window of this length is kept, for this many of them."""
IN_TIME = 0.99
"""The share of arrivals that the playout delay is long enough for."""
MAX_DELAY_S = 0.020
"""Samples are not set back by more, beyond a block, than a force is held in a gap
(docs/contracts.md#signals-events-rows)."""
MAX_SLEW, JUMP_S = 0.05, 0.050
MAX_DRIFT = 0.02
"""Ceramic resonators are within half a percent; nothing that counts microseconds is worse than this."""

CLOCK = np.dtype(
    [
        ("epoch", np.int64),
        ("origin_us", np.float64),
        ("heard", np.float64),
        ("opened_us", np.float64),
        ("earliest", np.float64),
        ("earliest_us", np.float64),
        ("count", np.int64),
        ("window_us", np.float64, (WINDOWS,)),
        ("window_earliest", np.float64, (WINDOWS,)),
        ("pivot_us", np.float64),
        ("offset", np.float64),
        ("slope", np.float64),
        ("rms_error", np.float64),
        ("delay", np.float64),
        ("began", np.float64),
        ("noted", np.float64),
        ("applied", np.float64),
        ("applied_us", np.float64),
    ],
    align=True,
)
"""What is known of a device's clock. Fields that end in `_us` are microseconds of the device since `origin_us`; all
others, but `epoch` and `count`, are frames of the host, of which offsets are what an arrival has beyond the device's
own time.

`epoch` is -1 before anything was heard, and `heard` the frame of the latest arrival. The window that is open began at
`opened_us`; its `earliest` offset came at `earliest_us`. `count` windows were closed, the latest of which are kept. The
line is `offset` at `pivot_us`, with `slope` frames a microsecond; `rms_error` is of the windows from it. `delay` is the
playout delay, of arrivals from frame `began` to `noted`, and `applied` the offset by which the latest sample was set,
at `applied_us`."""

_FEW = 4  # windows from which a rate can be told
_UP_HZ = 10.0  # of itself: how fast the delay goes up while every sample comes too late for it
_LEAST_DELAY_S = 0.001  # of which it goes up where it is less
_UNHEARD = -1


@dataclass(frozen=True)
class ClockFit:
    """A clock against the host's: how far its second is from ours, how well that is known, and how late samples come.

    `drift_ppm` is positive where the clock is slow (its second lasts longer), `error_s` the RMS distance of the
    earliest arrivals from the line, and `delay_s` the playout delay: how far samples are set back so as to be there
    when they are due.
    """

    drift_ppm: float
    error_s: float
    delay_s: float


class DeviceClocks:
    """The clocks of `count` devices, on a host that counts `rate` frames a second. `table` has a record of each.

    >>> clocks = DeviceClocks(1, rate=48_000.0)
    >>> for i in range(5000):  # a device whose second lasts 1.0001 of ours, each sample 1 ms on its way
    ...     observe(clocks.table[0], 0, 1000.0 * i, 48.0 * (1.0001 * i + 1.0), clocks.rate)
    >>> clocks.fit(0)
    ClockFit(drift_ppm=100.0, error_s=0.0, delay_s=0.0)
    >>> round(float(arrival_frame(clocks.table[0], 4_999_000.0, clocks.rate)) / 48.0, 6)
    5000.4999
    """

    def __init__(self, count: int, rate: float) -> None:
        self.rate = rate
        self.table = np.zeros(count, CLOCK)
        self.forget()

    def forget(self) -> None:
        """Begin with every clock anew."""
        self.table["epoch"] = _UNHEARD

    def known_s(self, device: int) -> float:
        """For how long a clock was observed without a break."""
        return float(self.table["count"][device] * WINDOW_US * 1e-6)

    def fit(self, device: int) -> ClockFit | None:
        """What is known of a device's clock; None before the first second of it."""
        clock = self.table[device]
        if clock["count"] < _FEW:
            return None
        drift = round(float(clock["slope"] / self.rate * 1e12), 3)
        error, delay = (round(float(frames / self.rate), 9) for frames in (clock["rms_error"], clock["delay"]))
        return ClockFit(drift, error, delay)


@kernel
def observe(clock: np.record, epoch: int, microseconds: float, frame: float, rate: float) -> None:
    """Note that what a device sent at this (unwrapped) time of its own had arrived in this frame of the host.

    Another `epoch` (0 or more) than before begins anew.
    """
    if clock.epoch != epoch:
        _begin(clock, epoch, microseconds, frame)
    x = microseconds - clock.origin_us
    offset = frame - x * rate * 1e-6
    clock.heard = frame
    if abs(x - clock.opened_us) >= WINDOW_US:
        if clock.earliest - _line(clock, clock.earliest_us) > JUMP_S * rate:
            clock.count = 0  # all is later than it was: what was known before says nothing about now
        at = clock.count % WINDOWS
        clock.window_us[at], clock.window_earliest[at] = clock.earliest_us, clock.earliest
        clock.count += 1
        _refit(clock, rate)
        clock.opened_us = clock.earliest_us = x
        clock.earliest = offset
    if offset < clock.earliest:
        clock.earliest, clock.earliest_us = offset, x
    beyond = offset - _line(clock, x)
    if beyond < -JUMP_S * rate:  # what came so far was held up
        clock.count = 0
        clock.slope = 0.0
        clock.opened_us = x
    clock.offset += min(beyond, 0.0)


@kernel
def arrival_frame(clock: np.record, microseconds: float, rate: float) -> float:
    """The frame of the host in which what a device sends at this time of its own arrives at the earliest."""
    x = microseconds - clock.origin_us
    return x * rate * 1e-6 + _line(clock, x)


@kernel
def sent_frame(clock: np.record, frame: float, rate: float) -> float:
    """The device's own time, in frames, of what arrives in this frame of the host at the earliest."""
    a_us = rate * 1e-6
    x_frames = (frame - clock.offset + clock.slope * clock.pivot_us) / (1.0 + clock.slope / a_us)
    return clock.origin_us * a_us + x_frames


@kernel
def note_lateness(clock: np.record, arrived: float, frames: float, most: float, period: float, rate: float) -> None:
    """Note that a sample, which arrived in this frame, could be used `frames` after the one that it belongs to.

    Samples come every `period` frames. Of those that arrived at once the first counts, which is the oldest. The delay
    is `most` frames at most: what is later was held up, and says nothing of others.
    """
    if arrived == clock.noted or frames > most:
        return
    clock.noted = arrived
    step = _UP_HZ * period / rate * max(clock.delay, _LEAST_DELAY_S * rate)
    first_step = step * max(WINDOWS * WINDOW_US * 1e-6 * rate / max(arrived - clock.began, period), 1.0)
    if frames > clock.delay:
        clock.delay += max(min(first_step, frames - clock.delay), step)
    else:
        clock.delay -= min(first_step * (1.0 - IN_TIME) / IN_TIME, clock.delay - max(frames, 0.0))


@kernel
def slewed(clock: np.record, microseconds: float, frame: float, rate: float) -> float:
    """Apply the mapping to a sample that is to go to `frame`; returns where it goes.

    It may not move faster than `MAX_SLEW` against the samples before it, but for a step of more than `JUMP_S`.
    """
    x = microseconds - clock.origin_us
    passed = x - clock.applied_us
    step = frame - x * rate * 1e-6 - clock.applied
    most = MAX_SLEW * max(passed, 0.0) * rate * 1e-6
    if abs(step) <= JUMP_S * rate:
        step = min(max(step, -most), most)
    clock.applied += step
    clock.applied_us = max(clock.applied_us, x)
    return x * rate * 1e-6 + clock.applied


@kernel
def _begin(clock: np.record, epoch: int, microseconds: float, frame: float) -> None:
    """Forget all that is known; the line goes through this arrival. Windows are kept by their count alone.

    How late samples come is the link's doing, which goes on as it was when a device's clock has stepped.
    """
    clock.delay = clock.delay if clock.epoch >= 0 else 0.0
    clock.epoch, clock.origin_us = epoch, microseconds
    clock.earliest = clock.offset = clock.applied = clock.began = frame
    clock.opened_us = clock.earliest_us = 0.0
    clock.count = 0
    clock.pivot_us = clock.slope = clock.rms_error = 0.0
    clock.applied_us = clock.noted = -np.inf


@kernel
def _line(clock: np.record, x: float) -> float:
    return clock.offset + clock.slope * (x - clock.pivot_us)


@kernel
def _refit(clock: np.record, rate: float) -> None:
    """Fit the line: the lower hull of the earliest arrivals, where their middle lies."""
    count = min(clock.count, WINDOWS)
    at_us, earliest = clock.window_us[:count], clock.window_earliest[:count]
    middle = 0.0
    for i in range(count):
        middle += at_us[i] / count
    lowest, slope = np.inf, 0.0
    for i in range(count):
        for j in range(count):
            if at_us[i] <= middle < at_us[j]:
                steep = (earliest[j] - earliest[i]) / (at_us[j] - at_us[i])
                height = earliest[i] + steep * (middle - at_us[i])
                if height < lowest:
                    lowest, slope = height, steep
    if lowest == np.inf:
        middle, lowest = at_us[0], earliest[0]
    steepest = MAX_DRIFT * rate * 1e-6 if count >= _FEW else 0.0
    clock.slope = min(max(slope, -steepest), steepest)
    clock.pivot_us, clock.offset = middle, lowest
    squares, below = 0.0, 0.0
    for i in range(count):
        beyond = earliest[i] - _line(clock, at_us[i])
        below = min(below, beyond)
        squares += beyond * beyond
    clock.offset += below  # where the slope is not the hull's
    clock.rms_error = np.sqrt(squares / count)
