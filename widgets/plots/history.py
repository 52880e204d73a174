"""The latest rows of a stream, for live plots."""

from typing import Generic, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Scalar = TypeVar("Scalar", bound=np.generic)


class History(Generic[Scalar]):
    """The latest rows of a stream, in order and contiguous, in preallocated memory: `capacity` rows of this shape.

    >>> history = History(np.float64, 3, 2)
    >>> history.append([[1, 1], [2, 2]])
    >>> history.append([[3, 3], [4, 4]])
    >>> history.latest()[:, 0]
    array([2., 3., 4.])
    """

    def __init__(self, dtype: type[Scalar], capacity: int, *shape: int) -> None:
        self.capacity = capacity
        self._rows = np.zeros((2, capacity, *shape), dtype)  # the same rows twice, so that any stretch is contiguous
        self._both = self._rows.reshape(2 * capacity, *shape)
        self._count = 0

    def append(self, rows: ArrayLike) -> None:
        """Add rows; the oldest are dropped."""
        new = np.asarray(rows, self._rows.dtype)
        new = new[max(0, len(new) - self.capacity) :]
        while len(new):
            at = self._count % self.capacity
            fits, new = np.split(new, [self.capacity - at])
            self._rows[:, at : at + len(fits)] = fits
            self._count += len(fits)

    def latest(self) -> NDArray[Scalar]:
        """Return the latest rows, at most `capacity`, oldest first; a view that the next `append` may change."""
        if self._count <= self.capacity:
            return self._both[: self._count]
        oldest = self._count % self.capacity
        return self._both[oldest : oldest + self.capacity]

    def clear(self) -> None:
        self._count = 0
