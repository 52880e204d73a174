"""A large picture of the fields on the floor for answers by foot, as the participant sees them."""

from PySide6.QtCore import QPointF, QRectF, Qt
from PySide6.QtGui import QColor, QPainter, QPaintEvent, QPolygonF, QTransform
from PySide6.QtWidgets import QWidget

from underfoot.phrases import ENGLISH, Language
from underfoot.studies.foot_answers import FootAnswers, FootField
from underfoot.widgets import theme

HEIGHT_PX, MIN_TEXT_PX, MAX_TEXT_PX = 46 * theme.GRID, 18, 40
_INSET_PX = 6.0


class FootFieldsView(QWidget):
    """Draws each field with its answer; the loaded field fills during the dwell time."""

    def __init__(self) -> None:
        super().__init__()
        self.setMinimumHeight(HEIGHT_PX)
        self._answers: FootAnswers | None = None
        self._language = ENGLISH
        self.hide()

    def show_answers(self, answers: FootAnswers | None, language: Language = ENGLISH) -> None:
        """Show the fields of a question; None if it has no answer by foot."""
        self._answers, self._language = answers, language
        self.setAccessibleName(language.say("Fields on the floor"))
        self.setVisible(answers is not None)
        self.update()

    def paintEvent(self, event: QPaintEvent) -> None:
        answers = self._answers
        if answers is None:
            return
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        shapes, say = self._shapes(answers.fields), self._language.say
        least = min(min(shape.boundingRect().width(), shape.boundingRect().height()) for shape in shapes)
        painter.setFont(theme.font(round(min(max(0.25 * least, MIN_TEXT_PX), MAX_TEXT_PX)), bold=True))
        for field, shape in zip(answers.fields, shapes, strict=True):
            box = shape.boundingRect()
            painter.setPen(Qt.PenStyle.NoPen)
            painter.setBrush(QColor(theme.RAISED))
            painter.drawPolygon(shape)
            if field is answers.on:
                painter.save()
                painter.setClipRect(QRectF(box.left(), box.bottom() - answers.share * box.height(), box.width(),
                                           answers.share * box.height()))  # fmt: skip
                painter.setBrush(QColor(theme.mixed(theme.FORCE, theme.RAISED, 0.6)))
                painter.drawPolygon(shape)
                painter.restore()
                painter.setPen(QColor(theme.FORCE))
                painter.setBrush(Qt.BrushStyle.NoBrush)
                painter.drawPolygon(shape)
            painter.setPen(QColor(theme.TEXT))
            painter.drawText(box, Qt.AlignmentFlag.AlignCenter | Qt.TextFlag.TextWordWrap, say(field.text))

    def _shapes(self, fields: tuple[FootField, ...]) -> list[QPolygonF]:
        """Return the fields in pixels, as large as possible, centred, with the forward direction up."""
        floor = [QPolygonF([QPointF(x, -y) for x, y in field.corners_m]) for field in fields]
        whole = floor[0].boundingRect()
        for shape in floor:
            whole = whole.united(shape.boundingRect())
        room = QRectF(self.rect()).adjusted(_INSET_PX, _INSET_PX, -_INSET_PX, -_INSET_PX)
        scale = min(room.width() / whole.width(), room.height() / whole.height())
        to_screen = QTransform().translate(room.center().x(), room.center().y()).scale(scale, scale)
        to_screen.translate(-whole.center().x(), -whole.center().y())
        return [_inset(to_screen.map(shape)) for shape in floor]


def _inset(shape: QPolygonF) -> QPolygonF:
    """Return a polygon slightly shrunk towards its centre, for gaps between fields."""
    box = shape.boundingRect()
    x, y = 1.0 - _INSET_PX / max(box.width(), 1.0), 1.0 - _INSET_PX / max(box.height(), 1.0)
    about = QTransform().translate(box.center().x(), box.center().y()).scale(x, y)
    return about.translate(-box.center().x(), -box.center().y()).map(shape)
