"""Drawings on the screen: where their points and ticks are, in every style and on every axis."""

import numpy as np
import pyqtgraph as pg
import pytest

from widgets.calibrate.drawing_view import DrawingColumn, DrawingPlot, linear_ticks, log_ticks
from workbench.drawing import Drawing, series


@pytest.fixture
def shown(qtbot):
    def show(drawing, size=(480, 320)):
        plot = DrawingPlot()
        qtbot.addWidget(plot)
        plot.resize(*size)
        plot.show()
        qtbot.waitExposed(plot)
        plot.show_drawing(drawing)
        return plot

    return show


def _range(plot):
    (left, right), (bottom, top) = plot.box.viewRange()
    return left, right, bottom, top


def test_every_point_is_within_the_axes(shown):
    x = np.linspace(3.0, 41.0, 50)
    plot = shown(Drawing("a", "x", "y", (series("line", x, x**2), series("dots", x, -x, "dots"))))
    left, right, bottom, top = _range(plot)
    assert left <= 3.0 < 41.0 <= right
    assert bottom <= -41.0 < 41.0**2 <= top
    assert right - left < 1.5 * 38.0


def test_a_log_axis_is_drawn_in_decades(shown):
    plot = shown(Drawing("a", "f, Hz", "y", (series("s", [20.0, 200.0, 2000.0], [1.0, 2.0, 3.0]),), x_log=True))
    curve = next(item for item in plot._items if isinstance(item, pg.PlotCurveItem))
    np.testing.assert_allclose(np.diff(curve.getData()[0]), 1.0)
    left, right, *_ = _range(plot)
    assert left <= np.log10(20.0)
    assert right >= np.log10(2000.0)


def test_what_is_not_finite_breaks_a_line_and_is_no_dot(shown):
    y = [1.0, np.nan, 2.0, -1.0]
    plot = shown(Drawing("a", "x", "y", (series("l", range(4), y), series("d", range(4), y, "dots")), y_log=True))
    curve, dots = plot._items
    assert np.isnan(curve.getData()[1]).tolist() == [False, True, False, True]
    assert len(dots.points()) == 2


@pytest.mark.parametrize("size", [(640, 240), (240, 480)])
def test_equal_axes_have_one_scale_in_any_room(shown, size):
    to = np.array([[0.1, 0.2], [-0.1, 0.05]])
    plot = shown(
        Drawing("a", "x", "y", (series("s", [0.0, -0.1], [0.0, 0.0], "arrows", "contact", to),), equal=True), size
    )
    left, right, bottom, top = _range(plot)
    across, up = plot.box.width() / (right - left), plot.box.height() / (top - bottom)
    assert across == pytest.approx(up, rel=1e-6)
    assert left < -0.1 < 0.1 < right
    assert bottom < 0.0 < 0.2 < top


def test_nothing_and_one_point_can_be_drawn(shown):
    shown(Drawing("a", "x", "y", ()))
    shown(Drawing("a", "x", "y", (series("s", [2.0], [np.nan], "dots"),), x_log=True, y_log=True))
    left, right, *_ = _range(shown(Drawing("a", "x", "y", (series("s", [2.0], [7.0], "dots"),))))
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


def test_a_column_shows_as_many_as_there_are_and_makes_plots_when_they_are_seen(qtbot):
    column = DrawingColumn()
    qtbot.addWidget(column)
    column.resize(480, 640)
    column.show()
    drawings = [Drawing(f"number {k}", "x", "y", (series("s", [0, 1], [0, k]),)) for k in range(9)]
    column.show_drawings(drawings, "nothing")
    qtbot.waitUntil(lambda: column.views[0].plot is not None and column.views[1].plot is not None)
    assert len(column.views) == 9
    assert column.views[8].plot is None
    column.ensureWidgetVisible(column.views[8])
    qtbot.waitUntil(lambda: column.views[8].plot is not None)
    column.show_drawings(drawings[:1], "nothing")
    assert [view._title.text() for view in column.views] == ["number 0"]
    column.show_drawings((), "nothing")
    assert column.views == []
