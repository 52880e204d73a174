"""A list of names beside a bar of colour, through which arrow keys step."""

from PySide6.QtCore import QRect, Qt
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import QListWidgetItem, QWidget

from underfoot.widgets import theme
from underfoot.widgets.design.headed_list import HeadedList, Index

_ROW_PX = 24
_ID, _COLOUR, _NOTE = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1, Qt.ItemDataRole.UserRole + 2


class NamedList(HeadedList):
    """Rows with an id, a name, a colour and a note at the end of the line, under headings."""

    def __init__(self, parent: QWidget | None, name: str) -> None:
        super().__init__(parent, name, _ROW_PX, _paint_row)

    def filter_by(self, text: str) -> None:
        """Remove all rows; a subclass then adds those that match the text."""
        self.clear()

    def add_words(self, text: str) -> None:
        """Add a row of text that cannot be selected."""
        QListWidgetItem(text, self).setFlags(Qt.ItemFlag.NoItemFlags)

    def add(self, id: str, name: str, colour: str, note: str = "", tip: str = "") -> None:
        """Add a row that can be chosen."""
        item = QListWidgetItem(name, self)
        for role, value in ((_ID, id), (_COLOUR, colour), (_NOTE, note)):
            item.setData(role, value)
        item.setToolTip(tip)

    def ids(self) -> list[str]:
        """Return the visible ids."""
        return [id for i in range(self.count()) if (id := self.item(i).data(_ID))]

    def current(self) -> str:
        """Return the current id, or ""."""
        item = self.currentItem()
        return (item.data(_ID) or "") if item else ""


def _paint_row(painter: QPainter, rect: QRect, index: Index, is_offered: bool) -> None:
    """Paint a name with a bar in its colour."""
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(theme.mixed(theme.current_colour(index.data(_COLOUR)), theme.PANEL, 0.7)))
    painter.drawRoundedRect(rect.x() + 4, rect.y() + 4, 5, rect.height() - 8, 1.5, 1.5)
    painter.setFont(theme.font())
    painter.setPen(QColor(theme.TEXT))
    align = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
    room = rect.adjusted(20, 0, -4, 0)
    cut = painter.fontMetrics().elidedText(index.data(), Qt.TextElideMode.ElideRight, room.width())
    painter.drawText(room, align, cut)
    if index.data(_NOTE):
        _paint_note(painter, room.adjusted(painter.fontMetrics().horizontalAdvance(cut), 0, -2, 0), index)


def _paint_note(painter: QPainter, room: QRect, index: Index) -> None:
    """Paint the note in small type at the end of the line, if the name leaves space."""
    painter.setFont(theme.font(theme.SMALL_PX))
    if painter.fontMetrics().horizontalAdvance(index.data(_NOTE)) + theme.GRID <= room.width():
        painter.setPen(QColor(theme.MUTED))
        painter.drawText(room, Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter, index.data(_NOTE))
