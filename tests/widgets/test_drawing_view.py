"""Drawings on the screen: where their points and ticks are, in every style and on every axis."""

from itertools import pairwise

import numpy as np
import pytest
from on_screen import show

from underfoot.drawing import Drawing, series
from underfoot.widgets import theme
from underfoot.widgets.calibrate.drawing_plot import DrawingPlot, linear_ticks, log_ticks
from underfoot.widgets.calibrate.drawing_view import DrawingColumn


@pytest.fixture
def shown(qtbot):
    def shows(drawing, size=(480, 320)):
        plot = DrawingPlot()
        qtbot.addWidget(plot)
        plot.resize(*size)
        show(qtbot, plot)
        plot.show_drawing(drawing)
        return plot

    return shows


def _ink(plot, x, y):
    """How far the pixels at a point of the axes are from the empty ground, 0 to 255."""
    across, up = np.round(plot.place(np.array([[x, y]]))[0]).astype(int).tolist()
    image, ground = plot.grab().toImage(), [int(theme.GROUND[k : k + 2], 16) for k in (1, 3, 5)]
    pixels = [image.pixelColor(across + i, up + j).getRgb()[:3] for i in (-1, 0) for j in (-1, 0)]
    return int(np.abs(np.array(pixels) - ground).max())


def test_every_point_is_within_the_axes(shown):
    x = np.linspace(3.0, 41.0, 50)
    plot = shown(Drawing("a", "x", "y", (series("line", x, x**2), series("dots", x, -x, "dots"))))
    left, right, bottom, top = plot.ranges
    assert left <= 3.0 < 41.0 <= right
    assert bottom <= -41.0 < 41.0**2 <= top
    assert right - left < 1.5 * 38.0
    assert plot.area.contains(*plot.place(np.array([[41.0, 41.0**2]]))[0])


def test_points_are_where_the_axes_say(shown):
    plot = shown(Drawing("a", "x", "y", (series("s", [1.3, 5.1, 8.7], [2.2, 7.7, 3.3], "dots"),)))
    for x, y in ((1.3, 2.2), (5.1, 7.7), (8.7, 3.3)):
        assert _ink(plot, x, y) > 100
        assert _ink(plot, x, y + 0.7) < 40


def test_a_log_axis_is_drawn_in_decades(shown):
    plot = shown(Drawing("a", "f, Hz", "y", (series("s", [30.0, 300.0, 3000.0], [1.1, 2.1, 3.1], "dots"),), x_log=True))
    for decade, y in ((0, 1.1), (1, 2.1), (2, 3.1)):
        assert _ink(plot, np.log10(30.0) + decade, y) > 100
    left, right, *_ = plot.ranges
    assert left <= np.log10(30.0)
    assert right >= np.log10(3000.0)


def test_what_is_not_finite_breaks_a_line_and_is_no_dot(shown):
    y = [1.5, np.nan, 1.5, 1.5, -1.0, 2.5]
    line = shown(Drawing("a", "x", "y", (series("l", range(6), y),), y_log=True))
    at = np.log10(1.5)
    assert _ink(line, 2.5, at) > 80
    assert _ink(line, 0.5, at) < 40
    assert _ink(line, 3.5, at) < 40
    dots = shown(Drawing("a", "x", "y", (series("d", range(6), y, "dots"),), y_log=True))
    assert [_ink(dots, x, at) > 100 for x in range(5)] == [True, False, True, True, False]


def test_a_long_line_is_thinned_and_keeps_its_peaks(shown):
    y = np.zeros(50_000)
    y[31_234] = 9.0
    plot = shown(Drawing("a", "x", "y", (series("l", np.arange(50_000.0), y),)))
    assert max(_ink(plot, x, 6.1) for x in range(31_100, 31_400, 20)) > 60


def test_arrows_end_in_a_dot(shown):
    plot = shown(Drawing("a", "x", "y", (series("s", [1.1], [1.1], "arrows", "contact", [[3.1, 2.1]]),)))
    assert _ink(plot, 3.1, 2.1) > 100
    assert _ink(plot, 2.1, 1.6) > 60


@pytest.mark.parametrize("size", [(640, 240), (240, 480)])
def test_equal_axes_have_one_scale_in_any_room(shown, size):
    to = np.array([[0.1, 0.2], [-0.1, 0.05]])
    plot = shown(
        Drawing("a", "x", "y", (series("s", [0.0, -0.1], [0.0, 0.0], "arrows", "contact", to),), equal=True), size
    )
    left, right, bottom, top = plot.ranges
    across, up = plot.area.width() / (right - left), plot.area.height() / (top - bottom)
    assert across == pytest.approx(up, rel=1e-6)
    assert left < -0.1 < 0.1 < right
    assert bottom < 0.0 < 0.2 < top


def test_nothing_and_one_point_can_be_drawn(shown):
    shown(Drawing("a", "x", "y", ()))
    shown(Drawing("a", "x", "y", (series("s", [2.0], [np.nan], "dots"),), x_log=True, y_log=True))
    left, right, *_ = shown(Drawing("a", "x", "y", (series("s", [2.0], [7.0], "dots"),))).ranges
    assert left < 2.0 < right


@pytest.mark.parametrize(("low", "high"), [(0.3, 41.0), (-3e-5, 2e-4), (0.0, 65535.0), (1e5, 1e5 + 1.0)])
def test_linear_ticks_enclose_the_range_at_round_places(low, high):
    places = np.array([at for at, _ in linear_ticks(low, high, 6.0)])
    step = places[1] - places[0]
    assert places[0] <= low + 1e-6 * step
    assert places[-1] >= high - 1e-6 * step
    assert 3 <= len(places) <= 14
    np.testing.assert_allclose(np.diff(places), step)


@pytest.mark.parametrize(("low", "high"), [(1.3, 3.3), (-3.0, 4.0), (1.7, 1.9), (2.0, 2.3)])
def test_log_ticks_enclose_the_range(low, high):
    places = [at for at, _ in log_ticks(low, high, 6.0)]
    assert places[0] <= low + 1e-6
    assert places[-1] >= high - 1e-6
    assert len(places) <= 12


def test_a_column_shows_as_many_as_there_are(qtbot):
    column = DrawingColumn()
    qtbot.addWidget(column)
    column.resize(480, 640)
    show(qtbot, column)
    drawings = [Drawing(f"number {k}", "x", "y", (series("s", [0, 1], [0, k]),)) for k in range(9)]
    column.show_drawings(drawings, "nothing")
    qtbot.waitUntil(lambda: len(column.views) == 9)
    assert [view.title.text() for view in column.views] == [drawing.title for drawing in drawings]
    places = [view.geometry() for view in column.views]
    assert all(above.bottom() < below.top() for above, below in pairwise(places))
    column.show_drawings(drawings[:1], "nothing")
    assert [view.title.text() for view in column.views] == ["number 0"]
    column.show_drawings((), "nothing")
    assert column.views == []
    assert column._nothing.text() == "nothing"
