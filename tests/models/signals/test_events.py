"""Lists of events: what is put into them, and what becomes of events that share a frame."""

import numpy as np
import pytest
from event_rows import rows_of
from hypothesis import given
from hypothesis import strategies as st

from underfoot.models.signals.events import EVENTS, append, emit, event_list, events_at


def test_a_list_has_the_events_that_it_was_made_of():
    events = event_list((3.25, 2.0), (7.0, -1.0, 0.5), room=4)
    assert rows_of(events).tolist() == [[3.25, 2.0, 0.0], [7.0, -1.0, 0.5]]
    assert (len(events), events.room, events.capacity) == (2, 4, 4.0)
    assert len(event_list()) == 0
    assert event_list(*rows_of(events)).room == 2


def test_what_is_appended_stands_at_the_end():
    events = event_list((3.25, 2.0), room=3)
    append(events, 4.0, 5.0, 0.25)
    append(events, 6.0, 7.0)
    assert rows_of(events).tolist() == [[3.25, 2.0, 0.0], [4.0, 5.0, 0.25], [6.0, 7.0, 0.0]]


def test_events_that_share_a_frame_become_one_at_their_weighted_time():
    events = event_list(room=4)
    for event in ((5.0, 1.0, 0.1), (5.5, 3.0, 0.3), (5.75, 0.0, 0.2), (6.0, 1.0, 0.0)):
        emit(events, *event)
    assert rows_of(events).tolist() == [[5.375, 4.0, 0.3], [6.0, 1.0, 0.0]]


def test_strengths_that_cancel_leave_an_event_of_none_where_the_first_was():
    events = event_list(room=2)
    emit(events, 5.25, 2.0)
    emit(events, 5.75, -2.0)
    assert rows_of(events).tolist() == [[5.25, 0.0, 0.0]]


def test_strengths_that_nearly_cancel_stay_in_their_frame():
    events = event_list(room=2)
    emit(events, 5.25, 2.0)
    emit(events, 5.75, -1.5)
    assert np.floor(rows_of(events)[:, 0]).tolist() == [5.0]


@given(st.lists(st.tuples(st.floats(0.0, 40.0), st.floats(0.01, 10.0), st.floats(0.0, 1.0)), max_size=60))
def test_one_event_a_frame_is_left_with_all_strength_and_the_same_first_moment(drawn):
    drawn = sorted(drawn)
    events = event_list(room=60)
    for event in drawn:
        emit(events, *event)
    left, given_rows = rows_of(events), np.array(drawn).reshape(-1, 3)
    frames = np.floor(given_rows[:, 0])
    assert np.floor(left[:, 0]).tolist() == np.unique(frames).tolist()
    for (time, strength, duration), frame in zip(left, np.unique(frames), strict=True):
        here = given_rows[frames == frame]
        assert strength == pytest.approx(here[:, 1].sum(), rel=1e-12)
        assert time == pytest.approx(np.average(here[:, 0], weights=here[:, 1]), rel=1e-12)
        assert duration == here[:, 2].max()


def test_the_driver_finds_a_list_by_its_values_alone():
    events = event_list((1.0, 2.0), room=3)
    assert EVENTS.size({"room": 3}) == events.values.size
    assert events.values[list(EVENTS.parts).index("count")] == 1.0
    assert events.values[list(EVENTS.parts).index("capacity")] == 3.0
    assert events_at is EVENTS.at
