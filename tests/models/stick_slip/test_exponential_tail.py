"""The exponential tail of long slips: where it begins, and that it goes on as the solution did."""

import math

import numpy as np
import pytest

from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.slip_distribution import SlipDistribution


def test_a_long_distribution_ends_exponentially_and_agrees_with_a_short_one():
    block = BlockOnBelt(1.0, 0.4, 0.1, 1.0, 0.3, 0.0)
    short = SlipDistribution.solve(block, t_end=60.0, error=1e-5).duration
    long = SlipDistribution.solve(block, t_end=300.0, error=1e-5).duration
    assert np.abs(np.interp(short.points, long.points, long.cdf) - short.cdf).max() < 2e-5
    survival = 1.0 - np.interp([60.0, 90.0, 120.0], long.points, long.cdf)
    assert survival[0] / survival[1] == pytest.approx(survival[1] / survival[2], rel=2e-2)


@pytest.mark.parametrize(
    "block", [BlockOnBelt(1.0, 1.0, 0.1, 1.0, 1.0, 0.0), BlockOnBelt(1.0, 0.3, 0.059, 1.0, 0.075, 0.0)]
)
def test_nothing_is_solved_once_the_hazard_is_constant(block):
    slip = SlipDistribution.solve(block, t_end=800.0, error=1e-2)
    assert len(slip.panels.table) < 60
    earlier = SlipDistribution.solve(block, t_end=100.0, error=1e-5).duration
    hazard = -np.diff(np.log1p(-np.interp([70.0, 100.0], earlier.points, earlier.cdf)))[0] / 30.0
    survival = 1.0 - earlier.cdf[-1]
    for t in (200.0, 400.0, 800.0):
        expected = 1.0 - survival * math.exp(-hazard * (t - 100.0))
        assert np.interp(t, slip.duration.points, slip.duration.cdf) == pytest.approx(expected, abs=1e-2)
