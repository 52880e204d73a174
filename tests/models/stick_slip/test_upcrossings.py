"""The expansions in upcrossings, compared with docs/models.md#stick-slip, quadrature and tight moment equations."""

import numpy as np
import pytest
from scipy.integrate import dblquad, quad, solve_ivp
from scipy.stats import multivariate_normal

from underfoot.errors import BadValue
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.slip_distribution import SlipDistribution
from underfoot.models.stick_slip.upcrossings import coloured_upcrossings, escape_time, white_upcrossings

FIG_8_5 = BlockOnBelt(w0=1.0, zeta=0.1, noise=0.4, belt_velocity=1.0, x0=0.0, v0=-1.0)
FIG_8_10 = BlockOnBelt(w0=1.0, zeta=0.4, noise=0.1, belt_velocity=0.45, x0=0.9, v0=0.0)


@pytest.mark.parametrize(("step", "rate"), [(0.002, 1.441), (0.01, 0.666), (0.05, 0.332), (1.0, 0.166)])
def test_the_crossing_rate_of_figure_8_5_is_the_corrected_one(step, rate):
    assert white_upcrossings(FIG_8_5, t=[20.0], step=step).density[0] == pytest.approx(rate, abs=6e-4)


def test_the_crossing_rate_is_the_quadrature_of_its_definition():
    # n1 = int dx int_0^inf da a N(a; -w0^2 x - zeta v_b, 2 D/h) P(x, v_b, t) (8.20, 8.21).
    crossings = white_upcrossings(FIG_8_5, t=[2.0], step=0.5)
    free = multivariate_normal(crossings.mean[0, :2], crossings.covariance[0, :2, :2])
    spread = (2.0 * 0.4 / 0.5) ** 0.5

    def flow(a, x):
        z = (a + x + 0.1) / spread
        return a * np.exp(-0.5 * z * z) / (spread * np.sqrt(2.0 * np.pi)) * free.pdf([x, 1.0])

    assert crossings.density[0] == pytest.approx(dblquad(flow, -8.0, 8.0, 0.0, 15.0, epsabs=1e-8)[0], abs=1e-6)
    at_position = quad(lambda a: flow(a, -0.4), 0.0, 15.0)[0]
    assert crossings.joint(np.array([-0.4]))[0, 0] == pytest.approx(at_position, rel=1e-7)


def test_coloured_moments_are_those_of_the_moment_equations():
    w0, zeta, noise, _, x0, v0 = FIG_8_10
    tc, t = 0.2, 1.7
    motion = np.array([[0.0, 1.0, 0.0], [-w0 * w0, -zeta, 1.0], [0.0, 0.0, -1.0 / tc]])
    drive = np.diag([0.0, 0.0, 2.0 * noise / tc**2])

    def moments(_, y):
        spread = y[3:].reshape(3, 3)
        return np.concatenate([motion @ y[:3], (motion @ spread + spread @ motion.T + drive).ravel()])

    start = np.concatenate([[x0, v0, 0.0], np.diag([0.0, 0.0, noise / tc]).ravel()])
    y = solve_ivp(moments, (0.0, t), start, rtol=1e-11, atol=1e-13).y[:, -1]
    to_acceleration = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], motion[1]])
    crossings = coloured_upcrossings(FIG_8_10, t=[t], correlation_time=tc)
    assert crossings.mean[0] == pytest.approx(to_acceleration @ y[:3], abs=1e-9)
    assert crossings.covariance[0] == pytest.approx(to_acceleration @ y[3:].reshape(3, 3) @ to_acceleration.T, abs=1e-9)


def test_the_stationary_rate_is_one_over_the_escape_time():
    block = BlockOnBelt(1.0, 0.33, 0.125, 1.0, 0.0, 0.0)
    stationary = white_upcrossings(block, t=[200.0], step=0.01).density[0]
    assert escape_time(block, step=0.01) == pytest.approx(1.0 / stationary, rel=1e-6)


@pytest.mark.parametrize(("step", "error"), [(1.0, 0.50), (0.002, 0.44)])
def test_white_noise_leaves_the_independent_crossings_far_from_the_distribution(step, error):
    times = np.linspace(0.005, 20.0, 2000)
    duration = SlipDistribution.solve(FIG_8_5, t_end=20.0, error=1e-3).duration
    escaped = white_upcrossings(FIG_8_5, t=times, step=step).escaped
    assert np.abs(escaped - np.interp(times, duration.points, duration.cdf)).max() == pytest.approx(error, abs=6e-3)


def test_durations_distances_and_periods_share_one_mass():
    times = np.linspace(0.04, 40.0, 1000)
    crossings = coloured_upcrossings(FIG_8_10, t=times, correlation_time=0.3)
    mass = crossings.escaped[-1]
    assert np.trapezoid(crossings.durations(), times) == pytest.approx(mass, abs=1e-3)
    d = np.linspace(-3.0, 5.0, 401)
    density = crossings.distances(d)
    assert np.trapezoid(density, d) == pytest.approx(mass, abs=2e-3)
    periods = np.linspace(0.01, 45.0, 150)
    # What ends ahead of x0 by d has its period d/v_b before its end: all of it lies in the integral to t, not beyond.
    assert np.trapezoid(crossings.periods(periods), periods) == pytest.approx(
        np.trapezoid(density[d >= 0], d[d >= 0]), abs=0.01
    )


def test_values_out_of_range_are_refused():
    with pytest.raises(BadValue, match=r"^t is "):
        white_upcrossings(FIG_8_5, t=[1.0, 0.5], step=0.01)
    with pytest.raises(BadValue, match=r"^step is 0"):
        white_upcrossings(FIG_8_5, t=[1.0], step=0.0)
    with pytest.raises(BadValue, match=r"^zeta is 0"):
        coloured_upcrossings(FIG_8_5._replace(zeta=0.0), t=[1.0], correlation_time=0.1)
    with pytest.raises(BadValue, match=r"^noise is -1"):
        escape_time(FIG_8_5._replace(noise=-1.0), step=0.01)
