"""Lists over the canvas in which nodes, their inputs and wires are chosen."""

from functools import cached_property
from typing import TypeVar

from PySide6.QtCore import QPoint, QPointF

from underfoot.patch.wiring import Wire, node_id, port_name
from underfoot.widgets.design.connection_search import Answers, ConnectionSearch
from underfoot.widgets.design.driving import DriverMenus
from underfoot.widgets.design.item_search import ItemSearch
from underfoot.widgets.design.node_drops import NodeDropView
from underfoot.widgets.design.node_search import NodeSearch
from underfoot.widgets.design.patch_editing import port_of, wire_at
from underfoot.widgets.design.rewiring import free_in_sum, sum_of
from underfoot.widgets.design.search_popup import SearchPopup

_Search = TypeVar("_Search", bound=SearchPopup)

BESIDE_PX = 48
"""Distance of a new node from the node that feeds it, in pixels of the scene, if the list of connections adds it."""


class AskingView(NodeDropView):
    """Asks what to add, to put in another's place, to connect, and to find; the base class of the canvas."""

    @cached_property
    def search(self) -> NodeSearch:
        """The list of types; each list is made when it is asked for: a window would be drawn later for them."""
        made = NodeSearch(self.patch_scene, self)
        made.add_requested.connect(self.add)
        made.replace_requested.connect(self.replace)
        made.disconnect_requested.connect(self.cut_wire)
        return self._made(made)

    @cached_property
    def item_search(self) -> ItemSearch:
        """The list of what is in the patch."""
        made = ItemSearch(self.patch_scene, self)
        made.chosen.connect(self.show_item)
        return self._made(made)

    @cached_property
    def connection_search(self) -> ConnectionSearch:
        """The list of inputs to connect to, and of wires to take away."""
        answers = Answers(self.connect_ports, self.add_up, self.connect_by_map, self._ask_for_fed, self.cut_wire)
        return self._made(ConnectionSearch(self.patch_scene, self, answers))

    def add_up(self, source: str, target: str, old: Wire | None = None) -> None:
        """Wire an output to an input that has a wire, in place of the wire `old`, by a node that adds both: a new one,
        or the one that is there already and has an input left.
        """
        patch = self.document.patch.disconnect([old]) if old else self.document.patch
        wire = wire_at(patch, target)
        assert wire is not None
        if free := free_in_sum(patch, self.registry, wire):
            self.document.edit(patch.connect(source, free, self.registry), "Connect")
        else:
            drawn = self.patch_scene.wires.get(wire)  # not within a sub-patch that is closed
            ends = [QPointF(*patch.node(node_id(end)).at) for end in wire]
            middle = drawn.path_middle() if drawn is not None else (ends[0] + ends[1]) / 2.0
            adding = sum_of(self.registry, port_of(patch, self.registry, source, "out").kind)
            self.add(adding, middle, (source, "out"), old, wire)

    @cached_property
    def driver_menus(self) -> DriverMenus:
        """The menus of what can drive a parameter."""
        return DriverMenus(self.document, self.patch_scene, self)

    def connect_by_map(self, source: str, target: str, old: Wire | None = None) -> None:
        """Drive a parameter by what this output gives, through a new Map, in place of its `old` wire if there is one,
        and select the Map: its range is set next.
        """
        before = self.document.patch
        self.driver_menus.drive(node_id(target), port_name(target), "map", source, old)
        self.patch_scene.select([node.id for node in self.document.patch.nodes[len(before.nodes) :]])
        if told := self._gave_way(before, target):
            self.show_message(told)

    def _made(self, search: _Search) -> _Search:
        search.closed.connect(self.setFocus)
        self.document.changed.connect(search.give_up)  # its wire or node may be gone
        return search

    def open_search(self, place: QPoint | None = None) -> None:
        """Open the list for a node to add at a position of the view, or at the mouse; on a wire it is inserted."""
        self.show_message("")  # it was read, or would be below the list
        at = place or self._mouse_position()
        self.search.ask_for_addition(at, self.mapToScene(at))

    def open_replacements(self) -> None:
        """Open the list of types by which the selected node can be replaced."""
        ids = self.patch_scene.selected()
        if len(ids) != 1 or ids[0] not in self.patch_scene.nodes:
            self.show_message("Select one node to replace")
            return
        item = self.patch_scene.nodes[ids[0]]
        self.search.ask_for_replacement(self.mapFromScene(item.pos()), item.node.type)

    def open_connections(self) -> None:
        """Open the list, beside the selected node or sub-patch, of the inputs that its outputs can be wired to, and of
        the wires that can be taken away.
        """
        chosen = [item for item in self.patch_scene.nodes_and_group_nodes() if item.isSelected()]
        if len(chosen) != 1:
            self.show_message("Select one node to connect its output")
        elif not self.connection_search.ask_for(chosen[0], self.mapFromScene(chosen[0].sceneBoundingRect().topRight())):
            self.show_message(f"{chosen[0].description.title} has no output")

    def _ask_for_fed(self, source: str) -> None:
        """Ask for a node to add that this output feeds."""
        item = next(item for item in self.patch_scene.nodes_and_group_nodes() if item.isSelected())
        place = item.wire_place("out", source) + QPointF(BESIDE_PX, 0.0)
        self.search.ask_for_end(self.mapFromScene(place), place, (source, "out"))

    def _mouse_position(self) -> QPoint:
        """Return the mouse's position in the view, or the view's centre if the mouse is outside."""
        mouse = self.viewport().mapFromGlobal(self.cursor().pos())
        return mouse if self.viewport().rect().contains(mouse) else self.viewport().rect().center()
