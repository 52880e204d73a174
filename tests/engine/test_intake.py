"""Force at audio rate, against straight lines drawn between the samples by hand."""

import numpy as np
import pytest
from given_forces import FLOOR, RATE, GivenForces, intake_signals, standing_forces

from underfoot.engine.intake import Intake
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

GATE, HOLD, SHIFT = 0.005, 0.020, 0.2


RATES = pytest.mark.parametrize("rate_hz", [1000.0, 240.0, 160.0])


@RATES
def test_force_is_linear_between_samples_and_late_by_exactly_one_period(rate_hz):
    stamps, forces = standing_forces(rate_hz)
    force, x, y = intake_signals(GivenForces(rate_hz, stamps, forces), 90_000)[:3, 0]
    period = RATE / rate_hz
    frames = np.arange(90_000)
    onset, off = stamps[forces[:, 0].any(axis=1)][[0, -1]]
    inside = slice(int(np.ceil(onset + GATE * RATE)) + 1, int(off + period))
    line = np.interp(frames - period, stamps, forces[:, 0].sum(axis=1))
    np.testing.assert_allclose(force[inside], line[inside], rtol=1e-12, atol=1e-9)
    sensors = np.array(FLOOR.tiles[0].sensors_m)
    loaded = forces[:, 0].any(axis=1)
    for place, axis in ((x, 0), (y, 1)):
        centroid = forces[loaded, 0] @ sensors[:, axis] / forces[loaded, 0].sum(axis=1)
        line = np.interp(frames - period, stamps[loaded], centroid)
        settled = slice(int(onset) + 1, int(off + period))
        np.testing.assert_allclose(place[settled], line[settled], atol=1e-12)


@RATES
def test_off_contact_all_is_exactly_zero_and_the_gate_takes_5_ms(rate_hz):
    stamps, forces = standing_forces(rate_hz)
    signals = intake_signals(GivenForces(rate_hz, stamps, forces), 90_000)
    assert not signals[:, 1].any()
    force = signals[0, 0]
    loaded = np.flatnonzero(forces[:, 0].any(axis=1))
    period = RATE / rate_hz
    opens, closes = stamps[loaded[0]], stamps[loaded[-1] + 1]
    first, last = np.flatnonzero(force)[[0, -1]]
    assert first == opens + 1  # at its beginning the line is still at zero
    assert closes <= last <= closes + max(period, GATE * RATE)
    assert not signals[:, 0, : first - 1].any()
    assert not signals[:, 0, int(closes + max(period, GATE * RATE)) + 2 :].any()
    line = np.interp(np.arange(90_000) - period, stamps, forces[:, 0].sum(axis=1))
    gate = force[first : first + 300] / line[first : first + 300]
    np.testing.assert_allclose(gate, np.minimum(np.arange(2, 302) / (GATE * RATE), 1.0), atol=1e-9)


@RATES
def test_a_step_begins_at_the_load_that_was_too_small_for_a_foot(rate_hz):
    stamps, forces = standing_forces(rate_hz)
    forces[(stamps >= 0.27 * RATE) & (stamps < 0.3 * RATE), 0] = 3.0
    force = intake_signals(GivenForces(rate_hz, stamps, forces), 30_000)[0, 0]
    first = np.flatnonzero(force)[0]
    line = np.interp(np.arange(first, first + 300) - RATE / rate_hz, stamps, forces[:, 0].sum(axis=1))
    gate = np.minimum(np.arange(1, 301) / (GATE * RATE), 1.0)
    np.testing.assert_allclose(force[first : first + 300], line * gate, atol=1e-9)


@RATES
def test_at_the_first_sample_and_after_a_gap_no_force_changes_faster_than_a_foot_changes_it(rate_hz):
    """One stands from the beginning on; the other lands in a gap of 0.3 s, and leaves in one of 50 ms."""
    stamps = np.arange(round(1.7 * rate_hz)) * RATE / rate_hz
    forces = np.full((len(stamps), 2, 4), 150.0)
    forces[:, 1] = [300.0, 100.0, 100.0, 100.0]
    forces[:, 1] *= np.clip((stamps[:, None] / RATE - 0.77) / 0.06, 0.0, 1.0) * (stamps[:, None] < 1.225 * RATE)
    gone = ((stamps > 0.5 * RATE) & (stamps < 0.8 * RATE)) | ((stamps > 1.2 * RATE) & (stamps < 1.25 * RATE))
    source = [GivenForces(rate_hz, stamps[~gone], forces[~gone]) for _ in range(2)]
    signals, other = (
        intake_signals(one, 81_000, blocks=blocks) for one, blocks in zip(source, [(512,), (7, 33)], strict=True)
    )
    assert signals.tobytes() == other.tobytes()
    (stood, landed), x, cut = signals[0], signals[1, 1], signals[3]
    assert np.abs(np.diff(stood)).max() == pytest.approx(600.0 / (SHIFT * RATE))
    rises = np.flatnonzero(np.diff(stood) > 0.0) + 1
    assert cut[0, rises].all()
    assert np.count_nonzero(np.diff(rises) > 1) == 2
    assert cut[0].sum() <= 3 * (RATE / rate_hz + SHIFT * RATE + 2)
    assert np.diff(landed).max() == pytest.approx(10_000.0 / RATE)
    assert np.diff(landed).min() == pytest.approx(-10_000.0 / RATE)
    changes = np.flatnonzero((landed > 0.0) & (landed < 600.0))
    assert np.count_nonzero(changes < 1.0 * RATE) == pytest.approx(0.06 * RATE, abs=0.01 * RATE)
    assert np.count_nonzero(changes > 1.25 * RATE) == pytest.approx(0.06 * RATE, abs=0.01 * RATE)
    np.testing.assert_allclose(x[landed > 0.0], x[int(RATE)], atol=1e-12)
    assert abs(x[int(RATE)]) > 0.01
    assert not landed[int(1.33 * RATE) :].any()
    assert not cut[1, changes].any()


@RATES
@pytest.mark.parametrize(("gap_s", "before_n"), [(0.028, 25.0), (0.045, 100.0), (0.1, 200.0)])
def test_who_was_landing_as_a_gap_began_lands_after_it(rate_hz, gap_s, before_n):
    stamps = np.arange(rate_hz) * RATE / rate_hz
    lands_s = 0.5 - before_n / 10_000.0
    forces = np.full((len(stamps), 2, 4), 150.0) * np.clip((stamps[:, None, None] / RATE - lands_s) / 0.06, 0.0, 1.0)
    there = (stamps <= 0.5 * RATE) | (stamps >= (0.5 + gap_s) * RATE)
    force, _, _, cut = intake_signals(GivenForces(rate_hz, stamps[there], forces[there]), 40_000)[:, 0]
    assert np.diff(force[int((0.5 + gap_s) * RATE) :]).max() == pytest.approx(10_000.0 / RATE)
    assert force[int((0.5 + gap_s + 0.06) * RATE + RATE / rate_hz)] == 600.0
    assert not cut.any()


@RATES
def test_who_only_touched_a_tile_before_a_gap_and_shifts_weight_to_it_is_felt_to_do_so(rate_hz):
    stamps = np.arange(rate_hz) * RATE / rate_hz
    load_n = np.interp(stamps / RATE, [0.3, 0.31, 0.5, 0.55, 0.57, 0.6], [0.0, 30.0, 30.0, 165.0, 165.0, 600.0])
    forces = np.repeat(load_n / 4.0, 8).reshape(len(stamps), 2, 4)
    there = (stamps <= 0.5 * RATE) | (stamps >= 0.55 * RATE)
    force, _, _, cut = intake_signals(GivenForces(rate_hz, stamps[there], forces[there]), 40_000)[:, 0]
    assert np.diff(force[int(0.55 * RATE) :]).max() == pytest.approx(600.0 / (SHIFT * RATE))
    assert force[int(0.77 * RATE)] == 600.0
    assert cut[int(0.6 * RATE)]


@RATES
@pytest.mark.parametrize("gap_s", [0.0, 0.4])
def test_who_stood_there_lands_as_others_do_once_they_have_left(rate_hz, gap_s):
    """They leave at 0.1 s, or in a gap that begins there, and are not quite gone."""
    stamps = np.arange(round(0.7 * rate_hz)) * RATE / rate_hz
    forces = np.full((len(stamps), 2, 4), 150.0)
    forces[(stamps > 0.1 * RATE) & (stamps < (gap_s + 0.15) * RATE), 0] = 0.75
    there = (stamps < 0.1 * RATE) | (stamps > (gap_s + 0.1) * RATE)
    signals, other = (
        intake_signals(GivenForces(rate_hz, stamps[there], forces[there]), 33_000, blocks=blocks)[:, 0]
        for blocks in [(512,), (7, 33)]
    )
    assert signals.tobytes() == other.tobytes()
    force, _, _, cut = signals
    lands = np.flatnonzero((force[1:] > 0.0) & (force[:-1] == 0.0))[-1]
    assert cut[: int(0.1 * RATE)].any()
    assert not cut[lands:].any()
    assert force[lands + int(max(GATE * RATE, RATE / rate_hz)) + 2] == 600.0


def test_who_stood_there_gives_no_footfall_through_a_filter_either():
    """Of 5 Hz: the force passes the threshold behind it long after the first sample does, and only once they land."""
    stamps = np.arange(1_800) * RATE / 1000.0
    there = (stamps < 0.5 * RATE) | (stamps > 0.9 * RATE)
    forces = np.full((len(stamps), 2, 4), 150.0)
    forces[1_200:1_500] = 0.0
    patch = Patch().add("tile-force", REGISTRY).add("low-pass", REGISTRY, cutoff=5.0).add("footfall", REGISTRY)
    patch = patch.connect("tile-force.force", "low-pass.signal", REGISTRY)
    patch = patch.connect("low-pass.out", "footfall.force", REGISTRY)
    scope = "footfall.onset"
    loop = Loop(patch, REGISTRY, GivenForces(1000.0, stamps[there], forces[there]), LoopOptions(scopes=(scope,)))
    heard_s = []
    for _ in range(80):
        loop.run(1_024)
        heard_s += [event[0] / RATE for event in loop.program.events(scope)]
    assert len(heard_s) == 1
    assert 1.5 < heard_s[0] < 1.6


@RATES
def test_stamps_of_a_later_start_are_those_of_contacts(rate_hz):
    stamps = np.arange(round(0.3 * rate_hz)) * RATE / rate_hz
    later = Intake(GivenForces(rate_hz, stamps + RATE, np.full((len(stamps), 2, 4), 150.0)), RATE, 480)
    later.take(round(1.2 * RATE))
    assert {contact.start_s for contact in later.tracker.ongoing()} == {1.0}


@RATES
def test_noise_of_an_empty_tile_is_not_let_through(rate_hz):
    stamps, forces = standing_forces(rate_hz)
    forces[:, 1] = 3.0 + np.random.default_rng(2).normal(0.0, 0.4, (len(stamps), 4))
    assert not intake_signals(GivenForces(rate_hz, stamps, forces), 90_000)[:, 1].any()


@RATES
def test_a_gap_is_held_and_then_ramped_to_nothing(rate_hz):
    stamps, forces = standing_forces(rate_hz)
    before = np.searchsorted(stamps, 0.8 * RATE)
    after = np.searchsorted(stamps, 1.04 * RATE)
    kept = np.r_[:before, after : len(stamps)]
    force = intake_signals(GivenForces(rate_hz, stamps[kept], forces[kept]), 90_000)[0, 0]
    period = RATE / rate_hz
    reached = int(np.ceil(stamps[before - 1] + period))
    height = forces[before - 1, 0].sum()
    hold = HOLD * RATE
    frames = np.arange(reached, int(stamps[after]))
    line = height * np.interp(frames - period - stamps[before - 1], [0.0, hold, hold + SHIFT * RATE], [1.0, 1.0, 0.0])
    np.testing.assert_allclose(force[frames], line, atol=1e-9)
    assert not force[reached + int(hold + SHIFT * RATE) + 1 : int(stamps[after])].any()
    frames = np.arange(int(stamps[after] + period), int(1.3 * RATE))
    full = np.interp(frames - period, stamps, forces[:, 0].sum(axis=1))
    returns = max(forces[after, 0].sum(), 600.0) * (frames - stamps[after] + 1.0) / (SHIFT * RATE)
    np.testing.assert_allclose(force[frames], np.minimum(full, returns), rtol=1e-9, atol=1e-9)


@RATES
@pytest.mark.parametrize("over", [0.5, 480.0])
def test_nothing_jumps_at_the_edges_of_a_gap(rate_hz, over):
    """Not even where it is longer than a force is held by less than a frame, in which it would begin to fade."""
    stamps, forces = standing_forces(rate_hz)
    gone = (stamps > 0.8 * RATE) & (stamps < (0.8 + 0.030) * RATE)
    last, after = stamps[stamps <= 0.8 * RATE][-1], np.searchsorted(stamps, 0.83 * RATE)
    stamps[after:] += last + RATE / rate_hz + HOLD * RATE + over - stamps[after]
    force = intake_signals(GivenForces(rate_hz, stamps[~gone], forces[~gone]), 90_000)[0, 0]
    meanwhile = (stamps > 0.79 * RATE) & (stamps < 0.84 * RATE)
    swayed = np.ptp(forces[meanwhile, 0].sum(axis=1))  # which comes within a period
    steepest = swayed / (RATE / rate_hz) + 750.0 / (SHIFT * RATE)
    assert np.abs(np.diff(force[int(0.5 * RATE) : int(1.2 * RATE)])).max() <= 1.05 * steepest


def test_a_sample_that_is_late_changes_nothing_before_it_came():
    stamps, forces = standing_forces(1000.0)
    arrivals = stamps.copy()
    arrivals[900:904] += 30.0
    changed = forces.copy()
    changed[902, 0] *= 1.5
    one = intake_signals(GivenForces(1000.0, stamps, forces, arrivals), 60_000)[0, 0]
    other = intake_signals(GivenForces(1000.0, stamps, changed, arrivals), 60_000)[0, 0]
    assert np.flatnonzero(one != other)[0] in range(int(arrivals[902]), int(arrivals[902]) + 2)


def test_after_a_hold_up_the_force_is_on_time_again():
    """Fifty samples come at once when the force has begun to fade: the newest counts, the next are late by one period.

    It has faded for 30 ms, and returns in as many.
    """
    stamps, forces = standing_forces(1000.0)
    arrivals = stamps.copy()
    arrivals[800:850] = stamps[850] - 1.0
    force = intake_signals(GivenForces(1000.0, stamps, forces, arrivals), 60_000)[0, 0]
    line = np.interp(np.arange(60_000) - 48.0, stamps, forces[:, 0].sum(axis=1))
    on_time = slice(int(stamps[850] + 0.15 * SHIFT * RATE) + 1, 60_000)
    np.testing.assert_allclose(force[on_time], line[on_time], rtol=1e-12, atol=1e-9)
    late = slice(int(stamps[799]), int(stamps[860]))
    assert np.abs(np.diff(force[late])).max() <= np.ptp(line[late]) / 48.0 + 750.0 / (SHIFT * RATE)


def test_samples_that_are_always_late_by_the_same_are_still_straight_lines():
    stamps, forces = standing_forces(1000.0)
    force = intake_signals(GivenForces(1000.0, stamps, forces, stamps + 130.0), 60_000)[0, 0]
    line = np.interp(np.arange(60_000) - 48.0 - 82.0 - 48.0, stamps, forces[:, 0].sum(axis=1))
    inside = slice(int(0.4 * RATE), int(1.2 * RATE))
    np.testing.assert_allclose(force[inside], line[inside], rtol=1e-9)


@pytest.mark.parametrize("rate", [48_000.0, 44_100.0])
@pytest.mark.parametrize("rate_hz", [1000.0, 240.0, 160.0, 970.3])
def test_any_block_size_gives_the_same_bytes(rate, rate_hz):
    random = np.random.default_rng(5)
    stamps, forces = standing_forces(rate_hz, rate)
    kept = random.random(len(stamps)) > 0.02
    kept[: round(0.35 * rate_hz)] = True
    stamps, forces = stamps[kept], forces[kept]
    late = np.where(random.random(len(stamps)) < 0.05, random.exponential(0.02 * rate, len(stamps)), 0.0)
    arrivals = np.maximum.accumulate(stamps + late)
    whole = intake_signals(GivenForces(rate_hz, stamps, forces, arrivals), 60_000, rate, [1024])
    assert whole.any()
    for blocks in ([64], [7], [1, 250, 33]):
        again = intake_signals(GivenForces(rate_hz, stamps, forces, arrivals), 60_000, rate, blocks)
        assert again.tobytes() == whole.tobytes(), blocks


@pytest.mark.parametrize("rate_hz", [8_000.0, 20_000.0])
def test_no_sample_is_lost_where_a_block_holds_thousands(rate_hz):
    stamps, forces = standing_forces(rate_hz, 8_000.0)
    short, long = (intake_signals(GivenForces(rate_hz, stamps, forces), 16_000, 8_000.0, [n]) for n in (64, 1024))
    assert short[0].max() > 600.0
    assert long.tobytes() == short.tobytes()


def test_a_tare_takes_what_the_tile_reads_now_as_its_zero():
    stamps, forces = standing_forces(1000.0)
    forces[:, 0] += np.where(stamps > 0.1 * RATE, 4.0, 0.0)[:, None]
    intake = Intake(GivenForces(1000.0, stamps, forces), RATE, 480)
    intake.take(round(0.25 * RATE))
    intake.tare()
    np.testing.assert_allclose(intake.tracker.baseline_n, [[4.0] * 4, [0.0] * 4])


def test_every_sample_is_told_of_once():
    stamps, forces = standing_forces(1000.0)
    intake = Intake(GivenForces(1000.0, stamps, forces), RATE, 480)
    heard = []
    intake.on_samples = lambda count: heard.extend(intake.source.stamps[:count])
    for end in (1, 500, 40_000, 90_000):
        intake.take(end)
    assert heard == stamps[stamps < 90_000].tolist()


def test_without_centroid_the_force_is_the_same_and_the_centroid_continues_where_it_is_wanted_again():
    stamps, forces = standing_forces(1000.0)
    wanted = intake_signals(GivenForces(1000.0, stamps, forces), 90_000)
    intake = Intake(GivenForces(1000.0, stamps, forces), RATE, 480)
    for at in range(0, 90_000, 480):
        n, with_centroid = min(480, 90_000 - at), at // 4800 % 2 == 1
        intake.take(at + n)
        intake.fill(at, n, with_centroid)
        np.testing.assert_array_equal(intake.signals[0, :, :n], wanted[0, :, at : at + n])
        assert intake.zero_rows.tolist() == (~wanted[0, :, at : at + n].any(axis=1)).tolist()
        if with_centroid:
            np.testing.assert_array_equal(intake.signals[:, :, :n], wanted[:, :, at : at + n])
