"""A force source at another rate, by linear interpolation."""

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.force_source import ForceSource
from underfoot.errors import require

_MAX_SAMPLES = 1 << 15


class Resampled:
    """The samples of `source` at `rate_hz`; none in a gap of the source. It allocates: not for live use.

    >>> from underfoot.devices.replay import Replay
    >>> from underfoot.floor.forces import ForceSeries
    >>> from underfoot.floor.layout import default_floor
    >>> floor = default_floor(1, 1)
    >>> forces = np.arange(5.0)[:, None, None] * np.ones((1, 1, 4))
    >>> slow = Replay(ForceSeries(np.arange(5) * 0.01, forces, 100.0), floor, 48_000.0)
    >>> fast = Resampled(slow, 200.0, 48_000.0)
    >>> fast.forces[: fast.pull(2000), 0, 0]
    array([0. , 0.5, 1. , 1.5, 2. , 2.5, 3. , 3.5, 4. ])
    """

    def __init__(self, source: ForceSource, rate_hz: float, rate: float) -> None:
        require(1.0 <= rate_hz <= 100_000.0, "rate_hz", rate_hz, "1 to 100000 Hz")
        self.floor, self.rate_hz = source.floor, rate_hz
        self._source = source
        self._period, self._gap = rate / rate_hz, 1.5 * rate / source.rate_hz
        self._stamps: NDArray[np.float64] = np.zeros(0)
        self._forces: NDArray[np.float64] = np.zeros((0, len(source.floor.tiles), 4))
        self._next = 0
        self.stamps = self.arrivals = np.zeros(_MAX_SAMPLES)
        self.forces = np.zeros((_MAX_SAMPLES, len(source.floor.tiles), 4))

    def pull(self, end: int) -> int:
        """Write the interpolated samples before session frame `end` to the buffers, as many as fit."""
        while count := self._source.pull(end):
            self._stamps = np.append(self._stamps, self._source.stamps[:count])
            self._forces = np.append(self._forces, self._source.forces[:count], axis=0)
        if not len(self._stamps):
            return 0
        last = int(np.floor(self._stamps[-1] / self._period + 1e-9))
        wanted = np.arange(self._next, min(last + 1, self._next + _MAX_SAMPLES)) * self._period
        self._next += len(wanted)
        behind = np.clip(np.searchsorted(self._stamps, wanted - 1e-6), 1, max(len(self._stamps) - 1, 1))
        behind = np.minimum(behind, len(self._stamps) - 1)
        before = np.maximum(behind - 1, 0)
        length = self._stamps[behind] - self._stamps[before]
        inside = (wanted >= self._stamps[before] - 1e-6) & (length <= self._gap)
        inside |= np.abs(wanted - self._stamps[behind]) <= 1e-6
        share = np.clip((wanted - self._stamps[before]) / np.maximum(length, 1e-9), 0.0, 1.0)[:, None, None]
        found = self._forces[before] + share * (self._forces[behind] - self._forces[before])
        count = int(inside.sum())
        self.stamps[:count], self.forces[:count] = wanted[inside], found[inside]
        kept = max(int(np.searchsorted(self._stamps, self._next * self._period)) - 1, 0)
        self._stamps, self._forces = self._stamps[kept:], self._forces[kept:]
        return count
