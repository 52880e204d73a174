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
        self._rows = np.zeros((2 * capacity, *shape), dtype)
        self._end = 0

    def append(self, rows: ArrayLike) -> None:
        """Add rows; the oldest are dropped."""
        new = np.asarray(rows, self._rows.dtype)
        new = new[max(0, len(new) - self.capacity) :]
        if self._end + len(new) > len(self._rows):
            kept = self.latest()[max(0, len(self.latest()) + len(new) - self.capacity) :].copy()
            self._rows[: len(kept)] = kept
            self._end = len(kept)
        self._rows[self._end : self._end + len(new)] = new
        self._end += len(new)

    def latest(self) -> NDArray[Scalar]:
        """Return the latest rows, at most `capacity`, oldest first; a view that the next `append` may change."""
        return self._rows[max(0, self._end - self.capacity) : self._end]

    def clear(self) -> None:
        self._end = 0
