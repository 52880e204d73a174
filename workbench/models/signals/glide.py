"""Numbers that are read once a span, made smooth: frame by frame on a straight line to the next."""

from underfoot.clock import SPAN
from underfoot.kernels import kernel


@kernel
def glided(value: float, target: float, frame: int) -> float:
    """Where a number that stands at `value` goes in session frame `frame`, to be at `target` as the span ends.

    >>> value, way = 0.0, []
    >>> for frame in range(64):
    ...     value = glided(value, 1.0, frame)
    ...     way.append(value)
    >>> round(way[15], 9), way[31], way[63]
    (0.5, 1.0, 1.0)
    """
    left = SPAN - frame % SPAN
    return target if left == 1 else value + (target - value) / left
