"""The list of presets: rows with the name, the response to a step, and a star."""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path

from PySide6.QtCore import (
    QEvent,
    QMimeData,
    QPointF,
    QRect,
    QRectF,
    Qt,
    Signal,
)
from PySide6.QtGui import QColor, QContextMenuEvent, QKeyEvent, QMouseEvent, QPainter, QPolygonF
from PySide6.QtWidgets import QListWidgetItem, QWidget

from underfoot.engine.preset_pictures import PresetPicture
from underfoot.patch.preset_files import Preset
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.menu import Menu
from underfoot.widgets.design import preset_drops
from underfoot.widgets.design.headed_list import HeadedList, Index

_PRESET, _PICTURE, _IS_STARRED = (Qt.ItemDataRole.UserRole + i for i in range(3))
_OWN_KEYS = (Qt.Key.Key_Escape, Qt.Key.Key_Delete, Qt.Key.Key_Asterisk)
_ROW_PX, _STAR_PX, _LEVEL_PX = 46, 20, 58


class PresetList(HeadedList):
    """Presets by family. `chosen` carries the one to open, `current_changed` the current one after a key or click."""

    chosen = Signal(object)
    insertion_requested = Signal(object)
    """The preset on which Shift+Enter was pressed; as below, also from its context menu."""
    current_changed = Signal(object)
    starred = Signal(object)
    """The preset whose star was clicked, or toggled with *."""
    deletion_requested = Signal(object)
    """The preset on which Delete was pressed."""
    escaped = Signal()
    """Escape was pressed."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent, "Presets", _ROW_PX, _paint_row)
        self.itemDoubleClicked.connect(self._double_clicked)
        self.itemClicked.connect(self._clicked)
        self._on_star = False

    def show_presets(
        self, presets: Sequence[Preset], pictures: Mapping[Path, PresetPicture], stars: Sequence[str], *, headed: bool
    ) -> None:
        """Show these presets by name under headings of their families, or, if not `headed`, by title.

        With headings, the current preset stays current if it is still listed. Otherwise none is current, and Enter
        opens the first.
        """
        before = self.current() if headed else None
        self.clear()
        family = None
        for preset in presets:
            if headed and preset.family != family and preset.family:
                heading = QListWidgetItem(preset.family.upper(), self)
                heading.setFlags(Qt.ItemFlag.NoItemFlags)
            family = preset.family
            item = QListWidgetItem(preset.name if headed else preset.title, self)
            item.setData(_PRESET, preset)
            item.setData(_PICTURE, pictures.get(preset.path))
            item.setData(_IS_STARRED, str(preset.path) in stars)
            item.setToolTip(tooltip_text(preset, pictures.get(preset.path)))
            if before is not None and preset.path == before.path:
                self.setCurrentItem(item)

    def show_picture(self, path: Path, picture: PresetPicture) -> None:
        """Show the picture of a file."""
        for item in self._items():
            preset = item.data(_PRESET)
            if preset.path == path:
                item.setData(_PICTURE, picture)
                item.setToolTip(tooltip_text(preset, picture))

    def presets(self) -> list[Preset]:
        """Return the visible presets."""
        return [item.data(_PRESET) for item in self._items()]

    def current(self) -> Preset | None:
        """Return the current preset; None if there is none."""
        item = self.currentItem()
        return item.data(_PRESET) if item else None

    def step(self, by: int) -> None:
        super().step(by)
        if self.current():
            self.current_changed.emit(self.current())

    def mimeTypes(self) -> list[str]:
        return [preset_drops.MIME]

    def mimeData(self, items: list[QListWidgetItem]) -> QMimeData:  # type: ignore[override]
        preset = items[0].data(_PRESET) if items else None
        return preset_drops.dragged(preset.path) if preset is not None else QMimeData()

    def event(self, event: QEvent) -> bool:
        # Escape and * go to the list, not to shortcuts of the window.
        is_asked = event.type() == QEvent.Type.ShortcutOverride and isinstance(event, QKeyEvent)
        if is_asked and event.key() in _OWN_KEYS:  # type: ignore[attr-defined]
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        key, current = event.key(), self.current()
        if key in (Qt.Key.Key_Up, Qt.Key.Key_Down):
            self.step(1 if key == Qt.Key.Key_Down else -1)
        elif key in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and current is not None:
            is_inserted = bool(event.modifiers() & Qt.KeyboardModifier.ShiftModifier)
            (self.insertion_requested if is_inserted else self.chosen).emit(current)
        elif key == Qt.Key.Key_Escape:
            self.escaped.emit()
        elif key == Qt.Key.Key_Asterisk and current is not None:
            self.starred.emit(current)
        elif key == Qt.Key.Key_Delete and current is not None:
            self.deletion_requested.emit(current)
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what keys do with the preset under the mouse, or by Shift+F10 with the current one."""
        by_key = event.reason() == QContextMenuEvent.Reason.Keyboard
        item = self.currentItem() if by_key else self.itemAt(event.pos())
        if item is None or item.data(_PRESET) is None:
            return
        preset = item.data(_PRESET)
        menu = Menu(self)
        star = "Take from ★" if item.data(_IS_STARRED) else "Keep under ★"
        menu.addAction("Open\tReturn", partial(self.chosen.emit, preset))
        putting = with_native_keys("Put into the patch\tShift+Return")
        menu.addAction(putting, partial(self.insertion_requested.emit, preset))
        menu.addAction(f"{star}\t*", partial(self.starred.emit, preset))
        if preset.is_user_preset:
            menu.addAction("Delete…\tDel", partial(self.deletion_requested.emit, preset))
        below = self.visualItemRect(item).bottomLeft()
        menu.open_once(self.viewport().mapToGlobal(below) if by_key else event.globalPos())

    def mousePressEvent(self, event: QMouseEvent) -> None:
        self._on_star = event.position().x() > self.viewport().width() - _STAR_PX
        super().mousePressEvent(event)

    def _clicked(self, item: QListWidgetItem) -> None:
        preset = item.data(_PRESET)
        if preset is not None:
            (self.starred if self._on_star else self.current_changed).emit(preset)

    def _double_clicked(self, item: QListWidgetItem) -> None:
        if item.data(_PRESET) is not None and not self._on_star:
            self.chosen.emit(item.data(_PRESET))

    def _items(self) -> list[QListWidgetItem]:
        return [item for i in range(self.count()) if (item := self.item(i)).data(_PRESET) is not None]


def tooltip_text(preset: Preset, picture: PresetPicture | None) -> str:
    """Return a description of a preset in a few lines.

    >>> tooltip_text(Preset(Path("a.json"), "", "Ice", "Ice", "It cracks at 2 m/s^2."), None)
    'Ice\\nIt cracks at 2\\xa0m/s².'
    """
    lines = [preset.title, pretty_text(preset.comment)]
    if preset.tags:
        lines.append(", ".join(preset.tags))
    if preset.author:
        lines.append(f"by {preset.author}")
    if picture is not None:
        lines.append(f"One step: {level_text(picture)}")
    return "\n".join(line for line in lines if line)


def level_text(picture: PresetPicture) -> str:
    """Return the level of a preset, and its distance above the sensation threshold, as text.

    >>> import numpy as np
    >>> level_text(PresetPicture(np.zeros(96), 4.56, 22.8))
    '4.6 m/s² peak, 23 dB over the threshold in a shoe'
    """
    if picture.felt_db is None:
        return "nothing is felt"
    return f"{picture.peak_m_s2:.1f} m/s² peak, {picture.felt_db:.0f} dB over the threshold in a shoe"


def _paint_row(painter: QPainter, rect: QRect, index: Index, is_offered: bool) -> None:
    """Paint a preset with its picture and its star."""
    _paint_preset(painter, rect, index)
    if index.data(_IS_STARRED) or is_offered:
        painter.setFont(theme.font())
        painter.setPen(QColor(theme.EVENTS if index.data(_IS_STARRED) else theme.FAINT))
        star = QRect(rect.right() - _STAR_PX, rect.y(), _STAR_PX, rect.height())
        painter.drawText(star, Qt.AlignmentFlag.AlignCenter, "★" if index.data(_IS_STARRED) else "☆")


def _paint_preset(painter: QPainter, rect: QRect, index: Index) -> None:
    picture: PresetPicture | None = index.data(_PICTURE)
    text = rect.adjusted(8, 4, -_STAR_PX, -6)
    align = Qt.AlignmentFlag.AlignLeft
    painter.setFont(theme.font())
    painter.setPen(QColor(theme.TEXT))
    name = painter.fontMetrics().elidedText(index.data(), Qt.TextElideMode.ElideMiddle, text.width())
    painter.drawText(text, align | Qt.AlignmentFlag.AlignTop, name)
    painter.setFont(theme.font(theme.SMALL_PX))
    painter.setPen(QColor(theme.MUTED))
    level = "" if picture is None or picture.felt_db is None else f"{picture.peak_m_s2:.1f} m/s²"
    painter.drawText(text, align | Qt.AlignmentFlag.AlignBottom, level)
    if picture is not None:
        place = QRectF(text.adjusted(_LEVEL_PX, text.height() - 18, -4, 2))
        painter.setPen(Qt.PenStyle.NoPen)
        painter.setBrush(QColor(theme.VIBRATION))
        painter.drawPolygon(_outline(picture, place))


def _outline(picture: PresetPicture, place: QRectF) -> QPolygonF:
    """Return the envelope and its mirror image as a polygon."""
    count = len(picture.envelope)
    middle, half = place.center().y(), 0.5 * place.height()
    xs = [place.x() + place.width() * i / (count - 1) for i in range(count)]
    heights = [max(half * float(share), 0.5) for share in picture.envelope]
    upper = [QPointF(x, middle - height) for x, height in zip(xs, heights, strict=True)]
    lower = [QPointF(x, middle + height) for x, height in zip(xs, heights, strict=True)]
    return QPolygonF([*upper, *reversed(lower)])
