"""Mapping of a device's clock to the session's, from device times and arrival times of samples.

A device's clock is even but has its own rate; samples are never early, but delayed by buffers, radio and schedulers.
So the line through the earliest arrivals maps the device's clock to the host's: the lower convex hull of the earliest
arrival of each quarter of a second of the last ten seconds (as fitted by Moon, Skelly and Towsley 1999). What
comes at twice its own pace or faster was held up, and counts for nothing. The session is mapped in the same way: its
blocks are requested on time or late. Both lines together give a sample's session frame.

Samples are then delayed by a playout delay that 99 of 100 arrivals need, so that they are evenly spaced and present
when due. Samples that arrive together count as one arrival, as late as the oldest of them: a link that always sends
bursts gets the delay that it needs, but a single stall, which delays everything, is one arrival among a hundred. The
quantile is estimated recursively (Robbins and Monro 1951): an arrival that is later raises it by 1 % of itself (at 1
kHz), any other lowers it by a 99th of that, 10 % in a second; faster in a clock's first ten seconds. The applied
mapping is slewed by at most 5 % of the elapsed time, and so never runs backwards; only a step of more than 50 ms is
applied at once; under a foot, whose samples it would squeeze together or tear apart, one of more than 0.2 s.
"""

import numpy as np
from msgspec import Struct

from underfoot.kernels import kernel

WINDOW_US, WINDOWS = 250_000.0, 40
"""Length of a window, of which the earliest arrival is kept, and number of windows kept."""
IN_TIME = 0.99
"""Share of arrivals that the playout delay covers."""
MAX_DELAY_S = 0.020
"""Largest playout delay, beyond a block: as long as a force is held in a gap
(docs/contracts.md#signals-events-rows).
"""
MAX_SLEW, JUMP_S = 0.05, 0.050
LOADED_JUMP_S = 0.2
"""Largest step that is slewed under a foot, for 4 s: until then vibration lags by it."""
MAX_DRIFT = 0.02
"""Largest drift: ceramic resonators are within half a percent, and no clock that counts microseconds exceeds this."""

CLOCK = np.dtype(
    [
        ("epoch", np.int64),
        ("origin_us", np.float64),
        ("heard", np.float64),
        ("opened", np.float64),
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
"""State of a device's clock. Fields ending in `_us` are device microseconds since `origin_us`; all others, except
`epoch` and `count`, are frames of the host. An offset is an arrival's frame minus the device's own time.

`epoch` is -1 before the first arrival; `heard` is the frame of the latest one. The open window began at `opened_us`,
which was heard in frame `opened`; its `earliest` offset was at `earliest_us`. `count` windows were closed, the latest
of which are kept. The line is `offset` at `pivot_us`, with `slope` frames per microsecond; `rms_error` is the windows'
deviation from it. `delay` is the playout delay, from arrivals of frames `began` to `noted`; `applied` is the offset
applied to the latest sample, at `applied_us`.
"""

_AT_ONCE = 0.5  # samples that come in less than this share of their time were held up, and tell nothing of the clock
_FEW = 4  # least number of windows for a rate
_UP_HZ = 10.0  # relative rate at which the delay grows while every sample comes too late
_LEAST_DELAY_S = 0.001  # a smaller delay grows as fast as this one
_NEVER_OBSERVED = -1


class ClockFit(Struct, frozen=True):
    """Fit of a device's clock to the host's: drift, error, and playout delay.

    `drift_ppm` is positive if the clock is slow (its second lasts longer), `error_s` the RMS distance of the earliest
    arrivals from the line, and `delay_s` the delay by which samples are present when due.
    """

    drift_ppm: float
    error_s: float
    delay_s: float


class DeviceClocks:
    """Clocks of `count` devices, on a host that counts `rate` frames per second. `table` has one record for each.

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
        """Reset all clocks."""
        self.table["epoch"] = _NEVER_OBSERVED

    def known_s(self, device: int) -> float:
        """Return the time in seconds for which a clock has been observed without a break."""
        return float(self.table["count"][device] * WINDOW_US * 1e-6)

    def fit(self, device: int) -> ClockFit | None:
        """Return the fit of a device's clock; None in its first second."""
        clock = self.table[device]
        if clock["count"] < _FEW:
            return None
        drift = round(float(clock["slope"] / self.rate * 1e12), 3)
        error, delay = (round(float(frames / self.rate), 9) for frames in (clock["rms_error"], clock["delay"]))
        return ClockFit(drift, error, delay)


@kernel
def observe(clock: np.record, epoch: int, microseconds: float, frame: float, rate: float) -> None:
    """Note that a sample of this (unwrapped) device time arrived in this frame of the host.

    A change of `epoch` (0 or more) resets the clock.
    """
    if clock.epoch != epoch:
        _begin(clock, epoch, microseconds, frame)
    x = microseconds - clock.origin_us
    offset = frame - x * rate * 1e-6
    clock.heard = frame
    if abs(x - clock.opened_us) >= WINDOW_US:
        if frame - clock.opened >= _AT_ONCE * WINDOW_US * 1e-6 * rate:
            _close_window(clock, rate)
        clock.opened, clock.opened_us, clock.earliest_us = frame, x, x
        clock.earliest = offset
    if offset < clock.earliest:
        clock.earliest, clock.earliest_us = offset, x
    clock.offset += min(offset - _line(clock, x), 0.0)


@kernel
def arrival_frame(clock: np.record, microseconds: float, rate: float) -> float:
    """Return the host frame of the earliest possible arrival of a sample of this device time."""
    x = microseconds - clock.origin_us
    return x * rate * 1e-6 + _line(clock, x)


@kernel
def sent_frame(clock: np.record, frame: float, rate: float) -> float:
    """Return the device time, in frames, of a sample whose earliest possible arrival is this host frame."""
    a_us = rate * 1e-6
    x_frames = (frame - clock.offset + clock.slope * clock.pivot_us) / (1.0 + clock.slope / a_us)
    return clock.origin_us * a_us + x_frames


@kernel
def note_lateness(clock: np.record, arrived: float, frames: float, most: float, period: float, rate: float) -> None:
    """Note that a sample that arrived in this frame could be used `frames` after its own frame.

    Samples come every `period` frames. Of samples that arrive together only the first, the oldest, counts. The delay
    is at most `most` frames: a later sample was held up, and says nothing about others.
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
def step_to(clock: np.record, microseconds: float, frame: float, rate: float) -> float:
    """Return by how many frames the mapping would change if a sample of this device time were placed at `frame`."""
    return frame - (microseconds - clock.origin_us) * rate * 1e-6 - clock.applied


@kernel
def slewed(clock: np.record, microseconds: float, frame: float, rate: float, jump: float) -> float:
    """Apply the mapping to a sample that belongs at `frame`; return the frame at which it is placed.

    The mapping changes by at most `MAX_SLEW` of the time since the previous sample, except for a step of more than
    `jump` frames.
    """
    x = microseconds - clock.origin_us
    passed = x - clock.applied_us
    step = step_to(clock, microseconds, frame, rate)
    most = MAX_SLEW * max(passed, 0.0) * rate * 1e-6
    if abs(step) <= jump:
        step = min(max(step, -most), most)
    clock.applied += step
    clock.applied_us = max(clock.applied_us, x)
    return x * rate * 1e-6 + clock.applied


@kernel
def _begin(clock: np.record, epoch: int, microseconds: float, frame: float) -> None:
    """Reset a clock; the line goes through this arrival. Only the windows' count is reset.

    Lateness is a property of the link, and is kept when a device's clock steps.
    """
    clock.delay = clock.delay if clock.epoch >= 0 else 0.0
    clock.epoch, clock.origin_us = epoch, microseconds
    clock.earliest = clock.offset = clock.applied = clock.began = frame
    clock.opened = frame
    clock.opened_us = clock.earliest_us = 0.0
    clock.count = 0
    clock.pivot_us = clock.slope = clock.rms_error = 0.0
    clock.applied_us = clock.noted = -np.inf


@kernel
def _close_window(clock: np.record, rate: float) -> None:
    """Keep the earliest arrival of the open window, and fit the line anew."""
    if clock.earliest - _line(clock, clock.earliest_us) > JUMP_S * rate:
        clock.count = 0  # everything is later than before: earlier windows no longer hold
    before = clock.earliest
    for age in range(1, min(clock.count, _FEW) + 1):
        before = max(before, clock.window_earliest[(clock.count - age) % WINDOWS])
    if before - clock.earliest > JUMP_S * rate:
        clock.count = 0  # earlier samples were held up, and came together: each was less late than the one before
    at = clock.count % WINDOWS
    clock.window_us[at], clock.window_earliest[at] = clock.earliest_us, clock.earliest
    clock.count += 1
    _refit(clock, rate)


@kernel
def _line(clock: np.record, x: float) -> float:
    return clock.offset + clock.slope * (x - clock.pivot_us)


@kernel
def _refit(clock: np.record, rate: float) -> None:
    """Fit the line: the segment of the earliest arrivals' lower hull at their middle."""
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
    squares = 0.0
    for i in range(count):
        squares += (earliest[i] - _line(clock, at_us[i])) ** 2
    clock.rms_error = np.sqrt(squares / count)
