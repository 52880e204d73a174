"""Modes that are drawn: p(f) ~ f^alpha between two frequencies, amplitudes ~ f^-r (7.26)."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, kernel
from underfoot.models.signals.random import stream_key, uniform


def draws(count: int, draw: int) -> Floats:
    """Return `count` uniform random numbers in (0, 1), ascending; equal for equal `draw`.

    >>> draws(3, 1).shape
    (3,)
    """
    key = stream_key("modes", draw)
    return np.array(sorted(uniform(key, mode) for mode in range(count)))


@kernel
def place(
    draws: Floats,
    low_hz: float,
    high_hz: float,
    alpha: float,
    rolloff: float,
    quality: float,
    damping: float,
    modes: NDArray[np.float64],
) -> None:
    """Fill `modes` [3, m], rows of frequency (Hz), decay (1/s) and amplitude, from rising `draws` [m] in (0, 1).

    Frequencies have the density p(f) ~ f^alpha and rise with the draws; decays are pi low / quality (f / low)^damping;
    amplitudes are proportional to f^-rolloff, and their squares sum to 1.

    >>> modes = np.zeros((3, 2))
    >>> place(np.array([0.25, 0.75]), 100.0, 500.0, 0.0, 0.0, 10.0, 1.0, modes)
    >>> modes[0].round(9)
    array([200., 400.])
    """
    width = max(math.log(high_hz / low_hz), 0.0)
    power = alpha + 1.0
    span = math.expm1(power * width)
    squares = 0.0
    for m in range(draws.size):
        # Near alpha = -1 the distribution is log-uniform, to which the general one tends.
        above = draws[m] * width if abs(power) < 1e-9 else math.log1p(draws[m] * span) / power
        modes[0, m] = low_hz * math.exp(above)
        modes[1, m] = math.pi * low_hz / quality * math.exp(damping * above)
        modes[2, m] = math.exp(-rolloff * above)
        squares += modes[2, m] ** 2
    for m in range(draws.size):
        modes[2, m] /= math.sqrt(squares)
