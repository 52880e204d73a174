"""Concealment of lost samples of single tiles, for contact trackers, while other tiles are read."""

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import ContactTracker, TrackedContacts, joined
from underfoot.floor.layout import default_floor
from underfoot.floor.tracking import TARE_N
from underfoot.kernels import kernel

LAST = np.dtype([("time_s", np.float64), ("force_n", np.float64, (4,))], align=True)
"""Latest received sample of a tile, and its time; minus infinity before the first."""
_OPENING_PIECE = 8  # samples


class LossConcealment:
    """Replaces missing samples (NaN) of single tiles before they reach a tracker, which would restart otherwise.

    A tile keeps its last sample for as long as is no gap, 40 ms or two samples and a half. Before its first sample, and
    then, it stays NaN. A tile whose first sample comes after the stream's opening is tared with it, unless it is
    loaded. `most` is the largest number of samples per call.
    """

    def __init__(self, tracker: ContactTracker, most: int) -> None:
        self._tracker = tracker
        self.tiles, self.stream = tracker.memory.tiles, tracker.memory.stream
        self.last = np.zeros(len(self.tiles), LAST)
        self.last["time_s"] = -np.inf
        self.absent = np.zeros((most, len(self.tiles)), np.bool_)
        """The tiles of the last call's samples that were missing: shape (most, tiles)."""

    def fill(self, time_s: NDArray[np.float64], force_n: NDArray[np.float64], count: int) -> None:
        """Replace missing samples among the first `count` of `force_n` (n, tiles, 4). Allocates nothing."""
        conceal(time_s, force_n, count, self.tiles, self.stream, self.last, self.absent)

    def follow(self, time_s: NDArray[np.float64], force_n: NDArray[np.float64]) -> TrackedContacts:
        """Let the tracker follow any number of samples, the missing ones replaced; those given stay, for display.

        Pass whole samples, too: a tile that falls silent keeps the last of them. The pieces are short until the
        tracker's stream has begun: only then a tile can be heard late.
        """
        times, whole = np.array(time_s, np.float64), np.array(force_n, np.float64, order="C")
        found: list[TrackedContacts] = []
        at = 0
        while at < len(times) or not found:
            piece = slice(at, at + min(len(self.absent), _OPENING_PIECE if self._tracker.opening else len(times)))
            self.fill(times[piece], whole[piece], len(times[piece]))
            found.append(self._tracker.feed(times[piece], whole[piece]))
            at = piece.stop
        return joined(found, len(self.tiles))


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
    """Do the work of `LossConcealment.fill`; `tiles` and `stream` are the tracker's."""
    for i in range(count):
        for k in range(len(tiles)):
            total = 0.0
            for sensor in range(4):
                total += force_n[i, k, sensor]
            absent[i, k] = not np.isfinite(total)
            if not absent[i, k]:
                if last[k].time_s == -np.inf and stream[0].count > 0:
                    tiles[k].untared = tiles[k].began_untared = total >= TARE_N
                    for sensor in range(4):
                        tiles[k].base_n[sensor] = 0.0 if tiles[k].untared else force_n[i, k, sensor]
                last[k].time_s = time_s[i]
                for sensor in range(4):
                    last[k].force_n[sensor] = force_n[i, k, sensor]
            elif time_s[i] - last[k].time_s <= stream[0].gap_s:
                for sensor in range(4):
                    force_n[i, k, sensor] = last[k].force_n[sensor]


def load_kernels() -> None:
    """Load or compile the kernel."""
    LossConcealment(ContactTracker(default_floor(1, 2), 1000.0), 1).follow(np.zeros(1), np.zeros((1, 2, 4)))
