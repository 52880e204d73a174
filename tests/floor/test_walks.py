"""Persons, sides and gait, from footsteps of simulated people whose truth is known."""

import math
import pickle

import msgspec
import numpy as np
import pytest

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor import simulated_loads
from underfoot.floor.contacts import Contact, ContactTracker
from underfoot.floor.footsteps import Step
from underfoot.floor.gait_summary import GaitTotals, PersonGait, gait_of
from underfoot.floor.layout import default_floor
from underfoot.floor.walks import WalkTracker
from underfoot.models import gait

FLOOR = default_floor(6, 24)
MIDDLE_M = 0.93


def steps_of(walks, seconds, walkers, feed_s=0.1):
    """The steps that are told of these footfalls."""
    source = SimulatedFloor(FLOOR)
    source.footfalls = simulated_loads.footfall_table(walks)
    source.curves = simulated_loads.gait_curves(walkers)
    tracker, counter, steps = ContactTracker(FLOOR, 1000.0), WalkTracker(FLOOR), []
    for end in range(round(feed_s * 48_000), round(seconds * 48_000), round(feed_s * 48_000)):
        count = source.pull(end)
        time_s = source.stamps[:count] / 48_000.0
        steps += counter.feed(tracker.feed(time_s, source.forces[:count]).finished, time_s[-1])
    return steps + counter.feed(tracker.finish().finished, math.inf) + counter.finish()


def test_gait_is_that_of_the_walker():
    walker = gait.Walker(step_length_m=0.6, step_width_m=0.12, toe_out_deg=0.0, variation=0.0)
    made = gait.footfalls(walker, [(0.3, MIDDLE_M), (7.0, MIDDLE_M)], 30.0)
    steps = steps_of([made], 6.0, [walker])
    stance_ms = 1e3 * walker.contact_s
    assert len(steps) > 8
    assert {step.person for step in steps} == {1}
    for step, foot in zip(steps[2:], made[2:], strict=False):
        assert step.side == foot.side
        assert step.cadence_per_min == pytest.approx(110.0, rel=0.02)
        assert step.step_length_mm == pytest.approx(600.0, abs=15.0)
        assert step.step_width_mm == pytest.approx(120.0, abs=10.0)
        assert step.double_support_ms == pytest.approx(stance_ms - 1e3 * walker.step_s, abs=15.0)
        assert step.swing_ms == pytest.approx(2e3 * walker.step_s - stance_ms, abs=15.0)
        assert step.heading_deg == pytest.approx(0.0, abs=2.0 * step.heading_error_deg)
        assert step.speed_m_s == pytest.approx(0.6 * 110.0 / 60.0, rel=0.03)
        assert step.stance_percent == pytest.approx(50.0 * walker.contact_s / walker.step_s, abs=1.0)
    (found,) = gait_of(steps)
    assert found.cadence_per_min == pytest.approx(110.0, rel=0.02)
    assert found.stance_asymmetry_percent < 2.0
    assert found.line().startswith(f"person 1: {len(steps)} steps, 110 steps a minute, length 6")
    assert ", 1.1" in found.line()


def test_a_step_that_was_not_seen_leaves_what_is_between_its_neighbours_unknown():
    """The second and third steps of a walk come down beside the floor."""
    walker = gait.Walker(step_length_m=0.3, variation=0.0)
    made = gait.footfalls(walker, [(0.3, MIDDLE_M), (7.0, MIDDLE_M)], 30.0)
    steps = steps_of([[made[0], *made[3:]]], 6.0, [walker])
    assert {step.person for step in steps} == {1}
    assert steps[1].start_s - steps[0].start_s > 1.2
    for name in ("cadence_per_min", "step_length_mm", "step_width_mm", "double_support_ms", "swing_ms"):
        assert math.isnan(getattr(steps[1], name))
        assert math.isnan(getattr(steps[2], name)) == (name == "swing_ms")  # that foot was last seen before the gap
    (found,) = gait_of(steps)
    assert found.double_support_ms > 0.0
    assert found.cadence_per_min == pytest.approx(110.0, rel=0.02)
    assert found.step_length_mm == pytest.approx(300.0, abs=15.0)


def test_what_a_cut_step_leaves_unknown_of_the_next():
    """The recording begins 0.2 s after the first foot came down: it stood there, and nobody saw since when."""
    contacts = [contact_at(step, 0.55 * step, 0.3 + 0.5 * step, MIDDLE_M) for step in range(5)]
    seen = contacts[0].time_s >= 0.2
    curve = {name: getattr(contacts[0], name)[seen] for name in ("time_s", "force_n", "x_m", "y_m")}
    cut = msgspec.structs.replace(contacts[0], start_s=0.2, cut=True, **curve)
    _, steps = persons_of([cut, *contacts[1:]])
    assert [step.contact for step in steps] == [1, 2, 3, 4]
    for name in ("cadence_per_min", "step_length_mm", "step_width_mm"):
        assert math.isnan(getattr(steps[0], name))
    assert steps[0].double_support_ms == pytest.approx(1e3 * (cut.end_s - contacts[1].start_s))
    assert [step.cadence_per_min for step in steps[1:]] == [pytest.approx(60.0 / 0.55)] * 3


def test_where_neither_foot_is_down_the_double_support_is_negative():
    _, steps = persons_of([contact_at(step, 0.65 * step, 0.3 + 0.5 * step, MIDDLE_M) for step in range(4)])
    assert [step.double_support_ms for step in steps[1:]] == [pytest.approx(-50.0)] * 3


def test_who_limps_is_asymmetric():
    walker = gait.Walker(step_length_m=0.6, variation=0.0)
    made = gait.footfalls(walker, [(0.3, MIDDLE_M), (7.0, MIDDLE_M)], 30.0)
    limping = [msgspec.structs.replace(step, duration_s=step.duration_s * (0.85 if step.side == "left" else 1.0))
               for step in made]  # fmt: skip
    steps = steps_of([limping], 6.0, [walker])
    (found,) = gait_of(steps)
    assert found.stance_asymmetry_percent == pytest.approx(200.0 * 0.15 / 1.85, abs=1.5)
    # A foot that pauses is no limp.
    (paused,) = gait_of([*steps[:4], msgspec.structs.replace(steps[4], contact_ms=4000.0), *steps[5:]])
    assert paused.stance_asymmetry_percent == pytest.approx(found.stance_asymmetry_percent, abs=1.5)


def test_who_walks_backwards_has_the_same_sides():
    walker = gait.Walker(step_length_m=0.5, toe_out_deg=0.0, variation=0.0)
    forwards = gait.footfalls(walker, [(0.5, MIDDLE_M), (7.0, MIDDLE_M)], 30.0)
    # The last place first: each foot comes down behind the other one.
    backwards = [
        msgspec.structs.replace(step, heel_x_m=forwards[11 - number].heel_x_m)
        for number, step in enumerate(forwards[:12])
    ]
    steps = steps_of([backwards], 8.0, [walker])[:12]
    assert {step.person for step in steps} == {1}
    assert [step.side for step in steps] == [step.side for step in backwards]


def test_two_who_pass_keep_their_ids_and_somebody_long_gone_is_somebody_new():
    heavy, light = gait.Walker(weight_n=900.0), gait.Walker(weight_n=450.0, cadence_per_min=124.0, step_length_m=0.5)
    along = [(0.3, MIDDLE_M - 0.35), (7.0, MIDDLE_M - 0.35)]
    back = [(7.0, MIDDLE_M + 0.35), (0.3, MIDDLE_M + 0.35)]
    walks = [gait.footfalls(heavy, along, 5.5), gait.footfalls(light, back, 5.0, seed=2)]
    walks[0] += gait.footfalls(heavy, along, 13.0, start_s=10.0)
    steps = steps_of(walks, 14.0, (heavy, light))
    force = {}
    for step in steps:
        force.setdefault(step.person, []).append(step.impulse_ns / step.contact_ms * 1e3)
    assert sorted(force) == [1, 2, 3]
    # The mean force is the weight times step over contact time. Who stood first, ended first: the quicker one.
    assert np.median(force[2]) == pytest.approx(np.median(force[3]), rel=0.05)
    assert np.median(force[1]) < 0.7 * np.median(force[2])
    assert len(force[1]) == pytest.approx(len(walks[1]), abs=1)


def test_who_turns_at_each_step_has_sides_from_the_first_row_on():
    floor = default_floor(2, 2)
    source, tracker, counter, steps = SimulatedFloor(floor), ContactTracker(floor, 1000.0), WalkTracker(floor), []
    for end in range(4800, round(4.5 * 48_000), 4800):
        count = source.pull(end)
        time_s = source.stamps[:count] / 48_000.0
        steps += counter.feed(tracker.feed(time_s, source.forces[:count]).finished, time_s[-1])
    assert len(steps) >= 5
    assert [step.side == "left" for step in steps] == source.footfalls["left"][: len(steps)].tolist()


def test_the_next_step_has_a_person_while_it_is_under_way():
    walker = gait.Walker(step_length_m=0.6, variation=0.0)
    made = gait.footfalls(walker, [(0.3, MIDDLE_M), (7.0, MIDDLE_M)], 30.0)
    source = SimulatedFloor(FLOOR)
    source.footfalls = simulated_loads.footfall_table([made])
    tracker, counter = ContactTracker(FLOOR, 1000.0), WalkTracker(FLOOR)
    for end in range(4800, round(4.3 * 48_000), 4800):
        count = source.pull(end)
        time_s = source.stamps[:count] / 48_000.0
        counter.feed(tracker.feed(time_s, source.forces[:count]).finished, time_s[-1])
    contacts = tracker.ongoing()
    assert contacts
    assert {counter.person_at(contact.start_s, (contact.x_m, contact.y_m)) for contact in contacts} == {1}
    assert counter.person_at(contacts[0].start_s, (7.0, 0.1)) == 0


def contact_at(id, start_s, x_m, y_m, weight=1.0):
    """A footfall of 0.6 s that rolls along x."""
    share = np.linspace(0.0, 1.0, 121)
    force_n = weight * (900.0 * np.sin(math.pi * share) + 11.0)
    return Contact(
        id, start_s, start_s + 0.6, (0,), False, start_s - 0.005, 0.0,
        start_s + 0.6 * share, force_n, x_m + 0.18 * share, np.full(121, y_m),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("pause_s", "stands_s", "late_s", "missed"),
    [
        (0.5, {4: 0.5, 5: 0.5}, {}, ()),
        (1.5, {4: 1.5, 5: 1.5}, {}, ()),
        (0.0, {}, {3: 0.45, 4: 0.45}, (5,)),
        (0.0, {4: 0.5}, {}, (5,)),
    ],
    ids=["a pause of a step", "of three", "a step that no sensor saw", "two feet in one contact"],
)
def test_sides_alternate_after_a_pause_and_after_a_step_that_was_not_seen(pause_s, stands_s, late_s, missed):
    """Both feet stand while somebody pauses. Sensors that let go late, as uncalibrated FSRs, tell that a foot stands
    that is gone."""
    contacts = []
    for step in range(12):
        one = contact_at(1 + step, 0.5 * step + pause_s * (step > 5), 0.3 + 0.5 * step, 0.3 + 0.06 * (-1) ** step)
        one.time_s[60:] += stands_s.get(step, 0.0)
        one.time_s[-1] += late_s.get(step, 0.0)
        one.force_n[-2:] = 0.15 * one.force_n.max()
        if step not in missed:
            contacts.append(msgspec.structs.replace(one, end_s=float(one.time_s[-1])))
    _, steps = persons_of(contacts)
    told = {step.contact - 1: (step.person, step.side) for step in steps}
    assert told == {step: (1, ("left", "right")[step % 2]) for step in range(12) if step not in missed}


@pytest.mark.parametrize("feed", [1, 7])
def test_steps_that_come_together_are_given_to_those_whom_they_suit_together(feed):
    """Two walk abreast and both step aside: one nearer to where the other's foot is due than to where its own is."""
    contacts = []
    for step in range(12):
        for one in range(2):
            aside_m = 0.05 * (-1) ** step + (0.3 if step == 8 else 0.0)
            start_s = 0.55 * step + 0.01 * one
            contacts.append(contact_at(2 * step + one, start_s, 0.3 + 0.5 * step, 0.3 + 0.5 * one + aside_m))
    counter, steps = WalkTracker(FLOOR), []
    for begin in range(0, len(contacts), feed):
        chunk = contacts[begin : begin + feed]
        steps += counter.feed(chunk, chunk[-1].end_s)
    steps += counter.finish()
    persons = {one: {step.person for step in steps if step.contact % 2 == one} for one in range(2)}
    assert len(steps) == 24
    assert [len(of_one) for of_one in persons.values()] == [1, 1]
    assert persons[0] != persons[1]


def test_the_foot_that_the_end_cuts_takes_nobodys_last_step_away():
    """Two walk 1.2 m apart; the stream ends 0.3 s after the last foot came down, soon after the ones before left."""
    contacts = [contact_at(2 * step + one, 0.55 * step + 0.2 * one, 0.3 + 0.5 * step, 0.3 + 1.2 * one)
                for step in range(9) for one in range(2)]  # fmt: skip
    end_s = contacts[-1].start_s + 0.3
    counter, steps = WalkTracker(FLOOR), []
    for contact in contacts[:-2]:
        steps += counter.feed([contact], contact.end_s)
    for contact in contacts[-2:]:
        seen = contact.time_s < end_s
        curve = {name: getattr(contact, name)[seen] for name in ("time_s", "force_n", "x_m", "y_m")}
        steps += counter.feed([msgspec.structs.replace(contact, end_s=end_s, cut=True, **curve)], end_s)
    steps += counter.finish()
    assert [step.contact for step in sorted(steps, key=lambda step: step.contact)] == list(range(16))
    assert {(step.contact % 2, step.person) for step in steps} == {(0, 1), (1, 2)}


def persons_of(contacts):
    """The person of each contact, by its id, and all steps."""
    counter, steps = WalkTracker(FLOOR), []
    for contact in sorted(contacts, key=lambda contact: contact.end_s):
        steps += counter.feed([contact], contact.end_s)
    steps += counter.finish()
    return {step.contact: step.person for step in steps}, steps


def test_a_first_step_is_followed_by_that_which_comes_as_late_as_people_step():
    """Two come towards each other at 110 steps a minute, the usual cadence (Winter 1991). The second step of each lands
    where the other stood, but much too soon or too late after the other's first."""
    places = {1: (0.0, 1.0), 2: (0.19, 1.5), 3: (0.55, 1.5), 4: (0.74, 1.0)}
    person = persons_of([contact_at(id, start_s, x_m, 0.5) for id, (start_s, x_m) in places.items()])[0]
    assert person[1] == person[3] != person[2] == person[4]


def abreast(weights, lanes_m):
    """Two who walk side by side, of these weights (step, 2) in these lanes (step, 2); ids are even of the first one."""
    return [
        contact_at(
            2 * step + one, 0.55 * step + 0.01 * one, 0.3 + 0.5 * step,
            0.6 + lanes_m[step][one] + 0.05 * (-1) ** step, weights[step][one],
        )
        for step in range(len(weights)) for one in range(2)
    ]  # fmt: skip


def test_weight_tells_two_apart_who_differ_by_a_quarter_and_change_lanes():
    lanes_m = [(0.0, 0.5)] * 7 + [(0.5, 0.0)]
    person = persons_of(abreast([(1.0, 0.8)] * 8, lanes_m))[0]
    assert [person[14], person[15]] == [person[0], person[1]]


def test_places_tell_two_apart_who_are_nearly_alike():
    """Mean forces of one person's steps differ by some per cent: at one step that of each is the other's."""
    weights = [(1.0, 0.92)] * 7 + [(0.92, 1.0)]
    person = persons_of(abreast(weights, [(0.0, 0.5)] * 8))[0]
    assert [person[14], person[15]] == [person[0], person[1]]


def test_a_foot_half_beside_the_floor_does_not_make_its_person_a_light_one():
    """One foot bears 40 %, on the floor; then the two change lanes."""
    weights = [(1.0, 0.8)] * 7 + [(0.4, 0.8), (1.0, 0.8)]
    person = persons_of(abreast(weights, [(0.0, 0.5)] * 8 + [(0.5, 0.0)]))[0]
    assert [person[16], person[17]] == [person[0], person[1]]


@pytest.mark.parametrize("beside_s", [1.2, 1.6, 2.1])
def test_who_turns_beside_the_floor_has_the_right_sides_on_the_way_back(beside_s):
    """Back and forth on a walkway: nobody saw how many steps the turn took, and each part begins with the left foot."""
    contacts = []
    for way in range(4):
        for step in range(6):
            at_s = way * (2.5 + beside_s) + 0.5 * step
            one = contact_at(6 * way + step, at_s, 0.3 + 0.5 * step, 0.3 + 0.06 * (-1) ** step)
            if way % 2:
                one.x_m[:], one.y_m[:] = 3.3 - one.x_m, 0.6 - one.y_m
            contacts.append(one)
    person, steps = persons_of(contacts)
    assert set(person.values()) == {1}
    assert [step.side for step in steps] == ["left", "right"] * 12
    contacts = [*contacts[:6], contacts[6]]  # who makes one step on the way back
    assert persons_of(contacts)[1][-1].side == {1.2: "right", 1.6: "left", 2.1: "right"}[beside_s]  # by time


def test_who_slows_down_to_a_third_keeps_the_sides():
    start_s = np.cumsum([0.0, *(0.45 * 1.09 ** np.arange(14))])
    made = [contact_at(step, at_s, 0.3 + 0.45 * step, 0.9 + 0.05 * (-1) ** step) for step, at_s in enumerate(start_s)]
    person, steps = persons_of(made)
    assert set(person.values()) == {1}
    assert [step.side for step in steps] == ["left" if step.contact % 2 == 0 else "right" for step in steps]


def straight(first, start_s, x_m, y_m, count):
    return [
        contact_at(first + step, start_s + 0.55 * step, x_m + 0.5 * step, y_m + 0.05 * (-1) ** step)
        for step in range(count)
    ]


def test_who_runs_is_one_person_with_steps_longer_than_any_walk_has():
    """Two run at 4 and 5 m/s, one behind the other: each foot is down for 0.2 s, and then neither is. Of one step an
    uncalibrated FSR tells the end late."""
    runners = {0: (0.0, 0.34, 2.0, 1.36), 1: (0.13, 0.3, 0.2, 1.5)}
    contacts = []
    for one, (begin_s, step_s, x_m, step_m) in runners.items():
        for step in range(7):
            made = contact_at(2 * step + one, begin_s + step_s * step, x_m + step_m * step, 0.6 + 0.05 * (-1) ** step)
            time_s = made.start_s + (made.time_s - made.start_s) / 3.0
            time_s[-1] += 0.25 * (2 * step + one == 6)
            contacts.append(msgspec.structs.replace(made, time_s=time_s, end_s=float(time_s[-1])))
    person, steps = persons_of(contacts)
    assert person == {contact: 1 + contact % 2 for contact in range(14)}
    for step in steps:
        assert step.side == ("left" if step.contact % 4 < 2 else "right")
        if step.contact > 1:
            _, step_s, _, step_m = runners[step.contact % 2]
            assert step.step_length_mm == pytest.approx(1e3 * step_m, abs=1.0)
            assert step.double_support_ms == pytest.approx(200.0 - 1e3 * step_s + 250.0 * (step.contact == 8))


def test_who_steps_off_the_floor_for_a_moment_is_the_same_person_at_once():
    left = straight(0, 0.0, 3.0, 0.2, 6)
    back = straight(6, left[-1].start_s + 2.5 * 0.55, 4.0, 1.5, 5)
    assert set(persons_of(left + back)[0].values()) == {1}


def test_who_comes_while_somebody_alike_walks_is_somebody_else():
    person = persons_of(straight(0, 0.0, 0.3, 0.2, 12) + straight(12, 2.55, 0.3, 1.5, 8))[0]
    assert {person[id] for id in range(12)} == {1}
    assert {person[id] for id in range(12, 20)} == {2}


@pytest.mark.parametrize(("support_ms", "said"), [(120.0, "both feet 120 ms"), (-415.0, "neither foot 415 ms")])
def test_the_line_of_a_person_says_which_feet_are_down(support_ms, said):
    unknown = [math.nan] * 5
    assert PersonGait(1, 4, *unknown, support_ms).line() == f"person 1: 4 steps, {said}"


def test_a_gait_is_of_four_steps_or_more_of_somebody_who_is_known():
    steps = [
        Step(k, "t1", ("left", "right")[k % 2], 0.6 * k, 600.0, 700.0, 500.0, 700.0, 300.0, 8.0, 200.0, 200.0, person=2)
        for k in range(4)
    ]
    assert [gait.person for gait in gait_of(steps)] == [2]
    assert gait_of(steps[:3]) == []
    assert gait_of([msgspec.structs.replace(step, person=0) for step in steps]) == []
    (one_legged,) = gait_of([msgspec.structs.replace(step, side="left") for step in steps])
    assert math.isnan(one_legged.stance_asymmetry_percent)


def test_the_cadence_of_who_limps_is_the_number_of_steps_in_a_minute():
    """Steps of 0.5 and 0.9 s: their rates, 120 and 67, have a mean of 93."""
    limps = [
        Step(
            k, "t1", ("left", "right")[k % 2], 0.7 * k, 600.0, 700.0, 500.0, 700.0, 300.0, 8.0, 200.0, 200.0, person=1,
            cadence_per_min=60.0 / (0.5, 0.9)[k % 2],
        )
        for k in range(20)
    ]  # fmt: skip
    (found,) = gait_of(limps)
    assert found.cadence_per_min == pytest.approx(60.0 / 0.7)


def test_the_stride_time_varies_by_its_standard_deviation_over_its_mean():
    """Strides, not steps: that one leg is slower is no variation. A step that was not seen is in no stride."""
    draw = np.random.default_rng(2)
    step_s = np.where(np.arange(60) % 2, 0.5, 0.7) + draw.normal(0.0, 0.02, 60)
    step_s[20] = math.nan
    steps = [
        Step(
            k, "t1", ("left", "right")[k % 2], 0.6 * k, 600.0, 700.0, 500.0, 700.0, 300.0, 8.0, 200.0, 200.0, person=1,
            cadence_per_min=60.0 / one_s,
        )
        for k, one_s in enumerate(step_s)
    ]  # fmt: skip
    (found,), (few,) = gait_of(steps), gait_of(steps[:30])
    strides_s = step_s[1:] + step_s[:-1]
    strides_s = strides_s[np.isfinite(strides_s)]
    assert found.stride_variation_percent == pytest.approx(100.0 * strides_s.std(ddof=1) / strides_s.mean())
    assert found.line().endswith(f"stride time varies by {found.stride_variation_percent:.1f} %")
    assert math.isnan(few.stride_variation_percent)


def test_steps_on_the_spot_and_in_turns_make_no_length_asymmetric():
    """Lengths near 0 differ by any factor: of 20 and 1 mm the symmetry index is 181 %. Before and after a turn one foot
    goes less far than the other."""
    measured = (600.0, 700.0, 500.0, 700.0, 300.0, 8.0, 200.0, 200.0)

    def stepped(left_mm, right_mm):
        return [
            Step(
                k,
                "t1",
                ("left", "right")[k % 2],
                0.6 * k,
                *measured,
                person=1,
                step_length_mm=(left_mm, right_mm)[k % 2],
            )
            for k in range(12)
        ]

    (turned,), (shuffled,) = gait_of(stepped(20.0, 1.0)), gait_of(stepped(60.0, 100.0))
    assert math.isnan(turned.length_asymmetry_percent)
    assert turned.step_length_mm == pytest.approx((6 * 20.0 + 5 * 1.0) / 11)  # without the last one
    assert shuffled.length_asymmetry_percent == pytest.approx(50.0)
    (both,) = gait_of([*stepped(20.0, 1.0), *stepped(600.0, 660.0)])
    assert both.length_asymmetry_percent == pytest.approx(200.0 * 60.0 / 1260.0)
    of_a_way = (300.0, 610.0, 600.0, 250.0, math.nan, math.nan)
    there_and_back = [
        msgspec.structs.replace(step, step_length_mm=of_a_way[k % 6]) for k, step in enumerate(stepped(0.0, 0.0) * 3)
    ]
    (walking,), (few,) = gait_of(there_and_back), gait_of(stepped(60.0, 100.0)[:11])
    assert math.isnan(few.length_asymmetry_percent)
    assert walking.length_asymmetry_percent == pytest.approx(200.0 * 10.0 / 1210.0)
    assert walking.step_length_mm == pytest.approx(440.0)


def test_many_who_walked_one_after_another_are_told_in_one_line():
    """A day in an installation: every 10 s somebody else crosses the floor with four steps."""
    totals = GaitTotals()
    measured = (600.0, 700.0, 500.0, 700.0, 300.0, 8.0, 200.0, 200.0)
    walk = [Step(k, "t1", "left" if k % 2 else "right", 0.5 * k, *measured, step_length_mm=650.0) for k in range(4)]
    for person in range(1, 8641):
        began_s = 10.0 * person
        totals.add(msgspec.structs.replace(step, person=person, start_s=began_s + step.start_s) for step in walk)
        if person == 8:
            assert [line.split(",")[0] for line in totals.lines()] == [f"person {k}: 4 steps" for k in range(1, 9)]
    assert totals.lines() == ["8640 persons of 4 steps or more: 34560 steps, length 650 mm, stance 600 ms"]
    assert len(pickle.dumps(totals)) < 10_000
