"""The list of node types by family, and a search field, for the palette and the canvas."""

import re
from collections.abc import Collection

from PySide6.QtCore import QEvent, QMimeData, Qt, Signal
from PySide6.QtGui import QFocusEvent, QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QLineEdit,
    QListWidgetItem,
    QWidget,
)

from underfoot.parameters import Choice, Parameter
from underfoot.patch.node import NodeType, Port, Registry
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.design.named_list import NamedList
from underfoot.widgets.design.node_geometry import accent
from underfoot.widgets.escape import claims_escape

MIME = "application/x-underfoot-node"
NO_NODE = "."
"""The type of a row that is a choice, but not a node."""
FAMILIES = (
    "Floor", "Timing", "Sources", "Tones", "Impacts", "Materials", "Shapes", "Filters", "Modulation", "Outputs",
)  # fmt: skip
"""The order of the families; others follow."""


class NodeList(NamedList):
    """Families and their node types. `chosen` carries the type on Enter or double click."""

    chosen = Signal(str)
    drag_ended = Signal()
    """A node that was dragged from here was dropped, or given up."""

    def __init__(self, registry: Registry, parent: QWidget | None = None) -> None:
        super().__init__(parent, "Nodes")
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
        super().filter_by(text)
        allowed, real = self._allowed, {t: type for t, type in self._registry.items() if not type.missing}
        there = real if allowed is None else {t: type for t, type in real.items() if t in allowed}
        if self._first and not text.strip():
            self.add(NO_NODE, self._first, theme.MUTED)
            self.setCurrentRow(0)
        if text.strip():
            fitting = [type for type in there.values() if rank(type, text) >= 0]

            def order(type: NodeType) -> tuple[int, bool, int, str]:
                fits = rank(type, text)
                return max(fits, 1), type.type not in self._preferred, fits, type.label.lower()

            for type in sorted(fitting, key=order):
                self._add_type(type, type.family)
            if not fitting:
                others = [(rank(type, text), type.label) for type in real.values() if rank(type, text) >= 0]
                self.add_words(f"{min(others)[1]} does not fit here" if others else "No node has these words")
            self.setCurrentRow(0)
            return
        for family, types in grouped(there).items():
            self.add_words(family.upper())
            for type in types:
                self._add_type(type)

    def _add_type(self, type: NodeType, note: str = "") -> None:
        called = f"\n\nAlso called: {type.also_called}" if type.also_called else ""
        self.add(type.type, type.label, accent(type), note, pretty_text(type.doc) + called)

    def types(self) -> list[str]:
        """Return the visible types."""
        return [type for type in self.ids() if type != NO_NODE]

    def startDrag(self, actions: Qt.DropAction) -> None:
        super().startDrag(actions)
        self.drag_ended.emit()

    def mimeData(self, items: list[QListWidgetItem]) -> QMimeData:  # type: ignore[override]
        data = QMimeData()
        if items and (type := items[0].data(Qt.ItemDataRole.UserRole)):
            data.setData(MIME, type.encode())
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

    def __init__(self, hint: str, parent: QWidget, *, closes: bool = False) -> None:
        """Create the field; with `closes`, leaving it closes a list even if the field is empty."""
        super().__init__(parent)
        self.closes = closes
        self.setPlaceholderText(hint)
        self.setAccessibleName(hint)
        self.setClearButtonEnabled(False)

    def event(self, event: QEvent) -> bool:
        # Escape goes to the field while a list is open or the field has text.
        if claims_escape(event, lambda: self.closes or self.text()):
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
    """Return the rank of a node type for a search text: 0 is best, 4 fits its parameters and ports, -1 no match.

    Words are anywhere in the name, and elsewhere begin a word: not "ring" of "during". Names are one word, too.
    """
    words = re.sub("[~_]", " ", text.lower()).split()  # noise~ is what Max and Pure Data call it
    label, called = type.label.lower(), type.also_called.lower()
    called += re.sub(r"(?<=\w)[ -](?=\w)", "", f" {label}, {called}")  # lowpass, colorramp
    about = f"{type.type} {type.family} {type.doc} {called}".lower()
    if not all(word in label or _begins_in(about, word) for word in words):
        parts: list[Parameter | Port] = [*type.parameters.values(), *type.inputs, *type.outputs]
        options = [option for part in parts if isinstance(part, Choice) for option in part.options]
        details = " ".join([*(f"{part.name} {part.doc}" for part in parts), *options]).replace("_", " ").lower()
        return 4 if all(word in label or _begins_in(f"{about} {details}", word) for word in words) else -1
    if not words or label.startswith(words[0]):
        return 0
    return 1 if _begins_in(f"{label} {called}", words[0]) else (2 if words[0] in label else 3)


def _begins_in(text: str, word: str) -> bool:
    """Return whether a word of the text begins so."""
    return re.search(rf"(?<!\w){re.escape(word)}", text) is not None
