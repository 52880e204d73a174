"""Force sensing resistors, compared with their data sheet's figures and a plain transcription of the static model."""

import math

import numpy as np
import pytest
from msgspec.structs import replace

from underfoot.arguments import ranges_of
from underfoot.errors import BadValue
from underfoot.models.tile import fsr
from underfoot.models.tile.fsr import FULL_COUNTS, RATED_N, Fsr
from underfoot.models.tile.fsr_curves import exponential, power, rational, rising, spline, straight
from underfoot.models.tile.fsr_hysteresis import STATE, HysteresisModel, compensate

RATE = 1000.0
QUIET = Fsr(spread=0.0, hysteresis=0.0, creep=0.0, noise_counts=0.0)


def read(part, corner_n, rate=RATE, cuts=(), key=1, settled_n=0.0):
    states, coefficients, keys = np.zeros(1, fsr.STATE), fsr.coefficients([part], rate), np.array([key], np.uint64)
    fsr.settle(states, coefficients, settled_n)
    corner_n = np.asarray(corner_n, dtype=float)[:, None]
    counts = np.empty_like(corner_n)
    for a, b in zip((0, *cuts), (*cuts, len(corner_n)), strict=True):
        fsr.sense(states, coefficients, keys, corner_n[a:b], counts[a:b], a, b - a)
    return counts[:, 0]


def force_of(part, counts):
    """The static model of `fsr.py`'s first lines, solved for force by bisection: newtons on the corner."""
    low, high = np.zeros_like(counts), np.full_like(counts, 1e4)
    for _ in range(100):
        middle = 0.5 * (low + high)
        on_part = part.share * middle
        effective = on_part * (on_part / 10.0) ** (part.exponent - 1.0) * on_part / (on_part + part.soft_start_n)
        resistance = part.resistance_ohm_n / np.maximum(effective, 1e-300) + part.series_ohm
        over = FULL_COUNTS * part.divider_ohm / (part.divider_ohm + resistance) > counts
        low, high = np.where(over, low, middle), np.where(over, middle, high)
    return low


def test_the_reading_is_that_of_the_static_model_rounded():
    forces = np.linspace(0.0, 1200.0, 50)
    counts = read(QUIET, forces)
    assert (counts == np.rint(counts)).all()
    assert np.abs(counts - QUIET.counts(forces)).max() <= 0.5
    np.testing.assert_allclose(force_of(QUIET, QUIET.counts(forces[1:])), forces[1:], rtol=1e-9)


def test_conductance_is_about_proportional_to_force_after_a_soft_start():
    forces = np.array([1.0, 2.0, 5.0, 10.0, 20.0])
    slope = np.diff(np.log(1.0 / QUIET.resistance_ohm(forces))) / np.diff(np.log(forces))
    assert (slope > 0.7).all()
    assert (slope < 1.2).all()
    soft = np.array([0.01, 0.02])
    assert np.diff(np.log(1.0 / QUIET.resistance_ohm(soft)))[0] > 1.8 * math.log(2.0)


def test_a_thousand_newtons_on_a_corner_stay_within_the_parts_rating_and_the_converters_range():
    assert 1147.0 * Fsr().share < RATED_N
    parts = [Fsr().part(seed, "t1", 0) for seed in range(200)]
    readings = np.array([part.counts([1.0, 1147.0]) for part in parts])
    assert readings[:, 1].max() < FULL_COUNTS
    assert (np.diff(readings, axis=1) > 20_000.0).all()


def test_parts_are_spread_to_25_percent_and_all_differ():
    parts = [Fsr().part(1, "t1", sensor) for sensor in range(2000)]
    for name in ("resistance_ohm_n", "series_ohm", "soft_start_n", "hysteresis", "creep"):
        share = np.array([getattr(part, name) for part in parts]) / getattr(Fsr(), name)
        assert share.min() == pytest.approx(0.75, abs=0.01)
        assert share.max() == pytest.approx(1.25, abs=0.01)
        assert share.mean() == pytest.approx(1.0, abs=0.02)
    assert len({part.resistance_ohm_n for part in parts}) == 2000


def test_parts_of_any_allowed_type_can_be_made():
    for low_or_high in (0, 1):
        kind = Fsr(**{name: ends[low_or_high] for name, ends in ranges_of(Fsr).items()} | {"spread": 0.9})
        for sensor in range(20):
            part = kind.part(1, "t1", sensor)
            assert all(low <= getattr(part, name) <= high for name, (low, high) in ranges_of(Fsr).items())


def test_falling_forces_read_a_tenth_more():
    """The data sheet's hysteresis: the same force, rising and falling, seems 10 % apart; small turns less."""
    part = replace(QUIET, hysteresis=0.10)
    rise = np.linspace(0.0, 900.0, 2000)
    counts = read(part, np.concatenate([rise, rise[::-1]]))
    felt = force_of(part, counts)
    up, down = felt[:2000], felt[2000:][::-1]
    within = (rise > 50.0) & (rise < 700.0)
    np.testing.assert_allclose(down[within] / up[within], 1.10, rtol=0.003)
    np.testing.assert_allclose(up[within], rise[within], rtol=0.003)
    # It goes round the loop slowly: just below the turn, nothing has changed yet.
    assert down[1990] == pytest.approx(up[-1], rel=0.01)


def test_hysteresis_does_not_depend_on_speed():
    part = replace(QUIET, hysteresis=0.10)
    forces = 400.0 + 300.0 * np.sin(np.linspace(0.0, 20.0, 501))
    slow = read(part, np.repeat(forces, 20))
    np.testing.assert_array_equal(slow[19::20], read(part, forces))


def test_a_held_force_creeps_by_5_percent_a_decade_and_reads_right_after_a_second():
    part = replace(QUIET, creep=0.05)
    rate = 50.0
    felt = force_of(part, read(part, np.full(round(1000.0 * rate) + 1, 400.0), rate))
    at = [round(seconds * rate) for seconds in (1.0, 10.0, 100.0, 1000.0)]
    np.testing.assert_allclose(np.diff(felt[at]) / 400.0, 0.05, rtol=0.08)
    assert felt[at[0]] == pytest.approx(400.0, rel=0.003)


def test_creep_goes_back_as_slowly_as_it_came():
    part = replace(QUIET, creep=0.05)
    rate = 50.0
    counts = read(part, np.concatenate([np.full(5000, 800.0), np.full(5000, 200.0)]), rate)
    felt = force_of(part, counts)[5000:]
    assert felt[50] > 210.0
    assert (np.diff(felt) <= 1e-9).all()
    assert 200.0 < felt[-1] < 0.5 * (200.0 + felt[50])


@pytest.mark.parametrize("creep", [0.05, ranges_of(Fsr)["creep"][1]])
def test_a_sudden_press_is_read_at_once_and_its_creep_compensated(creep):
    part = replace(QUIET, creep=creep)
    forces = np.append(0.0, np.full(2000, 500.0))
    counts = read(part, forces)
    assert counts[1] > 0.0
    model = HysteresisModel(creep, relative=False, widths=np.empty(0), weights=np.ones(1))
    found = compensate(part.corner_n(counts), np.arange(forces.size) / RATE, model, np.zeros(1, STATE)[0])
    np.testing.assert_allclose(found, forces, rtol=2e-3)


def test_a_sensor_that_rested_under_a_load_reads_it_steadily():
    counts = read(replace(QUIET, creep=0.05, hysteresis=0.1), np.full(5000, 30.0), settled_n=30.0)
    assert counts.min() == counts.max()


def test_noise_is_white_and_as_large_as_asked():
    part = replace(QUIET, noise_counts=5.0)
    counts = read(part, np.full(50_000, 300.0))
    noise = counts - counts.mean()
    assert noise.std() == pytest.approx(math.hypot(5.0, math.sqrt(1.0 / 12.0)), rel=0.02)
    assert abs(np.mean(noise[1:] * noise[:-1])) < 0.02 * noise.var()


@pytest.mark.parametrize("cuts", [(1, 2, 3), (7, 64, 71, 900), tuple(range(13, 1000, 13))])
def test_cuts_do_not_change_a_bit(cuts):
    forces = 300.0 + 250.0 * np.sin(np.arange(1000) / 40.0)
    whole, parts = read(Fsr(), forces), read(Fsr(), forces, cuts=cuts)
    assert whole.tobytes() == parts.tobytes()
    assert whole.tobytes() != read(Fsr(), forces, key=2).tobytes()


def test_pulls_read_nothing_and_no_force_breaks_it():
    counts = read(QUIET, [-50.0, 0.0, 1e9, 1e300, -1e300])
    np.testing.assert_array_equal(counts[[0, 1, 4]], 0.0)
    assert counts.max() <= FULL_COUNTS
    assert np.isfinite(counts).all()


def test_the_inverse_gives_back_what_was_pressed():
    forces = np.geomspace(0.3, 2000.0, 60)
    np.testing.assert_allclose(Fsr().corner_n(Fsr().counts(forces)), forces, rtol=1e-4)
    grid = forces[: forces.size // 2 * 2].reshape(-1, 2).T  # not in the order of its memory
    np.testing.assert_array_equal(Fsr().counts(grid), Fsr().counts(grid.copy()))


def test_the_best_scale_is_found_at_the_end_of_those_that_are_allowed():
    """Of readings that tell nothing of the force but at the last: a second scale is nearly as good."""
    x, f = np.linspace(0.0, 1000.0, 21), np.r_[0.0, np.full(19, 100.0), 555.0]
    shapes = np.expm1(np.geomspace(0.05, 14.0, 1000)[:, None] * x / 1000.0)
    factors = shapes @ f / (shapes**2).sum(1)
    best = ((factors[:, None] * shapes - f) ** 2).sum(1).argmin()
    found = exponential(x, f, np.ones(21)).parameters
    assert (best, found["scale"], found["factor"]) == (999, pytest.approx(1000.0 / 14.0), pytest.approx(factors[best]))


def test_arrays_of_unequal_lengths_are_refused_in_a_line():
    nothing, three = HysteresisModel(0.0, False, np.empty(0), np.ones(1)), np.arange(3.0)
    with pytest.raises(BadValue, match=r"the shape of time_s is \(2,\); allowed: \(3,\), as apparent_n"):
        compensate(three, three[:2], nothing, np.zeros(1, STATE)[0])
    for fit in (straight, power, rational, exponential):
        with pytest.raises(BadValue, match=r"the shape of w is \(2,\); allowed: \(3,\), as x"):
            fit(three, three, three[:2])
    with pytest.raises(BadValue, match=r"the shape of f is \(2,\); allowed: \(3,\), as x"):
        spline(three, three[:2], three, 2)
    with pytest.raises(BadValue, match=r"the shape of weights is \(2,\)"):
        rising(three, three[:2])
