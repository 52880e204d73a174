"""Shaker under a tile (sections 4.3.3 and 4.4.1): inertial motor, from full-scale drive to force.

Its moving mass resonates near 70 Hz, its case colours the response above 380 Hz and the coil's inductance attenuates
high frequencies (figure 4.6, and the thesis's text on figure 4.13). Large forces are compressed: at 30 N the thesis
measured slightly more than 5 % of error at 300 Hz, and reached 40 N at all frequencies from 50 to 750 Hz.
"""

import cmath
import math
from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import require_within
from underfoot.kernels import kernel
from underfoot.models.filtering.poles import Poles, of_biquads


class Shaker(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Motor and amplifier. Raises `BadValue` outside the ranges.

    `force_n` is the uncompressed force at full-scale drive in mid-band; compressed it is 49 N, on 2.7 kg about the
    20 m/s^2 assumed for an uncalibrated tile. `resonance_hz` and `damping` describe the moving mass; `colour_hz`,
    `colour` (gain there; below 1 a notch) and `colour_damping` the case; `corner_hz` the coil. Forces saturate softly
    at `ceiling_n`; an offset of `bias` times that adds even harmonics.
    """

    force_n: Annotated[float, (0.1, 1e4)] = 64.0
    resonance_hz: Annotated[float, (5.0, 500.0)] = 70.0
    damping: Annotated[float, (0.01, 0.95)] = 0.30
    colour_hz: Annotated[float, (10.0, 1e4)] = 420.0
    colour: Annotated[float, (0.05, 20.0)] = 0.75
    colour_damping: Annotated[float, (0.005, 0.45)] = 0.08
    corner_hz: Annotated[float, (500.0, 1e5)] = 3000.0
    ceiling_n: Annotated[float, (0.1, 1e6)] = 78.0
    bias: Annotated[float, (0.0, 0.5)] = 0.03

    def __post_init__(self) -> None:
        require_within(self)

    def poles(self) -> Poles:
        """Return the small-signal system from drive (full scale) to force (N).

        >>> round(float(abs(Shaker(colour=1.0, corner_hz=1e5).poles().transfer(400.0))), 1)
        65.6
        """
        moving = _pair(self.resonance_hz, self.damping)
        case = _pair(self.colour_hz, self.colour_damping)
        case_zeros = _pair(self.colour_hz, self.colour_damping * self.colour)
        # Equal poles have no residues; a millionth apart they are the same shaker.
        if abs(case[0] - moving[0]) < 1e-6 * abs(case[0]):
            case = [(1.0 + 1e-6) * pole for pole in case]
        coil = 2.0 * math.pi * self.corner_hz
        return of_biquads([0.0, 0.0, *case_zeros], [*moving, *case, -coil], self.force_n * coil)

    def transfer(self, frequencies_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return force per full-scale drive, for small signals."""
        return self.poles().transfer(frequencies_hz)

    def compressed_n(self, force_n: ArrayLike) -> NDArray[np.float64]:
        """Return the force after compression.

        >>> Shaker(bias=0.0).compressed_n([0.1, 30.0, 78.0]).round(3)
        array([ 0.1  , 28.   , 55.154])
        """
        force = np.asarray(force_n, dtype=np.float64)
        out = force.ravel().copy()
        compress(self.compression(), out, out, out.size)
        return out.reshape(force.shape)

    def compression(self) -> NDArray[np.void]:
        """Return the coefficients of `compress`: shape (1,) of `COMPRESSION`."""
        found = np.zeros(1, COMPRESSION)
        found["ceiling_n"], found["bias"] = self.ceiling_n, self.bias
        found["gain"] = (1.0 + self.bias**2) ** 1.5
        found["offset"] = self.bias / math.sqrt(1.0 + self.bias**2)
        return found


COMPRESSION = np.dtype(
    [("ceiling_n", np.float64), ("bias", np.float64), ("gain", np.float64), ("offset", np.float64)], align=True
)
"""Soft saturation: ceiling and bias as in `Shaker`, and the gain and offset that map 0 to 0 with slope 1."""


@kernel
def compress(compression: NDArray[np.void], given: NDArray[np.float64], out: NDArray[np.float64], n: int) -> None:
    """Saturate n forces softly at the ceiling in both directions, slope 1 at 0; the arrays may be the same."""
    c = compression[0]
    ceiling_n, bias, gain, offset = c.ceiling_n, c.bias, c.gain, c.offset
    for i in range(n):
        x = given[i] / ceiling_n + bias
        out[i] = ceiling_n * gain * (x / math.sqrt(1.0 + x * x) - offset)


def _pair(frequency_hz: float, damping: float) -> list[complex]:
    """Return the two roots of s^2 + 2 d w s + w^2."""
    natural = 2.0 * math.pi * frequency_hz
    swing = cmath.sqrt(damping**2 - 1.0)
    return [natural * (swing - damping), natural * (-swing - damping)]
