"""Contacts and centroids: of measured walks beside a reference, and thresholds at their limits."""

import numpy as np
import pytest
from made_walks import Foot, corner_forces, read, touching_floor, walk
from measured import WALKS, needs_data, reference_centroids, reference_steps
from measured import walk as measured_walk

from underfoot.errors import BadValue
from underfoot.floor.contacts import ContactTracker
from underfoot.floor.layout import Floor, Tile
from underfoot.floor.step_finder import StepFinder

CORNERS = ((0.13, 0.13), (-0.13, 0.13), (-0.13, -0.13), (0.13, -0.13))
ONE_TILE = touching_floor(1, 1)


def follow(floor, time_s, force_n, rate_hz, chunk=1000):
    """All rows (as one table) and all contacts of a stream, fed in chunks."""
    tracker = ContactTracker(floor, rate_hz)
    parts = [tracker.feed(time_s[i : i + chunk], force_n[i : i + chunk]) for i in range(0, len(time_s), chunk)]
    parts.append(tracker.finish())
    names = ("time_s", "contact", "x_m", "y_m", "force_n", "on_tile")
    rows = {name: np.concatenate([getattr(part.rows, name) for part in parts]) for name in names}
    rows["tiles"] = [text for part in parts for text in part.rows.tiles(floor)]
    return rows, [contact for part in parts for contact in part.finished], tracker


def times(seconds, rate_hz):
    return np.arange(round(seconds * rate_hz)) / rate_hz


def loads(*levels, rate_hz=1000.0):
    """One tile under a load in its middle that has these levels for these times: (newtons, seconds), ..."""
    load = np.concatenate([np.full(round(seconds * rate_hz), newtons) for newtons, seconds in levels])
    return np.arange(len(load)) / rate_hz, np.repeat(load[:, None, None] / 4.0, 4, axis=2)


# --- against the measured walks ---


@needs_data
@pytest.mark.parametrize("tare_n", [0.0, 12.0])
@pytest.mark.parametrize("name", WALKS)
def test_centroids_of_measured_walks_are_those_of_the_reference(name, tare_n):
    floor, forces = measured_walk(name)
    tare = tare_n * np.random.default_rng(1).uniform(0.8, 1.25, forces.force_n.shape[1:])
    rows, contacts, _ = follow(floor, forces.time_s, forces.force_n + tare, forces.rate_hz)
    assert sorted(floor.tiles[contact.tiles[0]].id for contact in contacts) == sorted(reference_steps(name))
    for contact in contacts:
        tile = floor.tiles[contact.tiles[0]]
        at = np.searchsorted(forces.time_s, rows["time_s"][rows["contact"] == contact.id])
        place = np.column_stack([rows[axis][rows["contact"] == contact.id] for axis in ("x_m", "y_m")])
        loaded = rows["force_n"][rows["contact"] == contact.id] > 50.0
        error = np.hypot(*(tile.to_tile(place) - reference_centroids(name, tile.id)[at])[loaded].T)
        assert np.median(error) < 0.15e-3
        assert np.quantile(error, 0.99) < 1e-3


@needs_data
@pytest.mark.parametrize("tare_n", [0.0, 12.0])
def test_every_plate_of_the_large_floor_is_found_and_nothing_else(tare_n):
    floor, forces = measured_walk("floor14/floor")
    tare = tare_n * np.random.default_rng(2).uniform(0.8, 1.25, forces.force_n.shape[1:])
    rows, contacts, tracker = follow(floor, forces.time_s, forces.force_n + tare, forces.rate_hz)
    assert set(rows["tiles"]) == set(floor.ids)
    assert all(contact.force_n.max() > 300.0 and not contact.cut for contact in contacts)
    assert contacts[0].start_s == pytest.approx(87 / 160.0)
    assert not tracker.untared.any()


# --- thresholds and baselines ---


@pytest.mark.parametrize("rate_hz", [240.0, 500.0, 1000.0])
def test_a_step_on_an_untared_tile_is_followed_within_a_millimetre(rate_hz):
    foot = Foot(1.0, (0.1, 0.12), (0.22, 0.2))
    time_s = times(2.5, rate_hz)
    force_n = read(corner_forces(ONE_TILE, [foot], time_s), rate_hz, noise_n=0.1, tare_n=12.0, drift_n_s=0.1)
    rows, (contact,), tracker = follow(ONE_TILE, time_s, force_n, rate_hz)
    truth = foot.force_n(time_s)
    on = np.flatnonzero(truth >= 20.0)[0]
    off = np.flatnonzero(truth >= 10.0)[-1]
    assert abs(contact.start_s - time_s[on]) < 1.5 / rate_hz
    assert abs(contact.end_s - time_s[off]) < 1.5 / rate_hz
    np.testing.assert_allclose(contact.force_n, foot.force_n(contact.time_s), atol=3.0)
    error = np.hypot(*(np.column_stack([rows["x_m"], rows["y_m"]]) - foot.centre_m(rows["time_s"])).T)
    assert np.quantile(error[rows["force_n"] > 50.0], 0.99) < 1e-3
    np.testing.assert_allclose(tracker.baseline_n[0], np.median(force_n[-int(0.4 * rate_hz) :, 0], axis=0), atol=0.15)


@pytest.mark.parametrize(("noise_n", "on_n"), [(0.5, 20.0), (2.05, 20.0), (4.0, 40.0)])
def test_the_threshold_rises_with_the_noise(noise_n, on_n):
    time_s, force_n = loads((0.0, 3.0), (0.8 * on_n, 0.1), (0.0, 1.2), (1.2 * on_n, 0.1), (0.0, 1.0))
    noisy = force_n + (force_n == 0.0) * np.random.default_rng(3).normal(0.0, noise_n, force_n.shape)
    _, contacts, tracker = follow(ONE_TILE, time_s[:4300], noisy[:4300], 1000.0)
    assert not contacts
    # Four sensors' independent noise adds up to twice that of one.
    tracker = ContactTracker(ONE_TILE, 1000.0)
    tracker.feed(time_s[:2500], noisy[:2500])
    assert tracker.noise_n[0] == pytest.approx(2.0 * noise_n, rel=0.25)
    _, contacts, _ = follow(ONE_TILE, time_s, noisy, 1000.0)
    assert [round(contact.start_s, 3) for contact in contacts] == [4.3]
    finder = StepFinder(ONE_TILE, 1000.0)
    finder.feed(time_s[:2500], noisy[:2500])
    told = (
        [] if on_n == 20.0 else ["noisy, so that contacts begin late, at up to 40 N instead of 20 N, and end early: t1"]
    )
    assert finder.warnings() == told


def test_on_and_off_are_inclusive_and_half_apart():
    time_s, force_n = loads((0.0, 1.0), (19.9, 0.1), (20.0, 0.1), (10.0, 0.1), (9.9, 0.1), (0.0, 0.5))
    rows, (contact,), _ = follow(ONE_TILE, time_s, force_n, 1000.0)
    assert (contact.start_s, contact.end_s) == (1.1, 1.299)
    assert (contact.lead_s, contact.lead_n) == (1.099, pytest.approx(19.9))
    assert not contact.cut
    np.testing.assert_allclose(rows["time_s"], time_s[1100:1300])


def test_a_tile_loaded_from_the_first_sample_on_uses_zero_and_is_flagged():
    time_s, force_n = loads((600.0, 1.0), (0.0, 1.0), (300.0, 0.5), (0.0, 1.0))
    tracker = ContactTracker(ONE_TILE, 1000.0)
    rows = tracker.feed(time_s[:900], force_n[:900]).rows
    assert tracker.untared[0]
    assert rows.time_s[0] == 0.0
    np.testing.assert_allclose(rows.force_n, 600.0)
    first, second = (c for i in (900, 2000) for c in tracker.feed(time_s[i : i + 1100], force_n[i : i + 1100]).finished)
    assert first.cut
    assert not tracker.untared[0]
    assert not second.cut


def test_a_tile_that_is_left_within_the_first_chunk_is_still_named_as_untared():
    """Who stands on it at first gives no step: a file, which is read in chunks of 4 s, did not say so."""
    finder = StepFinder(ONE_TILE, 1000.0)
    finder.feed(*loads((600.0, 1.0), (0.0, 2.0)))
    assert finder.warnings() == ["untared, loaded from the first sample on: t1"]


def test_a_tile_in_use_from_the_first_sample_on_is_loaded_however_small_the_load():
    time_s, force_n = loads((0.0, 1.5))
    force_n += np.clip(40.0 + 800.0 * time_s, 0.0, 600.0)[:, None, None] / 4.0 * (time_s < 0.7)[:, None, None]
    _, (contact,), _ = follow(ONE_TILE, time_s, force_n, 1000.0)
    assert contact.cut
    assert contact.start_s == 0.0
    assert contact.force_n[0] == pytest.approx(40.0)


def test_a_load_of_the_first_sample_begins_at_its_time_and_not_at_0():
    """Times before 0 are those of a recording before an exported stretch; two feet were divided there."""
    time_s = np.arange(400) / 1000.0 - 0.9
    time_s[188:] += 0.9
    force_n = np.abs(np.random.default_rng(0).normal(100.0, 40.0, (400, 2, 4)))
    _, contacts, _ = follow(touching_floor(1, 2), time_s, force_n, 1000.0)
    assert contacts[0].start_s == -0.9


def test_a_tare_that_a_loaded_start_has_hidden_ends_with_half_a_second_of_rest():
    time_s, force_n = loads((648.0, 1.0), (48.0, 1.5), (448.0, 0.5), (48.0, 1.0))
    _, (first, second), tracker = follow(ONE_TILE, time_s, force_n, 1000.0)
    assert first.cut
    assert first.end_s == pytest.approx(1.0, abs=0.002)
    assert not second.cut
    np.testing.assert_allclose(second.force_n, 400.0)
    assert not tracker.untared[0]
    time_s, force_n = loads((648.0, 1.0), (48.0, 1.0))
    for swings_n, untared in ((9.0, False), (11.0, True)):  # who touches it only, sways
        swing_n = swings_n / 8.0 * np.sin(20.0 * np.pi * time_s) * (time_s > 1.0)
        _, _, tracker = follow(ONE_TILE, time_s, force_n + swing_n[:, None, None], 1000.0)
        assert tracker.untared[0] == untared


def test_a_residue_below_the_on_threshold_holds_a_contact_for_less_than_half_a_second():
    for lasts_s, spans in ((0.45, [(1.0, 2.45)]), (0.55, [(1.0, 1.5), (2.05, 2.549)])):
        time_s, force_n = loads((0.0, 1.0), (700.0, 0.5), (14.0, lasts_s), (714.0, 0.5), (14.0, 1.0))
        _, contacts, _ = follow(ONE_TILE, time_s, force_n, 1000.0)
        assert [(contact.start_s, round(contact.end_s, 3)) for contact in contacts] == spans
    np.testing.assert_allclose(contacts[1].force_n, 700.0)


def test_a_tile_tared_under_load_recovers_when_the_load_goes():
    time_s, force_n = loads((60.0, 1.0), (0.0, 1.0), (500.0, 0.5), (0.0, 0.5))
    _, (contact,), _ = follow(ONE_TILE, time_s, force_n, 1000.0)
    assert contact.start_s == 2.0
    np.testing.assert_allclose(contact.force_n, 500.0)


def test_a_load_below_zero_is_a_wrong_tare_only_if_it_stays_for_a_tenth_of_a_second():
    hum = [(60.0, 0.02), (-60.0, 0.02)] * 10  # as of a loose wire
    for levels, baseline_n in (([(-60.0, 0.09)], 0.0), ([(-60.0, 0.11)], -15.0), (hum, 0.0)):
        _, _, tracker = follow(ONE_TILE, *loads((0.0, 1.0), *levels), 1000.0)
        np.testing.assert_allclose(tracker.baseline_n, baseline_n)


def test_noise_that_few_samples_show_is_rather_taken_for_larger():
    """Else noise would be contacts in the first seconds of every second tile."""
    time_s, floor = times(0.6, 1000.0), touching_floor(6, 6)
    tracker = ContactTracker(floor, 1000.0)
    tracker.feed(time_s, np.random.default_rng(3).normal(0.0, 2.0, (600, 36, 4)))
    assert (tracker.noise_n > 4.0).mean() > 0.8
    assert np.median(tracker.noise_n) < 6.0


def test_the_baseline_is_renewed_only_after_half_a_second_of_quiet():
    levels = [(0.0, 1.5), (500.0, 0.5), (5.0, 0.4), (505.0, 0.5), (5.0, 0.6), (505.0, 0.5), (5.0, 0.5)]
    _, contacts, _ = follow(ONE_TILE, *loads(*levels), 1000.0)
    assert [contact.force_n.max() for contact in contacts] == pytest.approx([500.0, 505.0, 500.0])
    for lasts_s, baseline_n in ((0.02, 1.0), (0.08, 0.0)):  # the first may be noise, and does not end the quiet
        levels = [(0.0, 2.0), (300.0, 0.5), (4.0, 0.4), (24.0, lasts_s), (4.0, 0.4)]
        _, _, tracker = follow(ONE_TILE, *loads(*levels), 1000.0)
        np.testing.assert_allclose(tracker.baseline_n, baseline_n, atol=1e-9)


def test_what_is_too_short_for_a_foot_counts_in_the_median_of_the_baseline():
    """It is of the 2 s that ended 0.2 s ago, sample by sample: each enters it once, and leaves it once."""
    force_n = 12.0 + np.random.default_rng(1).normal(0.0, 0.3, (1500, 1, 4))
    for at in range(200, 1450, 64):
        force_n[at : at + 10] += 30.0
    tracker = ContactTracker(ONE_TILE, 250.0)
    for end in range(50, 1500, 50):
        tracker.feed(np.arange(end - 50, end) / 250.0, force_n[end - 50 : end])
        if end >= 150 and (end - 1 - 200) % 64 >= 10:
            expected = np.median(force_n[max(end - 550, 0) : end - 50, 0], axis=0)
            np.testing.assert_allclose(tracker.baseline_n[0], expected, rtol=1e-12)


def test_tare_by_hand():
    time_s, force_n = loads((0.0, 1.0), (150.0, 1.12), (550.0, 0.5), (150.0, 0.5))
    tracker = ContactTracker(ONE_TILE, 1000.0)
    tracker.feed(time_s[:1120], force_n[:1120])
    assert tracker.ongoing()[0].force_n == pytest.approx(150.0)
    tracker.tare()  # to what was read in the last 0.1 s
    finished = tracker.feed(time_s[1120:], force_n[1120:]).finished
    assert [contact.force_n.max() for contact in finished] == pytest.approx([150.0, 400.0])
    assert not tracker.ongoing()


@pytest.mark.parametrize(
    ("rate_hz", "gap_s", "contacts"),
    [(1000.0, 0.03, 1), (1000.0, 0.04, 1), (1000.0, 0.05, 2), (20.0, 0.1, 1), (20.0, 0.15, 2)],
)
def test_a_gap_ends_a_contact_and_what_follows_is_new(rate_hz, gap_s, contacts):
    time_s, force_n = loads((0.0, 1.0), (500.0, 1.0), (0.0, 0.5), rate_hz=rate_hz)
    kept = (time_s <= 1.3) | (time_s >= 1.3 + gap_s - 1e-9)
    rows, found, _ = follow(ONE_TILE, time_s[kept], force_n[kept], rate_hz)
    assert len(found) == contacts
    assert all(contact.cut == (contacts == 2) for contact in found)
    assert len(rows["time_s"]) == (force_n[kept, 0, 0] > 0.0).sum()


# --- feet, people, ids ---


def test_quiet_standing_is_one_contact_that_is_kept_for_ten_seconds():
    time_s = times(24.0, 250.0)
    sway = 0.02 * np.sin(2 * np.pi * 0.3 * time_s)
    force_n = np.where((time_s > 1.0) & (time_s < 22.0), 350.0, 0.0)[:, None] * np.ones(4) / 4.0
    force_n = force_n * (1.0 + np.array([1, -1, -1, 1]) * sway[:, None] / 0.13)
    noisy = read(force_n[:, None], 250.0, noise_n=0.5, tare_n=10.0, drift_n_s=0.05)
    rows, (contact,), _ = follow(touching_floor(1, 1), time_s, noisy, 250.0)
    assert contact.end_s - contact.start_s == pytest.approx(21.0, abs=0.01)
    assert contact.time_s[-1] - contact.start_s == pytest.approx(10.0, abs=0.01)
    assert len(rows["time_s"]) == pytest.approx(21.0 * 250.0, abs=2)
    np.testing.assert_allclose(rows["x_m"], 0.15 + np.interp(rows["time_s"], time_s, sway), atol=2e-3)


def test_a_foot_across_two_tiles_is_one_contact_with_one_centroid():
    floor = touching_floor(1, 2)
    foot = Foot(0.8, (0.23, 0.14), (0.37, 0.16))
    time_s = times(2.0, 1000.0)
    force_n = read(corner_forces(floor, [foot], time_s), 1000.0, noise_n=0.1, tare_n=12.0)
    rows, (contact,), _ = follow(floor, time_s, force_n, 1000.0)
    assert contact.id == 1
    assert set(contact.tiles) == {0, 1}
    assert {"t1", "t1+t2", "t2"} >= set(rows["tiles"]) > {"t1+t2"}
    both = np.array(rows["tiles"]) == "t1+t2"
    error = np.hypot(*(np.column_stack([rows["x_m"], rows["y_m"]]) - foot.centre_m(rows["time_s"]))[both].T)
    assert np.quantile(error, 0.99) < 1e-3
    np.testing.assert_allclose(rows["force_n"][both], foot.force_n(rows["time_s"][both]), atol=3.0)


def test_a_foot_on_the_corner_of_four_tiles_is_one_contact():
    floor = touching_floor(2, 2)
    foot = Foot(0.8, (0.25, 0.29), (0.36, 0.31))
    time_s = times(2.0, 500.0)
    rows, contacts, _ = follow(floor, time_s, read(corner_forces(floor, [foot], time_s), 500.0), 500.0)
    assert set(rows["contact"]) == {1}
    assert "t1+t2+t3+t4" in rows["tiles"]
    assert len(contacts) == 1


@pytest.mark.parametrize(
    ("first_x", "second_x", "late_s", "feet"),
    [
        (0.25, 0.50, 0.15, 1),  # heel and ball
        (0.15, 0.50, 0.15, 2),  # further apart than a foot is long
        (0.25, 0.36, 0.45, 1),  # the toes come down where the foot presses
        (0.20, 0.44, 0.45, 2),  # a step later, and not at the toes
    ],
)
def test_one_foot_or_two_is_told_by_place_and_time(first_x, second_x, late_s, feet):
    floor = touching_floor(1, 2)
    time_s = times(3.0, 1000.0)
    first = Foot(0.8, (first_x, 0.15), (first_x, 0.15))
    second = Foot(0.8 + late_s, (second_x, 0.15), (second_x, 0.15), duration_s=0.75 - late_s)
    rows, contacts, _ = follow(floor, time_s, read(corner_forces(floor, [first, second], time_s), 1000.0), 1000.0)
    assert len(contacts) == feet
    assert set(rows["contact"]) == set(range(1, feet + 1))


def test_what_outlasts_a_foot_by_far_is_no_toes():
    floor = touching_floor(1, 2)
    time_s = times(3.0, 1000.0)
    feet = [Foot(0.8, (0.25, 0.15), (0.25, 0.15)), Foot(1.3, (0.34, 0.15), (0.34, 0.15))]
    _, contacts, _ = follow(floor, time_s, read(corner_forces(floor, feet, time_s), 1000.0), 1000.0)
    assert [contact.tiles for contact in contacts] == [(0,), (1,)]


@pytest.mark.parametrize(("apart_m", "feet"), [(0.029, 1), (0.031, 2)])
def test_tiles_further_than_30_mm_apart_do_not_share_a_foot(apart_m, feet):
    tiles = [Tile(id, (0.3, 0.3), (x, 0.0), 0.0, CORNERS) for id, x in (("a", 0.0), ("b", 0.3 + apart_m))]
    time_s, force_n = loads((0.0, 1.0), (400.0, 0.5), (0.0, 0.5))
    # 0.08 m from the middle of each tile, towards the other.
    pressed = np.concatenate(
        [force_n * (1 + side * np.sign(np.array(CORNERS)[:, 0]) * 0.08 / 0.13) for side in (1, -1)], axis=1
    )
    _, contacts, _ = follow(Floor(tuple(tiles)), time_s, pressed, 1000.0)
    assert len(contacts) == feet


def test_rows_wait_until_it_is_decided_whose_foot_it_is_and_ongoing_contacts_do_not():
    floor = touching_floor(1, 2)
    time_s = times(2.5, 1000.0)
    toward = 1 + np.sign(np.array(floor.tiles[0].sensors_m)[:, 0]) * np.array([[0.1 / 0.13], [-0.1 / 0.13]])
    pressed = np.zeros((2500, 2, 4))
    pressed[1000:, 0] = 400.0 / 4.0 * toward[0]
    pressed[1100:, 1] = 60.0 / 4.0 * toward[1]
    tracker = ContactTracker(floor, 1000.0)
    given = tracker.feed(time_s[:1300], pressed[:1300]).rows
    assert not len(given)
    (both,) = tracker.ongoing()
    assert (both.id, both.tiles, both.force_n) == (1, (0, 1), pytest.approx(460.0))
    assert both.start_s == pytest.approx(0.999)
    assert both.x_m == pytest.approx((400.0 * 0.25 + 60.0 * 0.35) / 460.0)
    given = tracker.feed(time_s[1300:2300], pressed[1300:2300]).rows
    assert given.time_s[0] == 1.0
    assert 2.3 - given.time_s[-1] < 0.8
    assert set(given.contact) == {1}


def test_a_load_that_may_still_become_anothers_is_a_contact_without_an_id_meanwhile():
    time_s, pressed = times(1.2, 1000.0), np.zeros((1200, 3, 4))
    pressed[1000:, 1], pressed[1100:, 2] = 100.0, 100.0
    tracker = ContactTracker(touching_floor(1, 3), 1000.0)
    tracker.feed(time_s, pressed)
    assert [(contact.id, contact.tiles) for contact in tracker.ongoing()] == [(1, (1,)), (0, (2,))]


def test_a_foot_keeps_its_id_while_any_of_its_tiles_is_pressed():
    floor = touching_floor(1, 2)
    toward = 1 + np.sign(np.array(floor.tiles[0].sensors_m)[:, 0]) * np.array([[0.1 / 0.13], [-0.1 / 0.13]])
    time_s, pressed = times(3.0, 1000.0), np.zeros((3000, 2, 4))
    pressed[1000:1500, 0] = 100.0 * toward[0]
    pressed[1100:2000, 1] = 100.0 * toward[1]
    pressed[1900:2400, 0] = 100.0 * toward[0]
    rows, contacts, _ = follow(floor, time_s, pressed, 1000.0)
    assert [contact.id for contact in contacts] == [1, 2]
    assert (contacts[0].start_s, contacts[0].end_s) == (1.0, 1.999)
    # The tile came back 0.8 s after the other's onset: another foot.
    assert (contacts[1].start_s, contacts[1].tiles) == (1.9, (0,))
    assert len(rows["time_s"]) == 1000 + 500


def test_two_people_have_contacts_of_their_own():
    floor = touching_floor(6, 12)
    one = walk(5, heel_m=(0.15, 0.45), start_s=0.6)
    other = walk(5, heel_m=(0.25, 1.35), start_s=0.75, step_s=0.5)
    time_s = times(4.5, 500.0)
    rows, contacts, _ = follow(
        floor, time_s, read(corner_forces(floor, one + other, time_s), 500.0, tare_n=11.0), 500.0
    )
    assert len(contacts) == 10
    assert sorted(set(rows["contact"])) == list(range(1, 11))
    for contact in contacts:
        foot = min(
            one + other, key=lambda foot: abs(foot.start_s - contact.start_s) + abs(foot.heel_m[1] - contact.y_m[0])
        )
        error = np.hypot(*(np.column_stack([contact.x_m, contact.y_m]) - foot.centre_m(contact.time_s)).T)
        assert np.median(error) < 2e-3


# --- streaming ---


@pytest.mark.parametrize("chunk", [1, 7, 100_000])
def test_chunks_do_not_change_a_bit(chunk):
    floor = touching_floor(3, 8)
    time_s = times(3.0, 500.0)
    feet = walk(4, heel_m=(0.2, 0.45), start_s=0.3, step_s=0.4)
    force_n = read(corner_forces(floor, feet, time_s), 500.0, noise_n=3.0, tare_n=12.0, drift_n_s=2.0)
    force_n[700:704, 5, 1] = np.nan
    kept = (time_s < 1.9) | (time_s > 2.0)
    expected, finished, _ = follow(floor, time_s[kept], force_n[kept], 500.0)
    rows, contacts, _ = follow(floor, time_s[kept], force_n[kept], 500.0, chunk)
    assert len(finished) > 4
    for name, column in expected.items():
        np.testing.assert_array_equal(rows[name], column)
    for contact, other in zip(contacts, finished, strict=True):
        np.testing.assert_array_equal(contact.force_n, other.force_n)
        for name in ("id", "start_s", "end_s", "tiles", "cut", "lead_s", "lead_n"):
            np.testing.assert_array_equal(getattr(contact, name), getattr(other, name))


@pytest.mark.parametrize("length", [0, 1, 3, 30])
def test_a_stream_of_any_length_ends_well(length):
    time_s, force_n = loads((500.0, 0.1))
    rows, contacts, _ = follow(ONE_TILE, time_s[:length], force_n[:length], 1000.0)
    assert len(rows["time_s"]) == length
    assert [contact.cut for contact in contacts] == [True] * (length > 0)


def test_a_tracker_refuses_other_shapes_and_rates():
    with pytest.raises(BadValue, match="rate_hz is 0"):
        ContactTracker(ONE_TILE, 0.0)
    tracker = ContactTracker(ONE_TILE, 1000.0)
    with pytest.raises(BadValue, match=r"the shape of force_n is \(3, 2, 4\); allowed: \(3, 1, 4\)"):
        tracker.feed(np.zeros(3), np.zeros((3, 2, 4)))
    with pytest.raises(BadValue, match="the shape of time_s"):
        tracker.feed(np.zeros((1, 1)), np.zeros((1, 1, 4)))
