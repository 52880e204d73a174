"""The laws of stick-slip against an independent solver, closed forms, each other and drawn paths."""

import math

import numpy as np
import pytest
from scipy.stats import invgauss

from underfoot.errors import BadValue
from underfoot.models.stick_slip import distribution
from underfoot.models.stick_slip.distribution import SlipLaw

# Fig. 8.6, 8.7 left, 8.10 and one of strong damping: (w0, zeta, D, v_b, x0, v0).
FIG_8_6 = (1.0, 0.1, 0.4, 1.0, 0.0, -1.0)
FIG_8_7 = (1.0, 0.11, 0.04, 1.0, 0.3, 0.0)
FIG_8_10 = (1.0, 0.4, 0.1, 0.45, 0.9, 0.0)
DAMPED = (1.0, 1.5, 0.5, 1.0, 0.5, 0.0)

# CDF of the slip duration from the Fokker-Planck equation on a grid: semi-Lagrangian in x, Crank-Nicolson in v, Strang
# splitting, four grids up to 500 x 1280 and 0.0025 s, extrapolated twice. The last two extrapolations agree to 2e-9.
# (The prototype first_passage.py, run once; started from the free law at 0.1, 0.2, 0.02, 0.02 s.)
FOKKER_PLANCK = {
    FIG_8_6: (
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
    FIG_8_7: (
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
    FIG_8_10: (
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
    DAMPED: (
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

ERRORS = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6]


@pytest.mark.parametrize("error", ERRORS)
@pytest.mark.parametrize("values", FOKKER_PLANCK, ids=["8.6", "8.7", "8.10", "damped"])
def test_durations_keep_the_asked_error_against_an_independent_solver(values, error):
    times, cdf = FOKKER_PLANCK[values]
    law = distribution.first_passage(*values, t_end=times[-1], error=error)
    assert np.abs(np.interp(times, law.t, law.cdf) - cdf).max() <= error
    assert law.missing == pytest.approx(1.0 - cdf[-1], abs=error)


@pytest.mark.parametrize("error", ERRORS[:-1])
@pytest.mark.parametrize("gap", [2.0, 0.3, 0.1])
def test_a_constant_pull_gives_the_inverse_gaussian_law(gap, error):
    # A spring so soft and so far out that its pull stays at 1 m/s^2 to a few 1e-6.
    pull, noise, w0 = 1.0, 0.25, 1e-3
    law = distribution.first_passage(w0, 0.0, noise, 0.5, -pull / w0**2, 0.5 - gap, t_end=10.0, error=error)
    times = np.linspace(0.0, 10.0, 2001)[1:] * gap
    shape = gap**2 / (2.0 * noise)
    exact = invgauss(mu=gap / pull / shape, scale=shape).cdf(times)
    seen = times <= 10.0
    assert np.abs(np.interp(times, law.t, law.cdf) - exact)[seen].max() <= error


@pytest.mark.parametrize("error", ERRORS[:-1])
@pytest.mark.parametrize("zeta", [0.2, 5.0])
def test_a_resting_velocity_equal_to_the_belts_gives_the_ornstein_uhlenbeck_law(zeta, error):
    gap, noise, belt, w0 = 0.8, 0.3, 0.7, 1e-4
    law = distribution.first_passage(w0, zeta, noise, belt, -zeta * belt / w0**2, belt - gap, t_end=10.0, error=error)
    times = np.linspace(0.0, 10.0, 1001)[1:]
    spread = np.sqrt(2.0 * noise / zeta * -np.expm1(-2.0 * zeta * times))
    exact = np.array([math.erfc(z) for z in gap * np.exp(-zeta * times) / spread])
    assert np.abs(np.interp(times, law.t, law.cdf) - exact).max() <= error


# More of the thesis's figures, and corners: (values, t_end).
CORNERS = {
    "8.4 weak noise, weak damping": ((1.0, 0.01, 5e-4, 1.0, 1.05, 0.0), 30.0),
    "8.7 right": ((1.0, 0.125, 0.33, 1.0, 0.3, 0.0), 20.0),
    "8.8 left": ((1.0, 0.4, 0.1, 1.0, 0.3, 0.0), 40.0),
    "8.9 rare": ((1.0, 0.11, 0.005, 1.0, 0.1, 0.0), 60.0),
    "strong damping": ((1.0, 10.0, 10.0, 1.0, 0.5, 0.0), 40.0),
    "slow belt": ((1.0, 0.2, 0.1, 0.2, 0.5, 0.0), 30.0),
    "fast belt, long": ((1.0, 0.2, 0.1, 2.0, 0.5, 0.0), 500.0),
    "start near the belt": ((1.0, 0.4, 0.1, 1.0, 0.9, 0.95), 20.0),
    "hardly any noise": ((1.0, 0.1, 1e-6, 0.5, 1.0, 0.0), 20.0),
    "no damping": ((1.0, 0.0, 0.01, 1.0, 0.3, 0.0), 20.0),
    "in other units": ((300.0, 30.0, 10.8, 0.3, 0.0, -0.3), 0.05),
}


@pytest.mark.parametrize("name", CORNERS)
def test_each_asked_error_is_kept_against_a_much_smaller_one(name):
    values, t_end = CORNERS[name]
    exact = distribution.first_passage(*values, t_end, error=1e-5)
    for error in (1e-2, 1e-3):
        law = distribution.first_passage(*values, t_end, error=error)
        both = np.union1d(law.t, exact.t)
        assert np.abs(np.interp(both, law.t, law.cdf) - np.interp(both, exact.t, exact.cdf)).max() <= error


# Share of slips that ended by t, and with a distance up to d, of 1e7 drawn by friction.paths at error 1e-5 (run once);
# their own noise is 1.6e-4 at most.
DRAWN = {
    (1.0, 0.01, 5e-4, 1.0, 1.05, 0.0): (
        {4: 0.00000, 5: 0.77913, 6: 0.77914, 8: 0.77914, 10: 0.77914, 12: 0.81653, 14: 0.81653, 20: 0.82996},
        {10.0: 0.82996},
    ),
    (1.0, 0.1, 0.4, 1.0, 0.0, 0.9): (
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
    (1.0, 10.0, 10.0, 1.0, 0.5, 0.0): (
        {0.02: 0.09179, 0.05: 0.27122, 0.1: 0.44163, 0.2: 0.63124, 0.5: 0.88172, 1: 0.98314, 2: 0.99974, 5: 1.00000},
        {-0.3: 0.00000, -0.1: 0.00001, -0.03: 0.01943, -0.01: 0.18956, 0.01: 0.50243, 0.03: 0.57573},
    ),
}


@pytest.mark.parametrize("values", DRAWN)
def test_durations_and_distances_are_those_of_ten_million_drawn_slips(values):
    durations, distances = DRAWN[values]
    law = SlipLaw.solve(*values, t_end=20.0, error=1e-4)
    for found, drawn in ((law.duration, durations), (law.distance, distances)):
        assert np.abs(np.interp(list(drawn), found.at, found.cdf) - list(drawn.values())).max() < 6e-4


def test_the_density_is_the_slope_of_the_cdf_and_never_negative():
    law = SlipLaw.solve(*FIG_8_10, t_end=20.0, error=1e-4)
    for found in (law.duration, law.distance, law.period):
        assert np.all(np.diff(found.at) > 0.0)
        assert np.all(np.diff(found.cdf) >= 0.0)
        assert found.density.min() >= 0.0
        assert np.trapezoid(found.density, found.at) == pytest.approx(1.0 - found.missing, abs=1e-3)
        summed = np.cumsum(0.5 * (found.density[1:] + found.density[:-1]) * np.diff(found.at))
        assert np.abs(summed - (found.cdf[1:] - found.cdf[0])).max() < 1e-3


def test_periods_and_distances_are_those_of_drawn_slips():
    law = SlipLaw.solve(*FIG_8_10, t_end=20.0, error=1e-4)
    drawn = distribution.paths(*FIG_8_10, t_end=20.0, count=100_000, error=1e-3, seed=3)
    distance = FIG_8_10[4] - drawn.position
    sticks = distance >= 0.0  # false where a slip still lasted: its distance is nan
    period = (drawn.duration + distance / FIG_8_10[3])[sticks]
    for found, values in ((law.distance, distance), (law.period, period)):
        at = np.sort(values[np.isfinite(values)])
        risen = np.arange(1, at.size + 1) / drawn.duration.size
        assert np.abs(np.interp(at, found.at, found.cdf) - risen).max() < 6e-3
    assert law.negative_stick == pytest.approx((distance < 0.0).mean(), abs=2e-3)
    assert distribution.periods(*FIG_8_10, t_end=20.0, error=1e-2).missing == pytest.approx(
        law.period.missing, abs=1e-2
    )


def test_figure_8_10_has_a_small_mass_at_no_distance():
    law = distribution.distances(*FIG_8_10, t_end=40.0, error=1e-4)
    near = np.interp(0.1, law.at, law.cdf) - np.interp(-0.1, law.at, law.cdf)
    # The errata's 1.1 % comes from simulated slips.
    assert near == pytest.approx(0.011, abs=1e-3)


def test_units_do_not_matter():
    time, length = 0.01, 0.003
    w0, zeta, noise, belt, x0, v0 = FIG_8_6
    small = (w0 / time, zeta / time, noise * length**2 / time**3, belt * length / time, x0 * length, v0 * length / time)
    there = distribution.periods(*small, t_end=20.0 * time, error=1e-4)
    here = distribution.periods(*FIG_8_6, t_end=20.0, error=1e-4)
    assert np.abs(np.interp(here.t, there.t / time, there.cdf) - here.cdf).max() < 1e-4


def test_a_long_slip_law_ends_exponentially_and_goes_through_the_short_one():
    values = (1.0, 0.4, 0.1, 1.0, 0.3, 0.0)
    short = distribution.first_passage(*values, t_end=60.0, error=1e-5)
    long = distribution.first_passage(*values, t_end=300.0, error=1e-5)
    assert np.abs(np.interp(short.t, long.t, long.cdf) - short.cdf).max() < 2e-5
    left = 1.0 - np.interp([60.0, 90.0, 120.0], long.t, long.cdf)
    assert left[0] / left[1] == pytest.approx(left[1] / left[2], rel=2e-2)


@pytest.mark.parametrize("values", [(1.0, 1.0, 0.1, 1.0, 1.0, 0.0), (1.0, 0.3, 0.059, 1.0, 0.075, 0.0)])
def test_a_hazard_that_stands_still_is_not_solved_on(values):
    law = SlipLaw.solve(*values, t_end=800.0, error=1e-2)
    assert len(law.panels.table) < 60
    earlier = SlipLaw.solve(*values, t_end=100.0, error=1e-5)
    hazard = -np.diff(np.log1p(-np.interp([70.0, 100.0], earlier.duration.t, earlier.duration.cdf)))[0] / 30.0
    left = 1.0 - earlier.duration.cdf[-1]
    for t in (200.0, 400.0, 800.0):
        expected = 1.0 - left * math.exp(-hazard * (t - 100.0))
        assert np.interp(t, law.duration.t, law.duration.cdf) == pytest.approx(expected, abs=1e-2)


def test_nothing_ends_where_nothing_can():
    law = distribution.first_passage(1.0, 0.1, 1e-12, 1.0, 0.5, 0.0, t_end=50.0, error=1e-3)
    assert law.missing == 1.0
    assert law.cdf.max() == 0.0
    assert distribution.periods(1.0, 0.1, 1e-12, 1.0, 0.5, 0.0, t_end=50.0, error=1e-3).missing == 1.0


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
    values = dict(zip(("w0", "zeta", "noise", "belt_velocity", "x0", "v0"), FIG_8_6, strict=True), t_end=20.0)
    for refuses in (distribution.first_passage, distribution.periods, distribution.distances):
        with pytest.raises(BadValue, match=f"^{name} is .*; allowed: "):
            refuses(**(values | {name: value}))


def test_an_error_out_of_reach_is_refused():
    # Noise so small that a slip's end is sharper, in time, than the numbers can carry.
    with pytest.raises(BadValue, match=r"^error is 0.0001; allowed for these values: above"):
        distribution.first_passage(1.0, 0.1, 1e-12, 0.5, 1.0, 0.0, t_end=20.0, error=1e-4)


def test_the_place_law_at_a_time_holds_its_density():
    law = SlipLaw.solve(*FIG_8_6, t_end=20.0, error=1e-4)
    for t in (1.0, 2.3, 7.0):
        _, masses, width = law.places(t)
        assert width > 0.0
        assert masses.sum() == pytest.approx(np.interp(t, law.duration.t, law.duration.density), abs=2e-3)
    assert law.places(0.0)[0].size == 0
    with pytest.raises(BadValue, match=r"^t is 21"):
        law.places(21.0)
