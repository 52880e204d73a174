"""Smoothing of numbers that are read once per span: linear interpolation to the next value."""

from underfoot.clock import SPAN
from underfoot.kernels import kernel


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
