"""The list of nodes at a place of the canvas: which types fit there, and what the chosen one is for."""

from collections.abc import Callable, Collection

from PySide6.QtCore import QPoint, QPointF, Signal
from PySide6.QtWidgets import QWidget

from underfoot.widgets.design.connecting import WireDrag
from underfoot.widgets.design.node_list import NO_NODE, NodeList
from underfoot.widgets.design.patch_editing import port_of
from underfoot.widgets.design.rewiring import types_for_wire, types_of_unit, types_that_fit
from underfoot.widgets.design.scene import PatchScene
from underfoot.widgets.design.search_popup import SearchPopup


class NodeSearch(SearchPopup):
    """Asks for a node to add, to insert into a wire, to connect to a port, or to put in another's place, and closes."""

    add_requested = Signal(str, QPointF, object, object, object)
    """Type and place of a node, the port that it is connected to, the wire that was there before, and the wire that it
    is inserted into; the last three can be None."""
    replace_requested = Signal(str)
    disconnect_requested = Signal(object)
    """The `Wire` that was pulled off and is to be removed."""

    list: NodeList

    def __init__(self, scene: PatchScene, view: QWidget) -> None:
        super().__init__(view, NodeList(scene.registry))
        self._scene = scene
        self._use: Callable[[str], object] = self.replace_requested.emit
        self._held: WireDrag | None = None
        self.chosen.connect(lambda type: self._use(type))
        self.closed.connect(self._let_go)

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
        """Open at a point of the view. It offers all types, or only `allowed`, with
        `preferred` ones first. `first` is the text of a further choice at the top, for which `NO_NODE` is used.
        """
        self.list.set_allowed(allowed, first, preferred)
        self.open_at(at, hint)

    def _let_go(self) -> None:
        if self._held is not None:
            self._held.end()
            self._held = None
        self._scene.highlight()
