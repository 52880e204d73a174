"""The list of nodes at a place of the canvas: which types fit there, and what the chosen one is for."""

from collections.abc import Callable, Collection

from PySide6.QtCore import QPoint, QPointF, QSize, Qt, Signal
from PySide6.QtWidgets import QFrame, QVBoxLayout, QWidget

from underfoot.widgets import theme
from underfoot.widgets.design.connecting import WireDrag
from underfoot.widgets.design.node_list import NO_NODE, NodeList, SearchField
from underfoot.widgets.design.patch_editing import port_of
from underfoot.widgets.design.rewiring import types_for_wire, types_of_unit, types_that_fit
from underfoot.widgets.design.scene import PatchScene

_SIZE = QSize(248, 320)


class NodeSearch(QFrame):
    """Asks for a node to add, to insert into a wire, to connect to a port, or to put in another's place, and closes."""

    add_requested = Signal(str, QPointF, object, object, object)
    """Type and place of a node, the port that it is connected to, the wire that was there before, and the wire that it
    is inserted into; the last three can be None."""
    replace_requested = Signal(str)
    disconnect_requested = Signal(object)
    """The `Wire` that was pulled off and is to be removed."""
    closed = Signal()

    def __init__(self, scene: PatchScene, view: QWidget) -> None:
        super().__init__(view)
        self._scene, self._view = scene, view
        self._use: Callable[[str], object] = self.replace_requested.emit
        self._held: WireDrag | None = None
        self.setObjectName("search")
        self.setStyleSheet(
            f"#search {{ background: {theme.PANEL}; border: 1px solid {theme.LINE}; border-radius: 6px; }}"
            f"QListWidget {{ background: {theme.PANEL}; }}"
        )
        self.setFixedSize(_SIZE)
        self.field = SearchField("Add a node", self, closes=True)
        self.list = NodeList(scene.registry, self)
        self.list.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.list.setDragEnabled(False)
        self.list.itemClicked.connect(lambda: self._done(self.list.current()))
        column = QVBoxLayout(self)
        column.setContentsMargins(8, 8, 8, 8)
        column.setSpacing(8)
        column.addWidget(self.field)
        column.addWidget(self.list)
        self.field.textChanged.connect(self.list.filter_by)
        self.field.stepped.connect(self.list.step)
        self.field.return_pressed.connect(self._take_current)
        self.field.escaped.connect(lambda: self._done(""))
        self.hide()

    def ask_for_addition(self, at: QPoint, place: QPointF) -> None:
        """Ask, `at` a point of the view, for a node to add at a place in the scene; on a wire it is inserted."""
        scene = self._scene
        item = scene.wire_at(place) if scene.node_at(place) is None else None
        into = item.wire if item is not None and item.wire in scene.wires else None
        self._use = lambda type: self.add_requested.emit(type, place, None, None, into)
        if into is None:
            self._open(at, None, "Add a node")
        else:
            scene.highlight(item)
            self._open(at, types_for_wire(scene.patch, scene.registry, into), "Insert a node")

    def ask_for_replacement(self, at: QPoint, type: str) -> None:
        """Ask for a type other than this one, by which the selected node is replaced."""
        self._use = self.replace_requested.emit
        self._open(at, [other for other in self._scene.registry if other != type], "Replace by")

    def ask_for_end(self, at: QPoint, place: QPointF, from_port: tuple[str, str], held: WireDrag | None = None) -> None:
        """Ask for a node to connect to a port (name, and "in" or "out").

        `held` is a wire that was drawn from the port into the open: it is shown until the list closes. If it was pulled
        off an input, it can be removed instead.
        """
        scene, self._held = self._scene, held
        old = held.old if held is not None else None
        port = port_of(scene.patch, scene.registry, *from_port)
        fitting = types_that_fit(scene.registry, port, from_port[1])
        preferred = types_of_unit(scene.registry, fitting, port, from_port[1])

        def use(type: str) -> None:
            if type == NO_NODE:
                self.disconnect_requested.emit(old)
            else:
                self.add_requested.emit(type, place, from_port, old, None)

        self._use = use
        self._open(at, fitting, "Connect to a new node", "Remove the wire" if old else "", preferred)

    def _open(
        self, at: QPoint, allowed: Collection[str] | None, hint: str, first: str = "", preferred: Collection[str] = ()
    ) -> None:
        """Open at a point of the view, moved inside it if necessary. It offers all types, or only `allowed`, with
        `preferred` ones first. `first` is the text of a further choice at the top, for which `NO_NODE` is used.
        """
        room = self._view.rect()
        self.setFixedHeight(min(_SIZE.height(), room.height() - 16))
        x, y = room.width() - self.width() - 8, room.height() - self.height() - 8
        self.move(max(min(at.x(), x), 8), max(min(at.y(), y), 8))
        self.field.clear()
        self.field.setPlaceholderText(hint)
        self.list.set_allowed(allowed, first, preferred)
        self.list.filter_by("")
        self.show()
        self.raise_()
        self.field.setFocus()

    def _take_current(self) -> None:
        """Use the current type. Words that none has stay, with what the list says of them, to be corrected."""
        if self.list.current() or not self.field.text().strip():
            self._done(self.list.current())

    def _done(self, type: str) -> None:
        if self.isHidden():
            return
        self.hide()
        if type:
            self._use(type)
        if self._held is not None:
            self._held.end()
            self._held = None
        self._scene.highlight()
        self.closed.emit()
