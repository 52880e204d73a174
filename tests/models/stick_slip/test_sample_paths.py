"""Drawn slips against closed forms."""

import numpy as np
import pytest
from scipy.stats import invgauss, kstest

from underfoot.errors import BadValue
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.sample_paths import paths

FIG_8_6 = BlockOnBelt(w0=1.0, zeta=0.1, noise=0.4, belt_velocity=1.0, x0=0.0, v0=-1.0)


@pytest.mark.parametrize("gap", [1.0, 0.05])
def test_drawn_durations_and_positions_are_those_of_a_constant_acceleration(gap):
    acceleration, noise, belt, w0, count = 1.0, 0.25, 0.5, 1e-3, 60_000
    block = BlockOnBelt(w0, 0.0, noise, belt, -acceleration / w0**2, belt - gap)
    drawn = paths(block, 40.0, count, error=1e-4, seed=4)
    shape = gap**2 / (2.0 * noise)
    assert kstest(drawn.duration, invgauss(mu=gap / acceleration / shape, scale=shape).cdf).pvalue > 1e-3
    # x - x0 = int v dt, and E int_0^T v dt follows from v' = a: (v_b^2 - v0^2)/2 - D E T = a E (x - x0).
    distance = ((belt**2 - (belt - gap) ** 2) / 2.0 - noise * gap / acceleration) / acceleration
    moved = drawn.position - block.x0
    assert moved.mean() == pytest.approx(distance, abs=5.0 * moved.std() / count**0.5)


def test_the_same_seed_draws_the_same_slips():
    first, again, other = (paths(FIG_8_6, 3.0, 500, error=1e-3, seed=seed) for seed in (7, 7, 8))
    assert np.array_equal(first.duration, again.duration)
    assert np.array_equal(first.position, again.position, equal_nan=True)
    assert not np.array_equal(first.duration, other.duration)


def test_slips_that_last_have_no_end():
    drawn = paths(FIG_8_6, 2.5, 4000, error=1e-3, seed=1)
    lasting = np.isinf(drawn.duration)
    # 1 less the Fokker-Planck CDF at 2.5 s (`FOKKER_PLANCK` of test_distribution).
    assert lasting.mean() == pytest.approx(1.0 - 0.662094, abs=0.03)
    assert np.array_equal(lasting, np.isnan(drawn.position))
    assert drawn.duration[~lasting].max() <= 2.5


def test_values_without_a_slip_are_refused():
    with pytest.raises(BadValue, match=r"^v0 is 1.0; allowed: below belt_velocity, and not below -1e9 times it$"):
        paths(FIG_8_6._replace(v0=1.0), 20.0, 10)
    with pytest.raises(BadValue, match=r"^count is -1; allowed: a whole number, 0 to 2\^31$"):
        paths(FIG_8_6, 20.0, -1)
    assert paths(FIG_8_6, 20.0, 0).duration.size == 0
