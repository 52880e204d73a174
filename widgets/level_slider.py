"""The output level, with a level meter in the groove of its slider."""

import math

from PySide6.QtCore import QRectF, QSize, Qt
from PySide6.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QWheelEvent
from PySide6.QtWidgets import QSizePolicy, QSlider

from underfoot.widgets import theme
from underfoot.widgets.controls.wheel import takes_wheel

LOWEST_DB = -60.0
DEFAULT_DB = -30.0
"""The level to which a double-click goes back."""

WARNING_DB = -6.0
"""From here on the meter is drawn as a warning."""

_FALL_DB = 1.2
"""Fall of the meter per reading: 12 dB per second."""


class LevelSlider(QSlider):
    """The output level in tenths of a decibel; its groove is the level meter, on the same scale."""

    def __init__(self) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self.setAccessibleName("Output level")
        self.setToolTip("Output level, in dB of full scale; the bar shows the recent peak. Double-click for −30 dB.")
        self.setRange(round(10 * LOWEST_DB), 0)
        self.setSingleStep(5)
        self.setPageStep(30)
        self.setMinimumWidth(8 * theme.GRID)
        self.setMaximumWidth(24 * theme.GRID)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self.peak_db = -math.inf

    def show_peak(self, peak: float) -> None:
        """The recent peak, of full scale; the bar falls slowly."""
        db = 20.0 * math.log10(peak) if peak > 1e-6 else -math.inf
        fallen = max(db, self.peak_db - _FALL_DB if self.peak_db > LOWEST_DB else -math.inf)
        if fallen != self.peak_db:
            self.peak_db = fallen
            self.update()

    def sizeHint(self) -> QSize:
        return QSize(24 * theme.GRID, 3 * theme.GRID)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self._set_from_x(event.position().x())

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._set_from_x(event.position().x())

    def mouseDoubleClickEvent(self, event: QMouseEvent) -> None:
        if event.button() == Qt.MouseButton.LeftButton:
            self.setValue(round(10 * DEFAULT_DB))

    def wheelEvent(self, event: QWheelEvent) -> None:
        if takes_wheel(self, event):
            super().wheelEvent(event)

    def _set_from_x(self, x: float) -> None:
        groove = self._groove()
        share = min(max((x - groove.left()) / groove.width(), 0.0), 1.0)
        self.setValue(round(self.minimum() * (1.0 - share)))

    def _groove(self) -> QRectF:
        return QRectF(6, self.height() / 2 - 3, self.width() - 12, 6)

    def _x(self, db: float) -> float:
        groove = self._groove()
        return groove.left() + groove.width() * (1.0 - min(max(db / LOWEST_DB, 0.0), 1.0))

    def paintEvent(self, event: QPaintEvent) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        groove = self._groove()
        painter.setBrush(QColor(theme.RAISED))
        painter.drawRoundedRect(groove, 3, 3)
        if self.peak_db > LOWEST_DB:
            hot = self._x(WARNING_DB)
            end = self._x(self.peak_db)
            painter.setBrush(QColor(theme.VIBRATION))
            painter.drawRoundedRect(QRectF(groove.left(), groove.top(), min(end, hot) - groove.left(), 6), 3, 3)
            if end > hot:
                painter.setBrush(QColor(theme.ALARM if self.peak_db > -0.5 else theme.FORCE))
                painter.drawRect(QRectF(hot, groove.top(), end - hot, 6))
        painter.setBrush(QColor(theme.TEXT))
        if self.hasFocus():
            painter.setPen(QColor(theme.VIBRATION))
        painter.drawRoundedRect(QRectF(self._x(self.value() / 10) - 3, self.height() / 2 - 8, 6, 16), 2, 2)
