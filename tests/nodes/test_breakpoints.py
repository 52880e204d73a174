"""The breakpoint envelope against straight lines by NumPy."""

import numpy as np
import pytest
from bare_row import BareRow

from underfoot.models.signals.breakpoints import thinned
from underfoot.nodes import REGISTRY

RATE = 48_000
POINTS = [(0.0, 0.25, 80.0), (0.05, 1.0, 200.0), (0.2, -0.5, 50.0), (0.3, 0.5, 50.0)]
BREAKPOINTS = REGISTRY["breakpoints"]


def curve(time_s, column):
    rows = np.array(POINTS)
    inside = (time_s >= 0.0) & (time_s <= rows[-1, 0])
    return np.where(inside, np.interp(time_s, rows[:, 0], rows[:, column]), 0.0)


def played(*starts, frames=RATE, **parameters):
    row = BareRow(BREAKPOINTS, RATE, points=POINTS, **parameters)
    row.run(0, frames, events={"start": starts})
    return row.outputs["out"], row.outputs["frequency"]


def test_level_and_frequency_are_straight_between_points_from_an_onset_between_frames():
    level, frequency = played((1000.25, 2.0, 0.0), amplitude=3.0)
    time_s = (np.arange(RATE) - 1000.25) / RATE
    np.testing.assert_allclose(level, 6.0 * curve(time_s, 1), atol=1e-9)
    np.testing.assert_allclose(frequency[1001:], curve(time_s, 2)[1001:], atol=1e-9)
    assert not level[:1000].any()
    assert not level[1000 + 14_401 :].any()


def test_at_once_it_plays_from_the_first_frame_and_only_once():
    level, _ = played(begin="at once")
    np.testing.assert_allclose(level, curve(np.arange(RATE) / RATE, 1), atol=1e-9)


@pytest.mark.parametrize("again", [4800.0, 4800.5])
def test_a_start_in_the_middle_begins_again_in_5_ms_without_a_step(again):
    level, _ = played((0.0, 1.0, 0.0), (again, 1.0, 0.0))
    assert np.abs(np.diff(level[:9600])[1:]).max() < 2.0 / 240
    settled = 4801 + 240
    np.testing.assert_allclose(level[settled:], curve((np.arange(RATE) - again) / RATE, 1)[settled:], atol=1e-9)


def test_starts_that_come_fast_do_not_add_up():
    row = BareRow(BREAKPOINTS, RATE, points=[(0.0, 0.0, 50.0), (5e-4, 1.0, 50.0), (0.1, 0.0, 50.0)])
    row.run(0, 4800, events={"start": [(24.0 * k, 1.0, 0.0) for k in range(200)]})
    assert 0.9 < np.abs(row.outputs["out"]).max() <= 1.0


@pytest.mark.parametrize("points", [[], [(0.1, 1.0, 100.0)], [(0.0, 1.0, 100.0), (0.0, 0.5, 100.0)]])
def test_curves_of_no_length_are_finite_and_end(points):
    row = BareRow(BREAKPOINTS, RATE, points=points)
    row.run(0, RATE, events={"start": [(0.0, 1.0, 0.0)]})
    assert np.isfinite(row.outputs["out"]).all()
    assert row.outputs["out"][-1] == 0.0


def test_thinned_points_stay_within_the_tolerance():
    time_s = np.linspace(0.0, 1.0, 500)
    points = np.column_stack([time_s, np.sin(9.0 * time_s), 100.0 + 50.0 * time_s**2])
    lean = thinned(points, np.array([0.01, 1.0]), 500)
    assert len(lean) < 60
    for column, tolerance in ((1, 0.01), (2, 1.0)):
        assert np.abs(np.interp(time_s, lean[:, 0], lean[:, column]) - points[:, column]).max() <= tolerance + 1e-12
    assert len(thinned(points, np.array([0.0, 0.0]), 20)) <= 20
    allowed = [thinned(points, factor * np.array([0.001, 0.1]), 500) for factor in (1, 2, 4, 8)]
    assert [len(rows) > 50 for rows in allowed] == [True, True, True, False]  # doubled until they are few enough
    np.testing.assert_array_equal(thinned(points, np.array([0.001, 0.1]), 50), allowed[3])
    inner = np.array([[0.0, 0.0], [1.0, 1.0], [2.0, -0.9], [4.0, 0.0]])  # the second is further off than the first
    assert len(thinned(inner, np.array([0.5]), 3)) == 2
