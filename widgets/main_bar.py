"""The main bar: workspaces, target, play, stop, panic, record, level, and readouts of the engine."""

import time
from collections.abc import Collection, Sequence

from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QAction, QIcon, QResizeEvent
from PySide6.QtWidgets import (
    QButtonGroup,
    QFrame,
    QHBoxLayout,
    QMenu,
    QPushButton,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.engine.reports import Health
from underfoot.quantities import counted, first_of
from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.menu import literal
from underfoot.widgets.controls.panels import one_of_several
from underfoot.widgets.level_slider import LevelSlider

MAX_WARNINGS = 8
"""Largest number of warnings in a tooltip."""

BUSY_LOAD = 0.8
"""Share of a block's time from which the engine's load is shown as an alarm."""

ALARM_S = 10.0
"""Time for which a new error is shown as an alarm."""

TAB_PX = 4 * theme.GRID + 2
"""Width of a tab that shows its icon."""


LEAST_READABLE_PX, BESIDE_WORDS_PX = 7 * theme.GRID, 30
"""Readable width of the target beyond its minimum, and width beside its text."""
TARGET_PX, WIDEST_TARGET_PX = 22 * theme.GRID, 48 * theme.GRID
"""Width of the target for which tabs and figures make room, and up to which it shows its words where there is room."""

Choices = Sequence[tuple["str | Choices", str]]
"""Key and text of each choice. The key "" is a separator; choices in place of a key are a submenu."""

_LATENCY = ("Latency, est.", "Latency, meas.")
"""If estimated, and if measured; the tooltip says from what."""
_AUDIO = "Audio: device, rate, block, which tile is which (Ctrl+,)"
_XRUNS = "Buffer underruns: how often the sound device ran out of samples because the engine was late"


class MainBar(QWidget):
    """Shows the state that it is given, and emits requests."""

    workspace_chosen = Signal(str)
    target_chosen = Signal(str)
    """The key of a choice of `set_targets`."""
    play_requested = Signal()
    stop_requested = Signal()
    panic_requested = Signal()
    record_requested = Signal(bool)
    level_chosen = Signal(float)
    """Decibels of full scale."""
    audio_requested = Signal()
    warnings_clicked = Signal(str)
    """The workspace whose warnings are shown."""

    def __init__(self, menu: QMenu) -> None:
        super().__init__()
        theme.fill(self, "panel")
        self.setFixedHeight(6 * theme.GRID)
        self._warnings: dict[str, Sequence[str]] = {}
        self._tab_icons: dict[str, QIcon] = {}
        self._target_actions: dict[str, QAction] = {}
        self._target_keys: Collection[str] = ()
        self._layout = QHBoxLayout(self)
        self._layout.setContentsMargins(theme.GRID // 2, 0, theme.GRID, 0)
        self._layout.setSpacing(6)
        self._add_menu(menu)
        self._add_tabs()
        self._add_target()
        self._add_warnings()
        self._add_buttons()
        self._add_level()
        self._layout.addStretch(1)
        self._add_readouts()
        self.set_playing(False)

    # --- what it shows ---

    def add_workspace(self, name: str, key: str, icon: str) -> None:
        """Add a workspace's tab; in a narrow window it shows only the icon."""
        button = one_of_several(name, f"{name} ({key})")
        button.setAccessibleName(name)
        button.setIconSize(QSize(18, 18))
        button.toggled.connect(self._make_room)
        self._tab_icons[name] = theme.icon(icon, theme.MUTED)
        button.clicked.connect(lambda _=False: self.workspace_chosen.emit(name))
        self.tabs[name] = button
        self._tab_group.addButton(button)
        self._tab_line.addWidget(button)
        self._make_room()

    def update_colours(self) -> None:
        """Show the tabs' icons in the present colours."""
        self._tab_icons = {name: theme.recoloured_icon(icon) for name, icon in self._tab_icons.items()}
        self._make_room()

    def set_workspace(self, name: str) -> None:
        """Mark the visible workspace."""
        self.tabs[name].setChecked(True)

    def set_targets(self, choices: Choices) -> None:
        """Set the choices of the target menu."""
        self.target.menu().clear()
        self._target_actions = {}
        self._fill_menu(self.target.menu(), choices)

    def _fill_menu(self, menu: QMenu, choices: Choices) -> None:
        for key, text in choices:
            if not isinstance(key, str):
                self._fill_menu(menu.addMenu(text), key)
            elif key:
                action = self._target_actions[key] = menu.addAction(text)
                action.setCheckable(True)
                action.triggered.connect(lambda _=False, key=key: self._choose_target(key))
            else:
                menu.addSeparator()

    def set_target(self, text: str, keys: Collection[str] = ()) -> None:
        """Show a description of the target, and mark the choices with these keys."""
        self.target.setText(literal(text))
        self.target.setToolTip(f"Target: {text}. Click to choose another one.")
        self.target.setMaximumWidth(min(max(self._words_px(), TARGET_PX), WIDEST_TARGET_PX))
        self._target_keys = keys
        self._mark_target()
        self._make_room()

    def _mark_target(self) -> None:
        for key, action in self._target_actions.items():
            action.setChecked(key in self._target_keys)

    def _choose_target(self, key: str) -> None:
        self._mark_target()  # a click has marked what is not the target yet
        self.target_chosen.emit(key)

    def set_warnings(self, workspace: str, lines: Sequence[str]) -> None:
        """Set a workspace's warnings; the warning sign is visible if there are any."""
        self._warnings[workspace] = lines
        workspace, lines = next((item for item in self._warnings.items() if item[1]), (workspace, ()))
        self.warnings.setVisible(bool(lines))
        self._make_room()
        self.warnings.setToolTip("\n".join([f"{workspace}:", *first_of(lines, MAX_WARNINGS)]))
        self.warnings.setAccessibleName(f"{workspace}: {counted(len(lines), 'warning')}")
        self.warnings.setAccessibleDescription("; ".join(lines))

    def _click_warnings(self) -> None:
        self.warnings_clicked.emit(next(workspace for workspace, lines in self._warnings.items() if lines))

    def set_playing(self, playing: bool) -> None:
        """Show whether sound is on."""
        theme.set_role(self.play, "primary" if playing else "")

    def set_audio_problem(self, reason: str) -> None:
        """Show in the audio button that a card that was chosen does not play, and the reason; "" if all play."""
        self.audio.setIcon(theme.icon("speaker-off", theme.ALARM) if reason else theme.icon("speaker", theme.MUTED))
        audio = with_native_keys(_AUDIO)
        self.audio.setToolTip(f"{reason[:1].upper()}{reason[1:]}\n{audio}" if reason else audio)
        self.audio.setAccessibleDescription(reason)

    def set_recording(self, text: str) -> None:
        """Show a description of the recording; "" if there is none."""
        self.record.setChecked(bool(text))
        theme.set_role(self.record, "alarm" if text else "")
        self.record.setToolTip(text or with_native_keys("Record forces and vibration (Ctrl+R)"))

    def set_level(self, db: float) -> None:
        """Show the output level, without emitting `level_chosen`."""
        with QSignalBlocker(self.level):
            self.level.setValue(round(10 * db))
        self._show_level(round(10 * db))

    def set_health(self, health: Health, tiles: int, *, is_blind: bool = False) -> None:
        """Show the engine's state and, unless it `is_blind`, the level and how many of `tiles` are asleep."""
        running, is_shown = health.running, health.running and not is_blind
        self.level.show_peak(health.peak if is_shown else 0.0)
        self.engine.show_value(
            f"{100 * health.load:.0f} %" if running else "off", alarm=running and health.load > BUSY_LOAD
        )
        self.engine.setToolTip(
            f"Share of the time a block may take: {100 * health.load:.1f} % lately, {100 * health.worst:.0f} % at most"
        )
        self.asleep.show_value(f"{tiles - health.awake} of {counted(tiles, 'tile')}" if is_shown else "–")
        before = self._losses()
        self.xruns.show_count(health.xruns)
        self.xruns.setToolTip(_XRUNS + _jumps(health))
        self.lost.show_count(health.lost)
        if self._losses() != before:
            self._make_room()
        own, stream = 1e3 * health.latency_s, 1e3 * health.stream_latency_s
        self.latency.show_value(f"{own:.1f} + {stream:.1f} ms" if running else "–")
        self.latency.show_name(_LATENCY[bool(health.round_trip_s)])
        self.latency.setToolTip(
            f"{own:.2f} ms from the arrival of a force sample to the first output that it can change, "
            f"of which {1e3 * health.hold_s:.2f} ms because some samples come late; "
            f"plus {stream:.2f} ms of the sound device's output: " + _round_trip(health) + _further_cards(health)
        )

    # --- layout ---

    def minimumSizeHint(self) -> QSize:
        """Return the least width, without the readouts that can be hidden."""
        return QSize(0, super().minimumSizeHint().height())

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()

    def _make_room(self) -> None:
        """Show the figures for which there is room beside a target that can be read; what was lost goes last.

        Before a figure goes, tabs become pictures: first of the other workspaces, then of all.
        """
        others = (self.engine, self.latency, self.xruns, self.lost, self.asleep)
        figures = list(dict.fromkeys((*self._losses(), *others)))
        for figure in figures:
            figure.show()
        for with_names in (list(self.tabs), [name for name, tab in self.tabs.items() if tab.isChecked()], []):
            self._show_tabs(with_names)
            if self._has_room(hidden=self.asleep):
                break
        for figure in reversed(figures):
            if self._has_room():
                break
            figure.hide()
        # A figure that was shown for a moment has laid out the line with itself in it.
        self._layout.invalidate()
        self._layout.activate()

    def _losses(self) -> "list[Readout]":
        return [figure for figure in (self.xruns, self.lost) if figure.count]

    def _has_room(self, hidden: "Readout | None" = None) -> bool:
        """Return whether everything fits, without the readout `hidden`."""
        for layout in (self._tab_line, self._layout):
            layout.invalidate()  # or it has the size of before what was just hidden
        least = self._layout.minimumSize().width() - (hidden.width() + self._layout.spacing() if hidden else 0)
        readable = max(min(self._words_px(), TARGET_PX) - self.target.minimumWidth(), LEAST_READABLE_PX)
        return least + readable <= self.width()

    def _words_px(self) -> int:
        """Return the width at which the target is not cut off."""
        return self.target.fontMetrics().horizontalAdvance(self.target.text()) + BESIDE_WORDS_PX

    def _show_tabs(self, with_names: Sequence[str]) -> None:
        """Show names on these tabs, and icons on the others."""
        for name, tab in self.tabs.items():
            tab.setText(name if name in with_names else "")
            tab.setIcon(QIcon() if name in with_names else self._tab_icons[name])
            tab.ensurePolished()
            tab.setFixedWidth(tab.sizeHint().width() if name in with_names else TAB_PX)

    def _add_menu(self, menu: QMenu) -> None:
        self.menu = QToolButton()
        self.menu.setProperty("role", "flat")
        self.menu.setIcon(theme.icon("menu", theme.MUTED))
        self.menu.setToolTip(with_native_keys("Files, edits and help (Alt+M)"))
        self.menu.setAccessibleName("Menu")
        self.menu.setShortcut("Alt+M")
        self.menu.setMenu(menu)
        self.menu.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        self._layout.addWidget(self.menu)

    def _add_tabs(self) -> None:
        self.tabs: dict[str, QPushButton] = {}
        self._tab_group = QButtonGroup(self)
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
        self.target.setMinimumWidth(12 * theme.GRID)
        self.target.setMaximumWidth(TARGET_PX)
        self.target.setStyleSheet(
            "QToolButton { padding-right: 18px; }"
            "QToolButton::menu-indicator { subcontrol-position: right center; right: 6px; }"
        )
        self._layout.addWidget(self.target, 100)  # it takes what room there is, up to its most, before the level does

    def _add_warnings(self) -> None:
        self.warnings = QToolButton()
        self.warnings.setProperty("role", "flat")
        self.warnings.setIcon(theme.icon("alert", theme.FORCE))
        self.warnings.clicked.connect(self._click_warnings)
        self.warnings.hide()
        self._layout.addWidget(self.warnings)

    def _add_buttons(self) -> None:
        self.play = self._button("play", theme.VIBRATION, "Play (Space)")
        self.play.clicked.connect(self.play_requested)
        self.stop = self._button("stop", theme.TEXT, "Stop: fade the sound out; forces are still measured (Space)")
        self.stop.clicked.connect(self.stop_requested)
        self.record = self._button("record", theme.ALARM, "")
        self.record.setCheckable(True)
        self.record.clicked.connect(self.record_requested)
        self.panic = QPushButton("Panic")
        self.panic.setProperty("role", "alarm")
        self.panic.setToolTip(
            "Silence at once, and discard sound that is already buffered (F12; Esc, where nothing is open)"
        )
        self.panic.clicked.connect(self.panic_requested)
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
        self.level_text = theme.label("", "small")
        self.level_text.setAlignment(Qt.AlignmentFlag.AlignHCenter)
        over = QVBoxLayout()
        over.setSpacing(0)
        over.addStretch(1)
        over.addWidget(self.level)
        over.addWidget(self.level_text)
        over.addStretch(1)
        self._layout.addLayout(over, 1)

    def _show_level(self, tenths: int) -> None:
        text = f"{tenths / 10:.1f} dB".replace("-", "−")
        self.level_text.setText(text)
        self.level.setAccessibleDescription(f"{text} of full scale")  # as a value a screen reader has the tenths

    def _add_readouts(self) -> None:
        self.engine = Readout("Engine", "100 %")
        self.asleep = Readout("Asleep", "196 of 196 tiles")
        self.asleep.setToolTip("Tiles for which nothing has to be computed now: they take no time of the engine")
        self.xruns = Readout("Xruns", "000")
        self.xruns.setToolTip(_XRUNS)
        self.lost = Readout("Lost", "0000")
        self.lost.setToolTip("Force samples that were sent and did not arrive")
        self.latency = Readout(_LATENCY[False], "00.0 + 00.0 ms")
        for figure in (self.engine, self.asleep, self.xruns, self.lost, self.latency):
            self._layout.addWidget(figure)
        audio = QToolButton()
        audio.setProperty("role", "flat")
        audio.setAccessibleName("Audio")
        audio.clicked.connect(self.audio_requested)
        self.audio = audio
        self.set_audio_problem("")
        self._layout.addWidget(audio)


class Readout(QFrame):
    """A name over a value with its unit, as wide as its widest value."""

    def __init__(self, name: str, widest_text: str) -> None:
        super().__init__()
        self.setAccessibleName(name)
        self.count, self._red_until = 0, 0.0
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
        self.setFixedWidth(max(metrics.horizontalAdvance(text) for text in (widest_text, name)) + 2)

    def show_name(self, name: str) -> None:
        """Show another name, no longer than the first."""
        self._name.setText(name)
        self.setAccessibleName(name)

    def show_value(self, text: str, *, alarm: bool = False) -> None:
        """Show a value with its unit, in red for an alarm."""
        self._value.setText(text)
        theme.set_role(self._value, "alarm" if alarm else "")

    def show_count(self, count: int) -> None:
        """Show a count of errors, red for a while after it has grown; none is no alarm, as in a new session."""
        if count > self.count:
            self._red_until = time.perf_counter() + ALARM_S
        self.count = count
        self.show_value(str(count), alarm=count > 0 and time.perf_counter() < self._red_until)

    @property
    def is_alarm(self) -> bool:
        """Whether the value is shown as an alarm."""
        return bool(self._value.property("role") == "alarm")

    def text(self) -> str:
        """The value that is shown."""
        return self._value.text()


def _jumps(health: Health) -> str:
    """Return how often accelerometer input was realigned; "" if never."""
    if not health.jumps:
        return ""
    times = counted(health.jumps, "time")
    return f"; {times} frames were lost on the way to its inputs, and what is measured was aligned anew"


def _round_trip(health: Health) -> str:
    """Return the source of the sound device's share of the latency, in words."""
    if not health.round_trip_s:
        return "estimated, by the device's clock; Calibrate, Latency measures it"
    clock = f", {1e3 * health.clock_trip_s:.2f} ms by the device's clock" if health.clock_trip_s else ""
    return f"measured, of a round trip of {1e3 * health.round_trip_s:.2f} ms{clock}"


def _further_cards(health: Health) -> str:
    """Return how far other sound cards are behind the first; "" without any."""
    if not health.cards_delay_s:
        return ""
    return (
        f"; further cards play {1e3 * health.cards_delay_s:.1f} ms later, the worst of them "
        f"{1e3 * health.cards_offset_s:+.2f} ms off, its clock {health.cards_drift_ppm:+.0f} ppm"
    )
