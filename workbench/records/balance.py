"""What all that is on a floor bears together, and where: means over `PLACES_S` of a recording, as long as it lasts.

They are bytes, 16 for each time in which there is any load: people stand for minutes, and things for days.
"""

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.floor.contacts import ContactRows

PLACES_S = 0.025
"""Time over which means are taken; a foot rolls by a centimetre or two."""
_ROW = np.dtype([("place", "<i4"), ("x_m", "<f4"), ("y_m", "<f4"), ("force_n", "<f4")])
_MOST_EMPTY = 2
"""Times between two others that have no sample, of 20 a second, or of a link with jitter: means are interpolated."""


class Loaded(Struct, frozen=True):
    """A time in which there was a load throughout: the second at which it begins, and columns x and y of its centre of
    pressure, m, and the load, N, each `PLACES_S`: shape (n, 3)."""

    begin_s: float
    places: NDArray[np.float64]

    @property
    def end_s(self) -> float:
        """The second at which it ends."""
        return self.begin_s + PLACES_S * len(self.places)


class BalanceMeans:
    """Takes the rows of contacts, in order of time, and gives the means of all times that are over."""

    def __init__(self) -> None:
        self._held = np.zeros((4, 0))

    def take(self, rows: ContactRows) -> bytes:
        """Return the means of times that are over, as more rows come."""
        samples = np.concatenate([self._held, [rows.time_s, rows.x_m, rows.y_m, rows.force_n]], axis=1)
        place = np.floor(samples[0] / PLACES_S + 1e-6)
        over = int(np.searchsorted(place, place[-1])) if len(place) else 0
        self._held = samples[:, over:]
        return self._means(samples[:, :over])

    def rest(self) -> bytes:
        """Return the means that are left at the end."""
        return self._means(self._held)

    def _means(self, samples: NDArray[np.float64]) -> bytes:
        time_s, x_m, y_m, force_n = samples
        places, at = np.unique(np.floor(time_s / PLACES_S + 1e-6), return_inverse=True)
        moments = np.array([np.bincount(at, force_n * column, len(places)) for column in (x_m, y_m)])
        sums_n = np.bincount(at, force_n, len(places))
        count = np.bincount(at, np.diff(time_s, prepend=-1.0) > 0.0, len(places))
        told = np.zeros(len(places), _ROW)
        told["place"], told["force_n"] = places, sums_n / np.maximum(count, 1.0)
        told["x_m"], told["y_m"] = moments / np.where(sums_n, sums_n, 1.0)
        return told.tobytes()


def loaded_times(balance: bytearray) -> list[Loaded]:
    """Return the times in which there is a load.

    >>> time_s = np.arange(0.5, 1.0, 0.05)
    >>> rows = ContactRows(time_s, *np.ones((4, 10)), np.ones((10, 1), bool))
    >>> means = BalanceMeans()
    >>> (one,) = loaded_times(bytearray(means.take(rows) + means.rest()))
    >>> one.begin_s, round(one.end_s, 6), one.places[0].tolist()
    (0.5, 0.975, [1.0, 1.0, 1.0])
    """
    rows = np.frombuffer(balance, _ROW)
    found = []
    for part in np.split(rows, np.flatnonzero(np.diff(rows["place"]) > 1 + _MOST_EMPTY) + 1):
        if len(part):
            place = part["place"]
            every = np.arange(place[0], place[-1] + 1)
            columns = [np.interp(every, place, part[name]) for name in ("x_m", "y_m", "force_n")]
            found.append(Loaded(PLACES_S * int(place[0]), np.column_stack(columns)))
    return found
