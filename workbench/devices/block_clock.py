"""What a sound card's clock says between its blocks, from the jittered times at which it asks for them."""

import math

_SETTLING = 2.0
"""While the count is young the loop is wider: this over its age, in radians a second."""
_LOST_S = 0.05
"""A block that is so far from where it was expected begins a new count: somebody stood still meanwhile."""
_MOST_PPM = 1000.0
"""No card is so far from its nominal rate; crystals are within 100."""


class BlockClock:
    """Follows a counter of frames that moves at nearly `rate_hz`, by a delay-locked loop of `bandwidth_hz`.

    Adriaensen, Using a DLL to filter time (Linux Audio Conference 2005), for intervals that need not be equal.

    >>> clock = BlockClock(48_000.0)
    >>> for block in range(2000):
    ...     clock.update(block * 128 / 48_004.8, 128 * block)
    >>> round(1e6 * (clock.rate_hz / 48_000.0 - 1.0))
    100
    """

    def __init__(self, rate_hz: float, bandwidth_hz: float = 0.1) -> None:
        self.rate_hz = rate_hz
        """Frames a second, as it seems."""
        self._nominal_hz, self._omega = rate_hz, 2.0 * math.pi * bandwidth_hz
        self._time_s = self._frame = self._begun_s = math.nan

    def update(self, now_s: float, frame: float) -> None:
        """At `now_s` the counter went to `frame`."""
        error = frame - self.frame_at(now_s)
        if not abs(error) < _LOST_S * self._nominal_hz:
            self._time_s = self._begun_s = now_s
            self._frame = frame
            return
        passed_s = now_s - self._time_s
        omega = max(self._omega, _SETTLING / max(now_s - self._begun_s, 0.1))
        self._frame = frame - error + min(math.sqrt(2.0) * omega * passed_s, 1.0) * error
        off_hz = self.rate_hz - self._nominal_hz + omega**2 * passed_s * error
        most_hz = 1e-6 * _MOST_PPM * self._nominal_hz
        self.rate_hz = self._nominal_hz + min(max(off_hz, -most_hz), most_hz)
        self._time_s = now_s

    @property
    def age_s(self) -> float:
        """How long it has followed this count; NaN before the first block."""
        return self._time_s - self._begun_s

    def frame_at(self, now_s: float) -> float:
        """Where the counter is at `now_s`, with the jitter of its blocks taken out; NaN before the first block."""
        return self._frame + self.rate_hz * (now_s - self._time_s)
