"""Trails of contacts on the map of the floor: where each was in the last seconds."""

from collections import deque
from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtGui import QColor, QPainter, QPen, QPixmap, QPolygonF, QTransform

from underfoot.floor.contacts import ContactRows, OngoingContact
from underfoot.widgets import theme
from underfoot.widgets.pictures import blank_picture

TRAIL_S = 3.0
"""Time for which the trail of a contact is visible."""

_STEP_S = 0.02
"""Distance between points of a trail."""

_FADE_STEPS = 12
"""Number of steps in which a trail fades."""

_Line = list[tuple[float, float, float]]
"""Time in seconds, and place on the floor in metres."""


class Trails:
    """Keeps the trails of contacts, and paints them; that of a contact that ended is a cached picture, which fades."""

    def __init__(self) -> None:
        self._coming: deque[ContactRows] = deque()
        """Positions of the last seconds that are not shown yet."""
        self._by_contact: dict[int, deque[tuple[float, float, float]]] = {}
        self._finished: dict[int, tuple[QPoint, QPixmap]] = {}
        """Pictures of trails whose contact has ended, and their positions."""

    def add(self, rows: ContactRows) -> None:
        """Add recent positions of contacts, which `catch_up` shows."""
        self._coming.append(rows)
        while self._coming[0].time_s[-1] < rows.time_s[0] - TRAIL_S:
            self._coming.popleft()

    def catch_up(self) -> None:
        """Extend the trails by all positions that were added."""
        while self._coming:
            self._extend(self._coming.popleft())

    def _extend(self, rows: ContactRows) -> None:
        for id in [id for id, trail in self._by_contact.items() if trail[-1][0] < rows.time_s[0] - TRAIL_S]:
            del self._by_contact[id]
            self._finished.pop(id, None)
        for id in np.unique(rows.contact):
            path = rows.select(rows.contact == id)
            path = path.select(np.diff(np.floor(path.time_s / _STEP_S), prepend=-1.0) > 0.0)
            self._finished.pop(int(id), None)
            points = zip(path.time_s.tolist(), path.x_m.tolist(), path.y_m.tolist(), strict=True)
            self._by_contact.setdefault(int(id), deque(maxlen=round(TRAIL_S / _STEP_S))).extend(points)

    def are_visible(self, now_s: float) -> bool:
        """Return whether there are any that have not faded yet."""
        return any(trail[-1][0] > now_s - TRAIL_S for trail in self._by_contact.values())

    def forget_pictures(self) -> None:
        """Paint all trails anew, because the colours or the position of the floor have changed."""
        self._finished.clear()

    def paint(self, painter: QPainter, to_screen: QTransform, contacts: Sequence[OngoingContact], now_s: float) -> None:
        """Paint the trails of the last seconds, each up to its contact if that is on the floor."""
        tips = {contact.id: (now_s, contact.x_m, contact.y_m) for contact in contacts if contact.id}
        for id, trail in self._by_contact.items():
            if id in tips:
                self._finished.pop(id, None)
                _paint_line(painter, [*trail, tips[id]], to_screen)
                continue
            if id not in self._finished:
                self._finished[id] = _picture_of(list(trail), to_screen, painter.device().devicePixelRatioF())
            place, picture = self._finished[id]
            painter.setOpacity(min(max(1.0 - (now_s - trail[-1][0]) / TRAIL_S, 0.0), 1.0))
            painter.drawPixmap(place, picture)
        painter.setOpacity(1.0)


def _picture_of(line: _Line, to_screen: QTransform, pixel_ratio: float) -> tuple[QPoint, QPixmap]:
    """Return a picture of a finished trail, and its position."""
    places = QPolygonF([to_screen.map(QPointF(x, y)) for _, x, y in line])
    area = places.boundingRect().adjusted(-2.0, -2.0, 2.0, 2.0).toAlignedRect()
    picture = blank_picture(area.size(), pixel_ratio, Qt.GlobalColor.transparent)
    painter = QPainter(picture)
    painter.setRenderHint(QPainter.RenderHint.Antialiasing)
    painter.translate(-area.topLeft())
    _paint_line(painter, line, to_screen)
    painter.end()
    return area.topLeft(), picture


def _paint_line(painter: QPainter, line: _Line, to_screen: QTransform) -> None:
    """Paint a trail in segments that fade."""
    green = QColor(theme.CONTACT)
    ages = [min(max(int((line[-1][0] - time_s) / TRAIL_S * _FADE_STEPS), 0), _FADE_STEPS) for time_s, _, _ in line]
    places = [to_screen.map(QPointF(x, y)) for _, x, y in line]
    begin = 0
    for end in range(1, len(line)):
        if ages[end] != ages[begin] or end == len(line) - 1:
            green.setAlphaF(1.0 - ages[begin] / _FADE_STEPS)
            painter.setPen(QPen(green, 2.0, c=Qt.PenCapStyle.FlatCap))
            painter.drawPolyline(places[begin : end + 1])
            begin = end
