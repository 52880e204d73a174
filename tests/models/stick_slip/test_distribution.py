"""The distributions of stick-slip against an independent solver, closed forms and each other."""

import math

import numpy as np
import pytest
from scipy.stats import invgauss

from underfoot.errors import BadValue
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.slip_distribution import SlipDistribution

# Fig. 8.6, 8.7 left, 8.10 and one of strong damping.
BLOCKS = {
    "8.6": BlockOnBelt(w0=1.0, zeta=0.1, noise=0.4, belt_velocity=1.0, x0=0.0, v0=-1.0),
    "8.7": BlockOnBelt(w0=1.0, zeta=0.11, noise=0.04, belt_velocity=1.0, x0=0.3, v0=0.0),
    "8.10": BlockOnBelt(w0=1.0, zeta=0.4, noise=0.1, belt_velocity=0.45, x0=0.9, v0=0.0),
    "damped": BlockOnBelt(w0=1.0, zeta=1.5, noise=0.5, belt_velocity=1.0, x0=0.5, v0=0.0),
}

# CDF of the slip duration from the Fokker-Planck equation on a grid: semi-Lagrangian in x, Crank-Nicolson in v, Strang
# splitting, four grids up to 500 x 1280 and 0.0025 s, extrapolated twice; run once, from the free Gaussian density at
# 0.1, 0.2, 0.02 and 0.02 s on. The last two extrapolations agree to 2e-9.
FOKKER_PLANCK = {
    "8.6": (
        [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0],
        [
            0.002019384,
            0.044782616,
            0.174225486,
            0.411223842,
            0.662094327,
            0.814336304,
            0.930253544,
            0.968434299,
            0.984788666,
            0.996321132,
            0.999114084,
            0.999975510,
            0.999999327,
        ],
    ),
    "8.7": (
        [1.5, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0],
        [
            0.000000647,
            0.000020929,
            0.000875527,
            0.030494449,
            0.083510288,
            0.116590943,
            0.145348422,
            0.201604878,
            0.366851580,
            0.500521912,
            0.601921760,
            0.681861865,
            0.746283058,
            0.797894796,
        ],
    ),
    "8.10": (
        [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 15.0, 20.0],
        [
            0.008094639,
            0.011910381,
            0.013581403,
            0.017396543,
            0.045946749,
            0.173728983,
            0.608649213,
            0.844704400,
            0.934218258,
            0.986492380,
            0.997084213,
            0.999934882,
            0.999998539,
        ],
    ),
    "damped": (
        [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0],
        [
            0.044001025,
            0.096095624,
            0.145480684,
            0.205297794,
            0.278558333,
            0.360310738,
            0.522925371,
            0.659821053,
            0.763740701,
            0.890745476,
            0.950816680,
        ],
    ),
}


@pytest.mark.parametrize("error", [1e-2, 1e-3, 1e-4, 1e-6])
@pytest.mark.parametrize("name", FOKKER_PLANCK)
def test_durations_keep_the_asked_error_against_an_independent_solver(name, error):
    times, cdf = FOKKER_PLANCK[name]
    duration = SlipDistribution.solve(BLOCKS[name], t_end=times[-1], error=error).duration
    assert np.abs(np.interp(times, duration.points, duration.cdf) - cdf).max() <= error
    assert duration.unobserved == pytest.approx(1.0 - cdf[-1], abs=error)


@pytest.mark.parametrize(
    ("gap", "error"), [(gap, error) for gap in (2.0, 0.3, 0.1) for error in (1e-2, 1e-3)] + [(0.1, 1e-4), (2.0, 1e-5)]
)
def test_a_constant_acceleration_gives_the_inverse_gaussian_distribution(gap, error):
    # A spring so soft and so far out that its acceleration stays at 1 m/s^2 to a few 1e-6.
    acceleration, noise, w0 = 1.0, 0.25, 1e-3
    block = BlockOnBelt(w0, 0.0, noise, 0.5, -acceleration / w0**2, 0.5 - gap)
    t_end = 10.0 * min(gap, 1.0)
    duration = SlipDistribution.solve(block, t_end=t_end, error=error).duration
    times = np.linspace(0.0, t_end, 2001)[1:]
    shape = gap**2 / (2.0 * noise)
    exact = invgauss(mu=gap / acceleration / shape, scale=shape).cdf(times)
    assert np.abs(np.interp(times, duration.points, duration.cdf) - exact).max() <= error


@pytest.mark.parametrize("error", [1e-2, 1e-3, 1e-5])
@pytest.mark.parametrize("zeta", [0.2, 5.0])
def test_a_resting_velocity_equal_to_the_belts_gives_the_ornstein_uhlenbeck_distribution(zeta, error):
    gap, noise, belt_velocity, w0 = 0.8, 0.3, 0.7, 1e-4
    block = BlockOnBelt(w0, zeta, noise, belt_velocity, -zeta * belt_velocity / w0**2, belt_velocity - gap)
    duration = SlipDistribution.solve(block, t_end=10.0, error=error).duration
    times = np.linspace(0.0, 10.0, 1001)[1:]
    spread = np.sqrt(2.0 * noise / zeta * -np.expm1(-2.0 * zeta * times))
    exact = np.array([math.erfc(z) for z in gap * np.exp(-zeta * times) / spread])
    assert np.abs(np.interp(times, duration.points, duration.cdf) - exact).max() <= error


# More of the thesis's figures, and corners: (block, t_end).
CORNERS = {
    "8.4 weak noise, weak damping": (BlockOnBelt(1.0, 0.01, 5e-4, 1.0, 1.05, 0.0), 30.0),
    "8.7 right": (BlockOnBelt(1.0, 0.125, 0.33, 1.0, 0.3, 0.0), 20.0),
    "8.8 left": (BlockOnBelt(1.0, 0.4, 0.1, 1.0, 0.3, 0.0), 40.0),
    "8.9 rare": (BlockOnBelt(1.0, 0.11, 0.005, 1.0, 0.1, 0.0), 60.0),
    "strong damping": (BlockOnBelt(1.0, 10.0, 10.0, 1.0, 0.5, 0.0), 40.0),
    "slow belt": (BlockOnBelt(1.0, 0.2, 0.1, 0.2, 0.5, 0.0), 30.0),
    "fast belt, long": (BlockOnBelt(1.0, 0.2, 0.1, 2.0, 0.5, 0.0), 500.0),
    "start near the belt": (BlockOnBelt(1.0, 0.4, 0.1, 1.0, 0.9, 0.95), 20.0),
    "hardly any noise": (BlockOnBelt(1.0, 0.1, 1e-6, 0.5, 1.0, 0.0), 20.0),
    "no damping": (BlockOnBelt(1.0, 0.0, 0.01, 1.0, 0.3, 0.0), 20.0),
    "in other units": (BlockOnBelt(300.0, 30.0, 10.8, 0.3, 0.0, -0.3), 0.05),
}


@pytest.mark.parametrize("name", CORNERS)
def test_each_asked_error_is_kept_against_a_much_smaller_one(name):
    block, t_end = CORNERS[name]
    smaller = 2e-4
    exact = SlipDistribution.solve(block, t_end, error=smaller).duration
    for error in (1e-2, 1e-3):
        duration = SlipDistribution.solve(block, t_end, error=error).duration
        both = np.union1d(duration.points, exact.points)
        difference = np.interp(both, duration.points, duration.cdf) - np.interp(both, exact.points, exact.cdf)
        assert np.abs(difference).max() <= error - smaller


def test_figure_8_10_has_a_small_mass_at_no_distance():
    distance = SlipDistribution.solve(BLOCKS["8.10"], t_end=40.0, error=1e-4).distance
    below, above = np.interp([-0.1, 0.1], distance.points, distance.cdf)
    # The 1.1 % come from simulated slips.
    assert above - below == pytest.approx(0.011, abs=1e-3)


def test_units_do_not_matter():
    time, length = 0.01, 0.003
    w0, zeta, noise, belt, x0, v0 = block = BLOCKS["8.6"]
    velocity = length / time
    small = BlockOnBelt(w0 / time, zeta / time, noise * velocity**2 / time, belt * velocity, x0 * length, v0 * velocity)
    there = SlipDistribution.solve(small, t_end=20.0 * time, error=1e-4).period
    here = SlipDistribution.solve(block, t_end=20.0, error=1e-4).period
    assert np.abs(np.interp(here.points, there.points / time, there.cdf) - here.cdf).max() < 1e-4


def test_nothing_ends_where_nothing_can():
    block = BlockOnBelt(1.0, 0.1, 1e-12, 1.0, 0.5, 0.0)
    slip = SlipDistribution.solve(block, t_end=50.0, error=1e-3)
    assert slip.duration.unobserved == 1.0
    assert slip.duration.cdf.max() == 0.0
    assert slip.period.unobserved == 1.0


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("w0", 0.0),
        ("zeta", -0.1),
        ("noise", 0.0),
        ("belt_velocity", -1.0),
        ("x0", math.nan),
        ("v0", 1.0),
        ("v0", 1.5),
        ("t_end", math.inf),
        ("error", 1e-9),
        ("error", 0.5),
    ],
)
def test_values_without_a_slip_are_refused_by_name(name, value):
    values = BLOCKS["8.6"]._asdict() | {"t_end": 20.0, "error": 1e-3} | {name: value}
    t_end, error = values.pop("t_end"), values.pop("error")
    with pytest.raises(BadValue, match=f"^{name} is .*; allowed: "):
        SlipDistribution.solve(BlockOnBelt(**values), t_end, error)


def test_an_error_out_of_reach_is_refused():
    # Noise so small that a slip's end is sharper, in time, than the numbers can carry.
    block = BlockOnBelt(1.0, 0.1, 1e-12, 0.5, 1.0, 0.0)
    with pytest.raises(BadValue, match=r"^error is 0.0001; allowed for these values: above"):
        SlipDistribution.solve(block, t_end=20.0, error=1e-4)
