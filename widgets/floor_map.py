"""The floor from above: the load of each tile, and contacts with their trails."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PySide6.QtCore import QLineF, QPointF, QRectF, QSize, QSizeF, Qt, QTimer, Signal
from PySide6.QtGui import (
    QColor,
    QKeyEvent,
    QMouseEvent,
    QPainter,
    QPaintEvent,
    QPen,
    QPixmap,
    QPolygonF,
    QResizeEvent,
    QTransform,
)
from PySide6.QtWidgets import QSizePolicy

from underfoot.floor.contacts import ContactRows, OngoingContact
from underfoot.floor.layout import Floor
from underfoot.quantities import fixed, quantity
from underfoot.widgets import theme
from underfoot.widgets.controls.arrow_keys import ARROWS
from underfoot.widgets.floor_trails import Trails
from underfoot.widgets.pictures import blank_picture
from underfoot.widgets.pressed_floor import PressedFloor

NO_FLOOR = "no floor"
"""What is shown before there is one, as where no recording is open."""
FULL_SCALE_N = 1000.0
"""Load at which a tile has the full colour."""

_MARGIN = 2 * theme.GRID

_BOTTOM_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignBottom
_BOTTOM_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignBottom
_TOP_RIGHT = Qt.AlignmentFlag.AlignRight

_SHADES = 32
"""Number of shades of a loaded tile."""

_MIN_SHOWN_PEAK = 1e-4
"""Share of full scale from which a tile's vibration is visible."""

_MIN_SHOWN_LOST = 0.05
"""Share of a tile's samples that do not arrive from which it is marked, as it is reported."""

_FAULT_PX = 13.0
"""Length along both edges of the corner that is marked; what is written in a corner begins behind it."""

_MIN_SHOWN_N = 2.0
"""Loads below this are shown as 0."""


STEP_MS = 1000
"""Time for which the step of a preview is marked."""


class FloorMap(PressedFloor):
    """Shows loads and contacts; emits the chosen tile, and where the mouse presses in the tile's frame."""

    tile_chosen = Signal(str)
    """A tile's id."""
    tile_clicked = Signal()
    """The tile chosen by the user, with mouse or keys."""

    def __init__(self) -> None:
        super().__init__()
        self._tile_under_mouse = ""
        self.setAccessibleName("Floor from above")
        self._describe()
        self.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Expanding)
        self.setMouseTracking(True)
        self.setAttribute(Qt.WidgetAttribute.WA_OpaquePaintEvent)
        self._chosen_tile = ""
        self._background: QPixmap | None = None
        self._figures: list[tuple[QRectF, str]] = []
        """The loads of tiles in the present picture, and where they are written."""
        self._step_tile = ""
        self._step_timer = QTimer(self, singleShot=True, interval=STEP_MS)
        self._step_timer.timeout.connect(lambda: self.show_step(""))
        self.update_colours()

    # --- what it shows ---

    def update_colours(self) -> None:
        """Repaint in the present colours."""
        shares = [0.13 + 0.87 * shade / (_SHADES - 1) for shade in range(_SHADES)]
        self._amber = [QColor(theme.mixed(theme.PALETTE["loaded"], theme.RAISED, share)) for share in shares]
        self._background = None

    def set_floor(self, floor: Floor) -> None:
        """Show these tiles, empty, with the first one chosen."""
        count = len(floor.tiles)
        self._floor = floor
        self._load_n = np.zeros(count)
        self._untared = np.zeros(count, bool)
        self._peak = np.zeros(count)
        self._deviating = np.zeros(count, bool)
        self._lost_percent = np.zeros(count)
        self._faults: dict[tuple[str, int], str] = {}
        self._tile_under_mouse = ""
        self._contacts: Sequence[OngoingContact] = ()
        self._trails = Trails()
        self._now_s = 0.0
        self._look: tuple[object, ...] = ()
        self._pressed_tile = ""
        self._background = None
        self.choose_tile(floor.ids[0])

    def clear(self) -> None:
        """Show no floor, as before there was one."""
        self._floor, self._chosen_tile = None, ""
        self._describe()
        self.update()

    def choose_tile(self, tile: str) -> None:
        """Choose a tile; `tile_chosen` is emitted if it changes."""
        if tile != self._chosen_tile:
            self._chosen_tile = tile
            self.tile_chosen.emit(tile)
        self._describe()
        self.update()

    def chosen_tile(self) -> str:
        """Return the id of the chosen tile."""
        return self._chosen_tile

    def set_press(self, force_n: float) -> None:
        """Set the force of a press with the mouse."""
        self._press_n = force_n
        self._describe()

    def set_loads(self, load_n: ArrayLike, untared: ArrayLike) -> None:
        """Set the load of each tile in newtons, and which tiles are untared."""
        was_untared, self._untared = self._untared, np.asarray(untared)
        self._load_n = np.asarray(load_n)
        if not np.array_equal(was_untared, self._untared):
            self._describe()

    def show_step(self, tile: str) -> None:
        """Mark for a second the tile on which the preview's step plays without a person; "" ends the mark."""
        self._step_tile = tile
        if tile:
            self._step_timer.start()
        self.update()

    def set_vibration(self, peak: ArrayLike) -> None:
        """Set the recent peak of each tile's vibration, relative to full scale."""
        self._peak = np.asarray(peak)

    def set_deviating(self, deviating: ArrayLike) -> None:
        """Mark tiles whose acceleration deviates from the command."""
        self._deviating = np.asarray(deviating)

    def set_lost(self, share: NDArray[np.float64]) -> None:
        """Mark tiles of whose samples this share (tiles,) does not arrive."""
        self._lost_percent = np.where(share > _MIN_SHOWN_LOST, np.round(100.0 * share), 0.0)

    def set_faults(self, faults: Mapping[tuple[str, int], str]) -> None:
        """Mark sensors, by tile and number (1 to 4), with what is said of them beneath the mouse."""
        if faults != self._faults:
            self._faults = dict(faults)
            self._describe()
            self.update()

    def set_contacts(self, contacts: Sequence[OngoingContact], now_s: float) -> None:
        """Set the contacts at `now_s`, and show their trails up to then."""
        self._contacts, self._now_s = contacts, now_s
        self._trails.catch_up()

    def draw_changes(self) -> None:
        """Repaint, unless the floor looks as at the last call: nobody is there, and nothing moves."""
        loads_n = np.where(self._load_n > _MIN_SHOWN_N, self._load_n, 0.0)
        peaks = np.where(self._peak > _MIN_SHOWN_PEAK, self._peak, 0.0)
        moves = bool(self._contacts) or self._trails.are_visible(self._now_s)
        marks = (self._untared, self._deviating, self._lost_percent)
        look = (moves, *(values.tobytes() for values in (loads_n, peaks, *marks)))
        if moves or look != self._look:
            self._look = look
            self.update()

    def add_trails(self, rows: ContactRows) -> None:
        """Extend the trails of contacts by their recent positions, from the next `set_contacts` on.

        A paused map may be painted anew, beneath the mouse: it keeps its trails until then.
        """
        self._trails.add(rows)

    # --- geometry ---

    def sizeHint(self) -> QSize:
        return QSize(384, 384)

    def minimumSizeHint(self) -> QSize:
        return QSize(192, 160)

    def to_screen(self) -> QTransform:
        assert self._floor is not None
        area = QRectF(self.rect()).adjusted(_MARGIN, _MARGIN, -_MARGIN, -_MARGIN - 2 * theme.GRID)
        return fitted(self._floor, area)

    def tile_at(self, place: QPointF) -> str:
        """Return the id of the tile at a point of the widget, or ""."""
        tile, _ = self._place_at(place)
        return tile.id if tile is not None else ""

    # --- mouse and keys ---

    def mousePressEvent(self, event: QMouseEvent) -> None:
        tile = self.tile_at(event.position())
        if tile and event.button() == Qt.MouseButton.LeftButton:
            self.setFocus(Qt.FocusReason.MouseFocusReason)
            self.tile_clicked.emit()
            self.choose_tile(tile)
            self._press(event.position())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        tile = self.tile_at(event.position())
        self.setCursor(Qt.CursorShape.PointingHandCursor if tile else Qt.CursorShape.ArrowCursor)
        if tile != self._tile_under_mouse:
            self._tile_under_mouse = tile
            self._describe()
        if self._pressed_tile:
            self._press(event.position())

    def resizeEvent(self, event: QResizeEvent) -> None:
        self._background = None
        super().resizeEvent(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose the next tile in the direction of an arrow key."""
        if self._floor is None or event.key() not in ARROWS:
            super().keyPressEvent(event)
            return
        towards = np.array(ARROWS[Qt.Key(event.key())], float)
        here = np.array(self._floor.tiles[self._floor.index(self._chosen_tile)].centre_m)
        best, nearest = "", math.inf
        for tile in self._floor.tiles:
            step = np.array(tile.centre_m) - here
            along = float(step @ towards)
            across = float(np.hypot(*(step - along * towards)))
            if along > 1e-9 and across <= along and along + 2.0 * across < nearest:
                best, nearest = tile.id, along + 2.0 * across
        if best:
            self.tile_clicked.emit()
            self.choose_tile(best)

    def _describe(self) -> None:
        """Say what is selected, in the tooltip and to screen readers, after the faults of the tile that is meant."""
        if self._floor is None:
            self.setToolTip("")
            self.setAccessibleDescription(NO_FLOOR)
            return
        press = f" Hold the mouse button to press a tile with {quantity(self._press_n, 'N')}." if self.can_press else ""
        text = f"Tile {self._chosen_tile} is selected. Click a tile to select it.{press}"
        self.setToolTip(self._said_of(self._tile_under_mouse) + text)
        self.setAccessibleDescription(self._said_of(self._chosen_tile) + text)

    def _said_of(self, tile: str) -> str:
        """Return what is wrong with a tile, "" for no tile."""
        lines = dict.fromkeys(what for (of, _), what in self._faults.items() if of == tile)
        if self._floor is not None and tile and self._untared[self._floor.index(tile)]:
            lines["untared, as it was loaded from its first sample on; if nobody is on it, press Tare"] = None
        return "".join(f"{tile}: {line}.\n" for line in lines)

    # --- paint ---

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        if self._floor is None:
            painter.fillRect(self.rect(), QColor(theme.GROUND))
            painter.setPen(QColor(theme.MUTED))
            painter.drawText(self.rect(), Qt.AlignmentFlag.AlignCenter, NO_FLOOR)
            return
        if self._background is None:
            self._transform = self.to_screen()
            self._polygons = [_polygon(tile.corners_m(), self._transform) for tile in self._floor.tiles]
            self._background = self._paint_background()
            self._trails.forget_pictures()
        painter.drawPixmap(0, 0, self._background)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        circles = [self._circle(contact) for contact in self._contacts]
        self._paint_loads(painter, circles)
        for tile, number in self._faults:
            self._paint_fault(painter, self._floor.index(tile), number - 1)
        painter.setBrush(Qt.BrushStyle.NoBrush)
        painter.setPen(QPen(QColor(theme.TEXT if self.hasFocus() else theme.MUTED), 2.0))
        painter.drawPolygon(self._polygons[self._floor.index(self._chosen_tile)])
        if self._step_tile in self._floor.ids:
            self._paint_step(painter, self._polygons[self._floor.index(self._step_tile)])
        self._trails.paint(painter, self._transform, self._contacts, self._now_s)
        self._paint_contacts(painter, circles)

    def _paint_step(self, painter: QPainter, polygon: QPolygonF) -> None:
        """Paint a dashed sole for a simulated step, to distinguish it from a foot."""
        area = polygon.boundingRect()
        size = 0.5 * min(area.width(), area.height())
        painter.setPen(QPen(QColor(theme.CONTACT), 2.0, Qt.PenStyle.DashLine))
        painter.drawEllipse(area.center(), 0.4 * size, size * 0.75)
        if area.width() >= 88.0:
            painter.setFont(theme.font(theme.SMALL_PX))
            painter.drawText(area, Qt.AlignmentFlag.AlignCenter, "preview")

    def _paint_loads(self, painter: QPainter, circles: Sequence[QRectF]) -> None:
        """Paint tiles that are loaded, vibrate or are marked; find places for their loads beside the `circles`."""
        assert self._floor is not None
        self._figures = []
        painter.setFont(theme.font(theme.SMALL_PX))
        marked = self._untared | self._deviating | (self._lost_percent > 0.0)
        for row in np.flatnonzero(marked | (self._load_n > _MIN_SHOWN_N) | (self._peak > _MIN_SHOWN_PEAK)).tolist():
            polygon, load_n, peak = self._polygons[row], float(self._load_n[row]), float(self._peak[row])
            area = polygon.boundingRect().adjusted(6, 4, -6, -4)
            if load_n > _MIN_SHOWN_N:
                painter.setPen(QPen(QColor(theme.LINE), 1.0))
                painter.setBrush(self._amber[min(int(load_n / FULL_SCALE_N * _SHADES), _SHADES - 1)])
                painter.drawPolygon(polygon)
                self._paint_name(painter, row, theme.TEXT)
            if area.width() < 36.0:
                continue
            line = 14 if area.width() < 88.0 else 0
            if load_n > _MIN_SHOWN_N:
                text, place = f"{fixed(load_n)} N", area.adjusted(0, line, 0, -6)
                places = (_TOP_RIGHT,) if marked[row] else (_TOP_RIGHT, _BOTTOM_RIGHT)
                rooms = [painter.boundingRect(place, at, text) for at in places]
                room = min(rooms, key=lambda room: sum(_common(room, circle) for circle in circles))
                self._figures.append((room, text))
            if self._untared[row] and area.width() >= 48.0:
                below = area.adjusted(0, line + 14, 0, 0)
                _paint_on_ground(painter, below, Qt.AlignmentFlag.AlignRight, "untared", theme.ALARM)
            fault, lost = "off its command" if self._deviating[row] else "", self._lost_percent[row]
            if lost:
                fault = "silent" if lost == 100.0 else f"{lost:.0f} % lost"
            if fault and area.width() >= 48.0:
                _paint_on_ground(painter, area.adjusted(0, 0, 6, -6), _BOTTOM_LEFT, fault, theme.ALARM)
            if peak > _MIN_SHOWN_PEAK:
                share = max(0.0, 1.0 + math.log10(min(peak, 1.0)) / 3.0)
                bar = QRectF(area.left(), area.bottom() - 3.0, area.width() * share, 3.0)
                painter.fillRect(bar, QColor(theme.VIBRATION))

    def _paint_fault(self, painter: QPainter, row: int, sensor: int) -> None:
        """Paint the corner of a tile where a sensor is that has a fault, beside what is written there."""
        assert self._floor is not None
        tile, polygon = self._floor.tiles[row], self._polygons[row]
        to_corners_m = tile.corners_m() - tile.to_floor(tile.sensors_m[sensor])
        at = int(np.argmin(np.hypot(*to_corners_m.T)))
        corner = polygon.at(at)
        ends = [corner]
        for beside in (polygon.at((at + 3) % 4), polygon.at((at + 1) % 4)):
            along = QLineF(corner, beside)
            along.setLength(min(_FAULT_PX, 0.5 * along.length()))
            ends.append(along.p2())
        painter.setPen(QPen(QColor(theme.GROUND), 1.0))
        painter.setBrush(QColor(theme.ALARM))
        painter.drawPolygon(QPolygonF(ends))

    def _paint_background(self) -> QPixmap:
        """Paint what does not move: tiles, their names, and a scale."""
        assert self._floor is not None
        picture = blank_picture(self.size(), self.devicePixelRatioF(), QColor(theme.GROUND))
        painter = QPainter(picture)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setFont(theme.font(theme.SMALL_PX))
        painter.setBrush(QColor(theme.RAISED))
        for row, polygon in enumerate(self._polygons):
            painter.setPen(QPen(QColor(theme.LINE), 1.0))
            painter.drawPolygon(polygon)
            self._paint_name(painter, row, theme.MUTED)
        self._paint_scale(painter, self._transform.m11())
        painter.end()
        return picture

    def _paint_name(self, painter: QPainter, row: int, colour: str) -> None:
        assert self._floor is not None
        area = self._polygons[row].boundingRect()
        if min(area.width(), area.height()) >= 32.0:
            painter.setPen(QColor(colour))
            painter.drawText(area.adjusted(6, 4, -6, -4), Qt.AlignmentFlag.AlignLeft, self._floor.tiles[row].id)

    def _paint_scale(self, painter: QPainter, px_per_m: float) -> None:
        length_m = max(
            (m for m in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if m * px_per_m <= 0.3 * self.width()), default=0.1
        )
        y, x = self.height() - theme.GRID - 0.5, _MARGIN + 0.5
        painter.setPen(QPen(QColor(theme.MUTED), 1.0))
        painter.drawLine(QPointF(x, y), QPointF(x + length_m * px_per_m, y))
        for end in (x, x + length_m * px_per_m):
            painter.drawLine(QPointF(end, y - 3), QPointF(end, y))
        painter.drawText(QPointF(x + length_m * px_per_m + 6, y + 2), quantity(length_m, "m"))

    def _circle(self, contact: OngoingContact) -> QRectF:
        """Return where a contact is drawn: larger for a larger force."""
        radius = 5.0 + 9.0 * math.sqrt(min(max(contact.force_n, 0.0) / FULL_SCALE_N, 1.5))
        place = self._transform.map(QPointF(contact.x_m, contact.y_m))
        return QRectF(place.x() - radius, place.y() - radius, 2.0 * radius, 2.0 * radius)

    def _paint_contacts(self, painter: QPainter, circles: Sequence[QRectF]) -> None:
        """Paint the contacts, the loads of tiles over them, and the persons' numbers."""
        painter.setFont(theme.font(theme.SMALL_PX))
        painter.setPen(QPen(QColor(theme.CONTACT), 1.5))
        inside = QColor(theme.mixed(theme.CONTACT, theme.GROUND, 0.55))
        first: dict[int, int] = {}
        for number, contact in enumerate(self._contacts):
            painter.setBrush(inside if contact.id else Qt.BrushStyle.NoBrush)
            painter.drawEllipse(circles[number])
            if contact.person:
                first.setdefault(contact.person, number)
        painter.setPen(QColor(theme.TEXT))
        for room, text in self._figures:  # a circle may leave no room beside it
            painter.drawText(room, _TOP_RIGHT, text)
        names = [f"person {person}" for person in first]
        width = max(map(painter.fontMetrics().horizontalAdvance, names), default=0)
        owners = [circles[number] for number in first.values()]
        others = [*circles, *(room for room, _ in self._figures)]
        for name, room in zip(names, label_places(owners, others, width, QRectF(self.rect())), strict=True):
            _paint_on_ground(painter, room, Qt.AlignmentFlag.AlignCenter, name, theme.CONTACT)


def fitted(floor: Floor, area: QRectF) -> QTransform:
    """Return the transform from a floor's frame, whose y axis points away from the viewer, to fit it into an area."""
    low, high = floor.bounds_m()
    scale = max(1.0, min(area.width() / (high[0] - low[0]), area.height() / (high[1] - low[1])))
    moved = QTransform.fromTranslate(area.center().x(), area.center().y())
    return moved.scale(scale, -scale).translate(*(-0.5 * (low + high)).tolist())


def label_places(owners: Sequence[QRectF], others: Sequence[QRectF], width: float, area: QRectF) -> list[QRectF]:
    """Return the position of each owner's label: beside, below or above it, where it covers the least of the others.

    All are within `area` if they can be.
    """
    placed: list[QRectF] = []
    size = QSizeF(width, 16.0)
    for owner in owners:
        middle = owner.center() - QPointF(0.5 * size.width(), 0.5 * size.height())
        beyond_x, beyond_y = 0.5 * (owner.width() + width) + 3.0, 0.5 * (owner.height() + size.height())
        steps = ((1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0))
        rooms = [
            QRectF(middle + QPointF(times * x * beyond_x, times * y * beyond_y), size)
            for times in (1.0, 1.5)
            for x, y in steps
        ]
        within = [room for room in rooms if area.contains(room)] or rooms[:1]
        there = [*others, *placed]
        free = (room for room in within if not any(map(room.intersects, there)))
        placed.append(next(free, None) or min(within, key=lambda room: sum(_common(room, other) for other in there)))
    return placed


def _paint_on_ground(painter: QPainter, area: QRectF, flags: Qt.AlignmentFlag, text: str, colour: str) -> None:
    """Paint text on the plot background, because red and green are unreadable on the amber of a loaded tile."""
    painter.fillRect(painter.boundingRect(area, flags, text).adjusted(-3, 0, 3, 0), QColor(theme.GROUND))
    painter.setPen(QColor(colour))
    painter.drawText(area, flags | Qt.TextFlag.TextDontClip, text)


def _common(one: QRectF, other: QRectF) -> float:
    both = one.intersected(other)
    return both.width() * both.height()


def _polygon(corners_m: NDArray[np.float64], transform: QTransform) -> QPolygonF:
    return transform.map(QPolygonF([QPointF(x, y) for x, y in corners_m]))
