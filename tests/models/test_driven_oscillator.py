"""The motion over one frame, against the matrix exponential, closed forms and itself."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from underfoot.models.driven_oscillator import frame_response, frame_step, resolved


@pytest.mark.parametrize("gamma", [0.0, 1e-6, 6e-3, 0.249, 0.251, 2.0, 20.0])
def test_a_step_is_that_of_the_matrix_exponential(gamma):
    gain = 0.7
    system = np.zeros((4, 4))  # strain, speed, drive, drive's slope
    system[0, 1] = system[2, 3] = 1.0
    for kappa in (0.0, 1e-7, 4.3e-5, 0.0624, 0.0626, 0.9, 30.0):
        system[1] = -kappa, -gamma, gain, 0.0
        exact = expm(system)
        wanted = [
            *(exact[0, 0], exact[0, 1], exact[0, 2] - exact[0, 3], exact[0, 3]),
            *(exact[1, 0], exact[1, 1], exact[1, 2] - exact[1, 3], exact[1, 3]),
        ]
        np.testing.assert_allclose(frame_step(kappa, gamma, gain), wanted, 2e-13, 2e-15, err_msg=f"kappa {kappa}")


@pytest.mark.parametrize("gamma", [1e2, 1e4, 1e6])
def test_heavy_damping_keeps_the_slow_motion_exact(gamma):
    kappa = 0.03 * gamma  # the slow rate is a root of r^2 - gamma r + kappa, without the difference of large numbers
    slow = 2.0 * kappa / (gamma + math.sqrt(gamma * gamma - 4.0 * kappa))
    fast = gamma - slow
    c = frame_step(kappa, gamma, 1.0)
    kept = (fast * math.exp(-slow) - slow * math.exp(-fast)) / (fast - slow)
    assert c[0] == pytest.approx(kept, rel=1e-12)
    assert c[1] == pytest.approx((math.exp(-slow) - math.exp(-fast)) / (fast - slow), rel=1e-11)


@given(st.floats(0.0, 1e3), st.floats(0.0, 1e3))
def test_the_free_motion_never_gains_energy(kappa, gamma):
    response, slope, first, _ = frame_response(kappa, gamma)
    kept = 1.0 - kappa * first
    determinant = kept * slope + kappa * response * response
    assert determinant == pytest.approx(math.exp(-gamma), abs=1e-11)
    assert kappa * kept**2 + (kappa * response) ** 2 <= kappa * (1.0 + 1e-11)  # from a strain of 1
    assert kappa * response**2 + slope**2 <= 1.0 + 1e-11  # from a speed of 1


def test_mass_and_damping_stay_where_frames_resolve_them_and_settle_where_not():
    assert resolved(1.0 / 48000.0, 1.0, 0.0, 0.0, 1e-5) == (1e-5, 0.0)
    frame_s = 1.0 / 48000.0
    mass, damping = resolved(frame_s, 1.0, 0.0, 0.0, 0.0)
    c = frame_step(frame_s**2 / mass, damping * frame_s / mass, frame_s**2 / mass)
    assert abs(c[0]) < 1e-6
    assert abs(c[1]) < 1e-6
    assert c[2] + c[3] == pytest.approx(1.0, abs=1e-6)
