"""Nodes and wires on the canvas."""

from collections.abc import Callable, Sequence
from functools import cache, lru_cache
from itertools import pairwise

import numpy as np
from PySide6.QtCore import QLineF, QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPainterPath, QPainterPathStroker, QPen
from PySide6.QtWidgets import QGraphicsItem, QGraphicsSceneHoverEvent, QStyleOptionGraphicsItem, QWidget

from underfoot.patch.patch import PlacedNode
from underfoot.patch.wiring import Wire, port_name
from underfoot.quantities import pretty_text, pretty_unit, quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.design.marks import below_far_marks, button_at, is_inactive, paint_far_marks, paint_marks
from underfoot.widgets.design.node_geometry import (
    PAD,
    TITLE,
    WIDEST_TITLE,
    NodeDescription,
    NodeGeometry,
    PlacedPort,
    node_geometry,
)
from underfoot.widgets.design.node_painting import (
    PORT_RADIUS,
    NodeLook,
    paint_body,
    paint_far_port,
    paint_far_title,
    paint_port,
    paint_title,
)
from underfoot.widgets.design.patch_editing import snapped
from underfoot.widgets.design.thumbnail import thumbnail

MIN_LEGIBLE_SCALE = 0.45
"""Below this zoom a node shows its name alone: nothing else in it could be read."""
MIN_SHARP_SCALE = 0.75
"""Below this zoom a wire is one pixel wide, which costs an eighth of two."""
PROBES = 64
"""Places of a wire that are looked at when a node is held over it."""
MOVES = QGraphicsItem.GraphicsItemChange.ItemPositionChange
_MOVED = QGraphicsItem.GraphicsItemChange.ItemPositionHasChanged
_SELECTED = QGraphicsItem.GraphicsItemChange.ItemSelectedHasChanged


class NodeItem(QGraphicsItem):
    """A node on the canvas. Its content is set from outside; it has no access to patch or engine."""

    def __init__(self, node: PlacedNode, description: NodeDescription) -> None:
        super().__init__()
        self.node = node
        self.description = description
        self.wires: list[WireItem] = []
        self.geometry: NodeGeometry = node_geometry(description)
        self._bounds = _bounds_of(self.geometry)
        self.driven: tuple[str, ...] = ()
        self.shown_ports: tuple[str, ...] = ()
        self.shows_all_ports = False
        self.is_auditioned = False
        self.cost = ""
        self.state = ""
        self._plot: QPainterPath | None = None
        self._hovered = False
        self._dimmed = ""
        flag = QGraphicsItem.GraphicsItemFlag
        self.setFlags(flag.ItemIsMovable | flag.ItemIsSelectable | flag.ItemSendsGeometryChanges)
        self.setCacheMode(QGraphicsItem.CacheMode.DeviceCoordinateCache)
        self.setAcceptHoverEvents(True)
        self.setPos(*node.at)

    # --- what it shows ---

    def set_description(self, description: NodeDescription) -> None:
        """Set the name and the ports."""
        if description != self.description:
            self.description = description
            self._reshape()

    def set_ports(self, driven: tuple[str, ...], *, shows_all: bool) -> None:
        """Show these parameters as ports; `shows_all` shows all that a wire can drive."""
        if (driven, shows_all) != (self.driven, self.shows_all_ports):
            self.driven, self.shows_all_ports = driven, shows_all
            self._reshape()

    def show_port(self, name: str, *, wanted: bool) -> None:
        """Show a parameter's port even without a wire, or stop doing so."""
        self.shown_ports = tuple(port for port in self.shown_ports if port != name) + ((name,) if wanted else ())
        self._reshape()

    def _reshape(self) -> None:
        self.prepareGeometryChange()
        self.geometry = node_geometry(self.description, self.driven + self.shown_ports, shows_all=self.shows_all_ports)
        self._bounds = _bounds_of(self.geometry)
        self._update_z()
        for wire in self.wires:
            wire.follow()
        self.update()

    def _update_z(self) -> None:
        """Update the stacking order: nodes with all ports shown on top, then selected ones."""
        self.setZValue(1.0 if self.shows_all_ports else 0.5 if self.isSelected() else 0.0)

    def set_cost(self, cost: str, state: str) -> None:
        """Show the cost; `state` is "", "asleep", "unused" or "fault"."""
        if (cost, state) != (self.cost, self.state):
            self.cost, self.state = cost, state
            self.update()

    def set_curve(self, values: np.ndarray | None) -> None:
        """Show these samples in the small plot; None clears it."""
        if values is not None or self._plot is not None:
            self._plot = (
                None
                if values is None
                else thumbnail(values, are_events=self.description.outputs[0].port.kind == "event")
            )
            self.update()

    def set_auditioned(self, auditioned: bool) -> None:
        """Show whether the node is played alone."""
        if auditioned != self.is_auditioned:
            self.is_auditioned = auditioned
            self.update()

    def set_dimmed(self, side: str) -> None:
        """Dim the ports on this side during the drag of a wire."""
        if side != self._dimmed:
            self._dimmed = side
            self.update()

    @property
    def size(self) -> tuple[float, float]:
        return self.geometry.width, self.geometry.height

    def port_at(self, scene_place: QPointF, reach: float = 0.0) -> PlacedPort | None:
        """Return the port at a position of the scene, or within `reach` outside of the node; None if there is none."""
        return self.geometry.port_near(self.mapFromScene(scene_place), reach)

    def more_at(self, scene_place: QPointF) -> bool:
        """Return whether a position of the scene is on the dot that shows further ports."""
        more = self.geometry.more
        return more is not None and QLineF(self.mapFromScene(scene_place), more).length() <= PORT_RADIUS + 3.0

    def button_at(self, scene_place: QPointF) -> bool:
        """Return whether a position of the scene is on the button that plays the node alone."""
        return self.can_be_auditioned and button_at(self.geometry, self.mapFromScene(scene_place))

    @property
    def can_be_auditioned(self) -> bool:
        """Whether the node is a single node with an output, not a group."""
        return bool(self.node.type and self.description.outputs)

    def end(self, placed: PlacedPort) -> str:
        """Return the name of a port in the patch, "node.port"."""
        return f"{self.node.id}.{placed.name}"

    def wire_place(self, side: str, end: str) -> QPointF:
        """Return the scene position of a wire's end at "node.port"."""
        return self.port_place(side, port_name(end))

    def end_text(self, side: str, end: str) -> str:
        """Return the names of the node and of its port at a wire's end "node.port", as they are shown."""
        placed = self.geometry.port(side, end) or self.geometry.port(side, port_name(end))
        return f"{self.description.title}: {placed.row.text}" if placed else self.description.title

    def port_place(self, side: str, name: str) -> QPointF:
        """Return the scene position of the wires' ends at a port."""
        placed = self.geometry.port(side, name)
        return self.mapToScene(placed.at if placed else QPointF(0.0, TITLE / 2))

    # --- Qt ---

    def boundingRect(self) -> QRectF:
        return self._bounds

    def shape(self) -> QPainterPath:
        path = QPainterPath()
        path.addRect(self.geometry.rect)
        return path

    def itemChange(self, change: QGraphicsItem.GraphicsItemChange, value: object) -> object:
        if change == MOVES and isinstance(value, QPointF):
            return place_for(self, value)
        if change == _MOVED:
            for wire in self.wires:
                wire.follow()
        if change == _SELECTED:
            self._update_z()
        return super().itemChange(change, value)

    def hoverMoveEvent(self, event: QGraphicsSceneHoverEvent) -> None:
        placed = self.geometry.port_near(event.pos())
        if placed is not None:
            self.setToolTip(port_help(placed))
        elif self.more_at(event.scenePos()):
            names = ", ".join(row.text for row in self.description.drivable if row.end not in self.driven)
            self.setToolTip(f"A wire may also drive: {names}")
        elif self.button_at(event.scenePos()):
            self.setToolTip(with_native_keys("Hear this node alone (A; Shift+A on all tiles)"))
        elif event.pos().y() < TITLE:
            doc, title = pretty_text(self.description.doc), self.description.title
            cut = QFontMetricsF(theme.font(bold=True)).horizontalAdvance(title) > WIDEST_TITLE
            self.setToolTip(f"{title}\n{doc}" if cut else doc)
        else:
            self.setToolTip("")

    def hoverEnterEvent(self, event: QGraphicsSceneHoverEvent) -> None:
        self._hovered = True
        self.update()

    def hoverLeaveEvent(self, event: QGraphicsSceneHoverEvent) -> None:
        self._hovered = False
        self.update()

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        zoom = option.levelOfDetailFromTransform(painter.worldTransform())
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        quiet = self.state in ("asleep", "unused") or is_inactive(self.node)
        colour = self.description.colour
        geometry, title = self.geometry, self.description.title
        look = NodeLook(colour, self.state, quiet, self.isSelected(), self._hovered)
        paint_body(painter, geometry, look, is_far=zoom < MIN_LEGIBLE_SCALE)
        if zoom < MIN_LEGIBLE_SCALE:
            name_room = geometry.rect.adjusted(PAD / 2, below_far_marks(self.node, zoom), -PAD / 2, 0.0)
            paint_far_title(painter, name_room, title, look, zoom)
            for placed in geometry.ports:
                paint_far_port(painter, placed, faint=self._dimmed in (placed.side, "both"), zoom=zoom)
            paint_far_marks(painter, self.node, geometry, zoom, is_auditioned=self.is_auditioned)
            return
        paint_title(painter, geometry, title, self.cost, look)
        if self._plot is not None:
            painter.save()
            painter.translate(geometry.plot.topLeft())
            painter.scale(geometry.plot.width(), geometry.plot.height())
            pen = QPen(QColor(theme.mixed(colour, theme.RAISED, 0.35 if quiet else 0.85)), 1.0)
            pen.setCosmetic(True)
            painter.setPen(pen)
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.drawPath(self._plot)
            painter.restore()
        for placed in geometry.ports:
            has_wire = placed.name in self.driven or not placed.row.is_parameter
            paint_port(painter, geometry, placed, faint=self._dimmed in (placed.side, "both"), filled=has_wire)
        if geometry.more is not None:
            painter.setPen(QPen(QColor(theme.MUTED if self._hovered else theme.FAINT), 1.0))
            painter.setBrush(QColor(theme.GROUND))
            painter.drawEllipse(geometry.more, 3.0, 3.0)
        has_button = self._hovered and self.can_be_auditioned
        paint_marks(painter, self.node, geometry, has_button=has_button, is_auditioned=self.is_auditioned)


def place_for(item: QGraphicsItem, wanted: QPointF) -> QPointF:
    """Return the place of an item that is to be at `wanted`: on the grid, if the mouse drags it."""
    scene = item.scene()
    is_dragged = scene is not None and scene.mouseGrabberItem() is not None
    return QPointF(*snapped(wanted.x(), wanted.y())) if is_dragged else wanted


def _bounds_of(geometry: NodeGeometry) -> QRectF:
    """Return the rectangle that a node can paint; cached, because every wire requests it."""
    return geometry.rect.adjusted(-PORT_RADIUS - 3, -3, PORT_RADIUS + 3, 3)


class WireItem(QGraphicsItem):
    """A wire between two nodes, or from a node to the mouse. At rest, `WirePicture` paints it."""

    def __init__(self, wire: Wire, source: NodeItem | None, target: NodeItem | None, colour: str) -> None:
        super().__init__()
        self.wire = wire
        self.source, self.target = source, target
        self.colour = colour
        self.chosen = False
        self.refused = False
        self.is_highlighted = False
        self.is_in_picture = False
        self.outside = ""
        """The names of the node and of its port at an end outside of the open sub-patch."""
        self.unit = ""
        """Of the signal, for its range."""
        self.signal_range: tuple[float, float] | None = None
        """Least and largest value in the last preview of its source, if it is a signal."""
        self.about_to_move: Callable[[WireItem], None] | None = None
        """The scene is notified before the wire moves."""
        self._hovered = False
        self._path = QPainterPath()
        self._outline: QPainterPath | None = None
        self._lines: list[QLineF] = []
        self._probes: list[QPointF] = []
        self._bounds = QRectF()
        self.setZValue(-1.0)
        self.setAcceptHoverEvents(True)
        for end in (source, target):
            if end is not None:
                end.wires.append(self)
        if source and target:
            self.follow()

    def follow(self) -> None:
        """Update the line to the positions of its nodes."""
        if self.source and self.target:
            self.set_ends(
                self.source.wire_place("out", self.wire[0]),
                self.target.wire_place("in", self.wire[1]),
            )

    def target_place(self) -> QPointF:
        """Return the scene position of its end."""
        return self._path.currentPosition()

    def path_middle(self) -> QPointF:
        """Return the scene position of its middle."""
        return self._path.pointAtPercent(0.5)

    def set_ends(self, start: QPointF, end: QPointF) -> None:
        """Set the start and end positions."""
        if self.about_to_move is not None:
            self.about_to_move(self)
        self.prepareGeometryChange()
        self._path, self._lines, self._probes, self._outline = curve(start, end), [], [], None
        self._bounds = self._path.boundingRect().adjusted(-4, -4, 4, 4)

    def detach(self) -> None:
        """Detach the wire from its nodes."""
        for end in (self.source, self.target):
            if end is not None and self in end.wires:
                end.wires.remove(self)

    def set_in_picture(self, in_picture: bool) -> None:
        """Set whether `WirePicture` paints the line."""
        self.is_in_picture = in_picture
        self._paint_or_not()

    def set_chosen(self, chosen: bool) -> None:
        """Show the wire as selected for deletion."""
        self.chosen = chosen
        self._paint_or_not()

    def set_highlighted(self, is_highlighted: bool) -> None:
        """Highlight the wire as the target of an insertion."""
        if is_highlighted != self.is_highlighted:
            self.is_highlighted = is_highlighted
            self.setZValue(2.0 if is_highlighted else -1.0)
            self._paint_or_not()

    def _paint_or_not(self) -> None:
        is_lit = self.chosen or self.is_highlighted or self._hovered
        self.update()
        self.setFlag(QGraphicsItem.GraphicsItemFlag.ItemHasNoContents, self.is_in_picture and not is_lit)
        self.update()

    def passes(self, rect: QRectF) -> bool:
        """Return whether the line passes through a rectangle of the scene."""
        if not self._bounds.intersects(rect):
            return False
        if not self._probes:
            self._probes = [self._path.pointAtPercent(i / PROBES) for i in range(PROBES + 1)]
        return any(map(rect.contains, self._probes))

    def boundingRect(self) -> QRectF:
        return self._bounds

    def shape(self) -> QPainterPath:
        if self._outline is None:
            stroker = QPainterPathStroker()
            stroker.setWidth(10.0)
            self._outline = stroker.createStroke(self._path)
        return self._outline

    def hoverEnterEvent(self, event: QGraphicsSceneHoverEvent) -> None:
        self._hovered = True
        self.setToolTip(self._says())
        self._paint_or_not()

    def _says(self) -> str:
        """Return from where to where it leads, and the range of its signal."""
        ends = ((self.source, "out", self.wire[0]), (self.target, "in", self.wire[1]))
        names = " → ".join(self.outside if item is None else item.end_text(side, end) for item, side, end in ends)
        if self.signal_range is None:
            return names
        low, high = (quantity(value, self.unit, 3) for value in self.signal_range)
        return f"{names}\n{low} to {high} in the step that is previewed"

    def hoverLeaveEvent(self, event: QGraphicsSceneHoverEvent) -> None:
        self._hovered = False
        self._paint_or_not()

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        if self.chosen or self.is_highlighted:
            painter.setBrush(Qt.BrushStyle.NoBrush)
            painter.setPen(
                _wire_pen(theme.CONTACT if self.is_highlighted else theme.TEXT, 6.0 if self.is_highlighted else 4.0)
            )
            painter.drawPath(self._path)
        self.paint_line(painter)

    def paint_line(self, painter: QPainter) -> None:
        """Paint the line, as straight segments, which Qt paints much faster; its width depends on the zoom."""
        width = 1.0 if painter.worldTransform().m11() < MIN_SHARP_SCALE else 2.0
        painter.setPen(_wire_pen(theme.ALARM if self.refused else self.colour, width, lit=self._hovered))
        if not self._lines:
            self._lines = _straight_lines(self._path)
        painter.drawLines(self._lines)


@lru_cache(maxsize=64)
def _wire_pen(colour: str, width: float, *, lit: bool = False) -> QPen:
    pen = QPen(QColor(colour).lighter(125) if lit else QColor(colour), width)
    pen.setCosmetic(width == 1.0)
    return pen


def _straight_lines(path: QPainterPath) -> list[QLineF]:
    """Return straight segments that are visually identical to a path of `curve`: one if the path is straight, as dots
    would be seen along it where several meet.
    """
    corners = [(path.elementAt(i).x, path.elementAt(i).y) for i in range(path.elementCount())]
    (left, top), (right, bottom) = corners[0], corners[-1]  # the same corner, where a wire ends where it begins
    if top == bottom and left <= right:
        return [QLineF(left, top, right, bottom)]
    count = 8 + min(int(abs(right - left) + abs(bottom - top)) // 24, 16)
    points = (_weights(count) @ corners).tolist()
    return [QLineF(*begin, *end) for begin, end in pairwise(points)]


@cache
def _weights(count: int) -> np.ndarray:
    """Return the Bernstein weights of a cubic at `count` + 1 equally spaced parameters: float64 [place, corner]."""
    along = np.linspace(0.0, 1.0, count + 1)[:, None]
    return np.hstack([(1 - along) ** 3, 3 * along * (1 - along) ** 2, 3 * along**2 * (1 - along), along**3])


def curve(start: QPointF, end: QPointF) -> QPainterPath:
    """Return the path of a wire: leaving to the right, arriving from the left; a short one does not turn back."""
    ahead, across = end.x() - start.x(), abs(end.y() - start.y())
    reach = abs(ahead) * 0.5
    if ahead < 48.0:
        reach = max(reach, min(min(abs(ahead), 40.0) + 0.25 * across, 120.0))
    reach = min(reach, 160.0)
    path = QPainterPath(start)
    path.cubicTo(start + QPointF(reach, 0.0), end - QPointF(reach, 0.0), end)
    return path


def port_help(placed: PlacedPort) -> str:
    """Return a description of a port in one or two lines."""
    port = placed.port
    what = "events" if port.kind == "event" else f"signal{' in ' + pretty_unit(port.unit) if port.unit else ''}"
    return f"{placed.row.text}: {what}" + (f"\n{pretty_text(port.doc)}" if port.doc else "")


def bounds(items: Sequence[QGraphicsItem]) -> QRectF:
    """Return the bounding rectangle of these items in the scene."""
    rect = QRectF()
    for item in items:
        rect = rect.united(item.sceneBoundingRect())
    return rect
