"""Memory aligned for the processor's widest vectors."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

LINE = 8
"""Float64 values in a cache line, and in the widest vector."""

LANES = 4
"""Values that `lanes` processes at a time."""


def whole_lines(length: Any) -> Any:  # noqa: ANN401 - an integer, or a word of compiled code
    """Round a number of values up to whole cache lines.

    >>> whole_lines(1), whole_lines(8)
    (8, 8)
    """
    return (length + (LINE - 1)) & -LINE


def aligned_zeros(size: int) -> NDArray[np.float64]:
    """Return `size` zeros, aligned to a cache line.

    >>> aligned_zeros(3), aligned_zeros(3).ctypes.data % 64
    (array([0., 0., 0.]), 0)
    """
    memory = np.zeros(size + LINE)
    skip = -memory.ctypes.data % (8 * LINE) // 8
    return memory[skip : skip + size]
