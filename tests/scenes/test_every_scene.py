"""What holds for every scene that there is: bounded, the same for the same forces, and untroubled by any floor."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.errors import BadValue
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.scenes import discover
from underfoot.scenes.cues import Play, Set, Strike
from underfoot.scenes.moments import MOMENT_S, MOST_CONTACTS, Moment, Moments
from underfoot.scenes.rehearsal import rehearse
from underfoot.scenes.scene import values_of
from underfoot.scenes.shapes import MOST_LINES, MOST_SHAPES, Disc, Lines, Polygon, Text

KINDS = pytest.mark.parametrize("kind", discover().values(), ids=discover().keys())
SMALL, LARGE = default_floor(), default_floor(6, 6)


def check_shapes(scene):
    """What a scene shows is bounded, finite, and of colours that there are."""
    shapes = list(scene.shapes())
    assert len(shapes) <= MOST_SHAPES
    assert sum(len(shape.ends_m) for shape in shapes if isinstance(shape, Lines)) <= MOST_LINES
    for shape in shapes:
        numbers = {
            Lines: lambda s: [s.ends_m, s.width_m],
            Disc: lambda s: [s.x_m, s.y_m, s.radius_m, s.rim_m],
            Polygon: lambda s: [s.points_m],
            Text: lambda s: [s.x_m, s.y_m, s.height_m],
        }[type(shape)](shape)
        assert all(np.isfinite(number).all() for number in numbers)
        assert 0.0 <= shape.opacity <= 1.0
        assert len(bytes.fromhex(shape.colour.removeprefix("#"))) == 3
    return shapes


def check_cues(scene, cues):
    """Cues are for what there is, within its ranges."""
    patch = scene.patch(REGISTRY)
    for cue in cues:
        match cue:
            case Strike(node, strength=strength):
                assert patch.node(node).type == "strike"
                assert 0.0 <= strength <= 1.0
                assert cue.command(scene.floor, 0.0).tile in scene.floor.ids
            case Set(node, name, value):
                patch.set(node, name, value, REGISTRY)
            case Play():
                assert 0.0 <= cue.gain <= 1.0
                cue.beside(patch, scene.floor, REGISTRY)


def seen(shape):
    return [np.asarray(value).tolist() for value in vars(shape).values()]


@KINDS
def test_a_scene_declares_what_people_read(kind):
    assert kind.title
    assert kind.doc.endswith(".")
    assert kind.picture() is not None
    assert all(parameter.doc for parameter in kind.parameters.values())
    kind.patch(REGISTRY).check(REGISTRY)
    assert values_of(kind, []) == {}
    with pytest.raises(BadValue, match="allowed"):
        kind(SMALL, {"nothing": 1})


@KINDS
@pytest.mark.parametrize("floor", [SMALL, LARGE], ids=["2x2", "6x6"])
def test_the_same_walk_gives_the_same_scene(kind, floor):
    def done():
        scene = kind(floor)
        found = rehearse(scene, SimulatedFloor(floor), 2.0)
        check_cues(scene, [cue for _, cue in found.cues])
        return found.cues, scene.state, [seen(shape) for shape in check_shapes(scene)]

    (cues, state, shapes), (others, other_state, other_shapes) = done(), done()
    assert (repr(cues), state) == (repr(others), other_state)  # a time that is not a number equals none
    assert shapes == other_shapes


@KINDS
def test_nobody_comes(kind):
    scene = kind(SMALL)
    found = rehearse(scene, SimulatedFloor(SMALL, walking=False), 0.5)
    assert not any(isinstance(cue, Strike) for _, cue in found.cues)
    check_shapes(scene)


@st.composite
def contacts(draw):
    """What might stand on the large floor at one moment: known and new ids, anywhere, as heavy as may be."""
    ids = draw(st.lists(st.integers(1, 30), unique=True, max_size=MOST_CONTACTS))
    place, force = st.floats(-1.5, 1.5), st.floats(1.0, 5000.0)
    return tuple(OngoingContact(id, draw(place), draw(place), draw(force), (0,), 0.0) for id in ids)


@KINDS
@settings(max_examples=10, suppress_health_check=list(HealthCheck))
@given(st.lists(contacts(), min_size=1, max_size=30), st.integers(0, 1000))
def test_contacts_may_come_jump_and_vanish_as_they_like(kind, all_contacts, seed):
    scene = kind(LARGE, seed=seed)
    before = {}
    for k, standing in enumerate(all_contacts):
        now = {contact.id: contact for contact in standing}
        down = tuple(contact for id, contact in now.items() if id not in before)
        up = tuple(contact for id, contact in before.items() if id not in now)
        check_cues(scene, scene.step(Moment((k + 1) * MOMENT_S, standing, down, up)))
        check_shapes(scene)
        before = now


@KINDS
def test_parameters_at_their_ends_are_played(kind):
    for end in ("low", "high"):
        given = {name: getattr(p, end) for name, p in kind.parameters.items() if p.kind in ("number", "count")}
        scene = kind(SMALL, given)
        found = rehearse(scene, SimulatedFloor(SMALL), 2.0)
        check_cues(scene, [cue for _, cue in found.cues])
        check_shapes(scene)


def test_moments_do_not_depend_on_how_forces_are_cut():
    def moments(block):
        made, source = Moments(LARGE, 48_000.0, 1000.0), SimulatedFloor(LARGE)
        found = []
        for end in range(block, 48_000 * 3, block):
            count = source.pull(end)
            found += made.feed(source.stamps[:count], source.forces[:count])
        return found

    some, others = moments(480), moments(7_777)
    assert repr(some[: len(others)]) == repr(others[: len(some)])
    assert sum(len(moment.down) for moment in some) >= 4


def test_a_foot_on_a_tile_that_falls_silent_is_lifted():
    """As in the engine, after more than 40 ms: it stood there until the tile sent again."""
    made, force_n = Moments(SMALL, 48_000.0, 1000.0), np.zeros((3000, len(SMALL.tiles), 4))
    force_n[1000:, 0] = 150.0
    force_n[2000:, 0] = np.nan  # at the beginning of a moment
    found = list(made.feed(np.arange(3000) * 48.0, force_n))
    assert [round(moment.time_s, 2) for moment in found if moment.down] == [1.01]
    assert [round(moment.time_s, 2) for moment in found if moment.up] == [2.05]


def test_on_a_floor_that_falls_silent_nobody_stands_any_more():
    """The same where it is told by the clock, and where it is by the next sample."""
    frames, force_n = np.arange(3000) * 48.0, np.zeros((3000, len(SMALL.tiles), 4))
    force_n[1000:, 0] = 150.0
    frames[2000:] += 48_000.0

    def moments(now_s):
        made = Moments(SMALL, 48_000.0, 1000.0)
        for piece in (slice(0, 2000), slice(2000, 3000)):
            yield from made.feed(frames[piece], force_n[piece])
            yield from made.pass_time(now_s)

    told, found = list(moments(2.6)), list(moments(0.0))
    assert repr(told) == repr(found)
    (lifted,) = (at for at, moment in enumerate(told) if moment.up)
    assert [round(moment.time_s, 2) for moment in told[lifted - 1 : lifted + 2]] == [2.0, 2.49, 3.01]
    assert [len(moment.contacts) > 0 for moment in told[lifted - 1 : lifted + 2]] == [True, False, True]


def test_no_moment_goes_back_where_samples_come_after_their_silence():
    """As over TCP, which sends what waited: a scene saw half a second twice."""
    frames, force_n = np.arange(4000) * 48.0, np.zeros((4000, len(SMALL.tiles), 4))
    force_n[200:850, 0] = force_n[800:2800, 1] = 150.0
    made = Moments(SMALL, 48_000.0, 1000.0)
    found = [*made.feed(frames[:2505], force_n[:2505]), *made.pass_time(3.3), *made.feed(frames[2505:], force_n[2505:])]
    numbers = [round(100.0 * moment.time_s) for moment in found]
    assert numbers == [*range(1, 252), 300, *range(301, 400)]
    assert [round(moment.time_s, 2) for moment in found if moment.up] == [0.86, 3.0]
    assert [round(moment.time_s, 2) for moment in found if moment.steps] == [3.01]


def test_a_foot_keeps_its_id_over_an_edge_and_the_next_one_has_another():
    source = SimulatedFloor(LARGE)
    made, found = Moments(LARGE, 48_000.0, 1000.0), []
    for end in range(480, 48_000 * 10, 480):
        count = source.pull(end)
        found += made.feed(source.stamps[:count], source.forces[:count])
    ids = [contact.id for moment in found for contact in moment.down]
    steps = np.count_nonzero(source.footfalls["start_s"] < found[-1].time_s)
    assert ids == list(range(1, len(ids) + 1))
    assert 0.9 * steps <= len(ids) <= 1.2 * steps  # at once, a foot over an edge may look like two
    assert max(len(contact.tiles) for moment in found for contact in moment.contacts) > 1  # some lie on edges


APART = [f"t{6 * row + column + 1}" for row in (0, 2, 4) for column in (0, 2, 4)] + ["t6", "t18", "t32", "t34", "t36"]


def of_loads(*loads):
    """Moments of loads on the large floor (tile, newtons, first sample at 1 kHz, end), and what made them."""
    force_n = np.zeros((400, len(LARGE.tiles), 4))
    for tile, newtons, first, end in loads:
        force_n[first:end, LARGE.index(tile)] = newtons / 4.0
    made = Moments(LARGE, 48_000.0, 1000.0)
    return list(made.feed(48.0 * np.arange(400), force_n)), made


def test_of_more_than_the_most_contacts_the_heaviest_are_told_the_heaviest_first():
    loads_n = [100.0 + 20.0 * k for k in range(len(APART))]
    found, _ = of_loads(*((tile, newtons, 100, 300) for tile, newtons in zip(APART, loads_n, strict=True)))
    told = [[contact.force_n for contact in moment.contacts] for moment in found[12:28]]
    np.testing.assert_allclose(told, [loads_n[: -MOST_CONTACTS - 1 : -1]] * len(told))


def test_a_foot_that_lands_within_the_moment_in_which_another_lifts_is_another():
    found, _ = of_loads(("t1", 300.0, 100, 202), ("t1", 300.0, 205, 300))
    changes = {k: ([c.id for c in m.down], [c.id for c in m.up]) for k, m in enumerate(found) if m.down or m.up}
    assert changes == {10: ([1], []), 20: ([2], [1]), 30: ([], [2])}


def test_an_engine_that_began_anew_has_moments_from_its_first_frame_on():
    _, made = of_loads(("t1", 300.0, 100, 400))
    again = list(made.feed(48.0 * np.arange(50), np.zeros((50, len(LARGE.tiles), 4))))
    assert [round(moment.time_s, 3) for moment in again[-4:]] == [0.01, 0.02, 0.03, 0.04]
