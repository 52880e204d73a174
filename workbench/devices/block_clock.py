"""Estimate of a sound card's clock from the jittered times of its callbacks."""

import math

_OMEGA = 2.0 * math.pi * 0.1
"""The loop's bandwidth, in radians per second."""
_SETTLING = 2.0
"""While the count is young, the bandwidth is this over its age in seconds, if that is wider."""
_LOST_S = 0.05
"""Deviation in seconds after which a block begins a new count: the process or the card was interrupted."""
_MOST_PPM = 1000.0
"""Largest deviation from the nominal rate; crystals are within 100 ppm."""


class BlockClock:
    """Tracks a frame counter of nearly `rate_hz` by a delay-locked loop.

    Adriaensen, Using a DLL to filter time (Linux Audio Conference 2005), for intervals that need not be equal.

    >>> clock = BlockClock(48_000.0)
    >>> for block in range(2000):
    ...     clock.update(block * 128 / 48_004.8, 128 * block)
    >>> round(1e6 * (clock.rate_hz / 48_000.0 - 1.0))
    100
    """

    def __init__(self, rate_hz: float) -> None:
        self.rate_hz = rate_hz
        """Estimated frames per second."""
        self._nominal_hz = rate_hz
        self._time_s = self._frame = self._begun_s = math.nan

    def update(self, now_s: float, frame: float) -> None:
        """Note that the counter reached `frame` at `now_s`."""
        error = frame - self.frame_at(now_s)
        if not abs(error) < _LOST_S * self._nominal_hz:
            self._time_s = self._begun_s = now_s
            self._frame = frame
            return
        passed_s = now_s - self._time_s
        omega = max(_OMEGA, _SETTLING / max(now_s - self._begun_s, 0.1))
        self._frame = frame - error + min(math.sqrt(2.0) * omega * passed_s, 1.0) * error
        off_hz = self.rate_hz - self._nominal_hz + omega**2 * passed_s * error
        most_hz = 1e-6 * _MOST_PPM * self._nominal_hz
        self.rate_hz = self._nominal_hz + min(max(off_hz, -most_hz), most_hz)
        self._time_s = now_s

    @property
    def age_s(self) -> float:
        """Time in seconds since this count began; NaN before the first block."""
        return self._time_s - self._begun_s

    def frame_at(self, now_s: float) -> float:
        """Return the counter's estimated value at `now_s`, without jitter; NaN before the first block."""
        return self._frame + self.rate_hz * (now_s - self._time_s)
