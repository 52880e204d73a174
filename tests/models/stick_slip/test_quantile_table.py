"""The table of slips holds the joint distribution to the requested error, also where slips do not end."""

import math
from functools import cache

import numpy as np
import pytest
from scipy.stats import kstest, norm

from underfoot.errors import BadValue
from underfoot.kernels import kernel
from underfoot.models.signals.random import stream_key
from underfoot.models.stick_slip.mixture import density_and_cdf
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.quantile_table import LONGEST, draw, look_up, parts, slip_table
from underfoot.models.stick_slip.slip_distribution import SlipDistribution

# zeta, D, x0, v0: one peak; weak damping, separate peaks; a start against the belt; hardly any spread.
SETS = {
    "one peak": (0.4, 0.5, 2.0, 0.0),
    "subharmonics": (0.05, 0.02, 0.3, 0.0),
    "against the belt": (0.1, 0.4, 0.0, -1.0),
    "sure": (0.1, 0.02, 4.0, 0.0),
}


@kernel
def look_up_evenly(table, out):
    """Pairs of quantile levels that fill the square evenly (the additive recurrence of the plastic number)."""
    first = second = 0.5
    for i in range(out.shape[0]):
        first = (first + 0.7548776662466927) % 1.0
        second = (second + 0.5698402909980532) % 1.0
        out[i, 0], out[i, 1] = look_up(table, first, second)


@kernel
def draw_many(table, key, out):
    for i in range(out.shape[0]):
        out[i, 0], out[i, 1] = draw(table, key, i)


def looked_up(table, count=100_000):
    out = np.empty((count, 2))
    look_up_evenly(table, out)
    return out.T


def difference(values, of, distribution):
    """The largest CDF difference of `values`, out of `of`, from a distribution."""
    rising = np.sort(values)
    cdf = (np.arange(rising.size) + 0.5) / of
    return np.abs(np.interp(rising, distribution.points, distribution.cdf) - cdf).max()


@cache
def solved(zeta, noise, x0, v0):
    return SlipDistribution.solve(BlockOnBelt(1.0, zeta, noise, 1.0, x0, v0), LONGEST, 2e-4)


@pytest.mark.parametrize("error", [1e-2, 1e-3])
@pytest.mark.parametrize("name", SETS)
def test_durations_distances_and_periods_keep_the_asked_error(name, error):
    slip = solved(*SETS[name])
    durations, distances = looked_up(slip_table(*SETS[name], error=error))
    sticks = distances >= 0.0
    assert difference(durations, durations.size, slip.duration) <= error
    assert difference(distances, durations.size, slip.distance) <= error
    assert difference((durations + distances)[sticks], durations.size, slip.period) <= error


def test_draws_have_the_distribution_of_the_table():
    table = slip_table(*SETS["one peak"])
    drawn = np.empty((200_000, 2))
    draw_many(table, stream_key(1, "slips"), drawn)
    slip = solved(*SETS["one peak"])
    for column, marginal in ((0, slip.duration), (1, slip.distance)):
        assert difference(drawn[:, column], len(drawn), marginal) < 1e-3 + 1.95 / np.sqrt(
            len(drawn)
        )  # Kolmogorov, 0.1 %
    assert np.abs(drawn[:, 1]).mean() == pytest.approx(parts.py_func(table).mean_distance, rel=5e-3)


def test_the_outermost_quantile_levels_give_slips():
    table = slip_table(*SETS["one peak"], error=1e-2)
    edge = 2.0**-53
    for first in (edge, 1.0 - edge):
        for second in (edge, 1.0 - edge):
            assert np.isfinite(look_up(table, first, second)).all()


def test_slips_that_last_are_taken_to_end_at_last_where_a_block_at_rest_is():
    zeta, noise, x0, v0 = 0.54, 0.033, 0.15, 0.0
    slip = solved(zeta, noise, x0, v0)
    durations, distances = looked_up(slip_table(zeta, noise, x0, v0))
    last = durations > LONGEST - 1e-9
    assert slip.survival > 0.5
    assert last.mean() == pytest.approx(slip.survival, abs=1e-3)
    assert difference(durations[~last], durations.size, slip.duration) < 1e-3
    assert difference(distances[~last], durations.size, slip.distance) < 1e-3
    sticks = ~last & (distances >= 0.0)
    assert difference((durations + distances)[sticks], durations.size, slip.period) < 1e-3
    assert slip.lasting_positions().weights.sum() == pytest.approx(slip.survival, abs=1e-6)
    # The belt stops so few in a period that the rest is nearly as without one: normal, of the variance noise / zeta.
    free = norm(x0, math.sqrt(noise / zeta))
    assert kstest(distances[last], free.cdf).statistic < 0.01


def test_slips_that_last_for_long_are_where_others_are_that_last_as_long():
    """What has lasted for many relaxation times has forgotten when it began: only how many are left depends on that."""
    block = BlockOnBelt(1.0, 0.2, 0.02, 1.0, 0.0, 0.0)
    x = np.linspace(-1.2, 1.2, 500)
    shares = []
    for t_end in (LONGEST, 0.7 * LONGEST):
        positions = SlipDistribution.solve(block, t_end, 1e-3).lasting_positions()
        shares.append(density_and_cdf(positions, x)[1] / positions.weights.sum())
    assert np.abs(shares[1] - shares[0]).max() < 1e-4


def test_a_slip_that_never_ends_is_a_table_too():
    durations, distances = looked_up(slip_table(2.0, 1e-3, 0.5))
    assert (durations == LONGEST).all()
    assert kstest(distances, norm(0.5, math.sqrt(1e-3 / 2.0)).cdf).statistic < 1e-3


def test_a_smaller_error_takes_a_larger_table():
    sizes = [slip_table(*SETS["sure"], error=error).size for error in (1e-1, 1e-2, 1e-3)]
    assert sizes == sorted(sizes)
    assert sizes[0] < 0.2 * sizes[-1]


@pytest.mark.parametrize(("name", "value"), [("error", 1e-7), ("noise", 0.0), ("zeta", -1.0), ("v0", 1.0)])
def test_values_without_a_slip_are_refused_by_name(name, value):
    values = {"zeta": 0.4, "noise": 0.5, "x0": 2.0, "v0": 0.0} | {name: value}
    with pytest.raises(BadValue, match=f"^{name} is "):
        slip_table(**values)
