"""A `Drawing` on the screen: lines, dots and arrows between round ticks, with its legend; and several in a column."""

import math
from collections.abc import Sequence

import numpy as np
import pyqtgraph as pg
from numpy.typing import NDArray
from PySide6.QtCore import QPointF, QSize, Qt, QTimer
from PySide6.QtGui import QColor, QPainterPath, QPaintEvent, QPen, QWheelEvent
from PySide6.QtWidgets import QGraphicsItem, QGraphicsPathItem, QLabel, QScrollArea, QSizePolicy, QVBoxLayout, QWidget

from widgets import theme
from widgets.plots import Plot, thinned
from workbench.drawing import COLOURS, Drawing, Series

DOT_PX = 4
LEAST_PX = 304
"""Height below which a drawing is not pressed: the column scrolls instead."""

_NEAR_TICK = 0.4
"""An axis ends at a tick that is no further beyond what is drawn than this share of a step."""
_MOST_POINTS = 4000
_BINS = 700
_TICK_PX = (96, 48)
"""About how far ticks are apart, across and up."""


class DrawingView(QWidget):
    """A drawing with its title above, legend and axis names around it.

    The plot is made when it is first seen, each in a turn of its own: one takes most of a frame's time.
    """

    def __init__(self) -> None:
        super().__init__()
        self._title = theme.label("", "title")
        self._up = theme.label("", "small")
        self._across = theme.label("", "small")
        self._legend = theme.label("", "small")
        self._legend.setWordWrap(True)
        self._legend.setTextFormat(Qt.TextFormat.RichText)
        self._legend.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.plot: DrawingPlot | None = None
        self._drawing: Drawing | None = None
        for label in (self._title, self._up, self._across):
            label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._across.setAlignment(Qt.AlignmentFlag.AlignRight)
        self._across.setContentsMargins(0, 0, 2 * theme.GRID, 0)
        self._up.setContentsMargins(theme.GRID, 0, 0, 0)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(theme.GRID // 2)
        for widget in (self._title, self._legend, self._up):
            layout.addWidget(widget)
        self._room = QVBoxLayout()
        layout.addLayout(self._room, 1)
        layout.addWidget(self._across)
        self._making = QTimer(self)
        self._making.setSingleShot(True)
        self._making.timeout.connect(self._make_plot)
        self.setMinimumHeight(LEAST_PX)

    def hasHeightForWidth(self) -> bool:
        return False  # the legend has, but a plot takes any height

    def sizeHint(self) -> QSize:
        return QSize(400, LEAST_PX)

    def show_drawing(self, drawing: Drawing) -> None:
        """Show this one instead."""
        self._title.setText(drawing.title)
        self._up.setText(f"↑ {theme.pretty_text(drawing.y)}")
        self._across.setText(f"{theme.pretty_text(drawing.x)} →")
        named = [one for one in drawing.series if one.name]
        self._legend.setText(" &nbsp; ".join(map(_key, named)))
        self._legend.setVisible(bool(named))
        self._drawing = drawing
        if self.plot is not None:
            self.plot.show_drawing(drawing)

    def paintEvent(self, event: QPaintEvent) -> None:
        super().paintEvent(event)
        if self.plot is None and not self._making.isActive():
            self._making.start()

    def _make_plot(self) -> None:
        if self.plot is None and self._drawing is not None:
            self.plot = DrawingPlot()
            self._room.addWidget(self.plot)
            self.plot.show_drawing(self._drawing)


class DrawingPlot(Plot):
    """The plot of a drawing. Its ranges end at round ticks, and follow what is drawn only when that leaves them."""

    def __init__(self) -> None:
        super().__init__("Drawing")
        self._drawing: Drawing | None = None
        self._items: list[QGraphicsItem] = []
        self.setMinimumHeight(96)
        self.box.sigResized.connect(self._fit)

    def show_drawing(self, drawing: Drawing) -> None:
        """Draw this one instead of what was there."""
        self._drawing = drawing
        self.setAccessibleName(f"{drawing.title}: {drawing.y} over {drawing.x}")
        for item in self._items:
            self.removeItem(item)
        self._items = [item for one in drawing.series for item in self._made(one)]
        for item in self._items:
            self.addItem(item, ignoreBounds=True)
        self._fit()

    def wheelEvent(self, event: QWheelEvent) -> None:
        event.ignore()  # the column scrolls, not the plot

    def _fit(self) -> None:
        """Ranges and ticks for what is drawn, in the room that there is."""
        if self._drawing is None or self.box.width() < 1.0 or self.box.height() < 1.0:
            return
        drawing, width, height = self._drawing, self.box.width(), self.box.height()
        points = np.concatenate([np.zeros((0, 2)), *(_points(one, drawing) for one in drawing.series)])
        (left, right), (bottom, top) = _span(points[:, 0]), _span(points[:, 1])
        if drawing.equal and not (drawing.x_log or drawing.y_log):
            metre = max((right - left) / width, (top - bottom) / height)
            left, right = _widened(left, right, metre * width)
            bottom, top = _widened(bottom, top, metre * height)
        for side, low, high, log, room in (
            ("bottom", left, right, drawing.x_log, width / _TICK_PX[0]),
            ("left", bottom, top, drawing.y_log, height / _TICK_PX[1]),
        ):
            ticks = log_ticks(low, high, room) if log else linear_ticks(low, high, room)
            if not drawing.equal:
                low, high = _rounded(low, high, ticks)
            self.set_axis(side, low, high, [tick for tick in ticks if low <= tick[0] <= high])

    def _made(self, one: Series) -> list[QGraphicsItem]:
        assert self._drawing is not None
        colour, points = COLOURS[one.colour], _points(one, self._drawing, whole=True)
        if one.style == "arrows":
            ends = points[len(one.x) :]
            path = QPainterPath()
            for begin, end in zip(points[: len(one.x)], ends, strict=True):
                if np.isfinite([*begin, *end]).all():
                    path.moveTo(QPointF(*begin))
                    path.lineTo(QPointF(*end))
            arrows = QGraphicsPathItem(path)
            arrows.setPen(_pen(colour))
            return [arrows, _dots(ends, colour)]
        if one.style == "dots":
            return [_dots(points, colour)]
        x, y = points.T
        finite = np.isfinite(points).all(axis=1)
        if len(x) > _MOST_POINTS and finite.all() and (np.diff(x) > 0.0).all():
            x, thin = thinned(x, y[:, None], (x[-1] - x[0]) / _BINS)
            y = thin[:, 0]
        curve = pg.PlotCurveItem(pen=_pen(colour, dashed=one.style == "dashed"), antialias=False)
        curve.setData(np.where(np.isfinite(y), x, np.nan), np.where(np.isfinite(x), y, np.nan), connect="finite")
        return [curve]


class DrawingColumn(QScrollArea):
    """Drawings one under another; as many as fit are seen at once, and the rest by scrolling."""

    def __init__(self) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName("Drawings")
        inside = QWidget()
        self._layout = QVBoxLayout(inside)
        self._layout.setContentsMargins(2 * theme.GRID, theme.GRID, theme.GRID, theme.GRID)
        self._layout.setSpacing(3 * theme.GRID)
        self._nothing = QLabel()
        self._nothing.setProperty("role", "muted")
        self._nothing.setWordWrap(True)
        self._nothing.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._layout.addWidget(self._nothing)
        self._views: list[DrawingView] = []
        self.setWidget(inside)
        self.show_drawings((), "")

    @property
    def views(self) -> list[DrawingView]:
        """What is seen."""
        return [view for view in self._views if not view.isHidden()]

    def show_drawings(self, drawings: Sequence[Drawing], otherwise: str) -> None:
        """Show these, or a word on why there are none."""
        while len(self._views) < len(drawings):
            self._views.append(DrawingView())
            self._layout.addWidget(self._views[-1])
        for view, drawing in zip(self._views, drawings, strict=False):
            view.show_drawing(drawing)
        for place, view in enumerate(self._views):
            view.setVisible(place < len(drawings))
        self._nothing.setText(otherwise)
        self._nothing.setVisible(not drawings)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus if len(drawings) > 1 else Qt.FocusPolicy.NoFocus)


def linear_ticks(low: float, high: float, room: float) -> list[tuple[float, str]]:
    """Ticks at about `room` round places, the outermost not inside `low` to `high`.

    >>> linear_ticks(0.3, 41.0, 5.0)
    [(0.0, '0'), (10.0, '10'), (20.0, '20'), (30.0, '30'), (40.0, '40'), (50.0, '50')]
    """
    raw = (high - low) / max(room, 2.0)
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= raw * (1.0 - 1e-9))
    first, last = math.floor(low / step + 1e-6), math.ceil(high / step - 1e-6)
    return [(k * step, theme.number(k * step, 4)) for k in range(first, last + 1)]


def log_ticks(low: float, high: float, room: float) -> list[tuple[float, str]]:
    """Ticks of a logarithmic axis from 10^`low` to 10^`high`, the outermost not inside.

    >>> log_ticks(0.0, 2.0, 3.0), [text for _, text in log_ticks(1.7, 2.9, 6.0)]
    ([(0.0, '1'), (1.0, '10'), (2.0, '100')], ['50', '100', '200', '500', '1\\u202f000'])
    """
    decades = range(math.floor(low) - 1, math.ceil(high) + 2)
    steps: tuple[int, ...] = (1, 2, 5) if (high - low) * 3 <= room * 1.2 else (1,)
    every = [math.log10(k) + decade for decade in decades for k in steps]
    first = max((i for i, at in enumerate(every) if at <= low + 1e-6), default=0)
    last = min((i for i, at in enumerate(every) if at >= high - 1e-6), default=len(every) - 1)
    skip = max(1, round((last - first) / max(room, 2.0)))
    return [(at, theme.number(10.0**at, 4)) for at in every[first : last + skip : skip]]


def _points(one: Series, drawing: Drawing, *, whole: bool = False) -> NDArray[np.float64]:
    """The points of a set as they are drawn, ends of arrows after the others: only finite ones, or the `whole`."""
    points = np.column_stack([one.x, one.y])
    if one.to is not None:
        points = np.concatenate([points, one.to])
    for column, log in enumerate((drawing.x_log, drawing.y_log)):
        if log:
            positive = np.where(points[:, column] > 0.0, points[:, column], np.nan)
            points[:, column] = np.log10(positive)
    return points if whole else points[np.isfinite(points).all(axis=1)]


def _span(values: NDArray[np.float64]) -> tuple[float, float]:
    if not values.size:
        return 0.0, 1.0
    low, high = float(values.min()), float(values.max())
    if high - low <= 1e-9 * max(abs(low), abs(high), 1e-300):
        room = 0.5 * abs(low) or 0.5
        return low - room, high + room
    return low, high


def _widened(low: float, high: float, length: float) -> tuple[float, float]:
    middle, half = (low + high) / 2.0, 0.53 * length
    return middle - half, middle + half


def _rounded(low: float, high: float, ticks: list[tuple[float, str]]) -> tuple[float, float]:
    """The range with its ends at the outermost ticks, or a little beyond what is drawn where those are far."""
    room, near = 0.04 * (high - low), _NEAR_TICK * (ticks[-1][0] - ticks[0][0]) / max(len(ticks) - 1, 1)
    first, last = ticks[0][0], ticks[-1][0]
    return (first if low - first <= near else low - room), (last if last - high <= near else high + room)


def _dots(points: NDArray[np.float64], colour: str) -> pg.ScatterPlotItem:
    kept = points[np.isfinite(points).all(axis=1)]
    return pg.ScatterPlotItem(x=kept[:, 0], y=kept[:, 1], size=DOT_PX, pen=None, brush=QColor(colour))


def _pen(colour: str, *, dashed: bool = False) -> QPen:
    pen = QPen(QColor(colour))
    pen.setWidth(1)
    pen.setCosmetic(True)
    if dashed:
        pen.setDashPattern([6.0, 4.0])
    return pen


def _key(one: Series) -> str:
    mark = {"dots": "●", "arrows": "⟶", "dashed": "╌╌"}.get(one.style, "━━")
    return f'<span style="color:{COLOURS[one.colour]}">{mark}</span>&nbsp;{one.name.replace(" ", "&nbsp;")}'
