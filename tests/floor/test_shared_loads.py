"""Two feet on one tile: what each bears is known again from the load of both."""

import numpy as np
import pytest

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor.contacts import ContactTracker
from underfoot.floor.layout import default_floor
from underfoot.floor.shared_loads import SharedLoad, jump_time_s, relief_time_s, shared
from underfoot.floor.simulated_loads import feet_down
from underfoot.floor.simulated_people import drawn_people
from underfoot.floor.tracker_memory import ROW


def test_two_feet_whose_load_is_one_are_known_again():
    time_s = np.arange(150) * 0.004
    first_n = 600.0 * np.clip((0.36 - time_s) / 0.12, 0.0, 1.0)
    second_n = 600.0 * np.clip((time_s - 0.24) / 0.12, 0.0, 1.0)
    first_m = np.column_stack([0.05 + 0.2 * time_s, 0.02 + 0.0 * time_s])
    second_m = np.column_stack([-0.10 + 0.3 * (time_s - 0.3), -0.06 + 0.0 * time_s])
    force_n = first_n + second_n
    centroid_m = (first_n[:, None] * first_m + second_n[:, None] * second_m) / force_n[:, None]
    feet = shared(np.column_stack([time_s, centroid_m, force_n]), 0.31)
    assert feet.first_s == pytest.approx(0.24, abs=0.012)
    assert feet.last_s == pytest.approx(0.36, abs=0.012)
    together = (time_s > 0.25) & (time_s < 0.35)
    share, one_m, other_m = feet.shares(time_s[together], centroid_m[together])
    np.testing.assert_allclose(share * force_n[together], second_n[together], atol=3.0)
    np.testing.assert_allclose(one_m, first_m[together], atol=0.005)
    np.testing.assert_allclose(other_m, second_m[together], atol=0.005)


def test_a_light_load_that_was_lost_for_a_while_has_not_jumped():
    time_s = np.append(np.arange(100) * 0.01, 3.0)  # lost for two seconds
    track = np.column_stack([time_s, 0.0 * time_s, 0.0 * time_s, 20.0 + 0.0 * time_s])
    assert jump_time_s(track, 0.0, np.zeros(2)) is None


@pytest.mark.parametrize(
    ("first_n", "rise_s", "jump_m", "passes"),
    [
        (30.0, 0.02, 0.12, True),  # toes that only touch, then another foot
        (200.0, 0.02, 0.12, False),  # a heel that strikes, then the rest of the foot
        (70.0, 0.12, 0.12, False),  # a heel that is put down softly: 50 N after 70 ms
        (200.0, 0.02, 0.28, True),  # further than from a heel to the rest
        (30.0, 0.02, 0.05, False),
    ],
)
def test_soon_after_it_began_a_load_passes_on_where_it_was_no_heel_or_goes_too_far(first_n, rise_s, jump_m, passes):
    time_s = np.arange(100) * 0.004
    force_n = np.interp(time_s, (0.0, rise_s, 0.16, 0.2), (20.0, first_n, first_n, 400.0))
    x_m = np.interp(time_s, (0.16, 0.2), (0.0, jump_m))
    found = jump_time_s(np.column_stack([time_s, x_m, 0.0 * time_s, force_n]), 0.0, np.zeros(2))
    assert (found is not None) == passes
    assert found is None or 0.16 < found < 0.21


def test_a_load_that_has_not_come_to_rest_soon_after_it_began_has_not_passed_on_yet():
    time_s = np.arange(100) * 0.004
    x_m = np.interp(time_s, (0.1, 0.2, 0.3, 0.38), (0.0, 0.15, 0.15, 0.3))
    track = np.column_stack([time_s, x_m, 0.0 * time_s, np.where(time_s < 0.15, 30.0, 300.0)])
    assert jump_time_s(track, 0.0, np.zeros(2)) is None


@pytest.mark.parametrize(
    ("begins_s", "rolled_m", "jump_m", "passes"),
    [
        (1.0, 0.1, 0.12, True),  # the feet of who walks slowly, both down for a quarter of a second
        (1.0, 0.1, 0.08, False),  # a foot that rolls
        (0.4, 0.1, 0.12, False),  # a long foot of who walks fast
        (2.0, 0.1, 0.12, False),  # somebody who stands, and sways
        (1.0, 0.02, 0.09, False),  # the second foot of who comes to stand here
        (1.0, 0.1, -0.09, False),  # somebody who stands and sways to and fro
    ],
)
def test_who_walks_slowly_may_take_longer_to_pass_a_load_on(begins_s, rolled_m, jump_m, passes):
    time_s = np.arange(750) * 0.004
    x_m = np.interp(time_s, (0.0, begins_s, begins_s + 0.25), (0.0, rolled_m, rolled_m + jump_m))
    track = np.column_stack([time_s, x_m, 0.0 * time_s, 500.0 + 0.0 * time_s])
    ends = np.searchsorted(time_s, np.arange(begins_s, begins_s + 0.5, 0.032))
    found = [at_s for end in ends if (at_s := jump_time_s(track[:end], 0.0, np.zeros(2))) is not None]
    assert bool(found) == passes
    assert all(begins_s + 0.1 < at_s < begins_s + 0.25 for at_s in found)


def test_where_one_foot_leaves_as_the_other_comes_the_load_is_the_others_from_where_that_bears_half():
    feet = SharedLoad(0.5, 0.5, np.array([[0.0, 0.0], [0.2, 0.0]]), np.zeros((2, 2)))
    rows = np.zeros(20, ROW)
    rows["sample"] = 490 + np.arange(20)
    rows["time_s"] = rows["sample"] / 1000.0
    rows["x_m"] = np.interp(rows["time_s"], (0.495, 0.5), (0.0, 0.2))
    rows["force_n"] = np.interp(rows["time_s"], (0.49, 0.496, 0.5, 0.509), (60.0, 12.0, 12.0, 60.0))
    first, second, lead_n = feet.split(rows)
    assert (first["sample"][-1], second["sample"][0], lead_n) == (497, 498, 0.0)
    assert len(first) + len(second) == len(rows)


def test_the_forces_of_people_who_cross_sum_to_what_their_tiles_bear():
    floor = default_floor(6, 6)
    source = SimulatedFloor(floor, people=drawn_people(2, "crossing"))
    draw, tracker, followed, loads, stamps = np.random.default_rng(1), ContactTracker(floor, 1000.0), [], [], []
    for end in range(4800, 48_000 * 12, 4800):
        count = source.pull(end)
        force_n = source.forces[:count]
        loads.append(force_n.sum(axis=2))
        stamps.append(source.stamps[:count] / 48_000.0)
        followed.append(tracker.feed(stamps[-1], force_n + draw.normal(0.0, 0.3, force_n.shape)))
    followed.append(tracker.finish())
    time_s, load_n = np.concatenate(stamps), np.concatenate(loads)
    at, force_n, on_tile = (
        np.concatenate([getattr(part.rows, name) for part in followed]) for name in ("time_s", "force_n", "on_tile")
    )
    sample = np.searchsorted(time_s, at - 1e-6)
    pressed = np.zeros_like(load_n, bool)
    np.logical_or.at(pressed, sample, on_tile)
    total_n = np.bincount(sample, weights=force_n, minlength=len(time_s))
    # Six deviations of the noise of five tiles, and of their baselines.
    assert np.abs(total_n - (load_n * pressed).sum(axis=1)).max() < 10.0
    down = feet_down(source.footfalls, source.curves, time_s)
    began = np.sort([contact.start_s for part in followed for contact in part.finished if not contact.cut])
    feet = np.sort([down.time_s[(down.footfall == foot) & (down.force_n >= 20.0)][0] for foot in set(down.footfall)])
    assert len(began) > 40
    # Each contact begins with a foot.
    assert np.quantile(np.abs(began[:, None] - feet).min(axis=1), 0.95) < 0.015


@pytest.mark.parametrize(("last_n", "places"), [(90.0, (0.0, 0.2)), (45.0, (0.0, 0.2)), (90.0, (0.0, 0.01))])
def test_a_load_that_falls_and_rises_elsewhere_is_the_next_foots(last_n, places):
    """A foot rolls off a tile while the next comes down on it, and soon rolls off, too; or the same foot comes back."""
    time_s = np.arange(150) * 0.004
    force_n = np.interp(time_s, (0.0, 0.1, 0.3, 0.4, 0.6), (0.0, 160.0, 15.0, 90.0, last_n))
    x_m = np.where(time_s < 0.3, *places)
    found = relief_time_s(np.column_stack([time_s, x_m, np.zeros(150), force_n]), 0.25)
    assert found is not None
    least_s, moved = found
    assert least_s == pytest.approx(0.3, abs=0.005)
    assert moved == (places[1] > 0.1)


def test_the_valley_between_the_two_peaks_of_a_foot_is_no_relief():
    """Walking presses the ground with peaks of 1.1 body weights and 0.7 between (Winter 1991)."""
    time_s = np.arange(150) * 0.004
    force_n = 700.0 * np.interp(time_s, (0.0, 0.15, 0.3, 0.45, 0.6), (0.0, 1.1, 0.7, 1.1, 0.0))
    track = np.column_stack([time_s, 0.4 * time_s, np.zeros(150), force_n])
    assert relief_time_s(track[: int(0.45 / 0.004)], 0.2) is None
