"""The Gaussian transition against tight integration and closed forms."""

from decimal import Decimal, localcontext

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from underfoot.models.stick_slip.oscillator import transition


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


def test_a_short_time_keeps_the_covariance_of_the_position():
    # S_xx = 2 D t^3/3 (1 - 3 zeta t/4), 8.26 corrected; a closed form would leave no digit of it.
    t, zeta, noise = 1e-5, 0.3, 0.4
    assert transition(1.0, zeta, noise, t).s_xx == pytest.approx(
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
