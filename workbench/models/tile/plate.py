"""Plate of a tile (section 4.4.2): a stiff, light rectangle with hinged edges, and its bending modes.

Equations 4.3, 4.8 and 4.9 are corrected (docs/models.md#plate): no factor h in the frequency, modal coordinates with
their norm 4 / (rho h Lx Ly), and damping. A sandwich has two choices of stiffness: the thesis's, with which equation
4.5 gives 860.7 Hz for the panel of 2.54 cm, and the textbook's for thin facings, 5.196 times larger.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import require_within

ORDERS = 5
"""Default largest m and n of the modes (m, n)."""


class Plate(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Material and thickness of a plate. Raises `BadValue` outside the ranges.

    `stiffness` selects the bending stiffness: "thesis" and "textbook" are sandwiches with two facings of `modulus_pa`
    and `facing_m` on a core that only separates them; "solid" is homogeneous. `density_kg_m3` is the mean of the whole
    panel, `damping` the damping ratio of the modes.

    The default is the thesis's panel: its computation uses 210 kg/m3 (its 400 g would be 170), and facings of 0.081 cm
    where the description says 0.08 cm.

    >>> round(Plate(stiffness="thesis").frequency_hz((0.304, 0.304)), 1)
    860.7
    >>> round(Plate(stiffness="textbook").rigidity_nm())
    17768
    """

    stiffness: Literal["thesis", "textbook", "solid"] = "textbook"
    thickness_m: Annotated[float, (1e-3, 0.2)] = 0.0254
    facing_m: Annotated[float, (1e-5, 0.05)] = 0.00081
    modulus_pa: Annotated[float, (1e6, 1e12)] = 68e9
    poisson: Annotated[float, (0.0, 0.49)] = 0.33
    density_kg_m3: Annotated[float, (1.0, 2e4)] = 210.0
    damping: Annotated[float, (1e-4, 0.9)] = 0.02

    def __post_init__(self) -> None:
        require_within(self)

    def rigidity_nm(self) -> float:
        """Return the flexural rigidity D, N m."""
        if self.stiffness == "solid":
            return self.modulus_pa * self.thickness_m**3 / (12.0 * (1.0 - self.poisson**2))
        faces = self.modulus_pa * self.facing_m * self.thickness_m**2
        return faces / (2.0 if self.stiffness == "textbook" else 6.0 * math.sqrt(3.0))

    def mass_kg(self, size_m: Sequence[float]) -> float:
        """Return the mass of a plate of this size."""
        return self.density_kg_m3 * self.thickness_m * size_m[0] * size_m[1]

    def frequency_hz(self, size_m: Sequence[float], m: int = 1, n: int = 1) -> float:
        """Return the frequency of mode (m, n), both from 1 (equation 4.3, without its h)."""
        square = (m * math.pi / size_m[0]) ** 2 + (n * math.pi / size_m[1]) ** 2
        return square / (2.0 * math.pi) * math.sqrt(self.rigidity_nm() / (self.density_kg_m3 * self.thickness_m))

    def frequencies_hz(self, size_m: Sequence[float], orders: int = ORDERS) -> NDArray[np.float64]:
        """Return the frequencies of `modes(orders)`."""
        return np.array([self.frequency_hz(size_m, m, n) for m, n in modes(orders)])

    def modal_mass_kg(self, size_m: Sequence[float]) -> float:
        """Return the modal mass, the same for every mode: a quarter of the plate's mass."""
        return self.mass_kg(size_m) / 4.0

    def static_deflection_m(
        self, size_m: Sequence[float], at_m: ArrayLike, load_at_m: ArrayLike, force_n: float, orders: int = 199
    ) -> float:
        """Return the deflection at one position under a force at another, with the edges fixed.

        >>> plate = Plate()
        >>> sag = plate.static_deflection_m((0.3, 0.3), (0.0, 0.0), (0.0, 0.0), 1000.0)
        >>> round(sag * plate.rigidity_nm() / (1000.0 * 0.3**2), 5)  # handbook: 0.01160
        0.0116
        """
        stiff = self.modal_mass_kg(size_m) * (2.0 * math.pi * self.frequencies_hz(size_m, orders)) ** 2
        return float(np.sum(shapes(at_m, size_m, orders) * shapes(load_at_m, size_m, orders) * force_n / stiff))

    def transfer(
        self, frequencies_hz: ArrayLike, size_m: Sequence[float], at_m: ArrayLike, shakers_m: ArrayLike,
        orders: int = ORDERS,
    ) -> NDArray[np.complex128]:  # fmt: skip
        """Return acceleration at `at_m` per newton of each shaker, with the edges fixed: complex, (n, shakers).

        `shakers_m` is (shakers, 2). Equation 4.9 with its norm and damping.
        """
        omega = 2.0 * math.pi * np.asarray(frequencies_hz, dtype=np.float64)[:, None]
        natural = 2.0 * math.pi * self.frequencies_hz(size_m, orders)
        modal = -(omega**2) / (natural**2 - omega**2 + 2j * self.damping * natural * omega) / self.modal_mass_kg(size_m)
        driven = shapes(shakers_m, size_m, orders) * shapes(at_m, size_m, orders)
        return np.asarray(modal @ np.atleast_2d(driven).T)


def modes(orders: int = ORDERS) -> list[tuple[int, int]]:
    """Return the modes (m, n), m and n from 1 to `orders`, n fastest: the order of all arrays of modes.

    >>> modes(2)
    [(1, 1), (1, 2), (2, 1), (2, 2)]
    """
    return [(m, n) for m in range(1, orders + 1) for n in range(1, orders + 1)]


def shapes(at_m: ArrayLike, size_m: Sequence[float], orders: int = ORDERS) -> NDArray[np.float64]:
    """Return the mode shapes (equation 4.4) at positions (..., 2) in the tile's frame: (..., orders^2).

    The origin is the tile's centre (equation 4.4 has it at a corner). At the centre mode (1, 1) has its antinode, and
    every mode with an even number a node.

    >>> shapes((0.0, 0.0), (0.3, 0.3), 2).round(12) + 0.0
    array([1., 0., 0., 0.])
    """
    at = np.asarray(at_m, dtype=np.float64)
    order = math.pi * np.arange(1, orders + 1)
    along = np.sin(order * (at[..., :1] / size_m[0] + 0.5))
    across = np.sin(order * (at[..., 1:] / size_m[1] + 0.5))
    return (along[..., :, None] * across[..., None, :]).reshape(*at.shape[:-1], orders * orders)


def rigid_overlaps(orders: int) -> NDArray[np.float64]:
    """Return the mean over the plate of each mode shape times 1, x / (Lx/2) and y / (Ly/2): shape (3, orders^2).

    These couple the plate to its frame: for mode (1, 1) and heave it is 4 / pi^2.

    >>> rigid_overlaps(1)[:, 0].round(4) + 0.0
    array([0.4053, 0.    , 0.    ])
    """
    order = np.arange(1, orders + 1)
    odd = order % 2
    flat, tilted = 2.0 * odd / (math.pi * order), -2.0 * (1 - odd) / (math.pi * order)
    return np.array([np.outer(flat, flat).ravel(), np.outer(tilted, flat).ravel(), np.outer(flat, tilted).ravel()])
