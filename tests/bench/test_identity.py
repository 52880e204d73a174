"""The measures of tracking, on cases small enough to count by hand, and what comes of simulated people."""

import numpy as np
import pytest

from underfoot.bench.identity import Tracks, identity, simulate_walk
from underfoot.floor.layout import default_floor
from underfoot.floor.simulated_people import drawn_people


def tracks(*rows):
    """Of rows (frame, id, x), all at y = 0."""
    frame, id, x = zip(*sorted(rows), strict=True) if rows else ((), (), ())
    return Tracks.of(np.array(frame, int), np.array(id, int), x, np.zeros(len(x)))


def alone(id, frames, x=0.0):
    return [(frame, id, x) for frame in frames]


def test_a_perfect_hypothesis_has_no_errors():
    truth = tracks(*alone(1, range(10)), *alone(2, range(5, 15), 1.0))
    found = tracks(*alone(8, range(10)), *alone(9, range(5, 15), 1.0))
    measured = identity(truth, found)
    assert (measured.mota, measured.idf1) == (1.0, 1.0)
    assert measured.switches == 0
    assert measured.matched == {1: {8: 10}, 2: {9: 10}}


@pytest.mark.parametrize(
    ("found", "figures"),
    [
        # The published definitions, counted by hand for ten frames of one.
        (alone(1, range(6)), (4, 0, 0, 0.6, 12 / 16)),
        (alone(1, range(5)) + alone(2, range(5, 10)), (0, 0, 1, 0.9, 10 / 20)),
        (alone(1, range(4)) + alone(1, range(6, 10)), (2, 0, 0, 0.8, 16 / 18)),
        (alone(1, range(10)) + alone(2, range(3), 5.0), (0, 3, 0, 0.7, 20 / 23)),
        (alone(1, range(10), 0.2), (10, 10, 0, -1.0, 0.0)),
        ([], (10, 0, 0, 0.0, 0.0)),
    ],
)
def test_errors_are_counted_as_published(found, figures):
    measured = identity(tracks(*alone(7, range(10))), tracks(*found))
    misses, false_positives, switches, mota, idf1 = figures
    assert (measured.misses, measured.false_positives, measured.switches) == (misses, false_positives, switches)
    assert measured.mota == pytest.approx(mota)
    assert measured.idf1 == pytest.approx(idf1)


def test_a_match_is_kept_while_it_lies_within_reach_though_another_is_nearer():
    truth = tracks(*alone(1, range(4)))
    found = tracks((0, 5, 0.0), *alone(5, range(1, 4), 0.1), *alone(6, range(1, 4), 0.01))
    measured = identity(truth, found)
    assert (measured.switches, measured.false_positives) == (0, 3)


def test_two_that_swap_are_two_switches():
    truth = tracks(*alone(1, range(10)), *alone(2, range(10), 1.0))
    found = tracks(*alone(5, range(5)), *alone(5, range(5, 10), 1.0), *alone(6, range(5), 1.0), *alone(6, range(5, 10)))
    measured = identity(truth, found)
    assert (measured.switches, measured.idf1) == (2, 0.5)


@pytest.mark.parametrize(
    "people",
    [(), drawn_people(1, "turn", 1), drawn_people(1, "straight", 1), *(drawn_people(2, "crossing", s) for s in (1, 2))],
    ids=["around", "turn", "straight", "crossing", "crossing again"],
)
def test_people_on_a_large_floor_are_told_apart_and_have_every_step_once_with_its_side(people):
    walked = simulate_walk(default_floor(6, 6), people, 20.0 / max(len(people), 1))
    assert (walked.splits, walked.joins, walked.contacts.switches) == (0, 0, 0)
    assert walked.contacts.idf1 > 0.99
    assert walked.steps == walked.sided == walked.sides_right >= walked.feet - 3
    assert walked.person_idf1 > 0.97
