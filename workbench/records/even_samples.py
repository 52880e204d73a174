"""Forces at even times, for formats that have a sample rate and no times."""

from collections.abc import Iterable, Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import GAP_S
from underfoot.floor.forces import rate_of

_AT_ONCE = 4096
"""Samples that are made even at once, at least."""


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
    pieces: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]], rate_hz: float
) -> Iterator[NDArray[np.float32]]:
    """Yield corner forces (n, tiles, 4) at even times from the first sample on, of pieces of times and forces.

    A sample goes to the nearest time. Lost ones (no sample there, or NaN) are on a line between their neighbours, as a
    foot stands on; where these are further apart than a gap of contacts they are 0. What is held at a time does not
    grow with the length: hours of a large floor, or a clock that jumped by one, do not fit into memory.

    >>> lost = np.array([100.0, np.nan, 300.0]).repeat(4).reshape(3, 1, 4)
    >>> [even] = even_forces([(np.array([0.0, 0.001, 0.003]), lost)], 1000.0)
    >>> even[:, 0, 0]
    array([100.     , 166.66667, 233.33333, 300.     ], dtype=float32)
    """
    most = max(GAP_S, 2.5 / rate_hz) * rate_hz
    reach = int(most) + 2  # samples that a later one may still change
    held, begin, done = np.zeros((0, 0, 4), np.float32), 0, 0  # from sample `begin` on; those before `done` are out
    for place, force_n in _runs(pieces, rate_hz, reach):
        end, shape = begin + len(held), force_n.shape[1:]
        first = int(place.min())
        if first > end + reach:
            yield _bridged(held, most)[done - begin :]
            for at in range(end, first, _AT_ONCE):
                yield np.zeros((min(_AT_ONCE, first - at), *shape), np.float32)
            held, begin, done = held[:0], first, first
        more = np.full((max(int(place.max()) + 1 - begin - len(held), 0), *shape), np.nan, np.float32)
        held = np.concatenate([held.reshape(-1, *shape), more])
        held[place - begin] = force_n
        ready = begin + len(held) - reach
        if ready - done >= max(_AT_ONCE, reach):
            yield _bridged(held, most)[done - begin : ready - begin]
            held, begin, done = held[ready - reach - begin :].copy(), ready - reach, ready
    yield _bridged(held, most)[done - begin :]


def _runs(
    pieces: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]], rate_hz: float, reach: int
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.float64]]]:
    """Yield the samples' places at even times, and their forces, in runs that no gap of over `reach` is within."""
    first_s = None
    for time_s, force_n in pieces:
        first_s = time_s[0] if first_s is None else first_s
        place = np.round((time_s - first_s) * rate_hz).astype(np.intp)
        ends = [0, *(1 + np.flatnonzero(np.diff(place) > reach)).tolist(), len(place)]
        for begin, end in pairwise(ends):
            yield place[begin:end], force_n[begin:end]


def _bridged(held: NDArray[np.float32], most: float) -> NDArray[np.float32]:
    """Return samples of which none is lost: on a line between those at most so many apart, else 0."""
    even = held.copy()
    for tile in np.moveaxis(even, 1, 0):
        _bridge(tile, most)
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
