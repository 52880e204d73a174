"""The list of node types by family, and a search field, for the palette and the canvas."""

from collections.abc import Collection

from PySide6.QtCore import QEvent, QMimeData, QRect, Qt, Signal
from PySide6.QtGui import QColor, QFocusEvent, QKeyEvent, QKeySequence, QPainter
from PySide6.QtWidgets import (
    QLineEdit,
    QListWidgetItem,
    QWidget,
)

from underfoot.patch.node import NodeType, Registry
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.design.headed_list import HeadedList, Index
from underfoot.widgets.design.node_geometry import accent
from underfoot.widgets.escape import is_escape_override

MIME = "application/x-underfoot-node"
NO_NODE = "."
"""The type of a row that is a choice, but not a node."""
FAMILIES = (
    *("Floor", "Timing", "Sources", "Tones", "Impacts", "Materials", "Shapes", "Filters"),
    *("Modulation", "Outputs"),
)
"""The order of the families; others follow."""
_ROW_PX = 24
_TYPE, _COLOUR, _NOTE = Qt.ItemDataRole.UserRole, Qt.ItemDataRole.UserRole + 1, Qt.ItemDataRole.UserRole + 2


class NodeList(HeadedList):
    """Families and their node types. `chosen` carries the type on Enter or double click."""

    chosen = Signal(str)
    drag_ended = Signal()
    """A node that was dragged from here was dropped, or given up."""

    def __init__(self, registry: Registry, parent: QWidget | None = None) -> None:
        super().__init__(parent, "Nodes", _ROW_PX, _paint_node)
        self._registry = registry
        self._allowed: Collection[str] | None = None
        self._preferred: Collection[str] = ()
        self._first = ""
        self.itemDoubleClicked.connect(self._choose)
        self.filter_by("")

    def set_allowed(self, allowed: Collection[str] | None, first: str = "", preferred: Collection[str] = ()) -> None:
        """Limit the list to these types, or show all. `first` is the text of a further choice at the top that is not a
        node. Of types that match the search text, `preferred` ones come first.
        """
        self._allowed, self._first, self._preferred = allowed, first, preferred

    def filter_by(self, text: str) -> None:
        """Show the types that match the text; the best match is current."""
        self.clear()
        allowed, real = self._allowed, {t: type for t, type in self._registry.items() if not type.missing}
        there = real if allowed is None else {t: type for t, type in real.items() if t in allowed}
        if self._first and not text.strip():
            item = QListWidgetItem(self._first, self)
            item.setData(_TYPE, NO_NODE)
            item.setData(_COLOUR, theme.MUTED)
            item.setData(_NOTE, "")
            self.setCurrentRow(0)
        if text.strip():
            fitting = [type for type in there.values() if rank(type, text) >= 0]

            def order(type: NodeType) -> tuple[int, bool, int, str]:
                fits = rank(type, text)
                return max(fits, 1), type.type not in self._preferred, fits, type.label.lower()

            for type in sorted(fitting, key=order):
                self._add(type, type.family)
            if not fitting:
                others = [(rank(type, text), type.label) for type in real.values() if rank(type, text) >= 0]
                self._add_words(f"{min(others)[1]} does not fit here" if others else "No node has these words")
            self.setCurrentRow(0)
            return
        for family, types in grouped(there).items():
            self._add_words(family.upper())
            for type in types:
                self._add(type, "")

    def _add_words(self, text: str) -> None:
        """Add a row of text that cannot be selected."""
        QListWidgetItem(text, self).setFlags(Qt.ItemFlag.NoItemFlags)

    def _add(self, type: NodeType, note: str) -> None:
        item = QListWidgetItem(type.label, self)
        item.setData(_TYPE, type.type)
        item.setData(_COLOUR, accent(type))
        item.setData(_NOTE, note)
        item.setToolTip(pretty_text(type.doc))

    def current(self) -> str:
        """Return the current type, or ""."""
        item = self.currentItem()
        return (item.data(_TYPE) or "") if item else ""

    def types(self) -> list[str]:
        """Return the visible types."""
        found = (self.item(i).data(_TYPE) for i in range(self.count()))
        return [type for type in found if type and type != NO_NODE]

    def step(self, by: int) -> None:
        """Move the current row by `by` nodes."""
        rows = [i for i in range(self.count()) if self.item(i).data(_TYPE)]
        if rows:
            at = rows.index(self.currentRow()) + by if self.currentRow() in rows else (0 if by > 0 else -1)
            self.setCurrentRow(rows[at % len(rows)])

    def startDrag(self, actions: Qt.DropAction) -> None:
        super().startDrag(actions)
        self.drag_ended.emit()

    def mimeData(self, items: list[QListWidgetItem]) -> QMimeData:  # type: ignore[override]
        data = QMimeData()
        if items and items[0].data(_TYPE):
            data.setData(MIME, items[0].data(_TYPE).encode())
        return data

    def mimeTypes(self) -> list[str]:
        return [MIME]

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self._choose()
        elif event.key() in (Qt.Key.Key_Up, Qt.Key.Key_Down):
            self.step(1 if event.key() == Qt.Key.Key_Down else -1)
        else:
            super().keyPressEvent(event)

    def _choose(self) -> None:
        if self.current():
            self.chosen.emit(self.current())


class SearchField(QLineEdit):
    """A field whose arrow keys move through a list. Escape clears and leaves it."""

    stepped = Signal(int)
    return_pressed = Signal(bool)
    """Enter was pressed; True with Shift."""
    escaped = Signal()

    def __init__(self, hint: str, parent: QWidget | None = None, *, closes: bool = False) -> None:
        """Create the field; with `closes`, leaving it closes a list even if the field is empty."""
        super().__init__(parent)
        self.closes = closes
        self.setPlaceholderText(hint)
        self.setAccessibleName(hint)
        self.setClearButtonEnabled(False)

    def event(self, event: QEvent) -> bool:
        # Escape goes to the field while a list is open or the field has text.
        if is_escape_override(event) and (self.closes or self.text()):
            event.accept()
            return True
        if event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent):
            # Undo is that of the patch, unless something was typed since Enter.
            undoes, redoes = map(event.matches, (QKeySequence.StandardKey.Undo, QKeySequence.StandardKey.Redo))
            if (undoes and not self.isUndoAvailable()) or (redoes and not self.isRedoAvailable()):
                event.ignore()
                return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key = event.key()
        if key in (Qt.Key.Key_Up, Qt.Key.Key_Down):
            self.stepped.emit(1 if key == Qt.Key.Key_Down else -1)
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter):
            self.setText(self.text())  # which forgets how it was typed
            self.return_pressed.emit(bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier))
        elif key == Qt.Key.Key_Escape:
            self.clear()
            self.escaped.emit()
        else:
            super().keyPressEvent(event)

    def focusOutEvent(self, event: QFocusEvent) -> None:
        super().focusOutEvent(event)
        if event.reason() not in (Qt.FocusReason.PopupFocusReason, Qt.FocusReason.ActiveWindowFocusReason):
            self.escaped.emit()


def grouped(registry: Registry) -> dict[str, list[NodeType]]:
    """Return the node types by family, families in their order, types sorted by label."""
    order = {family: i for i, family in enumerate(FAMILIES)}
    families: dict[str, list[NodeType]] = {}
    for type in sorted(registry.values(), key=lambda t: (order.get(t.family, len(order)), t.family, t.label.lower())):
        families.setdefault(type.family, []).append(type)
    return families


def rank(type: NodeType, text: str) -> int:
    """Return the rank of a node type for a search text: 0 is best, -1 no match."""
    words = text.lower().split()
    label, rest = type.label.lower(), f"{type.type} {type.family} {type.doc}".lower()
    if not all(word in label or word in rest for word in words):
        return -1
    if not words or label.startswith(words[0]):
        return 0
    return 1 if any(part.startswith(words[0]) for part in label.split()) else (2 if words[0] in label else 3)


def _paint_node(painter: QPainter, rect: QRect, index: Index, is_offered: bool) -> None:
    """Paint a node with a bar in its colour."""
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
