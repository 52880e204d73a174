"""Drawing of groups and notes on the canvas."""

from collections.abc import Collection, Iterable, Sequence

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPen
from PySide6.QtWidgets import QGraphicsItem, QGraphicsSceneHoverEvent, QStyleOptionGraphicsItem, QWidget

from underfoot.patch.groups import Group, Note
from underfoot.patch.patch import PlacedNode
from underfoot.patch.wiring import Wire
from underfoot.widgets import theme
from underfoot.widgets.design.group_view import colour_of
from underfoot.widgets.design.items import MIN_LEGIBLE_SCALE, MOVES, NodeItem, WireItem, place_for
from underfoot.widgets.design.node_geometry import PAD, TITLE, NodeDescription, PlacedPort
from underfoot.widgets.design.node_painting import MIN_ZOOM, paint_far_note

FRAME_PAD = 2.0 * theme.GRID
EDGE_REACH = 6.0
"""Distance from the right edge of a note within which the mouse takes hold of it, in pixels."""
STUB = 40.0
"""Visible length of a wire that leaves the open group, in pixels."""


class GroupNodeItem(NodeItem):
    """A collapsed group, drawn as one node."""

    def __init__(self, group: Group, node: PlacedNode, description: NodeDescription) -> None:
        super().__init__(node, description)
        self.shown_group = group

    def set_group(self, group: Group, node: PlacedNode, description: NodeDescription) -> None:
        """Update the group, and the node that represents it."""
        self.shown_group, self.node = group, node
        self.setPos(*group.at)
        self.set_description(description)
        self.update()
        for wire in self.wires:
            wire.follow()

    def end(self, placed: PlacedPort) -> str:
        return placed.name

    def wire_place(self, side: str, end: str) -> QPointF:
        return self.port_place(side, end)

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        super().paint(painter, option, widget)
        inner = self.geometry.rect.adjusted(3.5, 3.5, -3.5, -3.5)
        painter.setPen(QPen(QColor(theme.mixed(self.description.colour, theme.RAISED, 0.5)), 1.0))
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(inner, 4.0, 4.0)
        if option.levelOfDetailFromTransform(painter.worldTransform()) < MIN_LEGIBLE_SCALE:
            return  # its name is there
        # Three small boxes indicate the nodes inside.
        plot = self.geometry.plot
        for i in range(3):
            box = QRectF(plot.center().x() - 26 + 18 * i, plot.center().y() - 6 + 4 * (i % 2), 14, 9)
            painter.drawRoundedRect(box, 2.0, 2.0)


class GroupFrameItem(QGraphicsItem):
    """The frame around an open group; it follows its members."""

    def __init__(self, group: Group) -> None:
        super().__init__()
        self.shown_group = group
        self._is_entered = False
        self._items: Sequence[QGraphicsItem] = ()
        self._rect = QRectF()
        self.setZValue(-3.0)

    def follow(self, group: Group, items: Sequence[QGraphicsItem], depth: int) -> None:
        """Set the frame around these items; `depth` is the number of enclosing groups."""
        self.shown_group, self._items = group, items
        self.setZValue(-3.0 - 1.0 / (depth + 1.0))
        self.adjust()

    def adjust(self) -> None:
        """Update the frame to the items' current positions."""
        rect = self.rect_without(())
        if rect != self._rect:
            self.prepareGeometryChange()
            self._rect = rect
        self.update()

    def rect_without(self, leaving: Collection[QGraphicsItem]) -> QRectF:
        """Return the frame around all that is in it but these, in scene coordinates; null if nothing is left."""
        frames = [item for item in self._items if isinstance(item, GroupFrameItem)]
        rects = [item_rect(item) for item in self._items if item not in leaving and item not in frames]
        return framed([*rects, *(frame.rect_without(leaving) for frame in frames)])

    def frame_rect(self) -> QRectF:
        """Return the frame, in scene coordinates."""
        return self._rect

    def set_entered(self, on: bool) -> None:
        """Show whether what is dragged would be put into the group."""
        self._is_entered = on
        self.update()

    def title_rect(self) -> QRectF:
        """Return the title, in scene coordinates, by which the mouse drags the frame."""
        return QRectF(self._rect.left(), self._rect.top(), self._rect.width(), TITLE)

    def boundingRect(self) -> QRectF:
        return self._rect.adjusted(-1, -1, 1, 1)

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        colour = colour_of(self.shown_group)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        line, ground = (1.0, 0.16) if self._is_entered else (0.55, 0.08)
        painter.setPen(QPen(QColor(theme.mixed(colour, theme.GROUND, line)), 1.0))
        painter.setBrush(QColor(theme.mixed(colour, theme.GROUND, ground)))
        painter.drawRoundedRect(self._rect, 8.0, 8.0)
        zoom = option.levelOfDetailFromTransform(painter.worldTransform())
        if zoom < MIN_ZOOM:
            return
        is_far = zoom < MIN_LEGIBLE_SCALE
        painter.setFont(theme.font(round(theme.SMALL_PX / zoom), bold=True) if is_far else theme.font(bold=True))
        painter.setPen(QColor(theme.mixed(colour, theme.TEXT, 0.6)))
        title, metrics = self.shown_group.title or "Group", painter.fontMetrics()
        room = self._title_room(metrics.horizontalAdvance(title), TITLE + FRAME_PAD - 1.0 if is_far else TITLE)
        text = metrics.elidedText(title, Qt.TextElideMode.ElideRight, int(room.width()))
        painter.drawText(room, Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter, text)

    def _title_room(self, width: float, height: float) -> QRectF:
        """Return the first stretch of the strip at the top of this width that nothing covers, or else the widest."""
        strip = QRectF(self._rect.left() + PAD + 4, self._rect.top(), self._rect.width() - 2 * PAD - 4, height)
        covers = [item_rect(item) for item in self.scene().items(strip) if isinstance(item, NodeItem | NoteItem)]
        stretches, left = [], strip.left()
        for cover in sorted(covers, key=QRectF.left):
            stretches.append((left, cover.left() - PAD))
            left = max(left, cover.right() + PAD)
        stretches.append((left, strip.right()))
        widest = max(stretches, key=lambda stretch: stretch[1] - stretch[0])
        left, right = next((stretch for stretch in stretches if stretch[1] - stretch[0] >= width), widest)
        return QRectF(left, strip.top(), right - left, strip.height())


class NoteItem(QGraphicsItem):
    """A text on the canvas."""

    def __init__(self, note: Note) -> None:
        super().__init__()
        self.note = note
        flag = QGraphicsItem.GraphicsItemFlag
        self.setFlags(flag.ItemIsMovable | flag.ItemIsSelectable | flag.ItemSendsGeometryChanges)
        self.setZValue(-2.0)
        self.setAcceptHoverEvents(True)
        self.set_note(note)

    def set_note(self, note: Note) -> None:
        """Update the note."""
        self.prepareGeometryChange()
        self.note = note
        self._rect = QRectF(0.0, 0.0, *note_size(note))
        self.setPos(*note.at)
        self.update()

    @property
    def size(self) -> tuple[float, float]:
        return self._rect.width(), self._rect.height()

    def boundingRect(self) -> QRectF:
        return self._rect.adjusted(-1, -1, 1, 1)

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        zoom = option.levelOfDetailFromTransform(painter.worldTransform())
        is_far, chosen = zoom < MIN_LEGIBLE_SCALE, self.isSelected()
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(QPen(QColor(theme.TEXT if chosen else theme.LINE), 1.0))
        ground = theme.mixed(theme.FORCE, theme.GROUND, 0.1)
        painter.setBrush(QColor(theme.PALETTE["selected"] if is_far and chosen else ground))  # as nodes
        painter.drawRoundedRect(self._rect, 4.0, 4.0)
        painter.setPen(QColor(theme.TEXT if self.note.text else theme.MUTED))
        text = self.note.text or "Note"
        if is_far:
            paint_far_note(painter, self._rect.adjusted(PAD, 0.0, -PAD, 0.0), text, zoom)
            return
        painter.setFont(theme.font())
        painter.drawText(self._rect.adjusted(PAD, PAD, -PAD, -PAD), int(Qt.TextFlag.TextWordWrap), text)

    def edge_at(self, scene_place: QPointF) -> bool:
        """Return whether a position of the scene is on the right edge, by which the mouse sets the width."""
        return abs(self.mapFromScene(scene_place).x() - self._rect.right()) <= EDGE_REACH

    def itemChange(self, change: QGraphicsItem.GraphicsItemChange, value: object) -> object:
        if change == MOVES and isinstance(value, QPointF):
            return place_for(self, value)
        return super().itemChange(change, value)

    def hoverMoveEvent(self, event: QGraphicsSceneHoverEvent) -> None:
        if self.edge_at(event.scenePos()):
            self.setCursor(Qt.CursorShape.SizeHorCursor)
        else:
            self.unsetCursor()

    def hoverLeaveEvent(self, event: QGraphicsSceneHoverEvent) -> None:
        self.unsetCursor()  # what is dragged over it meanwhile has its own


class StubItem(WireItem):
    """The part of a wire that leaves the open group, with the name of its other end."""

    def __init__(self, wire: Wire, item: NodeItem, side: str, colour: str, text: str) -> None:
        self._side, self._text = side, text
        super().__init__(wire, item if side == "out" else None, item if side == "in" else None, colour)
        self.follow()

    def follow(self) -> None:
        item = self.source or self.target
        if item is not None:
            place = item.wire_place(self._side, self.wire[0 if self._side == "out" else 1])
            away = QPointF(STUB if self._side == "out" else -STUB, 0.0)
            self.set_ends(*((place, place + away) if self._side == "out" else (place + away, place)))
            self._away = place + away

    def boundingRect(self) -> QRectF:
        width = QFontMetricsF(theme.font(theme.SMALL_PX)).horizontalAdvance(self._text) + 12
        x = self._away.x() if self._side == "out" else self._away.x() - width
        return super().boundingRect().united(QRectF(x, self._away.y() - 10, width, 20))

    def paint(self, painter: QPainter, option: QStyleOptionGraphicsItem, widget: QWidget | None = None) -> None:
        super().paint(painter, option, widget)
        painter.setFont(theme.font(theme.SMALL_PX))
        painter.setPen(QColor(theme.MUTED))
        out = self._side == "out"
        align = Qt.AlignmentFlag.AlignLeft if out else Qt.AlignmentFlag.AlignRight
        room = QRectF(self._away.x() + 6 if out else self._away.x() - 406, self._away.y() - 10, 400, 20)
        painter.drawText(room, align | Qt.AlignmentFlag.AlignVCenter, self._text)


def framed(rects: Iterable[QRectF]) -> QRectF:
    """Return the frame around these rectangles; null if there are none."""
    rect = QRectF()
    for one in rects:
        rect = rect.united(one)
    return rect if rect.isNull() else rect.adjusted(-FRAME_PAD, -FRAME_PAD - TITLE, FRAME_PAD, FRAME_PAD)


def note_size(note: Note) -> tuple[float, float]:
    """Return the width and height of a drawn note."""
    room = QRectF(0.0, 0.0, note.width - 2 * PAD, 1e5)
    wrap = int(Qt.TextFlag.TextWordWrap)
    height = QFontMetricsF(theme.font()).boundingRect(room, wrap, note.text or " ").height() + 2 * PAD
    return note.width, float(theme.GRID * -(-height // theme.GRID))


def item_rect(item: QGraphicsItem) -> QRectF:
    """Return an item's rectangle in the scene, without the margin for port dots."""
    if isinstance(item, NodeItem | NoteItem):
        return QRectF(item.pos().x(), item.pos().y(), *item.size)
    return item.sceneBoundingRect()
