"""The highest likelihood of psychometric curves with lapses and guesses, for many rows of answers at once."""

import math

import numpy as np

from underfoot.kernels import Floats

_LEAST_CHANCE = 1e-12
"""Least chance of either answer in a likelihood: 0 would rule a curve out by one answer."""
_RIDGE = 1e-12
"""Least information, so that what is known, or says nothing, can be solved for."""
_MOST_ROUNDS = 100
_NO_GAIN, _MOST_DAMPING = 1e-10, 1e10
"""Gain of a step, and damping, that end a climb."""


def bell(z: Floats) -> Floats:
    """Return the density of the standard normal distribution.

    >>> round(float(bell(np.array(0.0))), 6)
    0.398942
    """
    return np.asarray(np.exp(-0.5 * z**2) / math.sqrt(2.0 * math.pi))


def loss(chance: Floats, counts: Floats, totals: Floats) -> Floats:
    """Return the negative logarithm of the likelihood of `counts` answers of "yes", each by this chance; over the last
    axis.

    >>> round(float(loss(np.array([0.5, 0.25]), np.array([1.0, 0.0]), np.array([2.0, 1.0]))), 6)
    1.673976
    """
    chance = np.clip(chance, _LEAST_CHANCE, 1.0 - _LEAST_CHANCE)
    return np.asarray(-(counts * np.log(chance) + (totals - counts) * np.log1p(-chance)).sum(axis=-1))


class Climb:
    """Fisher's scoring of intercept, slope, lapse rate and share of guesses, for all rows of `counts` [row, level] at
    once. It is damped after a step without gain (Marquardt, J. Soc. Indust. Appl. Math. 11, 1963), and stays within
    `bounds` [value, 2]; what these leave no room is known.

    >>> counts, totals = np.array([[0.0, 5.0, 10.0, 15.0, 20.0]]), np.full(5, 20.0)
    >>> climb = Climb(np.arange(-2.0, 3.0), counts, totals, [(-9, 9), (-9, 9), (0, 0), (0, 0)], is_symmetric=True)
    >>> values, _ = climb.tops(np.array([[1.0, 0.5, 0.0, 0.0]]))
    >>> abs(values.round(3)).tolist()  # as of the regression
    [[0.0, 0.944, 0.0, 0.0]]
    """

    def __init__(
        self,
        x: Floats,
        counts: Floats,
        totals: Floats,
        bounds: list[tuple[float, float]],
        *,
        is_symmetric: bool,
    ) -> None:
        """Columns of `counts` beyond `x` are of nothing. With `is_symmetric`, guesses are as many as lapses."""
        self._x = np.append(x, np.zeros(len(totals) - len(x)))
        self._is_level = np.arange(len(totals)) < len(x)
        self._counts, self._totals, self._is_symmetric = counts, totals, is_symmetric
        self._low, self._high = np.array(bounds, np.float64).T

    def tops(self, values: Floats) -> tuple[Floats, Floats]:
        """Return the values [row, value] at the tops that are climbed to from these, and the loss there."""
        damping, climbing = np.full(len(values), 1e-3), np.full(len(values), fill_value=True)
        least = loss(self._curves(values)[0], self._counts, self._totals)
        for _ in range(_MOST_ROUNDS):
            tried = np.clip(values + self._steps(values, damping), self._low, self._high)
            found = loss(self._curves(tried)[0], self._counts, self._totals)
            gain = least - found
            better = climbing & (gain >= 0.0)
            values, least = np.where(better[:, None], tried, values), np.where(better, found, least)
            climbing &= ~(better & (gain < _NO_GAIN)) & (damping < _MOST_DAMPING)
            damping *= np.where(better, 0.1, 10.0)
            if not climbing.any():
                break
        return values, least

    def covariances(self, values: Floats) -> Floats:
        """Return the covariances of intercept and slope [row, 2, 2], from the inverse of Fisher's information."""
        free = self._low < self._high
        information = self._information(*self._curves(values)) * (free[:, None] & free)
        return np.linalg.inv(information + _RIDGE * np.eye(len(free)))[:, :2, :2]

    def _curves(self, values: Floats) -> tuple[Floats, Floats]:
        """Return the chance of "yes" [row, level], and its derivatives [row, value, level]."""
        from scipy.special import ndtr

        a, b, lapse, share = values.T[..., None]
        height = a + b * self._x
        normal, low = self._is_level * ndtr(height), lapse if self._is_symmetric else share
        rise = self._is_level * (1.0 - lapse - low) * bell(height)
        by_lapse = (1.0 - normal if self._is_symmetric else 0.0) - normal
        chance = np.clip(low + (1.0 - lapse - low) * normal, _LEAST_CHANCE, 1.0 - _LEAST_CHANCE)
        return chance, np.stack([rise, rise * self._x, by_lapse, 1.0 - normal], axis=1)

    def _information(self, chance: Floats, by: Floats) -> Floats:
        weighted = by * (self._totals / (chance * (1.0 - chance)))[:, None]
        return np.asarray((by[:, :, None] * weighted[:, None]).sum(axis=3))

    def _steps(self, values: Floats, damping: Floats) -> Floats:
        chance, by = self._curves(values)
        score = (by * ((self._counts - self._totals * chance) / (chance * (1.0 - chance)))[:, None]).sum(axis=2)
        moves = ~(((values <= self._low) & (score < 0.0)) | ((values >= self._high) & (score > 0.0)))
        information = self._information(chance, by) * (moves[:, :, None] & moves[:, None])
        diagonal = damping[:, None] * np.einsum("rpp->rp", information) + _RIDGE
        damped = information + diagonal[:, None] * np.eye(len(self._low))
        return np.asarray(np.linalg.solve(damped, (score * moves)[..., None])[..., 0])
