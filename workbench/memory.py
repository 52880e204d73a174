"""Memory that kernels read in the processor's widest vectors."""

import numpy as np
from numpy.typing import NDArray

_LINE = 64
"""Bytes in a cache line, and in the widest vector."""


def aligned_zeros(size: int) -> NDArray[np.float64]:
    """`size` zeros that begin on a cache line.

    >>> aligned_zeros(3), aligned_zeros(3).ctypes.data % 64
    (array([0., 0., 0.]), 0)
    """
    memory = np.zeros(size + _LINE // 8)
    start = -memory.ctypes.data % _LINE // 8
    return memory[start : start + size]
