"""Display of a node's marks (muted, bypassed, soloed), and the button that plays it alone."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPen

from underfoot.patch.patch import PlacedNode
from underfoot.widgets import theme
from underfoot.widgets.design.node_geometry import TITLE, NodeGeometry

MARK_LETTERS = {"muted": ("M", "alarm"), "bypassed": ("B", "force"), "soloed": ("S", "contact")}
"""The letter of each mark, and the name of its colour."""
CHIP_PX, BUTTON_PX, GAP_PX = 16.0, 18.0, 3.0


def is_inactive(node: PlacedNode) -> bool:
    """Return whether a node has no effect on the output.

    >>> is_inactive(PlacedNode("a", "gain", bypassed=True)), is_inactive(PlacedNode("a", "gain", soloed=True))
    (True, False)
    """
    return bool(node.muted or node.bypassed)


def button_at(geometry: NodeGeometry, place: QPointF) -> bool:
    """Return whether a position of the node is on the button."""
    return _button(geometry).contains(place)


def paint_marks(
    painter: QPainter, node: PlacedNode, geometry: NodeGeometry, *, has_button: bool, is_auditioned: bool
) -> None:
    """Paint the letters of a node's marks, and the button, highlighted while the node is played alone."""
    _paint_letters(painter, node, QPointF(geometry.plot.left() - GAP_PX, geometry.plot.top() - GAP_PX), 1.0)
    if has_button or is_auditioned:
        button = _button(geometry)
        _rounded(painter, button, theme.VIBRATION if is_auditioned else theme.LINE)
        icon = theme.icon("speaker", theme.GROUND if is_auditioned else theme.TEXT)
        icon.paint(painter, button.adjusted(2, 2, -2, -2).toRect())


def paint_far_marks(
    painter: QPainter, node: PlacedNode, geometry: NodeGeometry, zoom: float, *, is_auditioned: bool
) -> None:
    """Paint the marks when zoomed out: large letters, and a frame around the node that is played alone."""
    _paint_letters(painter, node, QPointF(GAP_PX, GAP_PX), _far_scale(zoom))
    if is_auditioned:
        pen = QPen(QColor(theme.VIBRATION), 2.0)
        pen.setCosmetic(True)
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(geometry.rect, 6.0, 6.0)


def below_far_marks(node: PlacedNode, zoom: float) -> float:
    """Return the height below which a node that is zoomed out has room for its name.

    >>> below_far_marks(PlacedNode("a", "gain"), 0.4), below_far_marks(PlacedNode("a", "gain", muted=True), 0.4)
    (24.0, 35.0)
    """
    return max(TITLE, GAP_PX + CHIP_PX * _far_scale(zoom)) if node.marks else TITLE


def _far_scale(zoom: float) -> float:
    return min(1.0 / zoom, 2.0)


def _paint_letters(painter: QPainter, node: PlacedNode, at: QPointF, scale: float) -> None:
    if not node.marks:
        return
    font = QFont(theme.font(theme.SMALL_PX, bold=True))
    font.setPixelSize(round(theme.SMALL_PX * scale))
    painter.setFont(font)
    for name in node.marks:
        letter, colour = MARK_LETTERS[name]
        chip = QRectF(at.x(), at.y(), CHIP_PX * scale, CHIP_PX * scale)
        _rounded(painter, chip, theme.PALETTE[colour])
        painter.setPen(QColor(theme.GROUND))
        painter.drawText(chip, Qt.AlignmentFlag.AlignCenter, letter)
        at = at + QPointF((CHIP_PX + GAP_PX) * scale, 0.0)


def _button(geometry: NodeGeometry) -> QRectF:
    return QRectF(geometry.plot.right() - BUTTON_PX + GAP_PX, geometry.plot.top() - GAP_PX, BUTTON_PX, BUTTON_PX)


def _rounded(painter: QPainter, rect: QRectF, colour: str) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colour))
    painter.drawRoundedRect(rect, 4.0, 4.0)
