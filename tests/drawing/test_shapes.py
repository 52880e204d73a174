"""What series are painted of."""

import numpy as np
import pytest

from underfoot.drawing import series
from underfoot.drawing.axes import Axis
from underfoot.drawing.shapes import Dots, HeatArea, Polyline, Segments, shapes_of

ACROSS, UP = Axis(0.0, 100.0, False, 0.0, 1000.0), Axis(0.0, 10.0, False, 500.0, 0.0)
LOG = Axis(1.0, 1000.0, True, 0.0, 300.0)


def test_a_line_goes_through_its_points_and_is_broken_where_one_is_missing():
    y = [1.0, 2.0, np.nan, 3.0, 4.0, 5.0]
    first, second = shapes_of(series("s", range(6), y), ACROSS, UP)
    np.testing.assert_allclose(first.points, [[0.0, 450.0], [10.0, 400.0]])
    np.testing.assert_allclose(second.points[:, 0], [30.0, 40.0, 50.0])


def test_what_a_log_axis_cannot_show_is_left_out():
    one = series("s", [-1.0, 0.0, 1.0, 10.0, 100.0], [5.0] * 5, "dots")
    (dots,) = shapes_of(one, LOG, UP)
    np.testing.assert_allclose(dots.points[:, 0], [0.0, 100.0, 200.0])


def test_a_long_line_is_thinned_and_keeps_its_peaks():
    y = np.zeros(50_000)
    y[31_234] = 9.0
    (line,) = shapes_of(series("s", np.linspace(0.0, 100.0, y.size), y), ACROSS, UP)
    assert len(line.points) <= 2002
    assert line.points[:, 1].min() == pytest.approx(50.0)
    assert line.points[line.points[:, 1].argmin(), 0] == pytest.approx(624.7, abs=1.0)


def test_a_long_line_is_not_broken_where_a_log_axis_spreads_it():
    x = np.linspace(1.0, 1000.0, 20_000)
    (line,) = shapes_of(series("s", x, np.full(x.size, 2.0)), LOG, UP)
    assert np.isfinite(line.points).all()
    assert line.points[0, 0] < 1.0
    assert line.points[-1, 0] > 299.0


def test_a_long_loop_keeps_its_shape():
    turn = np.linspace(0.0, 2.0 * np.pi, 40_001)
    (line,) = shapes_of(series("s", 50.0 + 40.0 * np.cos(turn), 5.0 + 4.0 * np.sin(turn)), ACROSS, UP)
    assert len(line.points) < 12_000
    np.testing.assert_allclose(line.points.min(axis=0), [100.0, 50.0], atol=0.6)
    np.testing.assert_allclose(line.points.max(axis=0), [900.0, 450.0], atol=0.6)
    np.testing.assert_allclose(line.points[0], line.points[-1], atol=0.6)


def test_there_is_one_dot_a_pixel():
    (dots,) = shapes_of(series("s", [10.0] * 1000, [5.0] * 1000, "dots"), ACROSS, UP)
    assert dots.points.tolist() == [[100.0, 250.0]]


def test_arrows_end_in_a_dot_and_both_ends_must_be_there():
    to = [[30.0, 5.0], [np.nan, 1.0]]
    shafts, heads = shapes_of(series("s", [10.0, 20.0], [1.0, 1.0], "arrows", to=to), ACROSS, UP)
    assert isinstance(shafts, Segments)
    assert isinstance(heads, Dots)
    np.testing.assert_allclose(shafts.ends, [[[100.0, 450.0], [300.0, 250.0]]])
    np.testing.assert_allclose(heads.points, [[300.0, 250.0]])


def test_stems_stand_on_the_bottom_of_the_axes():
    (stems,) = shapes_of(series("s", [10.0, np.nan], [5.0, 1.0], "stems"), ACROSS, UP)
    np.testing.assert_allclose(stems.ends, [[[100.0, 500.0], [100.0, 250.0]]])


def test_heat_fills_from_the_left_end_of_the_axis_to_the_line():
    area, line = shapes_of(series("s", [60.0, 20.0], [2.0, 8.0], "heat"), ACROSS, UP)
    assert isinstance(area, HeatArea)
    assert isinstance(line, Polyline)
    assert (area.left, area.right) == (0.0, 1000.0)
    np.testing.assert_allclose(area.points, [[600.0, 400.0], [200.0, 100.0], [0.0, 100.0], [0.0, 400.0]])
