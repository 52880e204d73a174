"""Uncertainty of the acceleration that a calibrated tile plays (JCGM 100:2008), from what its calibration measured."""

import math
from dataclasses import dataclass

import numpy as np

from underfoot.calibration.science.response import INNER_HZ, ResponseMeasurements
from underfoot.calibration.science.transfer_function import within

_COVERAGE = 2.0
"""k, for 95 % of normal errors (JCGM 100:2008, 6.3.3)."""


@dataclass(frozen=True)
class AccelerationUncertainty:
    """Standard uncertainties of the acceleration of a stimulus of 60 to 700 Hz, % of it, which are independent.

    `reference_percent` is half of the expanded uncertainty that was given for it, its input and its mounting.
    `repeatability_percent` is that of the mean over the passes, or what noise does to it, where that is more;
    `flatness_percent` the deviation from flat that was measured through the equaliser, both over frequency.
    `linearity_percent` is by how much the gain of quieter tones differs from that of one as loud as the sweeps. These
    three are root mean squares.
    """

    reference_percent: float
    repeatability_percent: float
    flatness_percent: float
    linearity_percent: float

    @property
    def expanded_percent(self) -> float:
        """Expanded uncertainty, k = 2, % of the acceleration.

        >>> AccelerationUncertainty(3.0, 0.0, 4.0, 0.0).expanded_percent
        10.0
        """
        parts = (
            self.reference_percent, self.repeatability_percent, self.flatness_percent, self.linearity_percent
        )  # fmt: skip
        return _COVERAGE * math.hypot(*parts)


def acceleration_uncertainty(found: ResponseMeasurements) -> AccelerationUncertainty | None:
    """Return the uncertainty of accelerations; None where tones, or sweeps through the equaliser, were not measured."""
    again, tones, basis = found.again, found.tones, found.basis
    if again is None or tones is None:
        return None
    inside = within(basis.frequencies_hz, INNER_HZ)
    magnitude = basis.magnitude[inside]
    spread = np.nan_to_num(np.expm1(basis.spread_db[inside] * math.log(10.0) / 20.0)) / math.sqrt(basis.passes)
    noise = np.nan_to_num(basis.noise[inside]) / (math.sqrt(2.0) * magnitude)  # the part in phase changes a magnitude
    off = found.sensitivity * again.magnitude[within(again.frequencies_hz, INNER_HZ)] / found.level - 1.0
    gains = tones.acceleration / tones.drive
    bent = gains / gains[-1] - 1.0
    return AccelerationUncertainty(
        reference_percent=(found.reference_percent or 0.0) / _COVERAGE,
        repeatability_percent=100.0 * float(np.sqrt(np.mean(np.maximum(spread, noise) ** 2))),
        flatness_percent=100.0 * float(np.sqrt(np.mean(off**2))),
        linearity_percent=100.0 * float(np.sqrt(np.mean(bent**2))),
    )
