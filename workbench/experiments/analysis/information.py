"""Transmitted information of a confusion matrix, corrected for the bias of few trials.

With few trials the cells' probabilities are uncertain, and noise resembles structure: the plug-in estimate of 96
trials over eight stimuli is two fifths of a bit too high. Each entropy is estimated by Grassberger's method (Entropy
estimates from insufficient samplings, arXiv physics/0307138, 2003), which removes most of the bias.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.experiments.analysis.estimate import Estimate


def transmitted_bits(counts: ArrayLike, corrected: bool = True) -> float:
    """Return the information in bits that answers (columns) carry about stimuli (rows); at least 0.

    >>> transmitted_bits(12 * np.eye(8), corrected=False)
    3.0
    """
    return _bits(_matrix(counts), _corrected_bits if corrected else _plug_in_bits)


def information(counts: ArrayLike) -> Estimate:
    """Return the corrected information with a 95 % jackknife interval over trials.

    The correction has a term that alternates between odd and even counts, which the jackknife would take for spread;
    it is omitted there.

    >>> found = information(12 * np.eye(8))
    >>> round(found.value, 1)
    3.0
    """
    matrix = _matrix(counts)
    value, total = _bits(matrix, _corrected_bits), int(matrix.sum())
    weights, left_out = [], []
    for i, j in zip(*np.nonzero(matrix), strict=True):
        without = matrix.copy()
        without[i, j] -= 1
        weights.append(int(matrix[i, j]))
        left_out.append(_bits(without, _smooth_bits) if total > 1 else 0.0)
    mean = float(np.average(left_out, weights=weights))
    variance = float(np.average((np.array(left_out) - mean) ** 2, weights=weights))
    half = 1.96 * math.sqrt((total - 1) * variance)
    return Estimate("information", value, max(value - half, 0.0), value + half, "bit")


def _bits(matrix: NDArray[np.int64], entropy: Callable[[NDArray[np.int64]], float]) -> float:
    total = int(matrix.sum())
    within = sum(int(row.sum()) / total * entropy(row) for row in matrix if row.any())
    return max(float(entropy(matrix.sum(axis=0)) - within), 0.0)


def _matrix(counts: ArrayLike) -> NDArray[np.int64]:
    matrix = np.asarray(counts)
    good = matrix.ndim == 2 and matrix.sum() > 0 and (matrix >= 0).all() and (matrix == matrix.astype(np.int64)).all()
    require(bool(good), "counts", counts, "a matrix of counts, stimuli by answers, not all 0")
    return matrix.astype(np.int64)


def _plug_in_bits(counts: NDArray[np.int64]) -> float:
    shares = counts[counts > 0] / counts.sum()
    return float(-(shares * np.log2(shares)).sum())


def _corrected_bits(counts: NDArray[np.int64]) -> float:
    from scipy.special import digamma

    n = counts[counts > 0].astype(np.float64)
    jump = 0.5 * (-1.0) ** n * (digamma(0.5 * (n + 1.0)) - digamma(0.5 * n))
    return float((np.log(n.sum()) - (n * (digamma(n) + jump)).sum() / n.sum()) / math.log(2.0))


def _smooth_bits(counts: NDArray[np.int64]) -> float:
    from scipy.special import digamma

    n = counts[counts > 0].astype(np.float64)
    return float((np.log(n.sum()) - (n * digamma(n)).sum() / n.sum()) / math.log(2.0))
