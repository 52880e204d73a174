"""Between a program and the shakers: nothing reaches a shaker but through here.

Each channel: level, DC block, limit of the running mean square, limit of the peak, ramps of start, stop and panic; and
silence where a value is not finite. Sample by sample, so that the result does not depend on the block.
"""

import math
from dataclasses import dataclass

import numpy as np

from underfoot.clock import FADE, RAMP
from underfoot.kernels import kernel

DC_HZ = 5.0
"""Corner of the DC block: far below the 40 Hz from which the sole feels, far above drift."""
RMS_SECONDS, BURST_SECONDS = 0.5, 0.05
"""Time over which the mean square is taken, of the order of a voice coil's heating that one can still hear coming; and
time in which a signal's power is known. A shorter burst is left as it is."""
RELEASE_SECONDS = 0.1
"""Time in which a limited channel comes back."""

PANIC = 48
"""Frames in which a panic ramps down."""

_X, _Y, _POWER, _HEAT, _PEAK_GAIN, _WIDTH = range(6)
_STILL, _LARGEST = 1e-12, 100.0


@dataclass(frozen=True)
class Limits:
    """What one channel may get, of full scale, and how many m/s^2 full scale is."""

    acceleration_per_unit: float = 20.0
    peak: float = 0.95
    rms: float = 0.35


class Safety:
    """The last stage for `limits`, one for each row; writes float32 [frame, channel] into `out`.

    `channels[row]` is the channel of a row, or -1 for a tile that has none.
    """

    def __init__(self, limits: list[Limits], channels: list[int], rate: float, block: int, width: int) -> None:
        self.out = np.zeros((block, width), np.float32)
        self._limits = np.array([(m.peak, m.rms) for m in limits])
        # Full scale a m/s^2: from, to, first frame, length; so are the level and the opening.
        self._scales = np.array([(1.0 / m.acceleration_per_unit,) * 2 + (0.0, 1.0) for m in limits])
        self.channels = np.array(channels, np.int64)
        self._state = np.zeros((len(limits), _WIDTH))
        self._state[:, _PEAK_GAIN] = 1.0
        self._coefficients = np.array(
            [
                math.exp(-2.0 * math.pi * DC_HZ / rate),
                1.0 - math.exp(-1.0 / (BURST_SECONDS * rate)),
                1.0 - math.exp(-1.0 / (RMS_SECONDS * rate)),
                1.0 - math.exp(-1.0 / (RELEASE_SECONDS * rate)),
            ]
        )
        self._level = np.array([1.0, 1.0, 0.0, 1.0])
        self._open = np.array([0.0, 0.0, 0.0, 1.0])
        self.faults = np.zeros(1, np.int64)
        self.peaks = np.zeros(len(limits))

    def rescale(self, row: int, acceleration_per_unit: float, frame: int) -> None:
        """Let full scale of a row be so many m/s^2, in a ramp of 10 ms from `frame` on."""
        self._turn(self._scales[row], 1.0 / acceleration_per_unit, frame, FADE)

    def level(self, gain: float, frame: int) -> None:
        """Go to `gain`, 0 to 1, in a ramp from `frame` on; to silence if it is not a number."""
        self._turn(self._level, min(max(gain, 0.0), 1.0) if math.isfinite(gain) else 0.0, frame, RAMP)

    def open(self, on: bool, frame: int) -> None:
        """Let sound out, or close, in a ramp of 10 ms from `frame` on. What is closing goes on as it was."""
        if on or self._open[1] != 0.0:
            self._turn(self._open, float(on), frame, FADE)

    def panic(self, frame: int) -> None:
        """Close in a ramp of 1 ms from `frame` on."""
        self._turn(self._open, 0.0, frame, PANIC)

    def closed(self, frame: int) -> bool:
        """Whether nothing is let out from `frame` on."""
        return bool(self._open[1] == 0.0 and frame >= self._open[2] + self._open[3])

    @staticmethod
    def _turn(ramp: np.ndarray, target: float, frame: int, length: int) -> None:
        now = ramp[0] + (ramp[1] - ramp[0]) * min(max((frame - ramp[2]) / ramp[3], 0.0), 1.0)
        ramp[:] = now, target, frame, length

    def apply(self, acceleration: np.ndarray, still: np.ndarray, frame: int, at: int, n: int) -> None:
        """Turn `n` frames of acceleration, float64 [row, frame] in m/s^2, into `out` from its row `at` on.

        `still` marks rows that are zero throughout. Rows on one channel add. Allocates nothing.
        """
        _protect(
            acceleration,
            still,
            self.out,
            self._limits,
            self._scales,
            self.channels,
            self._state,
            self._coefficients,
            self._level,
            self._open,
            self.faults,
            self.peaks,
            frame,
            at,
            n,
        )


def limited(signal: np.ndarray, rate_hz: float) -> np.ndarray:
    """A measuring signal (frames,), of full scale, as this stage lets it out: float64 (frames,).

    >>> bool(np.abs(limited(np.full(4800, 5.0), 48000.0)).max() <= Limits().peak)
    True
    """
    limits = Limits()
    stage = Safety([limits], [0], rate_hz, len(signal), 1)
    stage.open(True, -FADE)
    rows = np.ascontiguousarray(signal, dtype=np.float64)[None, :] * limits.acceleration_per_unit
    stage.apply(rows, np.zeros(1, np.uint8), 0, 0, len(signal))
    return stage.out[:, 0].astype(np.float64)


@kernel
def _along(ramp, frame):
    share = min(max((frame - ramp[2]) / ramp[3], 0.0), 1.0)
    return ramp[0] + (ramp[1] - ramp[0]) * share


@kernel
def _protect(x, still, out, limits, scales, channels, state, coefficients, level, opening, faults, peaks, frame, at, n):
    keep, quick, slow, release = coefficients[0], coefficients[1], coefficients[2], coefficients[3]
    for i in range(at, at + n):
        for j in range(out.shape[1]):
            out[i, j] = 0.0
    for row in range(x.shape[0]):
        channel = channels[row]
        s = state[row]
        peaks[row] *= 0.5 ** (n / 4800.0)
        if channel < 0 or (still[row] != 0 and s[_PEAK_GAIN] == 1.0 and s[_X] == s[_Y] == s[_POWER] == s[_HEAT] == 0.0):
            continue
        most, square = limits[row, 0], limits[row, 1] ** 2
        scale, settled = scales[row, 1], scales[row, 2] + scales[row, 3]
        largest = 0.0
        for i in range(n):
            now = x[row, i] * (scale if frame + i >= settled else _along(scales[row], float(frame + i)))
            if not math.isfinite(now):
                faults[0] += 1
                now = 0.0
            now = min(max(now, -_LARGEST), _LARGEST) * _along(level, float(frame + i))
            y = now - s[_X] + keep * s[_Y]
            s[_X] = now
            s[_Y] = y if abs(y) > _STILL else 0.0
            s[_POWER] = _toward(s[_POWER], y * y, quick)
            # What has not been used of the mean square may be spent in a burst, so that the mean itself keeps to it.
            allowed = square + max(square - s[_HEAT], 0.0) * (quick / slow - 1.0)
            if s[_POWER] > allowed:
                y *= math.sqrt(allowed / s[_POWER])
            s[_PEAK_GAIN] += release * (1.0 - s[_PEAK_GAIN])
            if s[_PEAK_GAIN] > 1.0 - _STILL:
                s[_PEAK_GAIN] = 1.0
            if abs(y) * s[_PEAK_GAIN] > most:
                s[_PEAK_GAIN] = most / abs(y)
            y *= s[_PEAK_GAIN] * _along(opening, float(frame + i))
            s[_HEAT] = _toward(s[_HEAT], y * y, slow)
            y = min(max(y + out[at + i, channel], -most), most)
            largest = max(largest, abs(y))
            out[at + i, channel] = y
        peaks[row] = max(peaks[row], largest)


@kernel
def _toward(mean, value, share):
    mean += share * (value - mean)
    return mean if mean > _STILL else 0.0
