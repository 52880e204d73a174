"""The Gaussian transition against tight integration, and the drawn paths against closed forms."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.stats import invgauss, kstest

from underfoot.errors import BadValue
from underfoot.models.stick_slip.oscillator import transition
from underfoot.models.stick_slip.sample_paths import paths


@pytest.mark.parametrize("t", [1e-3, 0.03, 0.4, 0.7, 3.0, 20.0])
@pytest.mark.parametrize(("w0", "zeta"), [(1.0, 0.1), (2.3, 0.1), (1.0, 2.0), (1.0, 9.0), (1.0, 0.0), (0.5, 1e-5)])
def test_the_transition_is_that_of_the_moment_equations(w0, zeta, t):
    noise = 0.4
    motion = np.array([[0.0, 1.0], [-w0 * w0, -zeta]])

    def moments(_, y):
        flow, spread = y[:4].reshape(2, 2), y[4:].reshape(2, 2)
        grown = motion @ spread + spread @ motion.T + np.diag([0.0, 2.0 * noise])
        return np.concatenate([(motion @ flow).ravel(), grown.ravel()])

    start = np.concatenate([np.eye(2).ravel(), np.zeros(4)])
    # The covariance of x grows as t^3 and must be right from its first digits on.
    exact = solve_ivp(moments, (0.0, t), start, method="DOP853", rtol=1e-12, atol=1e-10 * min(t, 1.0) ** 3).y[:, -1]
    found = np.array(transition(w0, zeta, noise, t))
    assert found[:4] == pytest.approx(exact[:4], rel=1e-8, abs=1e-9)
    assert found[4:] == pytest.approx(exact[[4, 5, 7]], rel=1e-7, abs=1e-9 * exact[7])
    assert found[4] == pytest.approx(exact[4], rel=1e-7)


def test_a_short_time_keeps_the_covariance_of_the_place():
    # S_xx = 2 D t^3/3 (1 - 3 zeta t/4), errata 8.26; a closed form would leave no digit of it.
    t, zeta, noise = 1e-5, 0.3, 0.4
    assert transition(1.0, zeta, noise, t)[4] == pytest.approx(
        2.0 * noise * t**3 / 3.0 * (1.0 - 0.75 * zeta * t), rel=1e-9
    )


@pytest.mark.parametrize("t", [1e-4, 1e-2, 3.0, 1e4])
@pytest.mark.parametrize("zeta", [1e3, 1e7])
def test_strong_damping_leaves_the_covariance_its_digits(zeta, t):
    with localcontext() as context:
        context.prec = 60
        rate, time, level = Decimal(zeta), Decimal(t), Decimal("0.4") / Decimal(zeta)
        root = (rate * rate / 4 - 1).sqrt()
        slow, fast = (-rate / 2 + root), (-rate / 2 - root)
        late, soon = (slow * time).exp(), (fast * time).exp()
        sine = (late - soon) / (2 * root)
        cosine, falling = (slow * soon - fast * late) / (2 * root), (slow * late - fast * soon) / (2 * root)
        exact = level * (1 - cosine**2 - sine**2), level * rate * sine**2, level * (1 - sine**2 - falling**2)
    assert transition(1.0, zeta, 0.4, t)[4:] == pytest.approx([float(value) for value in exact], rel=1e-10)


@pytest.mark.parametrize("gap", [1.0, 0.05])
def test_drawn_durations_and_places_are_those_of_a_constant_pull(gap):
    pull, noise, belt, w0, count = 1.0, 0.25, 0.5, 1e-3, 60_000
    x0 = -pull / w0**2
    drawn = paths(w0, 0.0, noise, belt, x0, belt - gap, 40.0, count, error=1e-4, seed=4)
    shape = gap**2 / (2.0 * noise)
    assert kstest(drawn.duration, invgauss(mu=gap / pull / shape, scale=shape).cdf).pvalue > 1e-3
    # x - x0 = int v dt, and E int_0^T v dt follows from v' = pull: (v_b^2 - v0^2)/2 - D E T = pull E (x - x0).
    way = ((belt**2 - (belt - gap) ** 2) / 2.0 - noise * gap / pull) / pull
    moved = drawn.position - x0
    assert moved.mean() == pytest.approx(way, abs=5.0 * moved.std() / count**0.5)


def test_the_same_seed_draws_the_same_slips():
    values = (1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 3.0, 500)
    first, again, other = (paths(*values, error=1e-3, seed=seed) for seed in (7, 7, 8))
    assert np.array_equal(first.duration, again.duration)
    assert np.array_equal(first.position, again.position, equal_nan=True)
    assert not np.array_equal(first.duration, other.duration)


def test_slips_that_last_have_no_end():
    drawn = paths(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 2.5, 4000, error=1e-3, seed=1)
    lasting = np.isinf(drawn.duration)
    # 1 less the Fokker-Planck CDF at 2.5 s (test_friction).
    assert lasting.mean() == pytest.approx(1.0 - 0.662094, abs=0.03)
    assert np.array_equal(lasting, np.isnan(drawn.position))
    assert drawn.duration[~lasting].max() <= 2.5


def test_values_without_a_slip_are_refused():
    with pytest.raises(BadValue, match=r"^v0 is 1.0; allowed: below belt_velocity, and not below -1e9 times it$"):
        paths(1.0, 0.1, 0.4, 1.0, 0.0, 1.0, 20.0, 10)
    with pytest.raises(BadValue, match=r"^count is -1; allowed: a whole number, 0 to 2\^31$"):
        paths(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 20.0, -1)
    assert paths(1.0, 0.1, 0.4, 1.0, 0.0, -1.0, 20.0, 0).duration.size == 0
