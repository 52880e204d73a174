"""A figure of the thesis drawn anew, with its numbers beside ours; and how densities and slopes are read."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing


@dataclass(frozen=True)
class Compared:
    """One number: what it is, what the thesis says, and what came out here."""

    what: str
    thesis: str
    ours: str


@dataclass(frozen=True)
class Figure:
    """What is to be seen and compared; `why` says in a sentence where the two differ, and why, or is empty."""

    number: str
    title: str
    drawings: tuple[Drawing, ...]
    compared: tuple[Compared, ...]
    why: str = ""

    def data(self) -> dict[str, Any]:
        """The figures as plain data, without the drawings."""
        return {
            "number": self.number,
            "title": self.title,
            "compared": [asdict(row) for row in self.compared],
            "why": self.why,
        }


def density(
    values: NDArray[np.float64], edges: NDArray[np.float64], of: int | None = None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where values lie: the middles of bins that hold some, and the share of all `of` values a unit of width there.

    >>> density(np.array([1.5, 1.6, 3.5]), np.array([1.0, 2.0, 3.0, 4.0]))[1].round(2)
    array([0.67, 0.33])
    """
    held = np.histogram(values, edges)[0]
    middles = np.sqrt(edges[1:] * edges[:-1]) if edges[0] > 0.0 else 0.5 * (edges[1:] + edges[:-1])
    some = held > 0
    return middles[some], (held / np.diff(edges) / (of or values.size))[some]


def slope(values: NDArray[np.float64], low: float, high: float) -> float:
    """The exponent of a power law through the density of values from `low` to `high`, in a dozen bins.

    >>> drawn = 1.0 / np.random.default_rng(1).random(100_000)  # of density 1 / x^2
    >>> bool(abs(slope(drawn, 1.0, 100.0) + 2.0) < 0.05)
    True
    """
    at, found = density(values, np.geomspace(low, high, 13))
    return float(np.polyfit(np.log(at), np.log(found), 1)[0])
