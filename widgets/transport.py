"""The bar that is always there: where the session plays, play, stop, panic, record, level, and how the engine is."""

import math
import time
from collections.abc import Sequence

from PySide6.QtCore import QRectF, QSize, Qt, Signal
from PySide6.QtGui import QColor, QPainter
from PySide6.QtWidgets import (
    QButtonGroup,
    QFrame,
    QHBoxLayout,
    QMenu,
    QPushButton,
    QSizePolicy,
    QSlider,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.engine.reports import Health
from underfoot.widgets import theme

LOWEST_DB = -60.0
HOT_DB = -6.0
MOST_FLAGS = 8
BUSY = 0.8
"""Share of a block's time from which the engine's load is shown as an alarm."""

ALARM_S = 10.0
"""How long a new loss is shown as an alarm."""

Choices = Sequence[tuple["str | Choices", str]]
"""A key and words for each. A key of "" is a line between; further choices instead of a key are a menu of theirs."""

_HOLD_DB = 1.2
"""The meter falls by so much a reading: 12 dB a second."""


class TransportBar(QWidget):
    """Shows what it is told, and says what was asked for."""

    workspace_chosen = Signal(int)
    target_chosen = Signal(str)
    """The key of a choice that `set_targets` gave."""
    play_wanted = Signal()
    stop_wanted = Signal()
    panic_wanted = Signal()
    record_wanted = Signal(bool)
    level_chosen = Signal(float)
    """Decibels of full scale."""
    audio_wanted = Signal()
    flags_clicked = Signal()

    def __init__(self, menu: QMenu) -> None:
        super().__init__()
        self.setProperty("role", "panel")
        self.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
        self.setFixedHeight(6 * theme.GRID)
        self._targets: dict[str, str] = {}
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(theme.GRID, 0, 2 * theme.GRID, 0)
        self._layout.setSpacing(theme.GRID)
        self._add_menu(menu)
        self._add_tabs()
        self._add_target()
        self._add_flags()
        self._add_buttons()
        self._add_level()
        self._layout.addStretch(1)
        self._add_figures()
        self.set_playing(False)

    # --- what it shows ---

    def add_workspace(self, name: str) -> None:
        """A tab for another workspace."""
        button = QPushButton(name)
        button.setProperty("role", "tab")
        button.setCheckable(True)
        index = len(self._tabs.buttons())
        button.setToolTip(f"{name} (Ctrl+{index + 1})")
        self._tabs.addButton(button, index)
        self._tab_line.addWidget(button)
        if index == 0:
            button.setChecked(True)

    def set_workspace(self, index: int) -> None:
        """Mark the workspace that is on the screen."""
        self._tabs.button(index).setChecked(True)

    def set_targets(self, choices: Choices) -> None:
        """What the target chooser offers."""
        self.target.menu().clear()
        self._offer(self.target.menu(), choices)

    def _offer(self, menu: QMenu, choices: Choices) -> None:
        for key, words in choices:
            if not isinstance(key, str):
                self._offer(menu.addMenu(words), key)
            elif key:
                menu.addAction(words).triggered.connect(lambda _=False, key=key: self.target_chosen.emit(key))
            else:
                menu.addSeparator()

    def set_target(self, words: str) -> None:
        """What the session plays on, in words."""
        self.target.setText(words)
        self.target.setToolTip(f"Plays on: {words}. Click to choose another target.")

    def set_flags(self, lines: Sequence[str]) -> None:
        """What speaks against the calibration of the target's tiles; nothing is shown where nothing does."""
        self.flags.setVisible(bool(lines))
        more = [f"and {len(lines) - MOST_FLAGS} more"] if len(lines) > MOST_FLAGS else []
        self.flags.setToolTip("\n".join(["Calibration:", *lines[:MOST_FLAGS], *more]))
        self.flags.setAccessibleName(f"Calibration: {len(lines)} warnings")
        self.flags.setAccessibleDescription("; ".join(lines))

    def set_playing(self, playing: bool) -> None:
        """Whether sound is let out."""
        self.play.setIcon(theme.icon("play", theme.VIBRATION))
        theme.set_role(self.play, "primary" if playing else "")

    def set_recording(self, words: str) -> None:
        """What is recorded, in words; "" while nothing is."""
        self.record.setChecked(bool(words))
        theme.set_role(self.record, "alarm" if words else "")
        self.record.setToolTip(words or "Record forces and vibration (Ctrl+R)")

    def set_level(self, db: float) -> None:
        """The output level, without saying that it was chosen."""
        blocked = self.level.blockSignals(True)
        self.level.setValue(round(10 * db))
        self.level.blockSignals(blocked)
        self._show_level(round(10 * db))

    def set_health(self, health: Health, tiles: int) -> None:
        """How the engine is, and how many of `tiles` are asleep."""
        self.level.show_peak(health.peak if health.running else 0.0)
        running = health.running
        self._engine.show_value(
            f"{100 * health.load:.0f} %" if running else "off", alarm=running and health.load > BUSY
        )
        self._engine.setToolTip(
            f"Share of the time a block may take: {100 * health.load:.1f} % lately, {100 * health.worst:.0f} % at worst"
        )
        self._asleep.show_value(f"{tiles - health.awake} of {tiles} tiles" if running else "–")
        self._xruns.show_count(health.xruns)
        self._lost.show_count(health.lost)
        own, stream = 1e3 * health.latency_s, 1e3 * health.stream_latency_s
        self._latency.show_value(f"{own:.1f} + {stream:.1f} ms" if running else "–")
        self._latency.setToolTip(
            f"{own:.2f} ms from a force sample's arrival to the first output that it can change, "
            f"and {stream:.2f} ms that the output stream adds"
        )

    # --- layout ---

    def _add_menu(self, menu: QMenu) -> None:
        self.menu = QToolButton()
        self.menu.setProperty("role", "flat")
        self.menu.setIcon(theme.icon("menu", theme.MUTED))
        self.menu.setToolTip("Files, edits and help (Alt+M)")
        self.menu.setAccessibleName("Menu")
        self.menu.setShortcut("Alt+M")
        self.menu.setMenu(menu)
        self.menu.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.menu.setStyleSheet("QToolButton::menu-indicator { image: none; }")
        self._layout.addWidget(self.menu)

    def _add_tabs(self) -> None:
        self._tabs = QButtonGroup(self)
        self._tabs.idClicked.connect(self.workspace_chosen)
        self._tab_line = QHBoxLayout()
        self._tab_line.setSpacing(theme.GRID // 2)
        self._layout.addLayout(self._tab_line)
        self._layout.addSpacing(theme.GRID)

    def _add_target(self) -> None:
        self.target = QToolButton()
        self.target.setAccessibleName("Target")
        self.target.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextOnly)
        self.target.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self.target.setMenu(QMenu(self.target))
        self.target.setFixedWidth(23 * theme.GRID)
        self.target.setStyleSheet("QToolButton::menu-indicator { subcontrol-position: right center; right: 6px; }")
        self._layout.addWidget(self.target)

    def _add_flags(self) -> None:
        self.flags = QToolButton()
        self.flags.setProperty("role", "flat")
        self.flags.setIcon(theme.icon("alert-outline", theme.FORCE))
        self.flags.clicked.connect(self.flags_clicked)
        self.flags.hide()
        self._layout.addWidget(self.flags)

    def _add_buttons(self) -> None:
        self.play = self._button("play", theme.VIBRATION, "Play (Space)")
        self.play.clicked.connect(self.play_wanted)
        self.stop = self._button("stop", theme.TEXT, "Stop: ramp the sound down; the session goes on (Space)")
        self.stop.clicked.connect(self.stop_wanted)
        self.record = self._button("record", theme.ALARM, "")
        self.record.setCheckable(True)
        self.record.clicked.connect(self.record_wanted)
        self.panic = QPushButton("Panic")
        self.panic.setProperty("role", "alarm")
        self.panic.setToolTip("Silence at once, and drop what is on its way (Esc)")
        self.panic.clicked.connect(self.panic_wanted)
        self._layout.addWidget(self.panic)

    def _button(self, icon: str, colour: str, tip: str) -> QPushButton:
        button = QPushButton()
        button.setIcon(theme.icon(icon, colour))
        button.setIconSize(QSize(18, 18))
        button.setToolTip(tip)
        button.setAccessibleName(tip.partition(" (")[0].partition(":")[0] or "Record")
        button.setFixedWidth(4 * theme.GRID + 4)
        self._layout.addWidget(button)
        return button

    def _add_level(self) -> None:
        self._layout.addSpacing(theme.GRID // 2)
        self.level = LevelSlider()
        self.level.valueChanged.connect(self._show_level)
        self.level.valueChanged.connect(lambda tenths: self.level_chosen.emit(tenths / 10))
        self._level_text = theme.label()
        self._level_text.setFixedWidth(self._level_text.fontMetrics().horizontalAdvance("−60.0 dB") + 4)
        self._layout.addWidget(self.level, 1)
        self._layout.addWidget(self._level_text)

    def _show_level(self, tenths: int) -> None:
        self._level_text.setText(f"{tenths / 10:.1f} dB".replace("-", "−"))

    def _add_figures(self) -> None:
        self._engine = Figure("Engine", "100 %")
        self._asleep = Figure("Asleep", "196 of 196 tiles")
        self._asleep.setToolTip("Tiles for which nothing has to be computed: they cost nothing")
        self._xruns = Figure("Xruns", "000")
        self._xruns.setToolTip("How often the output ran dry because the engine was late")
        self._lost = Figure("Lost", "0000")
        self._lost.setToolTip("Force samples that did not arrive")
        self._latency = Figure("Latency", "00.0 + 00.0 ms")
        for figure in (self._engine, self._asleep, self._xruns, self._lost, self._latency):
            self._layout.addWidget(figure)
        audio = QToolButton()
        audio.setProperty("role", "flat")
        audio.setIcon(theme.icon("speaker", theme.MUTED))
        audio.setToolTip("Audio: device, rate, block, which tile is which (Ctrl+,)")
        audio.setAccessibleName("Audio")
        audio.clicked.connect(self.audio_wanted)
        self.audio = audio
        self._layout.addWidget(audio)


class Figure(QFrame):
    """A name over a value with its unit, as wide as its widest value."""

    def __init__(self, name: str, widest: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self._count, self._red_until = 0, 0.0
        self._name, self._value = theme.label(name, "small"), theme.label("–")
        self._value.setFont(theme.font(theme.TEXT_PX - 1))
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addStretch(1)
        layout.addWidget(self._name)
        layout.addWidget(self._value)
        layout.addStretch(1)
        metrics = self._value.fontMetrics()
        self.setFixedWidth(max(metrics.horizontalAdvance(text) for text in (widest, name)) + 2)

    def show_value(self, text: str, *, alarm: bool = False) -> None:
        self._value.setText(text)
        theme.set_role(self._value, "alarm" if alarm else "")

    def show_count(self, count: int) -> None:
        """A count of bad things, red for a while after it has grown."""
        if count > self._count:
            self._red_until = time.monotonic() + ALARM_S
        self._count = count
        self.show_value(str(count), alarm=time.monotonic() < self._red_until)

    def text(self) -> str:
        return self._value.text()


class LevelSlider(QSlider):
    """The output level in tenths of a decibel; its groove is the meter of what comes out, on the same scale."""

    def __init__(self) -> None:
        super().__init__(Qt.Orientation.Horizontal)
        self.setAccessibleName("Output level")
        self.setToolTip(
            "Output level, in dB of full scale; the bar is the largest sample lately. Double-click for −30 dB."
        )
        self.setRange(round(10 * LOWEST_DB), 0)
        self.setSingleStep(5)
        self.setPageStep(30)
        self.setMinimumWidth(8 * theme.GRID)
        self.setMaximumWidth(24 * theme.GRID)
        self.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
        self._peak_db = -math.inf

    def show_peak(self, peak: float) -> None:
        """The largest sample lately, of full scale; the bar falls slowly."""
        db = 20.0 * math.log10(peak) if peak > 1e-6 else -math.inf
        fallen = max(db, self._peak_db - _HOLD_DB if self._peak_db > LOWEST_DB else -math.inf)
        if fallen != self._peak_db:
            self._peak_db = fallen
            self.update()

    def sizeHint(self) -> QSize:
        return QSize(24 * theme.GRID, 3 * theme.GRID)

    def mousePressEvent(self, event) -> None:
        self._go_to(event.position().x())

    def mouseMoveEvent(self, event) -> None:
        if event.buttons() & Qt.MouseButton.LeftButton:
            self._go_to(event.position().x())

    def mouseDoubleClickEvent(self, event) -> None:
        self.setValue(-300)

    def _go_to(self, x: float) -> None:
        groove = self._groove()
        share = min(max((x - groove.left()) / groove.width(), 0.0), 1.0)
        self.setValue(round(self.minimum() * (1.0 - share)))

    def _groove(self) -> QRectF:
        return QRectF(6, self.height() / 2 - 3, self.width() - 12, 6)

    def _x(self, db: float) -> float:
        groove = self._groove()
        return groove.left() + groove.width() * (1.0 - min(max(db / LOWEST_DB, 0.0), 1.0))

    def paintEvent(self, event) -> None:
        painter = QPainter(self)
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        painter.setPen(Qt.PenStyle.NoPen)
        groove = self._groove()
        painter.setBrush(QColor(theme.RAISED))
        painter.drawRoundedRect(groove, 3, 3)
        if self._peak_db > LOWEST_DB:
            hot = self._x(HOT_DB)
            end = self._x(self._peak_db)
            painter.setBrush(QColor(theme.VIBRATION))
            painter.drawRoundedRect(QRectF(groove.left(), groove.top(), min(end, hot) - groove.left(), 6), 3, 3)
            if end > hot:
                painter.setBrush(QColor(theme.ALARM if self._peak_db > -0.5 else theme.FORCE))
                painter.drawRect(QRectF(hot, groove.top(), end - hot, 6))
        painter.setBrush(QColor(theme.TEXT))
        if self.hasFocus():
            painter.setPen(QColor(theme.VIBRATION))
        painter.drawRoundedRect(QRectF(self._x(self.value() / 10) - 3, self.height() / 2 - 8, 6, 16), 2, 2)
