"""Layout of a drawn node: its size, ports and small plot, in the node's pixels."""

import math
from collections.abc import Iterable
from functools import lru_cache

from msgspec import Struct
from PySide6.QtCore import QLineF, QPointF, QRectF
from PySide6.QtGui import QFontMetricsF

from underfoot.patch.node import NodeType, Port
from underfoot.widgets import theme

TITLE, ROW, PAD, PLOT = 24.0, 20.0, 8.0, 40.0
NAME_AT = PAD + 4.0
"""Distance of a port's name from its side of the node."""
FIRST_PORT = TITLE + PAD / 2 + ROW / 2
"""Height of the first ports, below the top of a node."""
NARROWEST = 136.0
COST_ROOM = 48.0
WIDEST_TITLE, WIDEST_PORT = 160.0, 208.0
"""Room for every type's name, and for a port with its node's name on a group. A longer name is cut short."""
REACH = 12.0
"""Distance around a port within which the mouse hits it, in pixels of the node."""
REACH_ON_SCREEN = 8.0
"""The same outside of the node, and above and below, in pixels of the screen: where it is more, zoomed out."""


class PortRow(Struct, frozen=True):
    """A port in a node's face: the positions of its dot and label, and whether it is a parameter."""

    port: Port
    end: str
    """The port's name; "node.port" where the face is that of a whole group."""
    text: str
    is_parameter: bool = False


class NodeDescription(Struct, frozen=True):
    """The displayed content of a node, independent of its layout."""

    title: str
    doc: str
    colour: str
    inputs: tuple[PortRow, ...]
    outputs: tuple[PortRow, ...]
    drivable: tuple[PortRow, ...] = ()
    """The parameters that a wire may drive."""


class PlacedPort(Struct, frozen=True):
    """A port, the side it is on ("in" or "out"), and the middle of its dot."""

    row: PortRow
    side: str
    at: QPointF

    @property
    def port(self) -> Port:
        return self.row.port

    @property
    def name(self) -> str:
        return self.row.end

    @property
    def colour(self) -> str:
        return theme.signal_colour(self.port.kind, self.port.unit)


class NodeGeometry(Struct, frozen=True):
    """The drawn form of a node with some of its parameters shown as ports."""

    width: float
    height: float
    ports: tuple[PlacedPort, ...]
    more: QPointF | None
    """The dot for parameters that could be ports and are not shown."""
    plot: QRectF

    @property
    def rect(self) -> QRectF:
        return QRectF(0.0, 0.0, self.width, self.height)

    def port(self, side: str, name: str) -> PlacedPort | None:
        return next((p for p in self.ports if p.side == side and p.name == name), None)

    def port_near(self, at: QPointF, reach: float = 0.0) -> PlacedPort | None:
        """Return the port whose dot or label is at this position, or within `reach` of it outside of the node; of
        several the nearest, None if there is none.
        """

        def is_hit(placed: PlacedPort) -> bool:
            inwards = at.x() - placed.at.x() if placed.side == "in" else placed.at.x() - at.x()
            return -max(REACH, reach) <= inwards <= REACH and abs(at.y() - placed.at.y()) <= max(ROW / 2, reach)

        return min(filter(is_hit, self.ports), key=lambda placed: QLineF(at, placed.at).length(), default=None)

    def port_named_at(self, at: QPointF, side: str) -> PlacedPort | None:
        """Return the port on this side whose name is written at this position; None if none is."""
        inwards = at.x() if side == "in" else self.width - at.x()
        names = (p for p in self.ports if p.side == side and abs(at.y() - p.at.y()) <= ROW / 2)
        return next((p for p in names if 0.0 <= inwards <= NAME_AT + _name_width(p.row)), None)


def accent(type: NodeType) -> str:
    """Return the colour of a node: that of its output signal, or of its input if it has no output."""
    ports = type.outputs or type.inputs
    return theme.signal_colour(ports[0].kind, ports[0].unit) if ports else theme.MUTED


def description_of(type: NodeType, label: str = "") -> NodeDescription:
    """Return the description of a node of `type`; `label` is its own name, if it has one."""

    def rows(ports: Iterable[Port], *, are_parameters: bool = False) -> tuple[PortRow, ...]:
        return tuple(PortRow(port, port.name, display_name(port.name), are_parameters) for port in ports)

    drivable = rows(type.drivable_ports, are_parameters=True)
    return NodeDescription(label or type.label, type.doc, accent(type), rows(type.inputs), rows(type.outputs), drivable)


@lru_cache(maxsize=4096)
def geometry_of(title: str, inputs: tuple[PortRow, ...], outputs: tuple[PortRow, ...], hidden: int) -> NodeGeometry:
    """Return the layout of a node with these ports and `hidden` further parameters."""
    title_px = min(QFontMetricsF(theme.font(bold=True)).horizontalAdvance(title), WIDEST_TITLE)
    left, right = (max(map(_name_width, rows), default=0.0) for rows in (inputs, outputs))
    wanted = max(title_px + 2 * PAD + COST_ROOM, left + right + 5 * PAD, NARROWEST)
    width = math.ceil(wanted / theme.GRID) * theme.GRID
    rows = max(len(inputs), len(outputs))
    below = FIRST_PORT + (rows - 0.5) * ROW + PAD / 2
    ports = tuple(
        PlacedPort(row, side, QPointF(0.0 if side == "in" else width, FIRST_PORT + i * ROW))
        for side, group in (("in", inputs), ("out", outputs))
        for i, row in enumerate(group)
    )
    return NodeGeometry(
        width=width,
        height=below + PLOT + PAD,
        ports=ports,
        more=QPointF(0.0, below + PLOT / 2) if hidden else None,
        plot=QRectF(PAD, below, width - 2 * PAD, PLOT),
    )


def _name_width(row: PortRow) -> float:
    """Return the width of a port's name; a longer one is cut short."""
    return min(QFontMetricsF(theme.font()).horizontalAdvance(row.text), WIDEST_PORT)


def node_geometry(
    description: NodeDescription, driven: tuple[str, ...] = (), *, shows_all: bool = False
) -> NodeGeometry:
    """Return the layout of a node with wires at the parameters `driven`; `shows_all` shows all that could have one.

    The others come below, so that no port moves away from a wire that is brought to it.
    """
    extra = tuple(row for row in description.drivable if row.end in driven)
    if shows_all:
        extra += tuple(row for row in description.drivable if row.end not in driven)
    return geometry_of(
        description.title, description.inputs + extra, description.outputs, len(description.drivable) - len(extra)
    )


def display_name(name: str) -> str:
    """Return the label of a port.

    >>> display_name("level_a")
    'level a'
    """
    return name.replace("_", " ")
