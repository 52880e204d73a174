"""The drawn patch: keeps one item for each node and wire, and changes only what differs."""

from collections.abc import Iterable, Mapping

import numpy as np
from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QBrush, QColor, QTransform
from PySide6.QtWidgets import QGraphicsScene

from underfoot.patch.heard import as_heard
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch, PlacedNode, Wire
from underfoot.widgets import theme
from underfoot.widgets.design.editing import driven_parameters, drivers, upstream
from underfoot.widgets.design.items import NodeItem, WireItem, bounds
from underfoot.widgets.design.shape import REACH, PlacedPort

WORLD = 40_000.0
"""Pixels in each direction: large and fixed, so that the view never jumps when a node is added."""

STIR = 0.15
"""A node's cost is written anew when it has changed by this share."""


class PatchScene(QGraphicsScene):
    """Shows a patch. Selecting and dragging happen in it; everything else is the canvas's."""

    def __init__(self, registry: Registry) -> None:
        super().__init__(-WORLD, -WORLD, 2 * WORLD, 2 * WORLD)
        self.setItemIndexMethod(QGraphicsScene.ItemIndexMethod.BspTreeIndex)
        self.setBackgroundBrush(QBrush(QColor(theme.GROUND)))
        self.registry = registry
        self.patch = Patch()
        self.nodes: dict[str, NodeItem] = {}
        self.wires: dict[Wire, WireItem] = {}
        self._costs: dict[str, float] = {}

    def show(self, patch: Patch) -> None:
        """Show this patch instead."""
        self.patch = patch
        placed = {node.id: node for node in patch.nodes}
        wanted = set(patch.wires)
        for wire in [w for w in self.wires if w not in wanted or not self._keeps(w, placed)]:
            gone = self.wires.pop(wire)
            gone.unhook()
            self.removeItem(gone)
        for id in [i for i, item in self.nodes.items() if i not in placed or placed[i].type != item.node.type]:
            self.removeItem(self.nodes.pop(id))
        for id, node in placed.items():
            if id not in self.nodes:
                self.nodes[id] = NodeItem(node, self.registry[node.type])
                self.addItem(self.nodes[id])
            elif self.nodes[id].node is not node:
                is_marked_otherwise = self.nodes[id].node.marks != node.marks
                self.nodes[id].node = node
                self.nodes[id].setPos(*node.at)
                if is_marked_otherwise:
                    self.nodes[id].update()
        wired = drivers(patch)
        for id, item in self.nodes.items():
            item.set_ports(driven_parameters(self.registry, item.node.type, wired.get(id, ())), item.opened)
        for wire in patch.wires:
            if wire not in self.wires:
                self._draw(wire)

    def _keeps(self, wire: Wire, placed: Mapping[str, PlacedNode]) -> bool:
        """Whether both ends of a drawn wire stay what they are."""
        ids = (end.partition(".")[0] for end in wire)
        return all(id in placed and id in self.nodes and placed[id].type == self.nodes[id].node.type for id in ids)

    def _draw(self, wire: Wire) -> None:
        (source, _, out), (target, _, _) = (end.partition(".") for end in wire)
        port = self.nodes[source].node_type.output_ports[out]
        colour = theme.signal_colour(port.kind, port.unit)
        self.wires[wire] = WireItem(wire, self.nodes[source], self.nodes[target], colour)
        self.addItem(self.wires[wire])

    # --- asking ---

    def selected_ids(self) -> list[str]:
        """The selected nodes, in the order of the patch."""
        return [id for id, item in self.nodes.items() if item.isSelected()]

    def select(self, ids: Iterable[str]) -> None:
        """Select these nodes and no others."""
        wanted = set(ids)
        blocked = self.blockSignals(True)
        for id, item in self.nodes.items():
            item.setSelected(id in wanted)
        self.blockSignals(blocked)
        self.selectionChanged.emit()

    def node_at(self, place: QPointF, reach: float = 0.0) -> NodeItem | None:
        """The uppermost node here, or within `reach` of here."""
        area = QRectF(place.x() - reach, place.y() - reach, 2 * reach + 0.1, 2 * reach + 0.1)
        return next((item for item in self.items(area) if isinstance(item, NodeItem)), None)

    def port_at(self, place: QPointF) -> tuple[NodeItem, PlacedPort] | None:
        """The port that a mouse here means."""
        area = QRectF(place.x() - REACH, place.y() - REACH, 2 * REACH, 2 * REACH)
        for item in self.items(area):
            if isinstance(item, NodeItem):
                placed = item.port_at(place)
                if placed is not None:
                    return item, placed
        return None

    def wire_at(self, place: QPointF) -> WireItem | None:
        """The wire under the mouse, where no node is."""
        found = self.itemAt(place, QTransform())
        return found if isinstance(found, WireItem) else None

    def chosen_wires(self) -> list[Wire]:
        return [wire for wire, item in self.wires.items() if item.chosen]

    def choose(self, wire: WireItem | None) -> None:
        """Mark this wire as what Delete takes away, and no other."""
        for item in self.wires.values():
            if item.chosen != (item is wire):
                item.set_chosen(item is wire)

    def sizes(self) -> dict[str, tuple[float, float]]:
        return {id: item.size for id, item in self.nodes.items()}

    def places(self) -> dict[str, tuple[float, float]]:
        """Nodes that were dragged, and where to."""
        return {
            id: (item.pos().x(), item.pos().y())
            for id, item in self.nodes.items()
            if (item.pos().x(), item.pos().y()) != item.node.at
        }

    def extent(self, ids: Iterable[str] = ()) -> QRectF:
        """The rectangle around these nodes, or around all."""
        chosen = [self.nodes[id] for id in ids]
        return bounds(chosen or list(self.nodes.values()))

    # --- what the engine says ---

    def show_costs(self, share: Mapping[str, float] | None, awake: Mapping[str, int]) -> None:
        """Each node's share of a block, and for how many tiles it is awake; None when nothing runs.

        A node is unused where it leads to no output that plays; one that is only not built yet is not.
        """
        heard = as_heard(self.patch, self.registry)
        used = upstream(heard, (node.id for node in heard.nodes if self.registry[node.type].is_sink))
        for id, item in self.nodes.items():
            if item.state == "fault":
                continue
            if share is None or id not in share:
                self._costs.pop(id, None)
                item.set_cost("", "" if share is None or id in used else "unused")
                continue
            # Figures that tremble would have every node drawn anew twice a second.
            before = self._costs.get(id, -1.0)
            if abs(share[id] - before) > STIR * before:
                self._costs[id] = share[id]
            item.set_cost(percent(self._costs[id]), "" if awake.get(id, 0) else "asleep")

    def show_fault(self, id: str | None) -> None:
        """Mark the node that made a value that is not finite, or clear the mark."""
        for other, item in self.nodes.items():
            if other == id:
                item.set_cost("", "fault")
            elif item.state == "fault":
                item.set_cost("", "")

    def show_alone(self, id: str) -> None:
        """Mark the node that is heard alone; "" for none."""
        for other, item in self.nodes.items():
            item.set_alone(other == id)

    def show_curve(self, id: str, values: np.ndarray | None) -> None:
        if id in self.nodes and self.nodes[id].node_type.outputs:
            self.nodes[id].set_curve(values)


def percent(share: float) -> str:
    """A share of the block, short enough for a title strip.

    >>> percent(0.008), percent(0.00004), percent(0.123)
    ('0.8 %', '< 0.1 %', '12 %')
    """
    if share < 0.0005:
        return "< 0.1 %"
    return f"{100 * share:.1f} %" if share < 0.0995 else f"{100 * share:.0f} %"
