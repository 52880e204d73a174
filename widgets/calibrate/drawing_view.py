"""A `Drawing` on the screen: its plot, with title, legend and axis names around it; and several in a column."""

from collections.abc import Sequence

from PySide6.QtCore import QSize, Qt, QTimer
from PySide6.QtWidgets import QLabel, QScrollArea, QSizePolicy, QVBoxLayout, QWidget

from underfoot.drawing import COLOURS, Drawing, Series
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.calibrate.drawing_plot import DrawingPlot

LEAST_PX = 304
"""Height below which a drawing is not pressed: the column scrolls instead."""

_APART_PX = 3 * theme.GRID


class DrawingView(QWidget):
    """A drawing with its title above, legend and axis names around it."""

    def __init__(self) -> None:
        super().__init__()
        self.title = theme.label("", "title")
        self._up = theme.label("", "small")
        self._across = theme.label("", "small")
        self._legend = theme.label("", "small")
        self._legend.setTextFormat(Qt.TextFormat.RichText)
        for label in (self.title, self._legend):
            label.setWordWrap(True)
        for label in (self.title, self._legend, self._up, self._across):
            label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self._across.setAlignment(Qt.AlignmentFlag.AlignRight)
        self._across.setContentsMargins(0, 0, 2 * theme.GRID, 0)
        self._up.setContentsMargins(theme.GRID, 0, 0, 0)
        self.plot = DrawingPlot()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(theme.GRID // 2)
        for widget in (self.title, self._legend, self._up):
            layout.addWidget(widget)
        layout.addWidget(self.plot, 1)
        layout.addWidget(self._across)
        self.setMinimumHeight(LEAST_PX)

    def hasHeightForWidth(self) -> bool:
        return False  # title and legend have, but a plot takes any height

    def sizeHint(self) -> QSize:
        return QSize(400, LEAST_PX)

    def show_drawing(self, drawing: Drawing) -> None:
        """Show this one instead."""
        self.title.setText(drawing.title)
        self._up.setText(f"↑ {pretty_text(drawing.y)}")
        self._across.setText(f"{pretty_text(drawing.x)} →")
        named = [one for one in drawing.series if one.name]
        self._legend.setText(" &nbsp; ".join(map(_key, named)))
        self._legend.setVisible(bool(named))
        self.plot.show_drawing(drawing)


class DrawingColumn(QScrollArea):
    """Drawings one under another; as many as fit are seen at once, and the rest by scrolling."""

    def __init__(self) -> None:
        super().__init__()
        self.setWidgetResizable(True)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setAccessibleName("Drawings")
        self._inside = inside = QWidget()
        self._layout = QVBoxLayout(inside)
        self._layout.setContentsMargins(2 * theme.GRID, theme.GRID, theme.GRID, theme.GRID)
        self._layout.setSpacing(_APART_PX)
        self._nothing = QLabel()
        self._nothing.setProperty("role", "muted")
        self._nothing.setWordWrap(True)
        self._nothing.setAlignment(Qt.AlignmentFlag.AlignCenter)
        self._layout.addWidget(self._nothing)
        self._views: list[DrawingView] = []
        self._drawings: Sequence[Drawing] = ()
        self._ready = 0
        self._next = QTimer(self)
        self._next.setInterval(0)
        self._next.timeout.connect(self._make_next)
        self.setWidget(inside)
        self.show_drawings((), "")

    @property
    def views(self) -> list[DrawingView]:
        """What is seen."""
        return [view for view in self._views if not view.isHidden()]

    def show_drawings(self, drawings: Sequence[Drawing], otherwise: str) -> None:
        """Show these, or a word on why there are none. Further ones than there were are made one after another, in
        turns of their own, and shown when all are there: together they take longer than a frame."""
        self._drawings, self._ready = drawings, len(self.views)
        for view, drawing in zip(self._views, drawings[: self._ready], strict=False):
            view.show_drawing(drawing)
        for view in self._views[len(drawings) :]:
            view.hide()
        self._next.start()
        self._nothing.setText(otherwise)
        self._nothing.setVisible(not drawings)
        self.setFocusPolicy(Qt.FocusPolicy.TabFocus if len(drawings) > 1 else Qt.FocusPolicy.NoFocus)

    def _make_next(self) -> None:
        """Make one that is not there yet; when all are, show them."""
        place = self._ready
        if place >= len(self._drawings):
            self._next.stop()
            # At once, or they would lie upon one another until the next turn.
            least = place * LEAST_PX + (place - 1) * _APART_PX + 2 * theme.GRID
            self._inside.setMinimumHeight(max(least, 0))
            for view in self._views[: len(self._drawings)]:
                view.show()
            return
        if place == len(self._views):
            self._views.append(DrawingView())
            self._views[place].hide()
            self._layout.addWidget(self._views[place])
        self._views[place].show_drawing(self._drawings[place])
        self._ready += 1


def _key(one: Series) -> str:
    mark = {"dots": "●", "arrows": "⟶", "dashed": "╌╌"}.get(one.style, "━━")
    return f'<span style="color:{COLOURS[one.colour]}">{mark}</span>&nbsp;{one.name.replace(" ", "&nbsp;")}'
