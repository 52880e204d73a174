"""Dragging a wire from a port to a port, with a message on whether the connection is allowed."""

from PySide6.QtCore import QPointF, Qt

from underfoot.patch.node import Port, can_connect
from underfoot.patch.patch import Patch
from underfoot.patch.wiring import Wire
from underfoot.widgets.design.items import MIN_LEGIBLE_SCALE, NodeItem, WireItem
from underfoot.widgets.design.node_geometry import ROW, PlacedPort
from underfoot.widgets.design.patch_editing import map_hint, refusal, wire_at
from underfoot.widgets.design.rewiring import loudness_port, wired
from underfoot.widgets.design.scene import PatchScene

MIN_LOOSE_PX = 48.0
"""Pixels of the scene that a wire must be drawn into the open before it asks for a node at its end."""


class WireDrag:
    """One drag of a wire, from the press on a port to the release. It draws the wire, and shows the result."""

    button = Qt.MouseButton.LeftButton

    def __init__(self, scene: PatchScene, item: NodeItem, placed: PlacedPort) -> None:
        self._scene = scene
        self.old: Wire | None = None
        drawn = scene.wires.get(wire_at(scene.patch, item.end(placed)) or ("", "")) if placed.side == "in" else None
        if drawn is not None and drawn.source is not None:
            # A wire pulled off an input stays connected to its source.
            self.old, item = drawn.wire, drawn.source
            placed = next(p for p in item.geometry.ports if p.side == "out" and item.end(p) == drawn.wire[0])
            scene.show_wire(drawn, shown=False)
        self.item, self.placed = item, placed
        self.target: str = ""
        self.reason = ""
        self.is_mapped = False
        """Whether a Map can go between two units for which the wire is refused."""
        self._verdicts: dict[tuple[str, str], tuple[str, bool]] = {}
        self._opened: NodeItem | None = None
        self._line = WireItem(("", ""), None, None, placed.colour)
        scene.addItem(self._line)
        other = "in" if placed.side == "out" else "out"
        for node in scene.nodes_and_group_nodes():
            fitting = any(p.side == other and can_connect(*self._source_and_target(p)) for p in node.geometry.ports)
            node.set_dimmed("both" if node is item or not fitting else placed.side)

    def move(self, place: QPointF) -> None:
        """Follow the mouse; over a possible port, check whether the connection is allowed."""
        # Nearest to where it began it has no target: a click there connects nothing, whatever is beside it.
        is_begun = self._scene.port_at(place) != (self.item, self.placed)
        over = self._scene.node_at(place, 8.0) if is_begun else None
        self._open(over)
        found = self._candidate(place, over) if is_begun else None
        start = self.item.port_place(self.placed.side, self.placed.name)
        end = place
        self.target = self.reason = ""
        self.is_mapped = False
        if found is not None:
            node, port = found
            end = node.port_place(port.side, port.name)
            self.target = node.end(port)
            self.reason, self.is_mapped = self._verdict()
        elif over is not None and over is not self.item:
            lacks = "input that takes" if self.placed.side == "out" else "output that gives"
            self.reason = f"{over.description.title} has no {lacks} {self.placed.port.kind}s"
        self._line.refused = bool(self.reason)
        self._line.set_ends(*((start, end) if self.placed.side == "out" else (end, start)))
        self._line.update()

    def result(self, patch: Patch) -> Patch | None:
        """Return the patch after a release here; None if nothing changes."""
        wire = self.wire()
        if wire is None or self.reason or wire == self.old:
            return None
        base = patch.disconnect([self.old]) if self.old else patch
        return wired(base, self._scene.registry, *wire)

    def displaced(self, patch: Patch) -> Wire | None:
        """Return the wire that this one would replace; None if the input is free."""
        offered = self.wire()
        there = wire_at(patch, offered[1]) if offered else None
        return there if there not in (self.old, offered) else None

    @property
    def end_name(self) -> str:
        """The port at the fixed end of the wire, "node.port"."""
        return self.item.end(self.placed)

    def wire(self) -> Wire | None:
        """Return the proposed wire, allowed or not; None away from ports."""
        if not self.target:
            return None
        return (self.end_name, self.target) if self.placed.side == "out" else (self.target, self.end_name)

    def is_loose(self, place: QPointF) -> bool:
        """Return whether the wire ends on the empty canvas, at some distance from its start."""
        held = self.item.port_place(self.placed.side, self.placed.name)
        if self.old is not None:
            held = self._scene.wires[self.old].target_place()
        return (
            (place - held).manhattanLength() > MIN_LOOSE_PX
            and not self.target
            and self._scene.node_at(place, 8.0) is None
        )

    def end(self) -> None:
        """Restore everything that the drag changed in the drawing."""
        self._open(None)
        self._scene.removeItem(self._line)
        if self.old in self._scene.wires:
            self._scene.show_wire(self._scene.wires[self.old], shown=True)
        for node in self._scene.nodes_and_group_nodes():
            node.set_dimmed("")

    def _candidate(self, place: QPointF, over: NodeItem | None) -> tuple[NodeItem, PlacedPort] | None:
        side = "in" if self.placed.side == "out" else "out"
        found = self._scene.port_at(place, side)
        if found is not None:
            return found
        if over is None or over is self.item:
            return None
        at = over.mapFromScene(place)
        is_legible = self._scene.zoom >= MIN_LEGIBLE_SCALE
        if is_legible and (named := over.geometry.port_named_at(at, side)) is not None:
            return over, named
        near = sorted((p for p in over.geometry.ports if p.side == side), key=lambda port: abs(at.y() - port.at.y()))
        pointed_at = [p for p in near[:1] if is_legible and abs(at.y() - p.at.y()) <= ROW / 2]
        meant = self._meant(over, near, pointed_at) or near
        return (over, meant[0]) if meant else None

    def _meant(self, over: NodeItem, near: list[PlacedPort], pointed_at: list[PlacedPort]) -> list[PlacedPort]:
        """Return the ports that a position on a node selects, the best of the nearest first.

        A free input is before an occupied one, and before parameters. Of those it is the one whose row is pointed at,
        also if its unit is another, else a loudness that an envelope can drive, else one of the wire's unit.
        """
        fits = [p for p in near if can_connect(*self._source_and_target(p))]
        if self.placed.side == "in":
            return fits
        taken = {wire[1] for wire in self._scene.patch.wires if wire != self.old}
        free = [p for p in fits if over.end(p) not in taken]
        inputs, parameters = ([p for p in free if p.row.is_parameter == is_one] for is_one in (False, True))
        occupied = [p for p in fits if not p.row.is_parameter]
        type, loudness = self._scene.registry.get(over.node.type), ""
        if type is not None and not type.is_sink:  # a tile's second signal is audio: it drives nothing
            loudness = loudness_port(type, self.placed.port)
        loud = [p for p in parameters if p.name == loudness]
        if occupied:
            return [*inputs, *loud, *occupied]
        same_unit = [p for p in parameters if p.port.unit == self.placed.port.unit]
        return [*pointed_at, *loud, *same_unit, *parameters]

    def _source_and_target(self, other: PlacedPort) -> tuple[Port, Port]:
        return (self.placed.port, other.port) if self.placed.side == "out" else (other.port, self.placed.port)

    def _verdict(self) -> tuple[str, bool]:
        wire = self.wire()
        assert wire is not None
        if wire not in self._verdicts:
            patch, registry = self._scene.patch, self._scene.registry
            why = refusal(patch.disconnect([self.old]) if self.old else patch, registry, *wire)
            hint = map_hint(patch, registry, *wire) if why and "map" in registry else ""
            self._verdicts[wire] = hint or why, bool(hint)
        return self._verdicts[wire]

    def _open(self, over: NodeItem | None) -> None:
        """Show all parameters of the node under the mouse as ports, during the drag."""
        if over is self._opened:
            return
        if self._opened is not None:
            self._opened.set_ports(self._opened.driven, shows_all=False)
        self._opened = None
        drives = self.placed.side == "out" and self.placed.port.kind == "signal"
        if drives and over is not None and over is not self.item and not over.shows_all_ports:
            over.set_ports(over.driven, shows_all=True)
            over.set_dimmed(self.placed.side)
            self._opened = over
