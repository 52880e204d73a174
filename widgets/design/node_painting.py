"""Painting of a node: its box, its names, and its ports. Marks are in `marks`."""

from functools import lru_cache
from typing import NamedTuple

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFontMetricsF, QPainter, QPainterPath, QPen, QPolygonF

from underfoot.widgets import theme
from underfoot.widgets.design.node_geometry import COST_ROOM, NAME_AT, PAD, TITLE, WIDEST_PORT, NodeGeometry, PlacedPort

MIN_ZOOM = 0.3
"""Below this zoom not even a node's name has room."""
SMALLEST_FAR = 0.8
"""How small text is that needs more room than there is when zoomed out, as a share of a small label's size."""
PORT_RADIUS = 5.0
_AT_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_AT_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter
_FIRST_LINES = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter | Qt.TextFlag.TextDontClip


class NodeLook(NamedTuple):
    """What decides the colours of a node."""

    colour: str
    state: str
    """Empty, or "asleep", "unused" or "fault"."""
    quiet: bool
    """Whether it has no effect now."""
    selected: bool
    hovered: bool


def paint_body(painter: QPainter, geometry: NodeGeometry, look: NodeLook, *, is_far: bool) -> None:
    """Paint the box of a node and the ground of its title. Zoomed out, all of it shows that it is selected: the border
    is then too thin to be seen.
    """
    body, strip = _body(geometry.width, geometry.height)
    if look.selected:
        border = QPen(QColor(look.colour), 1.5)
    elif look.state == "fault":
        border = QPen(QColor(theme.ALARM), 1.5)
    else:
        border = QPen(QColor(theme.LINE if not look.hovered else theme.FAINT), 1.0)
    if look.state == "unused" and not look.selected:
        border.setStyle(Qt.PenStyle.DashLine)
    ground = theme.mixed(theme.RAISED, theme.GROUND, 0.6) if look.quiet else theme.RAISED
    painter.fillPath(body, QColor(theme.PALETTE["selected"] if is_far and look.selected else ground))
    title = theme.mixed(look.colour, theme.PANEL, 0.12 if look.quiet else theme.TITLE_SHARE)
    painter.fillPath(strip, QColor(theme.PALETTE["alarming"] if look.state == "fault" else title))
    painter.strokePath(body, border)


def paint_title(painter: QPainter, geometry: NodeGeometry, title: str, cost: str, look: NodeLook) -> None:
    """Paint the name of a node, and beside it its cost, or a state in its place."""
    width = geometry.width
    painter.setFont(theme.font(bold=True))
    painter.setPen(QColor(theme.MUTED if look.quiet else theme.TEXT))
    room = width - 2 * PAD - (COST_ROOM if cost or look.state else 0.0)
    text = painter.fontMetrics().elidedText(title, Qt.TextElideMode.ElideRight, int(room) + 1)
    painter.drawText(QRectF(PAD, 0.0, room + 2, TITLE), _AT_LEFT, text)
    note = look.state if look.state in ("asleep", "unused", "fault") else cost
    if note:
        painter.setFont(theme.font(theme.SMALL_PX))
        fault = look.state == "fault"
        painter.setPen(QColor(theme.PALETTE["alarming text"] if fault else theme.MUTED if look.quiet else theme.TEXT))
        painter.drawText(QRectF(0.0, 0.0, width - PAD, TITLE), _AT_RIGHT, note)


def paint_far_title(painter: QPainter, room: QRectF, title: str, look: NodeLook, zoom: float) -> None:
    """Paint only the name, in this room and at the size of a small label, when zoomed out."""
    if zoom < MIN_ZOOM:
        return
    size_px, lines = far_name(title, round(theme.SMALL_PX / zoom), room.width(), room.height())
    painter.setFont(theme.font(size_px))
    painter.setPen(QColor(theme.MUTED if look.quiet and not look.selected else theme.TEXT))
    painter.drawText(room, Qt.AlignmentFlag.AlignCenter, lines)


def paint_far_port(painter: QPainter, placed: PlacedPort, *, faint: bool, zoom: float) -> None:
    """Paint a port as a point that is as large as there is room for, when zoomed out."""
    colour = QColor(theme.mixed(placed.colour, theme.RAISED, 0.25) if faint else placed.colour)
    point = QPen(colour, min(4.0, 2 * PORT_RADIUS * zoom), Qt.PenStyle.SolidLine, Qt.PenCapStyle.RoundCap)
    point.setCosmetic(True)
    painter.setPen(point)
    painter.drawPoint(placed.at)


@lru_cache(maxsize=512)
def far_name(name: str, size_px: int, width: float, height: float) -> tuple[int, str]:
    """Return the size up to `size_px` at which all of a name has room, or else the smallest, and the lines that do."""
    smallest, size_px = round(SMALLEST_FAR * size_px), size_px + 1
    lines = ""
    while size_px > smallest and lines.split() != name.split():
        size_px -= 1
        lines = far_note(name, size_px, width, height)
    return size_px, lines


def paint_far_note(painter: QPainter, room: QRectF, text: str, zoom: float) -> None:
    """Paint as much of a note as there is room for, as small as the smallest names, when zoomed out."""
    if zoom < MIN_ZOOM:
        return
    size_px = round(SMALLEST_FAR * theme.SMALL_PX / zoom)
    painter.setFont(theme.font(size_px))
    painter.drawText(room, _FIRST_LINES, far_note(text, size_px, room.width(), room.height()))


@lru_cache(maxsize=512)
def far_note(text: str, size_px: int, width: float, height: float) -> str:
    """Return the lines of a text that have room, the last one cut short if there is more; at least one."""
    metrics = QFontMetricsF(theme.font(size_px))
    left, lines = text.split(), list[str]()
    while left:
        line = left.pop(0)
        is_last = metrics.lineSpacing() * (len(lines) + 2) > height
        while left and (is_last or metrics.horizontalAdvance(f"{line} {left[0]}") <= width):
            line = f"{line} {left.pop(0)}"
        lines.append(metrics.elidedText(line, Qt.TextElideMode.ElideRight, width))
    return "\n".join(lines)


def paint_port(painter: QPainter, geometry: NodeGeometry, placed: PlacedPort, *, faint: bool, filled: bool) -> None:
    """Paint the dot of a port, hollow unless `filled`, and its name; those of events are diamonds."""
    colour = QColor(theme.mixed(placed.colour, theme.RAISED, 0.25) if faint else placed.colour)
    painter.setPen(QPen(QColor(theme.GROUND), 2.0))
    painter.setBrush(colour)
    if placed.port.kind == "event":
        x, y, r = placed.at.x(), placed.at.y(), PORT_RADIUS + 1.0
        painter.drawPolygon(QPolygonF([QPointF(x - r, y), QPointF(x, y - r), QPointF(x + r, y), QPointF(x, y + r)]))
    elif not filled:
        painter.setBrush(QColor(theme.GROUND))
        painter.setPen(QPen(colour, 1.5))
        painter.drawEllipse(placed.at, PORT_RADIUS - 1.0, PORT_RADIUS - 1.0)
    else:
        painter.drawEllipse(placed.at, PORT_RADIUS, PORT_RADIUS)
    painter.setFont(theme.font())
    painter.setPen(QColor(theme.PALETTE["quiet"] if faint else theme.MUTED))
    rect = QRectF(NAME_AT, placed.at.y() - 10, geometry.width - 2 * NAME_AT, 20)
    painter.drawText(rect, _AT_LEFT if placed.side == "in" else _AT_RIGHT, _port_text(placed.row.text))


@lru_cache(maxsize=256)
def _port_text(text: str) -> str:
    """Return the name of a port, cut short where it is too long."""
    return QFontMetricsF(theme.font()).elidedText(text, Qt.TextElideMode.ElideRight, WIDEST_PORT + 1.0)


@lru_cache(maxsize=256)
def _body(width: float, height: float) -> tuple[QPainterPath, QPainterPath]:
    """Return the outlines of a node of this size and of its title; cached, because path intersection is slow."""
    body, strip = QPainterPath(), QPainterPath()
    body.addRoundedRect(QRectF(0.5, 0.5, width - 1.0, height - 1.0), 6.0, 6.0)
    strip.addRect(QRectF(0.0, 0.0, width, TITLE))
    return body, body & strip
