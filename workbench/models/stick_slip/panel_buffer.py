"""Panels of the first-passage density while it is being solved, and the hazard rate that they imply."""

from typing import TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from underfoot.models.stick_slip.boundary_integral import Grid
from underfoot.models.stick_slip.panels import GAUSS_WEIGHTS, NODES_PER_PANEL, PANEL, TO_INTEGRAL, Panels

_Item = TypeVar("_Item", np.float64, np.record)


class PanelBuffer:
    """Appendable panels. `negligible` is a probability that does not matter."""

    def __init__(self, negligible: float) -> None:
        self.negligible = negligible
        self.count = 0
        self.weight_count = 0
        """Number of weights: all components, at all nodes of all panels."""
        self.ended = 0.0
        """Probability that the slip has ended by the end of the last panel."""
        self._table = cast(NDArray[np.record], np.zeros(64, PANEL))
        self._weights = np.zeros(1 << 14)
        self._rates = np.zeros((64, NODES_PER_PANEL))
        self._hazards = np.zeros((64, NODES_PER_PANEL))

    def panels(self) -> Panels:
        """Return the panels so far; they share the buffer's memory."""
        return Panels(self._table[: self.count], self._weights[: self.weight_count], self._rates[: self.count])

    def hazards(self) -> NDArray[np.float64]:
        """Return the hazard rate at the panels' nodes, 1/s, [panels, NODES_PER_PANEL]."""
        return self._hazards[: self.count]

    def append(self, time: float, length: float, grid: Grid, weights: NDArray[np.float64]) -> None:
        """Append the panel from `time` s on with its `weights` [node, point], without negligible outer components."""
        rates = weights.sum(axis=1)
        ended_within = 0.5 * length * (rates @ TO_INTEGRAL.T)
        hazards = rates / np.maximum(1.0 - self.ended - ended_within, 0.1 * self.negligible)
        self.ended += 0.5 * length * float(GAUSS_WEIGHTS @ rates)
        begin, end = self._significant(np.abs(weights).max(axis=0) * length)
        used = self.weight_count + NODES_PER_PANEL * (end - begin)
        if self.count == len(self._table):
            self._table = _doubled(self._table)
            self._rates, self._hazards = _doubled(self._rates), _doubled(self._hazards)
        while used > self._weights.size:
            self._weights = _doubled(self._weights)
        first = grid.first + begin * grid.spacing
        self._table[self.count] = (
            *(time, length, first, grid.spacing, grid.width, grid.speed),
            *(end - begin, self.weight_count),
        )
        self._weights[self.weight_count : used] = weights[:, begin:end].ravel()
        self._rates[self.count], self._hazards[self.count] = rates, hazards
        self.weight_count = used
        self.count += 1

    def _significant(self, probabilities: NDArray[np.float64]) -> tuple[int, int]:
        """Return the range of components whose `probabilities` matter; at least one component."""
        least = 0.01 * self.negligible
        begin = int(np.searchsorted(np.cumsum(probabilities), least))
        end = probabilities.size - int(np.searchsorted(np.cumsum(probabilities[::-1]), least))
        return (begin, end) if begin < end else (0, 1)


def _doubled(array: NDArray[_Item]) -> NDArray[_Item]:
    return np.concatenate([array, np.zeros_like(array)])
