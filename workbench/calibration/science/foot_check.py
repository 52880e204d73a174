"""Check of four calibrated sensors by a load that all of them bear, and the uncertainty of such a force.

What other sensors bear of a load over one of them is taken off as they measure it, so that their sum is right there
whatever the error of a share. In the middle the errors of the four shares add up: there it shows.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from underfoot.calibration.reference import COVERAGE
from underfoot.calibration.rig import Readings
from underfoot.errors import BadMeasurement
from underfoot.floor.curves import Curve
from underfoot.kernels import Floats
from underfoot.models.tile.fsr_hysteresis import STATE

_HELD = 0.9
"""Share of the largest force above which the load counts: errors of shares grow with it."""
_SECOND = 0.3
"""Change of a sensor's reading over that of the sensor with the largest, which a second one reaches in the middle."""


@dataclass(frozen=True)
class FootCheck:
    """Standard uncertainties of the force of a foot, % of full scale.

    `error_percent` is by how much the sum of the four was off the reference under a load in the middle (root mean
    square), `scatter_percent` the sum of the four sensors' errors on held-out loadings. These add up as they are (JCGM
    100:2008, 5.2.2, r = 1), and not as independent ones: a foot loads the four alike, and what their models miss of
    hysteresis and creep has one sign. `reference_percent` is what the load cell itself is off by.
    """

    error_percent: float
    scatter_percent: float
    reference_percent: float

    @property
    def expanded_percent(self) -> float:
        """Expanded uncertainty, k = 2, % of full scale.

        >>> FootCheck(2.0, 3.0, 6.0).expanded_percent
        14.0
        """
        return COVERAGE * math.hypot(self.error_percent, self.scatter_percent, self.reference_percent)


def forces_over_time(curves: Sequence[Curve], successive: Sequence[Readings]) -> list[Floats]:
    """Return newtons (n, 4) of each of successive readings, as a session has them: without hysteresis and creep."""
    states = np.zeros(len(curves), STATE)
    return [
        np.stack(
            [curve.force_over_time(one.values[:, j].copy(), one.time_s, states[j]) for j, curve in enumerate(curves)], 1
        )
        for one in successive
    ]


def check_foot(
    curves: Sequence[Curve], full_n: float, over_time_n: Floats, force_n: Floats, reference_percent: float
) -> FootCheck:
    """Return how far the sum of sensors with these `curves` is off the forces (n,) of a load that they bear together.

    `reference_percent` is the expanded uncertainty (k = 2) of the load cell, % of full scale.

    `over_time_n` (n, 4) are those by `forces_over_time` from the rested tile on: what the sensors have crept before is
    taken off as a session does. Where the load comes and goes does not count.
    """
    off = (over_time_n.sum(axis=1) - force_n)[force_n > _HELD * force_n.max()]
    scatter_percent = sum(curve.over_time_error_percent for curve in curves)
    error_percent = 100.0 * float(np.sqrt(np.mean(off**2))) / full_n
    return FootCheck(error_percent, scatter_percent, reference_percent / COVERAGE)


def require_shared(change: Floats) -> None:
    """Raise `BadMeasurement` for changes of reading (4,) of a load that is over one sensor alone."""
    second, most = np.sort(change)[-2:]
    if second < _SECOND * most:
        raise BadMeasurement(
            f"sensor {int(np.argmax(change)) + 1} responds alone; press in the middle of the tile, so that all "
            "bear the load"
        )
