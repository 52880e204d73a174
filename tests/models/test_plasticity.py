"""Elasto-plastic slip: its linear motion, the distribution and sum of its energies, and its life in real time."""

import math
from itertools import pairwise

import numpy as np
import pytest
from event_rows import rows_of
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats
from scipy.integrate import solve_ivp

from underfoot.errors import BadValue
from underfoot.models import elasto_plastic
from underfoot.models.elasto_plastic import Ground, power_law, slip_displacement, slip_energy
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key

RATE = 48000.0
GROUND = {"spread": 0.3, "renewal_s": 0.01}


def designed(**changes):
    ground, coefficients = Ground(**{**GROUND, **changes}), elasto_plastic.COEFFICIENTS.zeros()
    elasto_plastic.design(ground.parameters(), ground.most_j, 1.0, 0.5, RATE, coefficients)
    return coefficients


def played(coefficients, force, cuts=(), state=None, frame=0):
    state = elasto_plastic.STATE.zeros() if state is None else state
    moved, found = np.zeros(force.size), []
    for i, j in pairwise([0, *sorted(cuts), force.size]):
        events = event_list(room=j - i)
        elasto_plastic.run(
            force[i:j], stream_key("slip"), frame + i, coefficients, state, moved[i:j], events, moved[:0]
        )
        found.append(rows_of(events))
    return moved, np.concatenate(found), state


def slip(force, seed=0, **ground):
    """What ground of these values does at `RATE`."""
    return Ground(**ground).response(force, RATE, seed)


def footsteps():
    """Two footsteps with a rest between them, the second a little heavier."""
    step = np.sin(np.linspace(0.0, np.pi, 6000)) ** 2
    return np.concatenate((700.0 * step, np.zeros(700), 800.0 * step, np.zeros(300)))


# The motion


def test_below_the_threshold_the_ground_moves_as_an_ode_solver_says():
    def force(time_s):
        return 300.0 * np.sin(40.0 * time_s) + 2000.0 * time_s

    exact = solve_ivp(
        lambda time_s, state: [state[1], (force(time_s) - 400.0 * state[1] - 8e5 * state[0]) / 0.5],
        (0.0, 0.2),
        [0.0, 0.0],
        method="DOP853",
        rtol=1e-11,
        atol=1e-16,
        dense_output=True,
    )
    time_s = np.arange(int(0.2 * RATE)) / RATE
    got = slip(force(time_s), threshold_n=1e6)
    wanted = exact.sol(time_s)[0]
    assert got.time_s.size == 0
    assert np.linalg.norm(got.displacement_m - wanted) < 1e-7 * np.linalg.norm(wanted)


def test_between_two_slips_the_ground_rings_exactly_around_its_new_rest():
    """After the last slip, x - x0 is a free damped oscillation plus the answer to a constant force: a closed form."""
    force = np.concatenate((np.linspace(0.0, 450.0, 4800), np.full(4800, 450.0)))
    got = slip(force, seed=2)
    last = int(got.time_s[-1] * RATE)
    x, plastic = got.displacement_m, got.plastic_m[-1]
    start = max(last, 4800) + 5
    assert start < 9000
    loss = 400.0 / (2 * 0.5)
    turn = math.sqrt(8e5 / 0.5 - loss**2)
    rest = (450.0 + 4e5 * plastic) / 8e5
    time_s = np.arange(9600 - start) / RATE
    basis = np.exp(-loss * time_s) * np.array([np.cos(turn * time_s), np.sin(turn * time_s)])
    fitted, *_ = np.linalg.lstsq(basis.T, x[start:] - rest, rcond=None)
    np.testing.assert_allclose(x[start:], rest + fitted @ basis, atol=1e-13)


def test_a_slow_ramp_slips_as_far_as_statics_say():
    """Quasi-static: the plastic unit's force k2 (F - k1 xi) / K stays near its threshold."""
    force = np.linspace(0.0, 800.0, 96000)
    got = slip(force, most_j=1e-4, least_j=1e-5)
    wanted = np.maximum(force - 100.0 * 8e5 / 4e5, 0.0) / 4e5
    np.testing.assert_allclose(got.plastic_m, wanted, atol=5e-6)
    assert wanted[-1] > 1e-3


# The energies


@given(st.floats(1.0, 1e4), st.floats(1e3, 1e8), st.floats(0.0, 1.0))
def test_energy_and_displacement_are_each_others_inverse(force, stiffness, share):
    energy = share * 0.5 * force**2 / stiffness
    displacement = slip_displacement(force, energy, stiffness)
    assert 0.0 <= displacement <= force / stiffness * (1.0 + 1e-12)
    assert slip_energy(force, displacement, stiffness) == pytest.approx(energy, rel=1e-12, abs=1e-300)


@pytest.mark.parametrize("gamma", [0.0, 1.0, 1.0 + 1e-13, 1.5, 2.0, 3.1])
def test_the_power_law_has_its_closed_form(gamma):
    chances = np.linspace(0.0, 1.0, 11)
    got = [power_law(chance, 1e-5, math.log(1e3), 1.0 - gamma) for chance in chances]
    if abs(gamma - 1.0) < 1e-9:
        wanted = 1e-5 * 1e3**chances
    else:
        low, high = 1e-5 ** (1.0 - gamma), 1e-2 ** (1.0 - gamma)
        wanted = (low + chances * (high - low)) ** (1.0 / (1.0 - gamma))
    np.testing.assert_allclose(got, wanted, rtol=1e-9)


@pytest.mark.parametrize("gamma", [1.2, 1.5, 2.0])
def test_the_energies_of_slips_follow_the_truncated_power_law(gamma):
    force = np.linspace(0.0, 10_000.0, 960_000)  # slow, so that nearly no two slips share a frame
    limits_j = {"gamma": gamma, "least_j": 1e-4, "most_j": 1e-2}
    energies = slip(force, **limits_j, stiffness_n_m=1e6, threshold_n=200.0, seed=3).energy_j
    power = 1.0 - gamma

    def cdf(energy):
        return (energy**power - 1e-4**power) / (1e-2**power - 1e-4**power)

    assert energies.size > 300
    assert energies.min() >= 1e-4
    assert stats.kstest(energies[energies <= 1e-2], cdf).pvalue > 0.01
    edges = np.geomspace(1e-4, 1e-2, 9)
    density = np.histogram(energies, edges)[0] / np.diff(edges)
    centres = np.sqrt(edges[1:] * edges[:-1])
    slope = np.polyfit(np.log(centres), np.log(density), 1, w=np.sqrt(density * np.diff(edges)))[0]
    assert slope == pytest.approx(-gamma, abs=0.15)


def test_no_slip_takes_more_than_the_plastic_unit_holds():
    got = slip(np.linspace(0.0, 1000.0, 9600), least_j=1.0, most_j=10.0)
    held = 0.5 * 100.0**2 / 4e5
    assert got.energy_j.size > 2
    assert (got.energy_j >= held).all()
    assert (got.energy_j < 1.5 * held).all()


def test_slips_that_pile_up_in_a_frame_still_bring_the_force_to_its_threshold():
    force = np.full(4800, 900.0)
    got = slip(force, least_j=1e-9, most_j=1e-9)
    pulled = 4e5 * (got.displacement_m - got.plastic_m)
    assert pulled.max() < 100.0 * (1.0 + 1e-9)
    assert got.energy_j.max() > 30e-9


def test_the_energies_are_the_work_that_the_slips_took():
    got = slip(np.linspace(0.0, 700.0, 48000), seed=5)
    jumps = np.flatnonzero(np.diff(got.plastic_m, prepend=0.0))
    np.testing.assert_array_equal(jumps, np.floor(got.time_s * RATE + 1e-6))
    before = got.plastic_m - np.diff(got.plastic_m, prepend=0.0)
    x, old, new = got.displacement_m[jumps], before[jumps], got.plastic_m[jumps]
    np.testing.assert_allclose(got.energy_j, 0.5 * 4e5 * ((x - old) ** 2 - (x - new) ** 2), rtol=1e-6)


# Thresholds


def test_a_slip_lies_where_the_force_passes_its_threshold():
    got = slip(np.linspace(0.0, 500.0, 4800))
    i = int(got.time_s[0] * RATE)
    pulled = 4e5 * (got.displacement_m[i - 1 : i + 1] - got.plastic_m[i - 1])
    share = (100.0 - pulled[0]) / (pulled[1] - pulled[0])
    assert got.time_s[0] * RATE == pytest.approx(i + share, abs=1e-6)


def test_drawn_thresholds_lie_evenly_within_their_spread():
    first = []
    for seed in range(300):
        got = slip(np.linspace(0.0, 400.0, 2400), spread=0.5, seed=seed, damping_ns_m=3000.0)
        i = int(got.time_s[0] * RATE)
        share = got.time_s[0] * RATE - i
        first.append(4e5 * (got.displacement_m[i - 1] * (1 - share) + got.displacement_m[i] * share))
    assert stats.kstest(first, stats.uniform(50.0, 100.0).cdf).pvalue > 0.01


def test_reloading_below_the_former_force_makes_no_slip():
    rise = np.linspace(0.0, 600.0, 9600)
    got = slip(np.concatenate((rise, rise[::-1], 0.9 * rise)))
    assert got.time_s.size > 20
    assert (got.time_s < 9900 / RATE).all()


# In real time


def test_any_split_gives_the_same_bits():
    coefficients, force = designed(), footsteps()
    moved, events, state = played(coefficients, force, frame=10**7)
    assert len(events) > 50
    frames = np.floor(events[:, 0])
    assert (np.diff(frames) > 0).all()
    assert (events[:, 1] > 0.0).all()
    rng = np.random.default_rng(5)
    for cuts in (range(7, 13000, 7), range(64, 13000, 64), rng.integers(0, 13000, 300)):
        parted, found, left = played(coefficients, force, cuts, frame=10**7)
        np.testing.assert_array_equal(parted, moved)
        np.testing.assert_array_equal(found, events)
        np.testing.assert_array_equal(left.values, state.values)


def test_after_the_renewal_time_the_ground_is_fresh_and_differs():
    force, rest = footsteps()[:6000], np.zeros(9600)
    moved, events, state = played(designed(), np.concatenate((force, rest, force, rest)))
    again = events[events[:, 0] > 15600]
    slept, found, _ = played(designed(), force, frame=15600)
    np.testing.assert_allclose(moved[15600:21600], slept, atol=1e-15)
    np.testing.assert_allclose(again, found, rtol=1e-6)
    assert len(again) > 20
    assert abs(again[0, 0] - 15600 - events[0, 0]) > 1e-3
    assert elasto_plastic.tail(state, designed()) < 1e-9


def test_the_tail_bounds_what_is_left_and_waits_for_the_renewal():
    coefficients, state = designed(), elasto_plastic.STATE.zeros()
    assert elasto_plastic.tail(state, coefficients) == 0.0
    played(coefficients, footsteps()[:5000], state=state)
    assert elasto_plastic.tail(state, coefficients) == math.inf
    played(coefficients, np.zeros(481), state=state, frame=5000)
    bound = elasto_plastic.tail(state, coefficients)
    moved, events, _ = played(coefficients, np.zeros(4800), state=state, frame=5481)
    assert 0.0 < np.abs(moved).max() <= bound * (1.0 + 1e-9)
    assert len(events) == 0


@settings(max_examples=100)
@given(data=st.data())
def test_every_finite_force_is_answered_by_finite_values(data):
    changes = {
        "mass_kg": data.draw(st.sampled_from([0.0, 1e-9, 0.5, 1e6])),
        "damping_ns_m": data.draw(st.sampled_from([0.0, 400.0, 1e9])),
        "stiffness_n_m": data.draw(st.sampled_from([1e-3, 4e5, 1e12])),
        "plastic_stiffness_n_m": data.draw(st.sampled_from([1e-3, 4e5, 1e12])),
        "threshold_n": data.draw(st.sampled_from([1e-9, 100.0, 1e9])),
        "spread": data.draw(st.sampled_from([0.0, 0.99])),
        "gamma": data.draw(st.sampled_from([0.0, 1.0, 10.0])),
        "most_j": data.draw(st.sampled_from([1e-5, 1e6])),
    }
    force = np.array(data.draw(st.lists(st.floats(allow_nan=False, allow_infinity=False), max_size=200)))
    moved, events, state = played(designed(**changes), np.concatenate((force, np.repeat(force, 5))))
    assert np.isfinite(moved).all()
    assert np.isfinite(events).all()
    assert np.isfinite(state.values).all()


@pytest.mark.parametrize(
    "changes",
    [
        {"rate_hz": 0.0},
        {"mass_kg": -1.0},
        {"damping_ns_m": math.nan},
        {"stiffness_n_m": 0.0},
        {"plastic_stiffness_n_m": -1.0},
        {"threshold_n": 0.0},
        {"spread": 1.0},
        {"gamma": 11.0},
        {"least_j": 0.0},
        {"most_j": 1e-6},
        {"renewal_s": -1.0},
        {"force_n": [0.0, math.inf]},
    ],
)
def test_a_value_outside_its_range_is_named(changes):
    given = {"force_n": [0.0, 1.0], "rate_hz": RATE, **changes}
    force_n, rate_hz = given.pop("force_n"), given.pop("rate_hz")
    with pytest.raises(BadValue, match=next(iter(changes))):
        Ground(**given).response(force_n, rate_hz)
