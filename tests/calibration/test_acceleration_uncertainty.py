"""The parts of the uncertainty of an acceleration, of responses whose deviations are known."""

import numpy as np
import pytest

from underfoot.calibration.science.acceleration_uncertainty import acceleration_uncertainty
from underfoot.calibration.science.response import ResponseMeasurements
from underfoot.calibration.science.tones import DistortionOverLevel
from underfoot.calibration.science.transfer_function import SweepMeasurement


def swept(gain, spread_db, noise):
    """A flat response of this magnitude over four passes."""
    f, none = np.geomspace(10.0, 2000.0, 500), np.zeros(500)
    shown = (np.full(500, x) for x in (spread_db, noise))
    return SweepMeasurement(f, np.full(500, gain + 0j), *shown, none, {}, 0.0, 4, 0.5, noise, (10.0, 2000.0))


@pytest.mark.parametrize(
    ("spread_db", "noise", "repeatability"),
    [(20.0 * np.log10(1.06), 0.0, 3.0), (0.0, 0.5 * 0.03 * np.sqrt(2.0), 3.0), (np.nan, np.nan, 0.0)],
)
def test_parts_are_those_of_a_response_whose_deviations_are_known(spread_db, noise, repeatability):
    """Of 50 m/s^2 at full scale: measured again 4 % lower, and tones, one of them by 12 and one by 24 %, higher."""
    drive = np.array([0.1, 0.2])
    found = ResponseMeasurements(
        {"none": swept(0.5, spread_db, noise), "standing": swept(9.0, spread_db, noise)},
        100.0,
        16_000,
        tones=DistortionOverLevel(drive, 50.0 * drive * [1.12, 1.24], np.zeros(2)),
        again=swept(0.48, np.nan, np.nan),
        reference_percent=12.0,
    )
    linearity = np.sqrt((12.0**2 + 24.0**2) / 2.0)
    parts = {"reference": 6.0, "repeatability": repeatability, "flatness": 4.0, "linearity": linearity}
    expanded = 2.0 * np.sqrt(6.0**2 + repeatability**2 + 4.0**2 + linearity**2)
    assert acceleration_uncertainty(found) == pytest.approx({"expanded": expanded} | parts, rel=1e-4)
