"""The line of widgets over a panel's body, in which some give way where it is narrow."""

from collections.abc import Sequence

from PySide6.QtCore import QEvent, Qt
from PySide6.QtGui import QResizeEvent
from PySide6.QtWidgets import QHBoxLayout, QSizePolicy, QToolButton, QWidget

from underfoot.widgets import theme

_ICON_PX = 4 * theme.GRID
"""About how wide a button is without its words."""
_BESIDE, _ALONE = Qt.ToolButtonStyle.ToolButtonTextBesideIcon, Qt.ToolButtonStyle.ToolButtonIconOnly


class HeadLine(QWidget):
    """Widgets beside one another; None is a stretch. Where there is no room for all, those of `giving` give way, the
    first group of them first: a button with a picture goes without its words, anything else is hidden.
    """

    def __init__(self, widgets: Sequence[QWidget | None], giving: Sequence[Sequence[QWidget]] = ()) -> None:
        super().__init__()
        self._widgets, self._giving = widgets, giving
        self._wide_px: dict[QWidget, int] = {}
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
        could = [one for group in self._giving for one in group]
        there = [one for one in self._widgets if one is not None and (one in could or not one.isHidden())]
        room -= sum(self._wide(one) + gap for one in there) - gap
        for group in self._giving:
            gives = room < 0
            for one in group:
                if isinstance(one, QToolButton) and not one.icon().isNull():
                    is_there = not one.isHidden()
                    room += self._wide(one) + gap if not is_there else self._wide(one) - _ICON_PX if gives else 0
                    one.setToolButtonStyle(_ALONE if gives else _BESIDE)
                else:
                    room += self._wide(one) + gap if gives else 0
                    one.setHidden(gives)

    def _wide(self, one: QWidget) -> int:
        """How wide a widget is with all its words; one that shows what there is room for asks for none."""
        if one.sizePolicy().horizontalPolicy() == QSizePolicy.Policy.Ignored:
            return 0
        if isinstance(one, QToolButton) and one.toolButtonStyle() == _ALONE and one in self._wide_px:
            return self._wide_px[one]
        wide = min(max(one.sizeHint().width(), one.minimumWidth()), one.maximumWidth())
        self._wide_px[one] = wide
        return wide
