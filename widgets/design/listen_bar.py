"""The strip above the preview: play, loop, duration, slots A and B, and their blind test."""

from collections.abc import Callable, Mapping
from functools import partial

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QAction, QResizeEvent
from PySide6.QtWidgets import QButtonGroup, QComboBox, QHBoxLayout, QToolButton, QWidget

from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.controls.menu import add_action, literal
from underfoot.widgets.controls.panels import chip, one_of_several
from underfoot.widgets.session.open_patch import SLOTS, other_slot

LENGTHS_S = (0.0, 0.5, 1.0, 2.0, 5.0, 10.0)
"""Durations of a preview in seconds; 0 for the patch's own."""

MOST_NAME_PX = 16 * theme.GRID
"""Room for the name of a node that is played alone; the status line has all of it."""


class ListenBar(QWidget):
    """Shows the listening state, and emits requests. The keys of its actions work in all of `around`."""

    start_requested = Signal()
    loop_requested = Signal(bool)
    length_chosen = Signal()
    switch_requested = Signal()
    copy_requested = Signal()
    """Copy the edited slot to the other slot."""
    match_requested = Signal(bool)
    overlay_requested = Signal(bool)
    blind_requested = Signal()
    whole_patch_requested = Signal()
    """Play the whole patch again."""

    def __init__(self, around: QWidget) -> None:
        super().__init__(around)
        theme.fill(self, "panel")
        self.start_button = self._add_chip(
            "From start", "Play from the start, and strike the tile (P)", self.start_requested.emit
        )
        self.start_button.setIcon(theme.icon("play", theme.MUTED))
        self.start_button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.loop = chip("Loop", "Play from the start again and again, as long as the preview is (L)", self)
        self.loop.toggled.connect(self.loop_requested)
        self.length = QComboBox(self)
        self.length.addItems([f"{seconds:g} s" if seconds else "whole" for seconds in LENGTHS_S])
        self.length.setProperty("role", "chip")
        self.length.setAccessibleName("Length of the preview")
        self.length.setToolTip("How long the preview and the loop last; whole: until the patch has come to its end")
        self.length.activated.connect(self.length_chosen)
        self._slot = SLOTS[0]
        self.slots = {slot: one_of_several(slot, f"Edit and play {slot} (X switches)", "chip", self) for slot in SLOTS}
        group = QButtonGroup(self)
        for slot, button in self.slots.items():
            group.addButton(button)
            button.clicked.connect(lambda _=False, slot=slot: self._choose(slot))
        self.copy = self._add_chip("A → B", "", self.copy_requested.emit)
        self.overlay = chip(
            "Overlay", "Draw the other slot's preview over this one's, and show the difference", self, checked=True
        )
        self.overlay.toggled.connect(self.overlay_requested)
        self.match = chip(
            "Match",
            "Play the louder of A and B as softly as the other, by their RMS from 40 Hz to 1 kHz in the preview",
            self,
            checked=True,
        )
        self.match.toggled.connect(self.match_requested)
        self.blind_button = self._add_chip(
            "ABX…", "Blind test: is X A or B? Without pictures (Ctrl+B)", self.blind_requested.emit
        )
        self.audition_button = self._add_chip("", "Play the whole patch again (A)", self.whole_patch_requested.emit)
        self.audition_button.setCheckable(True)
        self.state = ElidedLabel("small")
        self.actions_by_name = self._make_actions(around)
        self._lay_out()
        self.show_slot(SLOTS[0], has_other=False)
        self.show_auditioned("")

    @property
    def seconds(self) -> float:
        """The duration of a preview in seconds; 0 for the patch's own."""
        return LENGTHS_S[self.length.currentIndex()]

    def show_slot(self, slot: str, *, has_other: bool) -> None:
        """Show the edited slot; enable comparisons if there are two."""
        self._slot = slot
        self.slots[slot].setChecked(True)
        text = f"Copy {slot} to {other_slot(slot)}"
        self.copy.setText(f"{slot} → {other_slot(slot)}")
        self.copy.setAccessibleName(text)
        self.copy.setToolTip(f"{text}; it can be undone there")
        self.actions_by_name["copy to other"].setText(text)
        for widget in (self.overlay, self.match, self.blind_button):
            widget.setVisible(has_other)
        if not has_other:
            self.state.set_full_text("")

    def show_auditioned(self, name: str) -> None:
        """Show the name of the node that is played alone; "" for none."""
        self.audition_button.setVisible(bool(name))
        self.audition_button.setChecked(bool(name))
        short = self.fontMetrics().elidedText(name, Qt.TextElideMode.ElideRight, MOST_NAME_PX)
        self.audition_button.setText(f"{literal(short)} alone  ×")

    def show_match(self, gains: Mapping[str, str], on: bool) -> None:
        """Show the attenuation of the louder slot."""
        softer = [f"{slot} {gain}" for slot, gain in gains.items() if gain not in ("", "0.0 dB")]
        same = "equally loud" if all(gains.values()) else ""
        self.state.set_full_text((", ".join(softer) or same) if on else "as they are")
        self._make_room()

    def show_looping(self, on: bool) -> None:
        """Show whether the loop is on, without emitting a request."""
        with QSignalBlocker(self.loop):
            self.loop.setChecked(on)

    def _choose(self, slot: str) -> None:
        """Request a slot; a click on the edited slot does nothing."""
        if slot != self._slot:
            self.switch_requested.emit()

    def _make_actions(self, around: QWidget) -> dict[str, QAction]:
        add = partial(add_action, around, where=Qt.ShortcutContext.WidgetWithChildrenShortcut)
        return {
            "from start": add("Play from the start", "P", self.start_requested.emit),
            "loop": add("Loop", "L", self.loop.toggle),
            "switch": add("Switch between A and B", "X", self.switch_requested.emit),
            "copy to other": add("Copy A to B", "Shift+X", self.copy_requested.emit),
            "blind test": add("Blind test of A and B…", "Ctrl+B", self.blind_requested.emit),
        }

    def _add_chip(self, text: str, tip: str, do: Callable[[], object]) -> QToolButton:
        button = chip(text, tip, self, checkable=False)
        button.clicked.connect(lambda _=False: do())
        return button

    def resizeEvent(self, event: QResizeEvent) -> None:
        super().resizeEvent(event)
        self._make_room()

    def _make_room(self) -> None:
        """If space is short, hide the text beside the icon, then the whole text on A and B; half a number would be
        misleading.
        """
        state_px = self.state.sizeHint().width()
        for style in (Qt.ToolButtonStyle.ToolButtonTextBesideIcon, Qt.ToolButtonStyle.ToolButtonIconOnly):
            self.start_button.setToolButtonStyle(style)
            self._row.invalidate()
            if self._row.minimumSize().width() + state_px <= self.width():
                break
        self.state.setMaximumWidth(state_px if self._row.minimumSize().width() + state_px <= self.width() else 0)

    def _lay_out(self) -> None:
        row = self._row = QHBoxLayout(self)
        row.setContentsMargins(2 * theme.GRID, theme.GRID // 2, theme.GRID, theme.GRID // 2)
        row.setSpacing(theme.GRID // 2)
        for widget in (self.start_button, self.loop, self.length):
            row.addWidget(widget)
        row.addSpacing(2 * theme.GRID)
        for slot in self.slots.values():
            row.addWidget(slot)
        for button in (self.copy, self.overlay, self.match, self.blind_button):
            row.addWidget(button)
        row.addSpacing(theme.GRID)
        row.addWidget(self.state)
        row.addStretch()
        row.addWidget(self.audition_button)
