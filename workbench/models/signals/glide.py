"""Smoothing of numbers that are read once per span: linear interpolation to the next value."""

from underfoot.clock import SPAN
from underfoot.kernels import Floats, kernel


@kernel
def glided(value: float, target: float, frame: int) -> float:
    """Return the next value, in session frame `frame`, on a line from `value` to `target` at the end of the span.

    >>> value, way = 0.0, []
    >>> for frame in range(64):
    ...     value = glided(value, 1.0, frame)
    ...     way.append(value)
    >>> round(way[15], 9), way[31], way[63]
    (0.5, 1.0, 1.0)
    """
    left = SPAN - frame % SPAN
    return target if left == 1 else value + (target - value) / left


@kernel
def multiply(signal: Floats, value: float, target: float, frame: int, out: Floats) -> float:
    """Multiply `signal`, from session frame `frame` on, by a number that glides from `value`; return its last value.

    >>> import numpy as np
    >>> out = np.zeros(64)
    >>> multiply(np.ones(64), 0.0, 1.0, 0, out), out[15].round(9), out[31]
    (1.0, np.float64(0.5), np.float64(1.0))
    """
    i = 0
    while i < out.size and value != target:
        value = glided(value, target, frame + i)
        out[i] = signal[i] * value
        i += 1
    for j in range(i, out.size):
        out[j] = signal[j] * value
    return value
