"""Drawings on the screen: their points and ticks are where the axes say, as in a report; live ones keep their frame."""

import math
import re

import numpy as np
import pytest
from msgspec.structs import replace
from on_screen import show
from PySide6.QtCore import QPoint, Qt

from underfoot.drawing import Drawing, HeatMap, ReferenceLine, series
from underfoot.drawing.layout import Margins
from underfoot.drawing.look import heat_table, rgb
from underfoot.drawing.svg import HEIGHT, WIDTH, svg
from underfoot.widgets import theme
from underfoot.widgets.plots.plot import Plot

LIVE = Drawing("a", "time, s", "force, N", x_range=(-5.0, 0.0), y_range=(0.0, 100.0))


@pytest.fixture
def shown(qtbot):
    def shows(drawing, size=(480, 320), margins=None):
        plot = Plot("", margins)
        qtbot.addWidget(plot)
        plot.resize(*size)
        show(qtbot, plot)
        plot.show_drawing(drawing)
        return plot

    return shows


def pixel(plot, x, y):
    """The colour of the pixel at a point of the axes."""
    across, up = np.floor(plot.place(np.array([[x, y]]))[0]).astype(int).tolist()
    return plot.grab().toImage().pixelColor(across, up).getRgb()[:3]


def ink(plot, x, y):
    """How far the pixels at a point of the axes are from the empty ground, 0 to 255."""
    across, up = np.round(plot.place(np.array([[x, y]]))[0]).astype(int).tolist()
    image = plot.grab().toImage()
    pixels = [image.pixelColor(across + i, up + j).getRgb()[:3] for i in (-1, 0) for j in (-1, 0)]
    return int(np.abs(np.array(pixels) - rgb(theme.GROUND)).max())


def test_points_are_where_the_axes_say(shown):
    plot = shown(Drawing("a", "x", "y", (series("s", [1.3, 5.1, 8.7], [2.2, 7.7, 3.3], "dots"),)))
    for x, y in ((1.3, 2.2), (5.1, 7.7), (8.7, 3.3)):
        assert ink(plot, x, y) > 100
        assert ink(plot, x, y + 0.7) < 40


def test_a_log_axis_is_drawn_in_decades(shown):
    plot = shown(Drawing("a", "f, Hz", "y", (series("s", [30.0, 300.0, 3000.0], [1.1, 2.1, 3.1], "dots"),), x_log=True))
    for x, y in ((30.0, 1.1), (300.0, 2.1), (3000.0, 3.1)):
        assert ink(plot, x, y) > 100
    first, second, third = plot.place(np.array([[30.0, 1.0], [300.0, 1.0], [3000.0, 1.0]]))[:, 0]
    assert second - first == pytest.approx(third - second)
    left, right, *_ = plot.ranges
    assert left <= 30.0 < 3000.0 <= right


def test_what_is_not_finite_breaks_a_line_and_is_no_dot(shown):
    y = [1.5, np.nan, 1.5, 1.5, -1.0, 2.5]
    line = shown(Drawing("a", "x", "y", (series("l", range(6), y),), y_log=True))
    assert ink(line, 2.5, 1.5) > 80
    assert ink(line, 0.5, 1.5) < 40
    assert ink(line, 3.5, 1.5) < 40
    dots = shown(Drawing("a", "x", "y", (series("d", range(6), y, "dots"),), y_log=True))
    assert [ink(dots, x, 1.5) > 100 for x in range(5)] == [True, False, True, True, False]


def test_a_long_line_keeps_its_peaks(shown):
    y = np.zeros(50_000)
    y[31_234] = 9.0
    plot = shown(Drawing("a", "x", "y", (series("l", np.arange(50_000.0), y),)))
    assert max(ink(plot, x, 6.1) for x in range(31_100, 31_400, 20)) > 60


def test_arrows_end_in_a_dot(shown):
    plot = shown(Drawing("a", "x", "y", (series("s", [1.1], [1.1], "arrows", "contact", [[3.1, 2.1]]),)))
    assert ink(plot, 3.1, 2.1) > 100
    assert ink(plot, 2.1, 1.6) > 60


def test_a_report_shows_the_same_points_at_the_same_pixels(shown):
    x, y = [1.3, 5.1, 8.7], [2.2, 7.7, 3.3]
    drawing = Drawing("Same", "x, m", "y, N", (series("", x, y, "dots"),))
    plot = shown(drawing, (WIDTH, HEIGHT))
    circles = re.findall(r'<circle cx="([\d.]+)" cy="([\d.]+)"', svg(drawing))
    np.testing.assert_allclose(np.array(circles, float), plot.place(np.column_stack([x, y])), atol=0.06)


def test_a_heat_map_is_coloured_by_its_levels_with_the_first_row_below(shown):
    levels = np.array([[0, 0], [255, 128]], np.uint8)
    plot = shown(Drawing("a", "x", "y", heat=HeatMap(levels, (0.0, 2.0), (0.0, 2.0)), x_range=(0, 2), y_range=(0, 2)))
    assert pixel(plot, 0.55, 1.45) == tuple(heat_table()[255][:3].tolist())
    assert pixel(plot, 1.55, 1.45) == tuple(heat_table()[128][:3].tolist())
    assert pixel(plot, 0.55, 0.45) == rgb(theme.GROUND)


def test_a_heat_area_has_the_colours_of_a_heat_map_from_left_to_right(shown):
    line = (series("", [100.0, 100.0], [0.0, 1.0], "heat", "muted"),)
    plot = shown(Drawing("a", "x", "y", line, x_range=(0.0, 100.0), y_range=(0.0, 1.0)))
    for share in (0.13, 0.51, 0.88):
        colour = heat_table()[round(255 * share)][:3].astype(int)
        assert np.abs(np.array(pixel(plot, 100.0 * share, 0.517)) - colour).max() <= 12


def test_what_is_beyond_a_given_range_is_not_painted(shown):
    plot = shown(Drawing("a", "x", "y", (series("", [-9.0, 9.0], [1.1, 1.1]),), x_range=(0.0, 5.0), y_range=(0.0, 2.0)))
    assert ink(plot, 2.6, 1.1) > 80
    assert ink(plot, 5.2, 1.1) < 40


def test_a_live_plot_keeps_its_frame_until_it_looks_different(shown):
    plot = shown(LIVE, margins=Margins())
    frame = plot.frame
    curve = series("", [-4.0, -1.0], [55.0, 55.0])
    plot.show_drawing(replace(LIVE, series=(curve,), lines=(ReferenceLine("x", -2.0),)))
    assert plot.frame is frame
    assert ink(plot, -3.3, 55.0) > 80
    plot.show_drawing(replace(LIVE, y_range=(0.0, 200.0)))
    assert plot.ranges == (-5.0, 0.0, 0.0, 200.0)
    plot.resize(600, 300)
    assert plot.frame.area.right > frame.area.right
    plot.set_margins(Margins(left=8.0))
    assert plot.frame.area.left == 8.0


def test_the_mouse_tells_its_place_along_the_axis_and_that_it_has_left(shown, qtbot):
    plot = shown(LIVE, margins=Margins())
    said = []
    plot.hovered.connect(said.append)
    middle = plot.place(np.array([[-2.5, 50.0]]))[0].round().astype(int).tolist()
    qtbot.mouseMove(plot, QPoint(*middle))
    qtbot.mouseMove(plot, QPoint(2, middle[1]))
    assert said[0] == pytest.approx(-2.5, abs=0.02)
    assert math.isnan(said[1])


def test_a_pointer_is_drawn_and_taken_away(shown):
    plot = shown(LIVE, margins=Margins())
    assert pixel(plot, -1.3, 31.0) == rgb(theme.GROUND)
    plot.point_at(-1.3)
    assert pixel(plot, -1.3, 31.0) == rgb(theme.MUTED)
    plot.point_at(math.nan)
    assert pixel(plot, -1.3, 31.0) == rgb(theme.GROUND)


def test_a_drawing_says_what_it_is_to_who_cannot_see_it(shown):
    plot = shown(Drawing("Creep", "time, s", "force, N"))
    assert plot.accessibleName() == "Creep: force, N over time, s"
    assert plot.focusPolicy() == Qt.FocusPolicy.NoFocus
