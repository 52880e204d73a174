"""Forces of the last ten minutes: the latest seconds as samples, earlier ones as means of 10 ms."""

import numpy as np
from numpy.typing import NDArray

from underfoot.widgets.plots.history import History

HISTORY_S = 600.0
BIN_S = 0.01
MAX_BYTES = 64 << 20
"""Memory of the means: on floors of more than 70 tiles they cover less than ten minutes."""


class ForceHistory:
    """Corner forces of a floor, in preallocated memory.

    >>> history = ForceHistory(1, 5.0, 1000.0)
    >>> history.append(np.arange(20_000) / 1000.0, np.ones((20_000, 1, 4), np.float32))
    >>> [len(history.samples_before(end_s, 5.0, 0)[0]) for end_s in (20.0, 10.0)]
    [5000, 500]
    """

    def __init__(self, tiles: int, fine_s: float, max_hz: float) -> None:
        """The latest `fine_s` seconds are kept as samples, at up to `max_hz`."""
        self._times = History(np.float64, int(fine_s * max_hz))
        self._forces = History(np.float32, int(fine_s * max_hz), tiles, 4)
        bins = min(round(HISTORY_S / BIN_S), MAX_BYTES // (16 * tiles))
        self._bins = History(np.int64, bins)
        self._means = History(np.float32, bins, tiles, 4)
        self._open_bin = -1
        self._sum = np.zeros((tiles, 4))
        self._count = 0

    def append(self, time_s: NDArray[np.float64], force_n: NDArray[np.floating]) -> None:
        """Add samples (n, tiles, 4) at `time_s` (n,), ascending."""
        self._times.append(time_s)
        self._forces.append(force_n)
        bins = np.floor(np.asarray(time_s) / BIN_S + 1e-6).astype(np.int64)
        starts = np.concatenate([[0], np.flatnonzero(np.diff(bins)) + 1])
        sums = np.add.reduceat(force_n, starts, axis=0, dtype=np.float64)
        counts = np.diff(starts, append=len(bins))
        if bins[0] == self._open_bin:
            sums[0] += self._sum
            counts[0] += self._count
            numbers = bins[starts]
        else:
            sums, counts = np.concatenate([self._sum[None], sums]), np.concatenate([[self._count], counts])
            numbers = np.concatenate([[self._open_bin], bins[starts]])
        whole = slice(int(counts[0] == 0), -1)
        self._bins.append(numbers[whole])
        self._means.append(sums[whole] / counts[whole][:, None, None])
        self._open_bin, self._sum, self._count = int(numbers[-1]), sums[-1], int(counts[-1])

    @property
    def first_s(self) -> float:
        """Beginning of the known times; NaN if there are none."""
        bins, times = self._bins.latest(), self._times.latest()
        if len(bins):
            return float(bins[0]) * BIN_S
        return float(times[0]) if len(times) else np.nan

    def missing_before(self, end_s: float, seconds: float) -> NDArray[np.float64]:
        """Return the share of each tile's samples (tiles,) in the seconds before a time that did not arrive; 0 where no
        tile sent."""
        times, forces = self._times.latest(), self._forces.latest()
        seen = slice(*np.searchsorted(times, [end_s - seconds, end_s + 1e-9]))
        missing = np.isnan(forces[seen, :, 0])
        return missing.sum(axis=0) / max(len(missing), 1)

    def samples_before(self, end_s: float, seconds: float, row: int) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
        """Return times (n,) and corner forces (n, 4) of a tile in the seconds before a time: samples if known, else
        means."""
        times, forces = self._times.latest(), self._forces.latest()
        if not len(times) or end_s - seconds < times[0]:
            bins = self._bins.latest()
            if len(bins) and float(bins[0]) * BIN_S < (times[0] if len(times) else np.inf):
                times, forces = (bins.astype(np.float64) + 0.5) * BIN_S, self._means.latest()
        seen = slice(*np.searchsorted(times, [end_s - seconds, end_s + 1e-9]))
        return times[seen], forces[seen, row]
