"""The hammer against an independent solution (DOP853), closed forms, and the energy that it may not make."""

import math
from itertools import pairwise

import numpy as np
import pytest
from event_rows import within
from scipy.optimize import brentq
from scipy.special import gamma
from solved_blow import solved_blow

from underfoot.errors import BadValue
from underfoot.models.modal import contact_motion, contact_step, impact, phasors
from underfoot.models.modal import hammer as impact_row
from underfoot.models.modal.hammer import Response
from underfoot.models.modal.impact import Hammer, ModalObject, strike
from underfoot.models.signals.events import event_list

RATE = 48_000.0
SOFT, MEDIUM, HARD = (1e4, 1.5), (1e7, 1.5), (1e11, 1.8)


def some_modes(count, seed=3, highest=5_000.0, mass=0.1):
    draw = np.random.default_rng(seed)
    frequencies = np.sort(draw.uniform(50.0, highest, count))
    return frequencies, draw.uniform(5, 80, count), mass * draw.uniform(0.3, 2, count), draw.uniform(0.3, 1, count)


WALL = ModalObject([1e-3], [0.0], [1e9], [1.0])


def against(run, truth):
    return np.linalg.norm(run - truth) / np.linalg.norm(truth)


TEN_MODES = ModalObject(*some_modes(10))


@pytest.fixture(scope="module")
def truths():
    """Force, displacement and speed for the three hardnesses of docs/models.md#impacts, on ten modes, for 20 ms."""
    times = np.arange(961) / RATE
    found = {}
    for stiffness, exponent in (SOFT, MEDIUM, HARD):
        impulse, displacement, speed = solved_blow(0.02, 1.0, stiffness, exponent, 0.3, some_modes(10), times)
        found[stiffness] = np.diff(impulse) * RATE, displacement[:-1], speed
    return found


@pytest.mark.parametrize(("stiffness", "exponent"), [SOFT, MEDIUM, HARD])
@pytest.mark.parametrize("error", [1e-2, 1e-4, 1e-6, 1e-8])
def test_the_asked_error_is_met(truths, stiffness, exponent, error):
    hit = strike(Hammer(0.02, 1.0, stiffness, exponent, 0.3), TEN_MODES, 0.02, RATE, error)
    force, displacement, speed = truths[stiffness]
    assert against(hit.displacement_m, displacement) <= error
    assert against(hit.force_n, force) <= 10 * error
    assert hit.displacement_m[0] == 0.0
    assert against(np.cumsum(hit.acceleration_m_s2) / RATE, speed[1:]) <= 10 * error


@pytest.mark.parametrize(
    ("hardness", "steps", "reach"), [(SOFT, 1, 1e-5), (MEDIUM, 1, 1e-5), (HARD, 4, 1e-3), (HARD, 8, 1e-4)]
)
def test_few_substeps_reach_the_asked_force(truths, hardness, steps, reach):
    hit = run(hardness, steps)
    assert against(hit.force_n, truths[hardness[0]][0]) <= reach


@pytest.mark.parametrize("hardness", [SOFT, MEDIUM, HARD])
@pytest.mark.parametrize("error", [1e-3, 1e-6, 1e-9])
def test_not_much_more_work_than_asked(hardness, error):
    truth = run(hardness, 256).displacement_m
    steps = strike(Hammer(0.02, 1.0, *hardness, 0.3), TEN_MODES, 0.02, RATE, error).substeps
    enough = next(n for n in range(1, 200) if against(run(hardness, n).displacement_m, truth) <= error)
    assert steps <= 3 * enough


def run(hardness, substeps):
    """A strike with a given number of sub-steps a frame, on ten modes for 20 ms."""
    thrown = hammer(0.02, *hardness, 0.3, substeps=substeps)
    (force, acceleration, displacement), *_ = throw(some_modes(10), [(0.0, 1.0, 0.0)], 960, thrown=thrown)
    return impact.Impact(force, displacement, acceleration, substeps)


@pytest.mark.parametrize("seed", range(6))
def test_random_blows_meet_the_asked_error(seed):
    draw = np.random.default_rng(seed)
    count = int(draw.integers(1, 6))
    rate = draw.uniform(8e3, 96e3)
    modes = some_modes(count, seed, 0.4 * rate, mass=10 ** draw.uniform(-1, 1))
    thrown = 10 ** draw.uniform(-2.5, -0.5), 10 ** draw.uniform(-1, 1), 10 ** draw.uniform(4, 10)
    thrown = *thrown, draw.uniform(1, 3), draw.choice([0.0, 0.1, 1.0])
    error = 10 ** draw.uniform(-7, -2)
    times = np.arange(201) / rate
    hit = strike(Hammer(*thrown), ModalObject(*modes), 200 / rate, rate, error)
    impulse, displacement, _ = solved_blow(*thrown, modes, times)
    assert against(hit.displacement_m, displacement[:-1]) <= error
    assert against(hit.force_n, np.diff(impulse) * rate) <= 30 * error


@pytest.mark.parametrize("damping", [0.03, 0.3, 3.0])
@pytest.mark.parametrize(("stiffness", "exponent", "mass"), [(1e4, 1.0, 0.5), (1e7, 1.5, 0.02), (1e11, 3.0, 0.1)])
def test_restitution_at_a_rigid_wall(stiffness, exponent, mass, damping):
    velocity = 1.5
    hit = strike(Hammer(mass, velocity, stiffness, exponent, damping), WALL, 0.2, 8_000.0, 1e-9)
    out = hit.force_n.sum() / 8_000.0 / mass - velocity
    lost = damping * velocity - math.log1p(damping * velocity)
    expected = brentq(lambda w: -damping * w - math.log1p(-damping * w) - lost, 0.0, (1 - 1e-15) / damping, xtol=1e-15)
    assert out == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.5, 4.0])
def test_contact_time_and_depth_without_losses(exponent):
    mass, velocity, stiffness, rate = 0.02, 1.0, 1e7, 1e6
    hit = strike(Hammer(mass, velocity, stiffness, exponent), WALL, 0.08, rate, 1e-8)
    depth = ((exponent + 1) * mass * velocity**2 / (2 * stiffness)) ** (1 / (exponent + 1))
    power = 1 / (exponent + 1)
    lasts = 2 * depth / velocity * math.sqrt(math.pi) * gamma(1 + power) / gamma(0.5 + power)
    assert np.count_nonzero(hit.force_n) == pytest.approx(lasts * rate, abs=1.01)
    speed = velocity - np.cumsum(hit.force_n) / rate / mass
    deepest = np.max(np.cumsum(speed + 0.5 * hit.force_n / rate / mass)) / rate
    assert deepest == pytest.approx(depth, rel=1e-5 + 2 / (lasts * rate) ** 2)


def energy(state, modes):
    """Energy (J) of hammer, contact and object, where a block or a contact lets it be read from the row."""
    frequencies, decays, masses, shapes = modes
    touching = state.in_contact != 0.0
    phasor = state.z if touching else state.end
    x, y = phasor.re[: frequencies.size], phasor.im[: frequencies.size]
    angular = 2 * np.pi * frequencies
    q, v = y / shapes, (angular * x - decays * y) / shapes
    stiffness, exponent, depth = state.contact.stiffness, state.contact.exponent, max(state.penetration, 0.0)
    contact = stiffness * depth ** (exponent + 1) / (exponent + 1) if touching else 0.0
    moving = 0.5 * state.mass * state.speed**2
    return moving + contact + 0.5 * (masses * (v**2 + (angular**2 + decays**2) * q**2)).sum()


@pytest.mark.parametrize("seed", range(5))
def test_energy_is_never_gained_and_the_force_never_pulls(seed):
    draw = np.random.default_rng(seed)
    out = Response(*np.empty((3, 32)))
    for _ in range(40):
        count, rate = int(100 ** draw.uniform()), 10 ** draw.uniform(np.log10(8e3), np.log10(192e3))
        damping, lossless = 10 ** draw.uniform(-3, 1.5), draw.uniform() < 0.3
        modes = (
            10 ** draw.uniform(0, np.log10(0.9 * rate), count),
            np.zeros(count) if lossless else draw.uniform(0, 1_000, count),
            10 ** draw.uniform(-4, 2, count),
            draw.uniform(0.01, 1, count),
        )
        thrown = hammer(
            10 ** draw.uniform(-4, 1),
            10 ** draw.uniform(3, 13),
            draw.uniform(1, 4),
            0.0 if lossless else damping,
            error=1e-3,
            substeps=draw.choice([1, 2, 7]),
        )
        velocity = 10 ** draw.uniform(-2, 1)
        known, state = row(modes, rate)
        first = last = 0.5 * thrown.mass * velocity**2
        for block in range(6):
            strikes = event_list((0.0, velocity)) if block == 0 else event_list()
            impact_row.ring(strikes, thrown, 32 * block, known, state, out)
            assert np.isfinite(out).all()
            assert (out.force >= 0.0).all()
            if state.in_contact or block % 2:
                now = energy(state, modes)
                assert now <= last + 1e-11 * first
                last = now
        if lossless:
            assert last == pytest.approx(first, rel=1e-10)


def test_a_standing_load_settles():
    modes = [80.0, 300.0], [30.0, 60.0], [0.5, 0.2], [1.0, 0.7]
    pressed = Hammer(2.0, 0.3, 1e5, 1.5, 2.0, load_n=300.0)
    hit = strike(pressed, ModalObject(*modes), 4.0, 8_000.0, 1e-6)
    frequencies, decays, masses, shapes = (np.array(values) for values in modes)
    sag = 300.0 * (shapes**2 / masses / ((2 * np.pi * frequencies) ** 2 + decays**2)).sum()
    np.testing.assert_allclose(hit.force_n[-800:], 300.0, rtol=1e-9)
    np.testing.assert_allclose(hit.displacement_m[-800:], sag, rtol=1e-9)


@pytest.mark.parametrize(
    ("stiffness", "exponent", "rate"), [(1e13, 1.0, 8e3), (1e13, 4.0, 8e3), (1e3, 1.0, 192e3), (1e3, 4.0, 8e3)]
)
def test_extremes_stay_bounded(stiffness, exponent, rate):
    for mass in (1e-4, 10.0):
        hit = strike(Hammer(mass, 3.0, stiffness, exponent, 1.0), TEN_MODES, 0.01, rate, 1e-5)
        assert 1 <= hit.substeps <= impact_row.MOST_SUBSTEPS
        assert np.isfinite(hit.displacement_m).all()
        assert (hit.force_n >= 0.0).all()
        assert 0.0 < hit.force_n.sum() / rate <= 2 * mass * 3.0 * (1 + 1e-12) or mass == 10.0


def test_the_least_error_is_that_of_rounding(truths):
    hit = strike(Hammer(0.02, 1.0, *MEDIUM, 0.3), TEN_MODES, 0.02, RATE, 1e-12)
    assert against(hit.displacement_m, run(MEDIUM, 256).displacement_m) < 1e-11
    assert against(hit.displacement_m, truths[MEDIUM[0]][1]) < 1e-9


def test_a_mode_above_half_the_rate_is_felt_but_not_heard():
    low, high = ([300.0], [20.0], [0.1], [1.0]), ([30_000.0], [20.0], [0.05], [1.0])
    both, hard = ModalObject(*(a + b for a, b in zip(low, high, strict=True))), Hammer(0.02, 1.0, *HARD, 0.3)
    alone = strike(hard, ModalObject(*low), 0.005, RATE, 1e-6)
    hit = strike(hard, both, 0.005, RATE, 1e-6)
    fine = strike(hard, both, 0.005, 4 * RATE, 1e-6)
    np.testing.assert_allclose(hit.force_n, fine.force_n.reshape(-1, 4).mean(1), atol=1e-4 * hit.force_n.max())
    assert against(alone.force_n, hit.force_n) > 0.01
    after = hit.displacement_m[100:] * np.exp(20.0 * np.arange(100, hit.displacement_m.size) / RATE)
    times = 2 * np.pi * 300.0 * np.arange(after.size) / RATE
    basis = np.column_stack([np.sin(times), np.cos(times)])
    assert against(basis @ np.linalg.lstsq(basis, after, rcond=None)[0], after) < 1e-9


def test_a_free_mass_and_a_critically_damped_mode():
    for decay in (0.0, 200.0):
        modes = [0.0], [decay], [0.1], [1.0]
        hit = strike(Hammer(0.02, 1.0, *MEDIUM), ModalObject(*modes), 0.01, RATE, 1e-7)
        expected = solved_blow(0.02, 1.0, *MEDIUM, 0.0, modes, np.arange(480) / RATE)[1]
        assert against(hit.displacement_m, expected) < 1e-6


def row(modes, rate=RATE, floor=0.0):
    """The object, and its row at rest."""
    sizes = phasors.sizes(len(modes[0]))
    known, state = contact_motion.OBJECT.zeros(**sizes), contact_motion.STATE.zeros(row=sizes["row"])
    impact_row.design(np.array(modes, dtype=float), 1.0, 1.0, rate, floor, known)
    return known, state


def hammer(mass=0.02, stiffness=1e7, exponent=1.5, damping=0.3, *, load=0.0, error=1e-4, substeps=0):
    made = impact_row.HAMMER.zeros()
    made.mass, made.stiffness, made.exponent, made.damping = mass, stiffness, exponent, damping
    made.load, made.error, made.substeps = load, error, substeps
    return made


def throw(modes, events, frames, cuts=(), thrown=None, floor=0.0):
    """Force, acceleration and displacement of a row in real time, in calls cut at `cuts`; the object, and the row."""
    known, state = row(modes, floor=floor)
    out = np.empty((3, frames))
    for first, last in pairwise([0, *cuts, frames]):
        strikes = event_list(*within(np.array(events), first, last))
        impact_row.ring(
            strikes, hammer() if thrown is None else thrown, first, known, state, Response(*out[:, first:last])
        )
    return out, known, state


@pytest.mark.parametrize("hardness", [SOFT, MEDIUM, HARD])
def test_the_same_bytes_however_the_frames_are_split(hardness):
    draw = np.random.default_rng(0)
    frames = 1 + np.sort(draw.choice(900, 8, replace=False))
    events = [(n + draw.uniform(), draw.uniform(0.1, 2.0), 0.0) for n in frames]
    modes, thrown = some_modes(12), hammer(0.02, *hardness)
    expected, known, state = throw(modes, events, 1_500, thrown=thrown, floor=1e-3)
    for step in (1, 7, 64, 1_024):
        out, _, left = throw(modes, events, 1_500, range(step, 1_500, step), thrown, 1e-3)
        assert out.tobytes() == expected.tobytes()
        assert impact_row.tail(left, known) == impact_row.tail(state, known)
    cuts = np.unique(draw.integers(1, 1_500, 90))
    assert throw(modes, events, 1_500, cuts, thrown, 1e-3)[0].tobytes() == expected.tobytes()


@pytest.mark.parametrize(("hardness", "part"), [(SOFT, 0.25), (MEDIUM, 0.7), (HARD, 0.001), (HARD, 0.999)])
def test_contact_begins_at_the_events_time(hardness, part):
    times = (np.arange(200) + 1 - part) / RATE
    impulse, displacement, _ = solved_blow(0.02, 1.0, *hardness, 0.3, some_modes(10), times)
    thrown = hammer(0.02, *hardness, error=1e-7)
    force, _, found = throw(some_modes(10), [(6 + part, 1.0, 0.0)], 207, thrown=thrown)[0]
    assert not force[:6].any()
    assert not found[:7].any()
    assert against(np.cumsum(force[6:-1]) / RATE, impulse) < 1e-6
    assert against(found[7:], displacement) < 1e-6


@pytest.mark.parametrize(
    ("modes", "mass", "velocity", "stiffness", "exponent", "damping", "error"),
    [
        (([15_100.0], [45.0], [6.0], [0.4]), 0.025, 0.26, 5.6e5, 1.15, 1.0, 2e-4),
        (([8e3, 16e3, 18e3], [47.0, 10.0, 25.0], [5.0, 2.2, 2.2], [0.5, 0.4, 1.0]), 0.026, 1.2, 3e6, 1.2, 0.1, 1e-4),
        (([5.8e3, 10.4e3], [79.0, 53.0], [2.8, 3.6], [0.9, 0.5]), 0.007, 9.25, 8.5e9, 1.14, 9.9, 3e-4),
    ],
    ids=["one fast mode", "three fast modes", "stopped by damping"],
)
def test_the_node_meets_its_error_where_modes_are_fast_or_damping_stops_the_hammer(
    modes, mass, velocity, stiffness, exponent, damping, error
):
    blow = mass, stiffness, exponent, damping
    found = throw(modes, [(0.0, velocity, 0.0)], 320, thrown=hammer(*blow, error=error))[0][2]
    expected = solved_blow(mass, velocity, stiffness, exponent, damping, modes, np.arange(320) / RATE)[1]
    assert against(found, expected) <= error


def test_a_second_throw_leaves_the_object_ringing():
    modes, far = some_modes(10), 700
    first = throw(modes, [(0.0, 1.0, 0.0)], 2_000)[0]
    both = throw(modes, [(0.0, 1.0, 0.0), (far + 0.5, 1e-9, 0.0)], 2_000)[0]
    np.testing.assert_allclose(both[2, far:], first[2, far:], atol=1e-3 * np.abs(first[2]).max())
    # While it is in contact, a hammer is taken away and comes again: the impulse is that of both.
    again = throw(modes, [(0.0, 1.0, 0.0), (20.2, 1.0, 0.0)], 2_000)[0]
    np.testing.assert_array_equal(again[:, :20], first[:, :20])
    assert again[0, 20:22].max() < first[0, 19]
    assert again[0].sum() > 1.2 * first[0].sum()


def test_the_acceleration_alone_is_the_same():
    known, state = row(some_modes(10))
    out = Response(np.empty(1_000), np.empty(1_000), np.empty(0))
    impact_row.ring(event_list((3.3, 1.0)), hammer(), 0, known, state, out)
    expected = throw(some_modes(10), [(3.3, 1.0, 0.0)], 1_000)[0]
    np.testing.assert_array_equal(out[:2], expected[:2])


def test_the_tail_bounds_the_acceleration_and_then_all_is_zero():
    modes = [100.0, 900.0, 7_000.0], [80.0, 90.0, 100.0], [0.1, 0.2, 0.3], [1.0, 0.5, 0.2]
    out, known, state = throw(modes, [(3.3, 1.0, 0.0)], 500, floor=1e-6)
    bound = impact_row.tail(state, known)
    later = Response(*np.empty((3, 30_000)))
    impact_row.ring(event_list(), impact_row.HAMMER.zeros(), 500, known, state, later)
    assert np.abs(later.acceleration).max() <= bound < 20 * np.abs(out[1]).max()
    assert not later.force.any()
    assert not later.acceleration[-1_000:].any()
    assert impact_row.tail(state, known) == 0.0


def test_the_force_is_elastic_at_its_mean_over_a_step():
    """The quotient of energies and its series meet where one hands over to the other."""
    for exponent in (1.0, 1.5, 3.7):
        x = 1e-4
        for d in (1.001e-3 * x, 0.999e-3 * x, -0.999e-3 * x):
            start, end = contact_step.power(x, exponent), contact_step.power(x + d, exponent)
            exact = start * (1 + exponent * d / x / 2 + exponent * (exponent - 1) * (d / x) ** 2 / 6)
            mean = contact_step.mean_force(x, x + d, start, end, exponent)
            assert mean == pytest.approx(exact, rel=3e-9)


HAMMER = {"mass_kg": 0.02, "velocity_m_s": 1.0, "stiffness": 1e7, "exponent": 1.5, "damping_s_m": 0.3}
TARGET = {"frequencies_hz": [100.0, 200.0], "decays_per_s": [1.0, 2.0], "masses_kg": [1.0, 1.0], "shapes": [1.0, 0.5]}
GOOD = {**HAMMER, **TARGET, "seconds": 0.01, "rate": RATE, "error": 1e-4}


def struck(**changes):
    """A strike of `GOOD` values but for `changes`."""
    given = {**GOOD, **changes}
    by, target = Hammer(**{name: given.pop(name) for name in HAMMER}), {name: given.pop(name) for name in TARGET}
    return strike(by, ModalObject(**target), **given)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name, np.nan) for name in GOOD if isinstance(GOOD[name], float)),
        *((name, -1.0) for name in GOOD if isinstance(GOOD[name], float)),
        *((name, []) for name in GOOD),
        ("mass_kg", 0.0),
        ("mass_kg", "heavy"),
        ("stiffness", 0.0),
        ("exponent", 0.9),
        ("error", 0.0),
        ("error", 1e-13),
        ("error", 2.0),
        ("rate", np.inf),
        ("seconds", 1e5),
        ("frequencies_hz", [-1.0, 2.0]),
        ("decays_per_s", [1.0, 2.0, 3.0]),
        ("decays_per_s", [1.0, -2.0]),
        ("masses_kg", [0.0, 1.0]),
        ("shapes", [1.0, np.nan]),
        ("shapes", [[1.0, 2.0]]),
    ],
)
def test_bad_parameters_are_named(name, value):
    with pytest.raises(BadValue, match=f"^{name} is .*; allowed: ") as error:
        struck(**{name: value})
    assert "\n" not in str(error.value)


def test_nothing_happens_in_no_time_or_without_speed():
    assert struck(seconds=0.0).force_n.size == 0
    assert not struck(velocity_m_s=0.0).force_n.any()
