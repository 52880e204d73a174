"""The joint distribution of a slip's end, and its marginals, against drawn paths and each other."""

from functools import cache

import numpy as np
import pytest

from underfoot.errors import BadValue
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.sample_paths import paths
from underfoot.models.stick_slip.slip_distribution import SlipDistribution

FIG_8_6 = BlockOnBelt(w0=1.0, zeta=0.1, noise=0.4, belt_velocity=1.0, x0=0.0, v0=-1.0)
FIG_8_10 = BlockOnBelt(w0=1.0, zeta=0.4, noise=0.1, belt_velocity=0.45, x0=0.9, v0=0.0)


@cache
def solved(block):
    return SlipDistribution.solve(block, t_end=20.0, error=2e-4)


# Proportion of slips that ended by t, and with a distance up to d, of 1e7 drawn by `paths` at error 1e-5 (run once);
# their own noise is 1.6e-4 at most.
DRAWN = {
    BlockOnBelt(1.0, 0.01, 5e-4, 1.0, 1.05, 0.0): (
        {4: 0.00000, 5: 0.77913, 6: 0.77914, 8: 0.77914, 10: 0.77914, 12: 0.81653, 14: 0.81653, 20: 0.82996},
        {10.0: 0.82996},
    ),
    BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, 0.9): (
        {
            0.003: 0.04081,
            0.01: 0.26059,
            0.03: 0.51245,
            0.1: 0.71380,
            0.3: 0.82367,
            1: 0.88722,
            2: 0.91026,
            4: 0.96061,
            10: 0.99943,
        },
        {-0.3: 0.04988, -0.1: 0.17515, -0.03: 0.38302, -0.01: 0.64149, -0.003: 0.87465, 0.1: 0.92612, 1: 0.96271},
    ),
    BlockOnBelt(1.0, 10.0, 10.0, 1.0, 0.5, 0.0): (
        {0.02: 0.09179, 0.05: 0.27122, 0.1: 0.44163, 0.2: 0.63124, 0.5: 0.88172, 1: 0.98314, 2: 0.99974, 5: 1.00000},
        {-0.3: 0.00000, -0.1: 0.00001, -0.03: 0.01943, -0.01: 0.18956, 0.01: 0.50243, 0.03: 0.57573},
    ),
}


@pytest.mark.parametrize("block", DRAWN)
def test_durations_and_distances_are_those_of_ten_million_drawn_slips(block):
    durations, distances = DRAWN[block]
    slip = solved(block)
    for found, drawn in ((slip.duration, durations), (slip.distance, distances)):
        assert np.abs(np.interp(list(drawn), found.points, found.cdf) - list(drawn.values())).max() < 6e-4


def test_the_density_is_the_slope_of_the_cdf_and_never_negative():
    slip = solved(FIG_8_10)
    for found in (slip.duration, slip.distance, slip.period):
        assert np.all(np.diff(found.points) > 0.0)
        assert np.all(np.diff(found.cdf) >= 0.0)
        assert found.density.min() >= 0.0
        assert np.trapezoid(found.density, found.points) == pytest.approx(1.0 - found.unobserved, abs=1e-3)
        summed = np.cumsum(0.5 * (found.density[1:] + found.density[:-1]) * np.diff(found.points))
        assert np.abs(summed - (found.cdf[1:] - found.cdf[0])).max() < 1e-3


def test_periods_and_distances_are_those_of_drawn_slips():
    slip = solved(FIG_8_10)
    drawn = paths(FIG_8_10, t_end=20.0, count=100_000, error=1e-3, seed=3)
    distance = FIG_8_10.x0 - drawn.position
    sticks = distance >= 0.0  # false where a slip still lasted: its distance is nan
    period = (drawn.duration + distance / FIG_8_10.belt_velocity)[sticks]
    for found, values in ((slip.distance, distance), (slip.period, period)):
        rising = np.sort(values[np.isfinite(values)])
        cdf = np.arange(1, rising.size + 1) / drawn.duration.size
        assert np.abs(np.interp(rising, found.points, found.cdf) - cdf).max() < 6e-3
    assert slip.negative_stick == pytest.approx((distance < 0.0).mean(), abs=2e-3)
    coarse = SlipDistribution.solve(FIG_8_10, t_end=20.0, error=1e-2)
    assert coarse.period.unobserved == pytest.approx(slip.period.unobserved, abs=1e-2)


def test_the_end_positions_at_a_time_hold_its_density():
    slip = solved(FIG_8_6)
    for t in (1.0, 2.3, 7.0):
        positions = slip.end_positions(t)
        assert np.all(positions.widths > 0.0)
        density = np.interp(t, slip.duration.points, slip.duration.density)
        assert positions.weights.sum() == pytest.approx(density, abs=2e-3)
    assert slip.end_positions(0.0).means.size == 0
    with pytest.raises(BadValue, match=r"^t is 21"):
        slip.end_positions(21.0)
