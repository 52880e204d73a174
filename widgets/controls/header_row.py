"""The row of widgets above a panel's body, some of which shrink if space is short."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QToolButton, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel

_ICON_PX = 4 * theme.GRID
"""About how wide a button is without its words."""
_FEW_WORDS_PX = 16 * theme.GRID
"""Width of an elided text that still tells something."""
_WITH_TEXT, _ICON_ONLY = Qt.ToolButtonStyle.ToolButtonTextBesideIcon, Qt.ToolButtonStyle.ToolButtonIconOnly


class HeaderRow(QWidget):
    """Widgets in a row; None is a stretch. If space is short, the groups of `shrinking` shrink in order: a button with
    an icon loses its text, a label that elides ends in dots as long as some words are seen, other widgets are hidden.
    """

    def __init__(
        self,
        widgets: Sequence[QWidget | None],
        shrinking: Sequence[Sequence[QWidget]],
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self._widgets, self._shrinking = widgets, shrinking
        self._full_widths_px: dict[QWidget, int] = {}
        self._line = line = QHBoxLayout(self)
        line.setContentsMargins(2 * theme.GRID, theme.GRID // 2, theme.GRID, 0)
        line.setSpacing(theme.GRID)
        for widget in widgets:
            if widget is None:
                line.addStretch(1)
            else:
                line.addWidget(widget)
        self.setFixedHeight(4 * theme.GRID + 4)

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._fit()

    def event(self, event: QEvent) -> bool:
        if event.type() == QEvent.Type.LayoutRequest:
            self._fit()
        return super().event(event)

    def _fit(self) -> None:
        margins = self._line.contentsMargins()
        room = self.width() - margins.left() - margins.right()
        gap = self._line.spacing()
        shrinkable = [widget for group in self._shrinking for widget in group]
        visible = [
            widget for widget in self._widgets if widget is not None and (widget in shrinkable or not widget.isHidden())
        ]
        room -= sum(self._full_width_px(widget) + gap for widget in visible) - gap
        for group in self._shrinking:
            shrinks = room < 0
            for widget in group:
                if isinstance(widget, QToolButton) and not widget.icon().isNull():
                    is_there = not widget.isHidden()
                    room += (
                        self._full_width_px(widget) + gap
                        if not is_there
                        else self._full_width_px(widget) - _ICON_PX
                        if shrinks
                        else 0
                    )
                    widget.setToolButtonStyle(_ICON_ONLY if shrinks else _WITH_TEXT)
                else:
                    elides = isinstance(widget, ElidedLabel) and self._full_width_px(widget) + room >= _FEW_WORDS_PX
                    widget.setHidden(shrinks and not elides)
                    if shrinks:
                        room = 0 if elides else room + self._full_width_px(widget) + gap

    def _full_width_px(self, widget: QWidget) -> int:
        """Return a widget's width with its full text, in pixels; 0 for one that elides its text."""
        if widget.sizePolicy().horizontalPolicy() == QSizePolicy.Policy.Ignored:
            return 0
        if (
            isinstance(widget, QToolButton)
            and widget.toolButtonStyle() == _ICON_ONLY
            and widget in self._full_widths_px
        ):
            return self._full_widths_px[widget]
        width_px = min(max(widget.sizeHint().width(), widget.minimumWidth()), widget.maximumWidth())
        self._full_widths_px[widget] = width_px
        return width_px
