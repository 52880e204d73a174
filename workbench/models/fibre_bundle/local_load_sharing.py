"""Local load sharing, beyond chapter 7: a ring of fibres in which neighbours take the load of a broken fibre.

Quasi-static. A share `locality` of a broken fibre's load goes to the nearest intact fibres, half to each side; the rest
is shared by all intact ones (mixed-mode sharing: Pradhan, Chakrabarti and Hansen, Phys. Rev. E 71, 036149, 2005).
Locality 0 is the global load sharing of (7.1), 1 the one-dimensional local model of Harlow and Phoenix. For fracture in
time and in the plane, with sharing over a chosen distance, see `grid`.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import HUGE, TINY, number, numbers, seed_of
from underfoot.errors import require
from underfoot.kernels import Floats, allocating, kernel
from underfoot.models.fibre_bundle.bundle import FibreBundle
from underfoot.models.signals.random import stream_key, uniform


@dataclass(frozen=True)
class Avalanches:
    """Avalanches of a ring under rising load: one value per avalanche, in order."""

    load: NDArray[np.float64]
    """Total load at which the avalanche began, rising."""
    fibres: NDArray[np.int64]
    """Fibres that broke in it; the sum over all avalanches is the number of fibres."""

    @property
    def strength(self) -> float:
        """Load that breaks the last fibre: the critical load of this sample."""
        return float(self.load[-1])


def ring(thresholds: ArrayLike, stiffness: float = 1.0, locality: float = 1.0) -> Avalanches:
    """Raise the load on a ring of fibres until all have broken.

    `thresholds` are the breaking strains in ring order, `stiffness` is k_F per fibre; `locality`, 0 to 1, is the share
    of a broken fibre's load that its neighbours take. The cost grows with the square of the number of fibres:
    20,000 take about half a second. Raises `BadValue`.

    >>> broken = ring([1.0, 1.6, 9.0, 9.0, 9.0, 1.1], locality=1.0)  # the sixth is the first one's neighbour
    >>> broken.fibres.tolist(), broken.load.round(3).tolist()
    ([3, 3], [6.0, 21.6])
    """
    strains = numbers("thresholds", thresholds)
    require(strains.size > 0, "thresholds", strains.size, "at least one fibre")
    require(bool((strains > 0.0).all()), "the least of thresholds", strains.min(), "above 0")
    number("stiffness", stiffness, TINY, HUGE, "above 0")
    number("locality", locality, 0.0, 1.0, "0 to 1")
    loads, fibres = np.zeros(strains.size), np.zeros(strains.size, np.int64)
    count = _raise_load(strains, locality, loads, fibres)
    return Avalanches(stiffness * strains.size * loads[:count], fibres[:count])


def draw_thresholds(
    fibres: int, shape: float = 4.0, scale: float = 2.5, seed: int = 0, thresholds: str = "weibull"
) -> NDArray[np.float64]:
    """Draw independent breaking strains, shape [fibres], distributed as in a `FibreBundle`. Raises `BadValue`.

    >>> strains = draw_thresholds(2000)
    >>> bool(abs(strains.mean() - 2.266) < 0.05)  # lambda Gamma(1 + 1/k)
    True
    """
    FibreBundle(fibres, shape, scale, thresholds=thresholds)
    probabilities = np.zeros(int(fibres))
    _draw(probabilities, stream_key(seed_of(seed), "thresholds"))
    if thresholds == "uniform":
        return scale * probabilities
    return scale * (-np.log(probabilities)) ** (1.0 / shape)


@kernel
def _draw(probabilities: Floats, key: np.uint64) -> None:
    for i in range(probabilities.size):
        probabilities[i] = uniform(key, i)


@allocating
@kernel
def _raise_load(strains: Floats, locality: float, loads: Floats, fibres: NDArray[np.int64]) -> int:
    """Break all fibres; fill loads per fibre and sizes of the avalanches, and return their number."""
    size = strains.size
    intact = np.ones(size, np.bool_)
    bearing = np.empty(size)
    left, count, load = size, 0, 0.0
    while left > 0:
        _bearing(strains, intact, (1.0 - locality) * (size - left) / left, locality, bearing)
        weakest = bearing.min()
        if weakest > load:
            load = weakest
            loads[count] = load
            count += 1
        for i in range(size):
            if bearing[i] <= load:
                intact[i] = False
                fibres[count - 1] += 1
                left -= 1
    return count


@kernel
def _bearing(strains: Floats, intact: NDArray[np.bool_], spread: float, locality: float, bearing: Floats) -> None:
    """Compute for each fibre the load per fibre of the ring at which it breaks; infinite if it is broken."""
    size = strains.size
    gap = 0
    while not intact[size - 1 - gap]:
        gap += 1
    for i in range(size):
        bearing[i] = 1.0 + spread + 0.5 * locality * gap
        gap = 0 if intact[i] else gap + 1
    gap = 0
    while not intact[gap]:
        gap += 1
    for i in range(size - 1, -1, -1):
        carried = bearing[i] + 0.5 * locality * gap
        bearing[i] = strains[i] / carried if intact[i] else np.inf
        gap = 0 if intact[i] else gap + 1
