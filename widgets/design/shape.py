"""Where everything of a drawn node is: its size, its ports, its small plot. In the node's own pixels."""

import math
from dataclasses import dataclass
from functools import lru_cache

from PySide6.QtCore import QPointF, QRectF
from PySide6.QtGui import QFontMetricsF

from underfoot.patch.node import NodeType, Port
from underfoot.widgets import theme

TITLE, ROW, PAD, PLOT = 24.0, 20.0, 8.0, 40.0
NARROWEST = 136.0
COST_ROOM = 48.0
REACH = 12.0
"""How far beside a port the mouse still means it."""


@dataclass(frozen=True)
class PlacedPort:
    """A port, the side it is on ("in" or "out"), and the middle of its dot."""

    port: Port
    side: str
    at: QPointF

    @property
    def name(self) -> str:
        return self.port.name

    @property
    def colour(self) -> str:
        return theme.signal_colour(self.port.kind, self.port.unit)


@dataclass(frozen=True)
class Shape:
    """The drawn form of a node with some of its parameters shown as ports."""

    width: float
    height: float
    ports: tuple[PlacedPort, ...]
    more: QPointF | None
    """The dot that stands for the parameters that could be ports and are not shown."""
    plot: QRectF

    @property
    def rect(self) -> QRectF:
        return QRectF(0.0, 0.0, self.width, self.height)

    def port(self, side: str, name: str) -> PlacedPort | None:
        return next((p for p in self.ports if p.side == side and p.name == name), None)

    def port_near(self, at: QPointF) -> PlacedPort | None:
        """The port whose dot or label is meant by a mouse at this place."""
        for placed in self.ports:
            across = at.x() - placed.at.x() if placed.side == "in" else placed.at.x() - at.x()
            if -REACH <= across <= REACH and abs(at.y() - placed.at.y()) <= ROW / 2:
                return placed
        return None


def drivable(type: NodeType) -> tuple[Port, ...]:
    """The parameters that a wire may drive, as ports."""
    return tuple(port for name, port in type.input_ports.items() if name in type.parameters)


def accent(type: NodeType) -> str:
    """The colour of a node: that of the signal it makes, or takes where it makes none."""
    ports = type.outputs or type.inputs
    return theme.signal_colour(ports[0].kind, ports[0].unit) if ports else theme.MUTED


@lru_cache(maxsize=4096)
def shape_of(type: str, label: str, inputs: tuple[Port, ...], outputs: tuple[Port, ...], hidden: int) -> Shape:
    """The form of a node with these ports, `hidden` parameters more than are shown."""
    metrics = QFontMetricsF(theme.font())
    title = QFontMetricsF(theme.font(bold=True)).horizontalAdvance(label)
    left = max((metrics.horizontalAdvance(shown(port.name)) for port in inputs), default=0.0)
    right = max((metrics.horizontalAdvance(shown(port.name)) for port in outputs), default=0.0)
    wanted = max(title + 2 * PAD + COST_ROOM, left + right + 5 * PAD, NARROWEST)
    width = math.ceil(wanted / theme.GRID) * theme.GRID
    rows = max(len(inputs), len(outputs))
    top = TITLE + PAD / 2
    below = top + rows * ROW + PAD / 2
    ports = tuple(
        PlacedPort(port, side, QPointF(0.0 if side == "in" else width, top + (i + 0.5) * ROW))
        for side, group in (("in", inputs), ("out", outputs))
        for i, port in enumerate(group)
    )
    return Shape(
        width=width,
        height=below + PLOT + PAD,
        ports=ports,
        more=QPointF(0.0, below + PLOT / 2) if hidden else None,
        plot=QRectF(PAD, below, width - 2 * PAD, PLOT),
    )


def node_shape(type: NodeType, driven: tuple[str, ...], opened: bool) -> Shape:
    """The form of a node of `type` whose parameters `driven` have a wire; `opened` shows all that could have one."""
    known = drivable(type)
    extra = known if opened else tuple(port for port in known if port.name in driven)
    return shape_of(type.type, type.label, type.inputs + extra, type.outputs, len(known) - len(extra))


def shown(name: str) -> str:
    """A port's name as it is written beside it.

    >>> shown("level_a")
    'level a'
    """
    return name.replace("_", " ")
