"""A list of rows under headings, as those of nodes and of presets are."""

from collections.abc import Callable

from PySide6.QtCore import QModelIndex, QPersistentModelIndex, QRect, QRectF, QSize, Qt
from PySide6.QtGui import QColor, QPainter, QPen
from PySide6.QtWidgets import QListWidget, QStyle, QStyledItemDelegate, QStyleOptionViewItem, QWidget

from underfoot.widgets import theme

_HEADING_PX = 28

Index = QModelIndex | QPersistentModelIndex


PaintRow = Callable[[QPainter, QRect, Index, bool], None]
"""Paints a row on its ground; the last argument is whether it is current or under the mouse."""


class HeadedList(QListWidget):
    """Headings; and, where an item has data of the role `UserRole`, rows of `row_px`, which may be dragged.

    `name` is for screen readers.
    """

    def __init__(self, parent: QWidget | None, name: str, row_px: int, paint_row: PaintRow) -> None:
        super().__init__(parent)
        self.setItemDelegate(_Row(self, row_px, paint_row))
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.setVerticalScrollMode(QListWidget.ScrollMode.ScrollPerPixel)
        self.setMouseTracking(True)
        self.setDragEnabled(True)
        self.setAccessibleName(name)

    def step(self, by: int) -> None:
        """Move the current row by `by` rows, past headings and around the ends."""
        rows = [i for i in range(self.count()) if self.item(i).data(Qt.ItemDataRole.UserRole)]
        if rows:
            at = rows.index(self.currentRow()) + by if self.currentRow() in rows else (0 if by > 0 else -1)
            self.setCurrentRow(rows[at % len(rows)])


class _Row(QStyledItemDelegate):
    def __init__(self, shown: HeadedList, row_px: int, paint_row: PaintRow) -> None:
        super().__init__(shown)
        self._row_px, self._paint_row = row_px, paint_row

    def sizeHint(self, option: QStyleOptionViewItem, index: Index) -> QSize:
        return QSize(80, self._row_px if index.data(Qt.ItemDataRole.UserRole) else _HEADING_PX)

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        rect: QRect = option.rect
        state: QStyle.StateFlag = option.state
        painter.save()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        if not index.data(Qt.ItemDataRole.UserRole):
            painter.setFont(theme.font(theme.SMALL_PX, bold=True))
            painter.setPen(QColor(theme.MUTED))
            align = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom
            painter.drawText(rect.adjusted(4, 0, 0, -4), align, index.data())
        else:
            # By Tab a row becomes current, and Enter takes it, without being selected.
            flag = QStyle.StateFlag
            is_offered = bool(state & (flag.State_Selected | flag.State_MouseOver | flag.State_HasFocus))
            if is_offered:
                _paint_ground(painter, rect, state)
            self._paint_row(painter, rect, index, is_offered)
        painter.restore()


def _paint_ground(painter: QPainter, rect: QRect, state: QStyle.StateFlag) -> None:
    """Paint the ground of a row that is current or under the mouse, with a border if the keys go to it."""
    has_focus = bool(state & QStyle.StateFlag.State_HasFocus)
    painter.setPen(QPen(QColor(theme.VIBRATION)) if has_focus else QPen(Qt.PenStyle.NoPen))
    painter.setBrush(QColor(theme.HOVER if state & QStyle.StateFlag.State_Selected else theme.RAISED))
    painter.drawRoundedRect(QRectF(rect).adjusted(0.5, 0.5, -0.5, -0.5), 4, 4)
