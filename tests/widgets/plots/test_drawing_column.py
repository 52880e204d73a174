"""Drawings in a column."""

from itertools import pairwise

from on_screen import show

from underfoot.drawing import Drawing, series
from underfoot.widgets.plots.drawing_column import DrawingColumn


def test_a_column_shows_as_many_as_there_are(qtbot):
    column = DrawingColumn()
    qtbot.addWidget(column)
    column.resize(480, 640)
    show(qtbot, column)
    drawings = [Drawing(f"number {k}", "x", "y", (series("s", [0, 1], [0, k]),)) for k in range(9)]
    column.show_drawings(drawings, "nothing")
    qtbot.waitUntil(lambda: column.plots[-1].y() > 8 * 304)
    assert [plot.drawing for plot in column.plots] == drawings
    places = [plot.geometry() for plot in column.plots]
    assert all(above.bottom() < below.top() for above, below in pairwise(places))
    assert not column.empty_text.isVisible()
    column.show_drawings(drawings[:1], "nothing")
    assert [plot.drawing.title for plot in column.plots] == ["number 0"]
    column.show_drawings((), "nothing")
    assert column.plots == []
    assert column.empty_text.text() == "nothing"
    assert column.empty_text.isVisible()


def test_a_drawing_is_no_higher_than_its_column(qtbot):
    """Of a plot that begins in view, the axis below can be seen, too."""
    column = DrawingColumn()
    qtbot.addWidget(column)
    column.resize(400, 240)
    show(qtbot, column)
    column.show_drawings([Drawing("One", "x", "y"), Drawing("Two", "x", "y")], "")
    qtbot.waitUntil(lambda: 0 < column.plots[0].height() <= column.viewport().height())
    column.resize(400, 800)
    qtbot.waitUntil(lambda: column.plots[0].height() > 300)
