"""The suspension of a tile (section 4.4.3): four rubber mounts under a rigid plate, its resonance and its deflections.

The thesis finds f0 = 49 Hz, which is right, and 4.5 mm of deflection at 1000 N on one corner, which is not
(docs/models.md#suspension).
"""

import math

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require

MOUNTS = 4


class Suspension(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One mount's area, height and Young's modulus, and the mass that the four carry. `damping` is the heave's ratio.

    Raises `BadValue` outside the ranges of `SUSPENSION_RANGES`.

    >>> thesis = Suspension()
    >>> round(thesis.resonance_hz(), 2)
    49.01
    >>> [round(1000.0 * thesis.deflection_m(1000.0, load), 2) for load in ("shared", "corner", "one mount")]
    [3.91, 11.72, 15.62]
    """

    area_m2: float = 8e-4
    height_m: float = 0.025
    modulus_pa: float = 2e6
    mass_kg: float = 2.7
    damping: float = 0.08

    def __post_init__(self) -> None:
        for name, (low, high) in SUSPENSION_RANGES.items():
            value = getattr(self, name)
            require(low <= value <= high, name, value, f"{low:g} to {high:g}")

    @property
    def stiffness_n_m(self) -> float:
        """The stiffness K = E A / h of one mount, N/m."""
        return self.modulus_pa * self.area_m2 / self.height_m

    def resonance_hz(self) -> float:
        """The frequency f0 at which the unloaded tile heaves."""
        return math.sqrt(MOUNTS * self.stiffness_n_m / self.mass_kg) / (2.0 * math.pi)

    def deflection_m(self, force_n: float, load: str = "shared") -> float:
        """How far the tile sinks where the force stands.

        `load` is "shared" (in the middle: F / 4K), "corner" (a rigid plate, the force over one mount, the one opposite
        pulling back: 3F / 4K) or "one mount" (the others bear nothing: F / K).
        """
        shares = {"shared": 1.0 / MOUNTS, "corner": 3.0 / MOUNTS, "one mount": 1.0}
        require(load in shares, "load", load, ", ".join(shares))
        return shares[load] * force_n / self.stiffness_n_m

    def transfer(self, frequencies_hz: ArrayLike) -> NDArray[np.complex128]:
        """Acceleration a newton of a rigid tile that only heaves: 1 / M far above f0."""
        omega = 2.0 * math.pi * np.asarray(frequencies_hz, dtype=np.float64)
        own = 2.0 * math.pi * self.resonance_hz()
        return np.asarray(-(omega**2) / (own**2 - omega**2 + 2j * self.damping * own * omega) / self.mass_kg)


SUSPENSION_RANGES = {
    "area_m2": (1e-6, 0.1),
    "height_m": (1e-3, 0.5),
    "modulus_pa": (1e3, 1e10),
    "mass_kg": (0.05, 500.0),
    "damping": (1e-4, 0.9),
}
"""The allowed range of each of a suspension's parameters."""


def deflection_at_resonance_m(resonance_hz: ArrayLike, mass_kg: float, force_n: float) -> NDArray[np.float64]:
    """The deflection, shared by four mounts, that a resonance forces: F / (M w0^2). One mount sinks four times as far.

    f0 at most 50 Hz forces 3.75 mm at 1000 N on 2.7 kg; the thesis's 4.5 mm belong to 45.7 Hz.

    >>> deflection_at_resonance_m([50.0, 45.7], 2.7, 1000.0).round(5)
    array([0.00375, 0.00449])
    """
    return force_n / (mass_kg * (2.0 * math.pi * np.asarray(resonance_hz, dtype=np.float64)) ** 2)
