"""Where title, legend, axes and texts of a drawing stand, with words of a known width."""

from itertools import pairwise

import numpy as np
import pytest
from msgspec.structs import replace

from underfoot.drawing import Drawing, HeatMap, ReferenceLine, Series, series
from underfoot.drawing.layout import AXIS_PX, Margins, content_of, frame_of
from underfoot.drawing.shapes import Area, Backdrop, Dots, HeatImage, Polyline, Segments, Text
from underfoot.drawing.table import csv

LIVE = Drawing(
    "force",
    "time, s",
    "force, N",
    (series("", [-4.0, -1.0], [0.0, 700.0]),),
    x_range=(-5.0, 0.0),
    y_range=(-100.0, 1000.0),
)


def measure(text, size_px, *, bold=False):
    return 6.0 * len(text)


def texts(frame):
    return {shape.text: shape for shape in frame.shapes if isinstance(shape, Text)}


def framed(drawing, width=640, height=400, margins=None):
    return frame_of(drawing, width, height, measure, margins)


def test_a_drawing_has_its_title_labels_and_legend_around_the_axes():
    lines = tuple(series(name, [0, 1], [0, 1]) for name in ("first", "second", ""))
    lines += (Series("one of many", *lines[0].x[None].repeat(2, 0), in_legend=False),)
    frame = framed(Drawing("Title", "time, s", "level, m/s^2", lines))
    words = texts(frame)
    assert "one of many" not in words
    assert {"Title", "time, s →", "↑ level, m/s²", "first", "second"} <= words.keys()
    assert words["Title"].y < words["first"].y == words["second"].y < words["↑ level, m/s²"].y < frame.area.top
    assert words["time, s →"].y > words["0"].y > frame.area.bottom
    keys = [shape for shape in frame.shapes if isinstance(shape, Polyline)]
    assert len(keys) == 2
    assert keys[1].points[:, 0].min() > words["first"].x + measure("first", 11)


def test_points_have_their_labels_beside_them_and_within_the_axes():
    dots = replace(series("", [0.0, 0.5, 1.0], [0.0, np.nan, 1.0], "dots"), labels=("sand", "lost", "gravel"))
    drawing = Drawing("Map", "x", "y", (dots,), x_range=(0.0, 1.0), y_range=(0.0, 1.0))
    frame = framed(drawing)
    left, right = (shape for shape in content_of(drawing, frame, measure) if isinstance(shape, Text))
    assert (left.text, left.anchor, right.text, right.anchor) == ("sand", "start", "gravel", "end")
    assert frame.area.left < left.x < right.x < frame.area.right
    assert [line.split(",")[0] for line in csv(drawing).splitlines()] == ["series", "sand", "lost", "gravel"]


def test_a_long_title_and_a_long_legend_go_on_in_the_next_line():
    lines = tuple(series(f"series of number {k}", [0, 1], [0, 1]) for k in range(9))
    frame = framed(Drawing("words " * 40, "x", "y", lines))
    shown = [shape for shape in frame.shapes if isinstance(shape, Text)]
    assert all(shape.x + measure(shape.text, 11) <= 640 for shape in shown if shape.anchor == "start")
    title = [shape for shape in shown if shape.bold]
    assert len(title) > 1
    assert " ".join(shape.text for shape in title).split() == ["words"] * 40
    assert len({shape.y for shape in shown if shape.text.startswith("series")}) == 3


def test_the_name_of_an_axis_without_room_loses_its_end_not_its_beginning():
    drawing = Drawing("", "energy of an event, of the bundle's units", "y", (series("", [0, 1], [0, 1]),))
    name = next(shape for words, shape in texts(framed(drawing, 160, 200)).items() if words.endswith("→"))
    assert name.text.startswith("energy")
    assert name.x - measure(name.text, 11) >= 0.0


def test_names_in_place_of_numbers_stand_below_what_they_are_of_as_far_as_there_is_room():
    names = ("TD", "carpet of wool", "X")
    drawing = Drawing("", "stimulus", "y", (series("", [1, 2, 3], [0, 1, 0], "dots"),), x_names=names)
    frame = framed(drawing, 640, 400)
    words = texts(frame)
    assert [words[name].x for name in names] == pytest.approx(frame.x.place([1.0, 2.0, 3.0]).tolist())
    narrow = texts(framed(drawing, 240, 400))
    assert {"TD", "X"} < narrow.keys()
    assert any(word.startswith("c") and word.endswith("…") for word in narrow)


def test_a_compact_plot_has_the_unit_behind_the_last_tick_and_no_title():
    words = texts(framed(LIVE, margins=Margins()))
    assert {"1\u202f000 N", "800", "0 s"} <= words.keys()
    assert "force" not in words
    assert not any("N" in word or "s" in word for word in words.keys() - {"1\u202f000 N", "0 s"})


def test_the_last_tick_of_a_compact_plot_has_room_for_its_unit():
    levels = Drawing("", "level, dB", "y", (series("", [0, 1], [0, 1]),), x_range=(-118.0, -80.0))
    margins = Margins(right=2.0)
    for width in range(AXIS_PX + 90, 640, 7):
        words = [shape for shape in framed(levels, width, margins=margins).shapes if getattr(shape, "y", 0.0) > 385.0]
        ends = [(word.x - measure(word.text, 11) / 2.0, word.x + measure(word.text, 11) / 2.0) for word in words]
        assert words[-1].text.endswith(" dB")
        assert all(after[0] - before[1] >= 8.0 for before, after in pairwise(ends)), width
        at = [float(word.text.removesuffix(" dB").replace("−", "-")) for word in words]
        assert len({after - before for before, after in pairwise(at)}) <= 1, f"{width}: {at} are not evenly spaced"


def test_an_axis_without_room_has_no_texts_and_a_left_one_is_always_as_wide():
    without = framed(LIVE, margins=Margins(bottom=8.0))
    assert "0 s" not in texts(without)
    assert without.area.left == framed(LIVE).area.left == AXIS_PX


@pytest.mark.parametrize("size", [(640, 240), (240, 480)])
def test_equal_axes_have_one_scale_in_any_room(size):
    to = np.array([[0.1, 0.2], [-0.1, 0.05]])
    arrows = series("s", [0.0, -0.1], [0.0, 0.0], "arrows", "contact", to)
    frame = framed(Drawing("a", "x", "y", (arrows,), equal=True), *size)
    across = frame.area.width / (frame.x.high - frame.x.low)
    up = frame.area.height / (frame.y.high - frame.y.low)
    assert across == pytest.approx(up, rel=1e-6)
    assert frame.x.low < -0.1 < 0.1 < frame.x.high
    assert frame.y.low < 0.0 < 0.2 < frame.y.high


def test_every_point_is_within_the_axes():
    x = np.linspace(3.0, 41.0, 50)
    frame = framed(Drawing("a", "x", "y", (series("line", x, x**2), series("dots", x, -x, "dots"))))
    assert frame.x.low <= 3.0 < 41.0 <= frame.x.high
    assert frame.y.low <= -41.0 < 41.0**2 <= frame.y.high
    assert frame.x.high - frame.x.low < 1.5 * 38.0


def test_a_series_on_the_right_has_its_own_axis_in_its_colour():
    force = Series("force", np.array([0.0, 1.0]), np.array([0.0, 500.0]), colour="force", right=True)
    drawing = Drawing("a", "x", "y", (series("s", [0, 1], [-1, 1]), force), right="force, N", right_range=(0.0, 1000.0))
    frame = framed(drawing, margins=Margins(right=52.0))
    assert frame.y.high < 2.0
    assert texts(frame)["1\u202f000 N"].colour == "force"
    assert texts(frame)["1\u202f000 N"].x > frame.area.right
    *_, line = content_of(drawing, frame, measure)
    assert line.points[1, 1] == pytest.approx((frame.area.top + frame.area.bottom) / 2.0)


def test_a_note_that_is_wider_than_the_axes_goes_on_in_the_next_line():
    drawing = replace(LIVE, series=(), note="looking for steps…")
    frame = framed(drawing, 150, 200)
    shown = [shape for shape in content_of(drawing, frame, measure) if isinstance(shape, Text)]
    assert [one.text for one in shown] == ["looking for", "steps…"]
    assert all(measure(one.text, one.size_px) < frame.area.width for one in shown)
    assert shown[0].y < (frame.area.top + frame.area.bottom) / 2.0 < shown[1].y


def test_a_heat_map_lies_under_lines_and_series_and_a_note_over_all():
    heat = HeatMap(np.zeros((4, 5), np.uint8), (-5.0, 0.0), (-100.0, 1000.0))
    lines = (ReferenceLine("y", 40.0, name="felt"), ReferenceLine("x", -2.0))
    drawing = replace(LIVE, heat=heat, lines=lines, note="nothing")
    frame = framed(drawing, margins=Margins())
    shapes = list(content_of(drawing, frame, measure))
    words = [Backdrop, Text] * 2
    assert [type(shape) for shape in shapes] == [HeatImage, Segments, Segments, Polyline, *words]
    assert shapes[0].box == frame.area
    level, upright = shapes[1].ends[0], shapes[2].ends[0]
    assert level[:, 0].tolist() == [frame.area.left, frame.area.right]
    assert upright[:, 1].tolist() == [frame.area.bottom, frame.area.top]
    assert [shape.text for shape in shapes if isinstance(shape, Text)] == ["felt", "nothing"]


def test_nothing_one_point_and_no_room_can_be_drawn():
    framed(Drawing("a", "x", "y"))
    framed(Drawing("a", "x", "y", (series("s", [2.0], [np.nan], "dots"),), x_log=True, y_log=True))
    framed(Drawing("a", "x", "y", (series("s", [1.0, 2.0], [1.0, 2.0]),), equal=True), 0, 0)
    one = framed(Drawing("a", "x", "y", (series("s", [2.0], [7.0], "dots"),)))
    assert one.x.low < 2.0 < one.x.high


def test_a_dot_in_the_legend_is_in_the_colour_of_the_series():
    frame = framed(Drawing("a", "x", "y", (series("s", [1, 2], [1, 2], "dots", "alarm"),)))
    (key,) = (shape for shape in frame.shapes if isinstance(shape, Dots))
    assert key.colour == "alarm"


def test_a_band_and_its_mean_have_different_keys():
    """In one colour, as mean and standard deviation of a gait: the band is filled in the legend, too."""
    around = Series("± 1 SD", np.array([0.0, 1.0]), np.array([0.5, 0.5]), "band", "force", spread=np.array([0.5, 2.0]))
    frame = framed(Drawing("a", "x", "y", (around, series("mean", [0, 1], [0, 1], colour="force"))))
    (band,) = (shape for shape in frame.shapes if isinstance(shape, Area))
    (mean,) = (shape for shape in frame.shapes if isinstance(shape, Polyline))
    assert band.points[:, 0].max() < texts(frame)["± 1 SD"].x
    assert np.ptp(band.points[:, 1]) >= 8.0
    assert np.ptp(mean.points[:, 1]) == 0.0
    assert max(frame.y.low, -1.5) == -1.5
    assert min(frame.y.high, 2.5) == 2.5, "all of the band is seen"


def compact(names, width):
    """The legend of a compact plot with lines of these names, over its data."""
    drawing = Drawing("a", "x", "y", tuple(series(name, [0, 1], [0, 1]) for name in names))
    frame = framed(drawing, width, margins=Margins())
    shapes = list(content_of(drawing, frame, measure))
    words = [shape for shape in shapes if isinstance(shape, Text)]
    assert all(frame.area.left <= word.x and word.x + measure(word.text, 11) <= frame.area.right for word in words)
    assert not words or shapes.index(words[0]) > len(names)
    return [word.text for word in words]


def test_a_compact_plot_has_its_legend_over_the_data_where_it_fits():
    assert compact(["commanded", "measured"], 640) == ["commanded", "measured"]
    assert compact(["commanded", "measured"], 160) == []
    assert compact(["slot A", "measured", "commanded"], 500) == ["slot A", "measured", "commanded"]
    assert compact(["alone"], 640) == []
    assert compact(["", ""], 640) == []
