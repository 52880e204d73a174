"""Suspension of a tile (section 4.4.3): four rubber mounts under a rigid plate, resonance and deflections.

The thesis's f0 = 49 Hz is right; its deflection of 4.5 mm at 1000 N on one corner is not (docs/models.md#suspension).
"""

import math
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import choice, require_within

MOUNTS = 4


class Suspension(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Area, height and Young's modulus of one mount, the mass on all four, and the damping ratio of heave.

    Raises `BadValue` outside the ranges.

    >>> thesis = Suspension()
    >>> round(thesis.resonance_hz(), 2)
    49.01
    >>> [round(1000.0 * thesis.deflection_m(1000.0, load), 2) for load in ("shared", "corner", "one mount")]
    [3.91, 11.72, 15.62]
    """

    area_m2: Annotated[float, (1e-6, 0.1)] = 8e-4
    height_m: Annotated[float, (1e-3, 0.5)] = 0.025
    modulus_pa: Annotated[float, (1e3, 1e10)] = 2e6
    mass_kg: Annotated[float, (0.05, 500.0)] = 2.7
    damping: Annotated[float, (1e-4, 0.9)] = 0.08

    def __post_init__(self) -> None:
        require_within(self)

    @property
    def stiffness_n_m(self) -> float:
        """Stiffness K = E A / h of one mount, N/m."""
        return self.modulus_pa * self.area_m2 / self.height_m

    def resonance_hz(self) -> float:
        """Return the heave resonance f0 of the unloaded tile."""
        return math.sqrt(MOUNTS * self.stiffness_n_m / self.mass_kg) / (2.0 * math.pi)

    def deflection_m(self, force_n: float, load: str = "shared") -> float:
        """Return the deflection of the tile under the force.

        `load` is "shared" (at the centre: F / 4K), "corner" (rigid plate, force over one mount, the opposite mount in
        tension: 3F / 4K) or "one mount" (the others carry nothing: F / K).
        """
        shares = {"shared": 1.0 / MOUNTS, "corner": 3.0 / MOUNTS, "one mount": 1.0}
        choice("load", load, shares)
        return shares[load] * force_n / self.stiffness_n_m

    def transfer(self, frequencies_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return acceleration per newton of a rigid tile in heave: 1 / M far above f0."""
        omega = 2.0 * math.pi * np.asarray(frequencies_hz, dtype=np.float64)
        natural = 2.0 * math.pi * self.resonance_hz()
        return np.asarray(-(omega**2) / (natural**2 - omega**2 + 2j * self.damping * natural * omega) / self.mass_kg)


def deflection_at_resonance_m(resonance_hz: ArrayLike, mass_kg: float, force_n: float) -> NDArray[np.float64]:
    """Return the deflection, shared by four mounts, implied by a resonance: F / (M w0^2); on one mount four times that.

    At f0 = 50 Hz or less it is at least 3.75 mm for 1000 N on 2.7 kg; the thesis's 4.5 mm correspond to 45.7 Hz.

    >>> deflection_at_resonance_m([50.0, 45.7], 2.7, 1000.0).round(5)
    array([0.00375, 0.00449])
    """
    return force_n / (mass_kg * (2.0 * math.pi * np.asarray(resonance_hz, dtype=np.float64)) ** 2)
