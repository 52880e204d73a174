"""Concealment of lost samples: what a contact tracker sees of a tile of which no sample came while others went on."""

import numpy as np
from numpy.typing import NDArray

from underfoot.floor import tracking
from underfoot.floor.contacts import GAP_S, ContactTracker
from underfoot.kernels import kernel

LAST = np.dtype([("time_s", np.float64), ("force_n", np.float64, (4,))], align=True)
"""The latest sample of a tile that came, and when: minus infinity where none came yet."""


class LossConcealment:
    """Fills in the samples (NaN) that a floor's tracker did not get of single tiles, so that it need not begin anew.

    A tile stays as it was for 40 ms, the time in which its force goes to 0, and then reads as it does when nobody
    stands on it; one of which no sample ever came stays NaN. A tile whose first sample comes after the stream's opening
    is tared with what it reads then, unless that is a load. `most` is how many samples are filled in at once.
    """

    def __init__(self, tracker: ContactTracker, most: int) -> None:
        self.tiles, self.stream = tracker.memory.tiles, tracker.memory.stream
        self.last = np.zeros(len(self.tiles), LAST)
        self.last["time_s"] = -np.inf
        self.absent = np.zeros((most, len(self.tiles)), np.bool_)
        """Which tiles of the samples that were filled in had none of their own: shape (most, tiles)."""

    def fill(self, time_s: NDArray[np.float64], force_n: NDArray[np.float64], count: int) -> None:
        """Fill in the first `count` samples of `force_n` (n, tiles, 4) in place. Allocates nothing."""
        conceal(time_s, force_n, count, self.tiles, self.stream, self.last, self.absent)


@kernel
def conceal(
    time_s: NDArray[np.float64],
    force_n: NDArray[np.float64],
    count: int,
    tiles: NDArray[np.void],
    stream: NDArray[np.void],
    last: NDArray[np.void],
    absent: NDArray[np.bool_],
) -> None:
    """Fill in `count` samples. `tiles` and `stream` are the tracker's, the rest is `LossConcealment`'s."""
    for i in range(count):
        for k in range(len(tiles)):
            total = 0.0
            for sensor in range(4):
                total += force_n[i, k, sensor]
            absent[i, k] = not np.isfinite(total)
            if not absent[i, k]:
                if last[k].time_s == -np.inf and stream[0].count > 0:
                    tiles[k].untared = total >= tracking.TARE_N
                    for sensor in range(4):
                        tiles[k].base_n[sensor] = 0.0 if tiles[k].untared else force_n[i, k, sensor]
                last[k].time_s = time_s[i]
                for sensor in range(4):
                    last[k].force_n[sensor] = force_n[i, k, sensor]
            elif last[k].time_s > -np.inf:
                held = time_s[i] - last[k].time_s <= GAP_S
                for sensor in range(4):
                    force_n[i, k, sensor] = last[k].force_n[sensor] if held else tiles[k].base_n[sensor]
