"""A tile of which no sample comes while others go on (NaN): its force fades, and what is known of it stays."""

import numpy as np
import pytest
from given_forces import GivenForces, intake_signals, standing_forces
from made_walks import Foot, corner_forces, touching_floor

from underfoot.floor.contacts import ContactTracker
from underfoot.floor.layout import default_floor
from underfoot.floor.loss_concealment import LossConcealment
from underfoot.floor.step_finder import StepFinder

RATE = 48_000.0
FLOOR = default_floor(1, 2)
PERIOD = 48.0


def test_a_tile_that_is_silent_fades_as_a_gap_does_and_the_other_does_not():
    stamps, forces = standing_forces(1000.0)
    forces[:, 1] = forces[:, 0]
    silent = forces.copy()
    first, last = np.searchsorted(stamps, (0.8 * RATE, 1.0 * RATE))
    silent[first:last, 0] = np.nan
    gone = intake_signals(GivenForces(1000.0, stamps, silent), 90_000)[0]
    np.testing.assert_array_equal(gone[1], intake_signals(GivenForces(1000.0, stamps, forces), 90_000)[0, 1])
    frames = np.arange(int(stamps[first - 1] + PERIOD) + 1, int(stamps[last]))
    height = forces[first - 1, 0].sum()
    held = np.interp(frames - PERIOD - stamps[first - 1], [0.02 * RATE, 0.22 * RATE], [1.0, 0.0])
    np.testing.assert_allclose(gone[0, frames], height * held, atol=1e-9)
    back = slice(int(stamps[last] + 0.2 * RATE) + 1, int(1.3 * RATE))
    np.testing.assert_allclose(gone[0, back], gone[1, back], rtol=1e-12)


def test_a_single_sample_that_is_missing_is_as_if_its_row_were():
    stamps, forces = standing_forces(1000.0)
    forces[:, 1] = 0.0
    holes = np.arange(310, 1290, 7)
    broken = forces.copy()
    broken[holes, 0] = np.nan
    kept = np.delete(np.arange(len(stamps)), holes)
    with_holes = intake_signals(GivenForces(1000.0, stamps, broken), 90_000)[:, 0]
    without = intake_signals(GivenForces(1000.0, stamps[kept], forces[kept]), 90_000)[:, 0]
    np.testing.assert_allclose(with_holes, without, atol=1e-9)


def followed(time_s, force_n, chunk=100, rate_hz=1000.0):
    tracker = ContactTracker(FLOOR, rate_hz)
    concealment = LossConcealment(tracker, chunk)
    contacts = []
    for a in range(0, len(time_s), chunk):
        part = force_n[a : a + chunk].copy()
        concealment.fill(time_s[a : a + chunk], part, len(part))
        contacts += tracker.feed(time_s[a : a + chunk], part).finished
    return tracker, [*contacts, *tracker.finish().finished]


def pressed(seconds=3.0, rest_n=-50.0):
    """Rest with noise, and a load on the first tile from 1 to 2 s."""
    time_s = np.arange(round(seconds * 1000)) / 1000.0
    force_n = rest_n + np.random.default_rng(1).normal(0.0, 0.3, (len(time_s), 2, 4))
    force_n[(time_s >= 1.0) & (time_s < 2.0), 0] += 100.0
    return time_s, force_n


def test_with_one_sample_in_twenty_missing_tare_and_contacts_are_found():
    time_s, force_n = pressed()
    lost = np.random.default_rng(2).random((len(time_s), 2)) < 0.05
    lost[:60] = lost[990:1010] = lost[1990:2010] = False
    broken = np.where(lost[:, :, None], np.nan, force_n)
    tracker, (contact,) = followed(time_s, broken)
    assert (contact.start_s, contact.end_s) == (1.0, 1.999)
    np.testing.assert_allclose(tracker.baseline_n, -50.0, atol=0.3)


def test_a_contact_on_a_tile_that_falls_silent_ends_and_is_cut_as_is_the_one_after_it():
    """They were whole, and gave two short steps of one."""
    time_s, force_n = pressed()
    force_n[1500:1700, 0] = np.nan
    _, (contact, after) = followed(time_s, force_n)
    assert contact.end_s == pytest.approx(1.540, abs=0.002)
    assert after.start_s == time_s[1700]
    assert contact.cut
    assert after.cut
    finder = StepFinder(FLOOR, 1000.0)
    assert not finder.feed(time_s, force_n).steps + finder.finish().steps
    assert finder.warnings() == ["2 contacts cut by gaps in the samples; they give no step"]


def test_a_foot_that_comes_down_on_a_silent_tile_and_beside_it_is_cut():
    """Only the load on the other tile was seen to begin: it gave a step, later and lighter than the foot."""
    floor, time_s = touching_floor(1, 2), np.arange(2500) / 1000.0
    force_n = corner_forces(floor, [Foot(1.0, (0.22, 0.15), (0.38, 0.15))], time_s)
    force_n[950:1100, 0] = np.nan
    finder = StepFinder(floor, 1000.0)
    assert not finder.feed(time_s, force_n).steps + finder.finish().steps
    assert finder.warnings() == ["1 contact cut by gaps in the samples; they give no step"]


def test_samples_of_which_one_sensor_is_missing_are_as_the_sample_before():
    time_s, force_n = pressed()
    whole = force_n.copy()
    lost = np.array([1200, 1201, 1700])
    whole[lost, 0] = whole[[1199, 1199, 1699], 0]
    force_n[lost, 0, 2] = np.nan
    (contact,), (same,) = (followed(time_s, forces)[1] for forces in (force_n, whole))
    assert (contact.start_s, contact.end_s, contact.cut) == (1.0, 1.999, False)
    np.testing.assert_array_equal(contact.force_n, same.force_n)


def test_at_a_low_rate_a_single_sample_that_is_missing_lifts_no_foot():
    """At 20 Hz one is missed for longer than 40 ms: each lifted the foot, which began a contact anew."""
    time_s, force_n = (samples[::50] for samples in pressed())
    force_n[30:38:2, 0] = np.nan
    _, (contact,) = followed(time_s, force_n, chunk=10, rate_hz=20.0)
    assert contact.force_n.min() > 390.0


def test_a_tile_that_falls_silent_between_two_pieces_is_lifted_by_those_who_look_for_steps():
    """Its last sample was in a piece without losses, which was not looked at, and the foot stood for ever."""
    time_s, force_n = pressed()
    force_n[1500:, 0] = np.nan
    finder = StepFinder(FLOOR, 1000.0)
    finder.feed(time_s[:1500], force_n[:1500])
    assert len(finder.ongoing()) == 1
    finder.feed(time_s[1500:1600], force_n[1500:1600])
    assert finder.ongoing() == ()


def test_a_tile_that_falls_silent_in_the_first_piece_has_the_baseline_of_its_samples():
    """As of a recording: it was 0 N, where the sensors' rest is not, and a foot of the difference stood there."""
    time_s, force_n = pressed()
    force_n[1500:2500, 0] = np.nan
    finder = StepFinder(FLOOR, 1000.0)
    (contact,) = [*finder.feed(time_s, force_n).finished, *finder.finish().finished]
    assert contact.end_s == pytest.approx(1.540, abs=0.002)


@pytest.mark.parametrize("rest_n", [-50.0, 10.0])
def test_a_tile_that_is_first_heard_later_is_tared_with_what_it_reads(rest_n):
    time_s, force_n = pressed(rest_n=rest_n)
    force_n[:400, 0] = np.nan
    tracker, (contact,) = followed(time_s, force_n)
    assert (contact.start_s, contact.end_s) == (1.0, 1.999)
    assert not tracker.untared.any()


def test_a_tile_that_is_first_heard_under_a_load_is_untared():
    time_s, force_n = pressed(rest_n=0.0)
    force_n[:1500, 0] = np.nan
    tracker = ContactTracker(FLOOR, 1000.0)
    concealment = LossConcealment(tracker, len(time_s))
    concealment.fill(time_s[:100], force_n[:100], 100)
    tracker.feed(time_s[:100], force_n[:100])
    concealment.fill(time_s[100:1600], force_n[100:1600], 1500)
    tracker.feed(time_s[100:1600], force_n[100:1600])
    assert tracker.untared.tolist() == [True, False]
