"""Forces at even times, for formats that have a sample rate and no times."""

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import GAP_S
from underfoot.floor.forces import rate_of


def even_rate(time_s: NDArray[np.float64], rate_hz: float) -> float:
    """Return the rate at which samples lie best at even times: `rate_hz`, unless they slip from it by half a sample.

    >>> even_rate(np.arange(1000) / 1000.0, 1000.0), even_rate(np.arange(1000) / 998.0, 1000.0)
    (1000.0, 998.0)
    """
    if len(time_s) < 2:
        return rate_hz
    measured = rate_of(time_s)
    return rate_hz if abs(measured - rate_hz) * float(time_s[-1] - time_s[0]) < 0.5 else measured


def even_forces(
    time_s: NDArray[np.float64], force_n: NDArray[np.float64], rate_hz: float, multiple: int = 1
) -> NDArray[np.float32]:
    """Return corner forces (n, tiles, 4) at even times from the first sample on, n a multiple of `multiple`.

    A sample goes to the nearest time. Lost ones (no sample there, or NaN) are on a line between their neighbours, as a
    foot stands on; where these are further apart than a gap of contacts they are 0.

    >>> lost = np.array([100.0, np.nan, 300.0]).repeat(4).reshape(3, 1, 4)
    >>> even_forces(np.array([0.0, 0.001, 0.003]), lost, 1000.0)[:, 0, 0]
    array([100.     , 166.66667, 233.33333, 300.     ], dtype=float32)
    """
    place = np.round((time_s - time_s[0]) * rate_hz).astype(np.intp)
    count = int(place[-1]) + 1
    even = np.full((-(-count // multiple) * multiple, *force_n.shape[1:]), np.nan, np.float32)
    even[place] = force_n
    for tile in np.moveaxis(even, 1, 0):
        _bridge(tile, max(GAP_S, 2.5 / rate_hz) * rate_hz)
    return np.nan_to_num(even, copy=False)


def _bridge(tile: NDArray[np.float32], most: float) -> None:
    """Put samples on a line where those beside them are at most so many apart."""
    is_known = np.isfinite(tile).all(axis=1)
    known, lost = np.flatnonzero(is_known), np.flatnonzero(~is_known)
    after = np.searchsorted(known, lost)
    is_within = (after > 0) & (after < len(known))
    lost, after = lost[is_within], after[is_within]
    near = known[after] - known[after - 1] <= most
    for corner in tile.T:
        corner[lost[near]] = np.interp(lost[near], known, corner[known]) if near.any() else 0.0
