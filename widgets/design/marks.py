"""What a node shows of how it is heard: the marks muted, bypassed and soloed, and the button that plays it alone."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QFont, QPainter, QPen

from underfoot.patch.patch import PlacedNode
from underfoot.widgets import theme
from underfoot.widgets.design.shape import Shape

LETTERS = {"muted": ("M", "alarm"), "bypassed": ("B", "force"), "soloed": ("S", "contact")}
"""How each mark is written, and the name of its colour."""
CHIP_PX, BUTTON_PX, GAP_PX = 16.0, 18.0, 3.0


def is_taken_out(node: PlacedNode) -> bool:
    """Whether a node does nothing to what is heard.

    >>> is_taken_out(PlacedNode("a", "gain", bypassed=True)), is_taken_out(PlacedNode("a", "gain", soloed=True))
    (True, False)
    """
    return bool(node.muted or node.bypassed)


def button_at(shape: Shape, place: QPointF) -> bool:
    """Whether a mouse at this place of the node means the button."""
    return _button(shape).contains(place)


def paint_marks(painter: QPainter, node: PlacedNode, shape: Shape, has_button: bool, is_alone: bool) -> None:
    """The letters of a node's marks; and the button where there is one, lit while the node is heard alone."""
    _paint_letters(painter, node, QPointF(shape.plot.left() - GAP_PX, shape.plot.top() - GAP_PX), 1.0)
    if has_button or is_alone:
        button = _button(shape)
        _rounded(painter, button, theme.VIBRATION if is_alone else theme.LINE)
        icon = theme.icon("speaker", theme.GROUND if is_alone else theme.TEXT)
        icon.paint(painter, button.adjusted(2, 2, -2, -2).toRect())


def paint_far_marks(painter: QPainter, node: PlacedNode, shape: Shape, is_alone: bool, zoom: float) -> None:
    """The same from afar: letters as large on the screen as they can be, and a frame around what is heard alone."""
    _paint_letters(painter, node, QPointF(GAP_PX, GAP_PX), min(1.0 / zoom, 2.0))
    if is_alone:
        pen = QPen(QColor(theme.VIBRATION), 2.0)
        pen.setCosmetic(True)
        painter.setPen(pen)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.drawRoundedRect(shape.rect, 6.0, 6.0)


def _paint_letters(painter: QPainter, node: PlacedNode, at: QPointF, scale: float) -> None:
    if not node.marks:
        return
    font = QFont(theme.font(theme.SMALL_PX, bold=True))
    font.setPixelSize(round(theme.SMALL_PX * scale))
    painter.setFont(font)
    for name in node.marks:
        letter, colour = LETTERS[name]
        chip = QRectF(at.x(), at.y(), CHIP_PX * scale, CHIP_PX * scale)
        _rounded(painter, chip, theme.PALETTE[colour])
        painter.setPen(QColor(theme.GROUND))
        painter.drawText(chip, Qt.AlignmentFlag.AlignCenter, letter)
        at = at + QPointF((CHIP_PX + GAP_PX) * scale, 0.0)


def _button(shape: Shape) -> QRectF:
    return QRectF(shape.plot.right() - BUTTON_PX + GAP_PX, shape.plot.top() - GAP_PX, BUTTON_PX, BUTTON_PX)


def _rounded(painter: QPainter, rect: QRectF, colour: str) -> None:
    painter.setPen(Qt.PenStyle.NoPen)
    painter.setBrush(QColor(colour))
    painter.drawRoundedRect(rect, 4.0, 4.0)
