"""Exact binomial and Poisson draws at a cost that does not grow with the count, from counter-based uniforms.

Small means by waiting times; large ones by transformed rejection (W. Hoermann, The generation of binomial random
variates, J. Stat. Comput. Simul. 46, 1993, algorithm BTRS; The transformed rejection method for generating
Poisson random variables, Insurance: Mathematics and Economics 12, 1993, algorithm PTRS). Counts are float64:
exact up to 1e15.

A draw reads the uniforms `counter`, `counter + 1`, ... of the stream `key`: about three for a large mean, the count
plus one for a small mean.
"""

import math

import numpy as np

from underfoot.kernels import kernel
from underfoot.models.signals.random import uniform

_SMALL_MEAN = 10.0
"""Mean below which counts are drawn by waiting times; transformed rejection needs a mean of at least 10."""
_HALF_LOG_2_PI = 0.5 * math.log(2.0 * math.pi)


@kernel
def binomial(key: np.uint64, counter: int, trials: float, probability: float) -> float:
    """Draw the number of successes in `trials` (a whole float64) trials of `probability` (0 to 1).

    >>> binomial(np.uint64(1), 0, 5.0, 1.0), binomial(np.uint64(1), 0, 5.0, 0.0)
    (5.0, 0.0)
    """
    if not (trials >= 1.0 and probability > 0.0):
        return 0.0
    if probability >= 1.0:
        return trials
    if probability > 0.5:
        return trials - _binomial_up_to_half(key, counter, trials, 1.0 - probability)
    return _binomial_up_to_half(key, counter, trials, probability)


@kernel
def poisson(key: np.uint64, counter: int, mean: float) -> float:
    """Draw from the Poisson distribution with `mean` (0 to 1e15).

    >>> poisson(np.uint64(1), 0, 0.0)
    0.0
    """
    if not mean > 0.0:
        return 0.0
    if mean < _SMALL_MEAN:
        count = 0.0
        waited = -math.log(uniform(key, counter))
        while waited <= mean:
            count += 1.0
            counter += 1
            waited -= math.log(uniform(key, counter))
        return count
    spread = 0.931 + 2.53 * math.sqrt(mean)
    skew = -0.059 + 0.02483 * spread
    height = 1.1239 + 1.1328 / (spread - 3.4)
    squeeze = 0.9277 - 3.6224 / (spread - 2.0)
    while True:
        place = uniform(key, counter) - 0.5
        level = uniform(key, counter + 1)
        counter += 2
        edge = 0.5 - abs(place)
        count = np.floor((2.0 * skew / edge + spread) * place + mean + 0.43)
        if edge >= 0.07 and level <= squeeze:
            return count
        if count < 0.0 or (edge < 0.013 and level > edge):
            continue
        # Stirling's series around the mean: no large terms cancel.
        log_probability = count - mean - (count + 0.5) * math.log1p((count + 1.0 - mean) / mean) + 1.0
        log_probability -= 0.5 * math.log(mean) + _HALF_LOG_2_PI + _stirling_remainder(count)
        if math.log(level * height / (skew / (edge * edge) + spread)) <= log_probability:
            return count


@kernel
def _binomial_up_to_half(key: np.uint64, counter: int, trials: float, probability: float) -> float:
    if trials * probability < _SMALL_MEAN:
        per_log = 1.0 / math.log1p(-probability)
        count, passed = -1.0, 0.0
        while passed <= trials:
            passed += np.floor(math.log(uniform(key, counter)) * per_log) + 1.0
            counter += 1
            count += 1.0
        return count
    deviation = math.sqrt(trials * probability * (1.0 - probability))
    spread = 1.15 + 2.53 * deviation
    skew = -0.0873 + 0.0248 * spread + 0.01 * probability
    centre = trials * probability + 0.5
    squeeze = 0.92 - 4.2 / spread
    height = (2.83 + 5.1 / spread) * deviation
    odds = probability / (1.0 - probability)
    mode = np.floor((trials + 1.0) * probability)
    while True:
        place = uniform(key, counter) - 0.5
        level = uniform(key, counter + 1)
        counter += 2
        edge = 0.5 - abs(place)
        count = np.floor((2.0 * skew / edge + spread) * place + centre)
        if edge >= 0.07 and level <= squeeze:
            return count
        if count < 0.0 or count > trials:
            continue
        log_probability = (mode + 0.5) * math.log((mode + 1.0) / (odds * (trials - mode + 1.0)))
        log_probability += (trials + 1.0) * math.log1p((count - mode) / (trials - count + 1.0))
        log_probability += (count + 0.5) * math.log(odds * (trials - count + 1.0) / (count + 1.0))
        log_probability += _stirling_remainder(mode) + _stirling_remainder(trials - mode)
        log_probability -= _stirling_remainder(count) + _stirling_remainder(trials - count)
        if math.log(level * height / (skew / (edge * edge) + spread)) <= log_probability:
            return count


@kernel
def _stirling_remainder(n: float) -> float:
    """Return ln n! minus Stirling's formula (n + 1/2) ln(n + 1) - (n + 1) + ln(2 pi) / 2."""
    if n < 10.0:
        return math.lgamma(n + 1.0) - (n + 0.5) * math.log(n + 1.0) + n + 1.0 - _HALF_LOG_2_PI
    inverse = 1.0 / (n + 1.0)
    square = inverse * inverse
    return (1.0 / 12.0 - (1.0 / 360.0 - square / 1260.0) * square) * inverse
