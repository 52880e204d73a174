"""A reproduced figure of the thesis with its numbers beside ours; estimates of densities and slopes."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing


@dataclass(frozen=True)
class Compared:
    """One number: its name, the thesis's value, and ours."""

    what: str
    thesis: str
    ours: str


@dataclass(frozen=True)
class Figure:
    """Drawings and numbers to compare; `why` explains where the two differ, or is empty."""

    number: str
    title: str
    drawings: tuple[Drawing, ...]
    compared: tuple[Compared, ...]
    why: str = ""

    def data(self) -> dict[str, Any]:
        """Return the figure as plain data, without the drawings."""
        return {
            "number": self.number,
            "title": self.title,
            "compared": [asdict(row) for row in self.compared],
            "why": self.why,
        }


def density(
    values: NDArray[np.float64], edges: NDArray[np.float64], of: int | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Estimate a density: the centres of bins that are not empty, and the share of all `of` values per unit of width.

    >>> density(np.array([1.5, 1.6, 3.5]), np.array([1.0, 2.0, 3.0, 4.0]))[1].round(2)
    array([0.67, 0.33])
    """
    held = np.histogram(values, edges)[0]
    middles = np.sqrt(edges[1:] * edges[:-1]) if edges[0] > 0.0 else 0.5 * (edges[1:] + edges[:-1])
    some = held > 0
    return middles[some], (held / np.diff(edges) / (of or values.size))[some]


def slope(values: NDArray[np.float64], low: float, high: float) -> float:
    """Estimate the exponent of a power law from the density of values from `low` to `high`, in a dozen bins.

    >>> drawn = 1.0 / np.random.default_rng(1).random(100_000)  # of density 1 / x^2
    >>> bool(abs(slope(drawn, 1.0, 100.0) + 2.0) < 0.05)
    True
    """
    at, found = density(values, np.geomspace(low, high, 13))
    return float(np.polyfit(np.log(at), np.log(found), 1)[0])
