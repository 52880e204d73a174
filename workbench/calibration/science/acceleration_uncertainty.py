"""Uncertainty of the acceleration that a calibrated tile plays (JCGM 100:2008), from what its calibration measured."""

import math

import numpy as np

from underfoot.calibration.reference import COVERAGE
from underfoot.calibration.science.response import INNER_HZ, ResponseMeasurements
from underfoot.calibration.science.tones import TONE_HZ, DistortionOverLevel
from underfoot.calibration.science.transfer_function import within
from underfoot.kernels import Floats


def acceleration_uncertainty(found: ResponseMeasurements) -> dict[str, float]:
    """Return the uncertainty of the acceleration of a stimulus of 60 to 700 Hz, "expanded" (k = 2), and its parts, %.

    Nothing where tones, or sweeps through the equaliser, were not measured. The parts are standard uncertainties, which
    are independent: "reference", half of the expanded uncertainty that was given for it, its input and its mounting;
    "repeatability", that of the mean over the passes, or what noise does to it, where that is more; "flatness", the
    deviation from flat that was measured through the equaliser; and "linearity", by how much the gain of tones of all
    levels differs from that of the sweeps, so that a gain that wanders from recording to recording is in it, too. The
    latter three are root mean squares.
    """
    again, tones, basis = found.again, found.tones, found.basis
    if again is None or tones is None:
        return {}
    inside = within(basis.frequencies_hz, INNER_HZ)
    spread = np.nan_to_num(np.expm1(basis.spread_db[inside] * math.log(10.0) / 20.0)) / math.sqrt(basis.passes)
    # The part of noise in phase changes a magnitude.
    noise = np.nan_to_num(basis.noise[inside]) / (math.sqrt(2.0) * basis.magnitude[inside])
    off = found.sensitivity * again.magnitude[within(again.frequencies_hz, INNER_HZ)] / found.level - 1.0
    parts = {
        "reference": (found.reference_percent or 0.0) / COVERAGE,
        "repeatability": _rms_percent(np.maximum(spread, noise)),
        "flatness": _rms_percent(off),
        "linearity": _rms_percent(tones_over_sweeps(found, tones) - 1.0),
    }
    return {"expanded": COVERAGE * math.hypot(*parts.values()), **parts}


def tones_over_sweeps(found: ResponseMeasurements, tones: DistortionOverLevel) -> Floats:
    """Return the gain of tones (n,) over that of the sweeps before, with nothing on the tile; the last is as loud."""
    empty = found.loads["none"]
    swept = found.sensitivity * np.interp(TONE_HZ, empty.frequencies_hz, empty.magnitude)
    return tones.acceleration / (tones.drive * swept)


def _rms_percent(shares: Floats) -> float:
    return 100.0 * float(np.sqrt(np.mean(shares**2)))
