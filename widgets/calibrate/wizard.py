"""The wizard, which presents any procedure page by page, beside the measurements so far."""

from collections.abc import Callable

from PySide6.QtCore import Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent
from PySide6.QtWidgets import (
    QAbstractButton,
    QHBoxLayout,
    QPushButton,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from underfoot.calibration.procedure import Page
from underfoot.calibration.result import Result
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Part
from underfoot.quantities import pretty_text
from underfoot.widgets import theme
from underfoot.widgets.calibrate.measuring import Measurement, Snapshot
from underfoot.widgets.calibrate.page_view import PageView, plays_sound
from underfoot.widgets.calibrate.result_view import ResultView
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.panels import progress_bar
from underfoot.widgets.controls.question import ask
from underfoot.widgets.controls.scrolled import scroll_in
from underfoot.widgets.controls.tab_order import set_tab_order
from underfoot.widgets.plots.drawing_column import DrawingColumn

BUSY_S = 0.4
"""Seconds after which a page shows that a computation is running."""
WORTH = 0.1
"""Share of the work done beyond which leaving asks for confirmation."""

_POLL_MS = 100


class Wizard(QWidget):
    """Shows measurements, each started by `begin`; signals when the user leaves, saves or reports."""

    closed = Signal()
    """The user cancelled, or closed the last page."""
    save_requested = Signal(object)
    """A `Result`."""
    report_requested = Signal(object)
    projection_requested = Signal()
    ready = Signal()
    """The tile is ready, and the first page of its measurement."""
    page_shown = Signal(object)
    """The `Snapshot` now on the screen."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.measurement: Measurement | None = None
        self.snapshot: Snapshot | None = None
        self._before: Part | None = None
        self._is_saved = False
        self._build()
        self._show_buttons()  # all of them would make it twice as wide
        self._timer = QTimer(self, interval=_POLL_MS)
        self._timer.timeout.connect(self._show_busy)

    def begin(self, measurement: Measurement, tile: Tile, calibration: str, before: Part | None) -> None:
        """Show this measurement of `tile`; `before` is the part of its profile that the result would replace."""
        self.measurement, self.snapshot, self._before, self._is_saved = measurement, None, before, False
        self._heading.setText(f"{calibration}  ·  tile {tile.id}")
        self.page.set_tile(tile, calibration if measurement.by_hand else "")
        self.page.show_page(Page("", "One moment", "The tile is being prepared."))
        self._body.setCurrentWidget(self.page)
        self.drawings.show_drawings((), "Measurements are drawn here.")
        self._progress.setValue(0)
        self._share.setText("")
        self._show_refusal("")
        measurement.changed.connect(self._show_snapshot)
        measurement.failed.connect(self._fail)
        self._show_buttons()
        self._timer.start()

    def end(self) -> None:
        """Drop the measurement."""
        self._timer.stop()
        if self.measurement is not None:
            self.measurement.changed.disconnect(self._show_snapshot)
            self.measurement.failed.disconnect(self._fail)
            self.measurement = None
            self._show_busy()  # nothing is, and no timer will say so

    def mark_saved(self) -> None:
        """Note that the result is in the profile."""
        self._is_saved = True
        self._show_buttons()
        self.closing.setFocus()

    def mark_unsaved(self, reason: str) -> None:
        """Say why the result could not be written into the profile; it can be saved again."""
        self._show_refusal(reason)
        self._show_buttons()
        self.saving.setFocus()

    # --- messages of the measurement ---

    def _show_snapshot(self) -> None:
        measurement = self.measurement
        if measurement is None:
            return
        measurement.acknowledge()
        old, new = self.snapshot, measurement.snapshot
        if new is None:
            return
        self.snapshot = new
        if old is None:
            self.ready.emit()
        turned = old is None or (old.page.key, old.page.questions) != (new.page.key, new.page.questions)
        had_focus = self._has_focus()
        self._show_buttons()  # before anything else changes: each change lays out the whole
        if new.page.last and new.result is not None:
            self.result.show_result(new.result, self._before, simulated=not measurement.by_hand)
            self._body.setCurrentWidget(self.result)
            if turned:
                self.drawings.show_drawings(new.result.drawings, "This result has no drawings.")
        else:
            self.page.show_page(new.page)
            self.page.show_live(new.live)
            self._body.setCurrentWidget(self.page)
            if old is None or old.drawings is not new.drawings:
                self.drawings.show_drawings(new.drawings, "Measurements are drawn here.")
        self._progress.setValue(round(1000 * new.page.share))
        self._share.setText(f"{100 * new.page.share:.0f} % done")
        self._show_refusal(new.rejection)
        if turned:
            self._scrolled.verticalScrollBar().setValue(0)
            self._order_stops()
            if had_focus:
                self._focus_page()
        self.page_shown.emit(new)

    def _fail(self, reason: str) -> None:
        if self.snapshot is None:
            self.page.show_page(Page("failed", "The calibration cannot begin", "Nothing was measured."))
        self._show_refusal(reason)
        self.snapshot = None
        self._show_buttons()
        self.leaving.setFocus()

    def _show_refusal(self, reason: str) -> None:
        self.refusal.setText(pretty_text(reason))
        self.refusal.setVisible(bool(reason))

    def _show_busy(self) -> None:
        """Show that something is being computed or played, if it takes noticeable time."""
        measurement, snapshot = self.measurement, self.snapshot
        busy_s = 0.0 if measurement is None else measurement.busy_s
        if busy_s < BUSY_S:
            self.busy.hide()
            self.busy_words.setText("")
            return
        sound = None if snapshot is None or snapshot.is_waiting else snapshot.page.sound
        if sound is not None and snapshot is not None:
            length_s = len(sound.signal) / sound.rate_hz
            self.busy.setRange(0, 1000)
            self.busy.setValue(round(1000 * min(busy_s / length_s, 1.0)))
            does = "Playing" if plays_sound(snapshot.page) else "Listening"
            self.busy_words.setText(f"{does}  {min(busy_s, length_s):.0f} of {length_s:.0f} s")
        else:
            self.busy.setRange(0, 0)
            self.busy_words.setText(f"Computing…  {busy_s:.0f} s")
        self.busy.show()

    # --- actions of the user ---

    def go_on(self) -> None:
        """Do what Continue means on the page."""
        complaint = self.page.take_input_error()
        if complaint:
            self._show_refusal(complaint)
        elif self.going.isEnabled() and self.going.isVisibleTo(self) and self.measurement is not None:
            self.setFocus()  # otherwise the focus would leave the page with the button
            self.going.setEnabled(False)
            self.measurement.proceed(self.page.values())

    @property
    def would_lose(self) -> bool:
        """Whether leaving would lose much manual work."""
        measurement, snapshot = self.measurement, self.snapshot
        is_much = snapshot is not None and snapshot.page.share > WORTH and not self._is_saved
        return measurement is not None and measurement.by_hand and is_much

    def cancel(self) -> None:
        """Leave without changes; ask first if much has been done."""
        self.ask_to_leave(self.closed.emit)

    def ask_to_leave(self, then: Callable[[], object]) -> None:
        """Call `then` at once if nothing is lost by leaving, else when the person agrees to lose it."""
        if not self.would_lose:
            then()
            return
        text = "Leave now? What was measured is lost; the profile stays as it is."
        if self._result() is not None:
            text += " To keep the raw data, stay, and click Report…"
        ask(self, "Leave the calibration", text, "Leave", then, "Stay")

    def _run_automatically(self) -> None:
        complaint = self.page.take_input_error()
        if complaint:
            self._show_refusal(complaint)
        elif self.measurement is not None and self.snapshot is not None:
            self.measurement.run_automatically(not self.snapshot.is_automatic, self.page.values())

    def _back(self) -> None:
        if self.measurement is not None:
            self.measurement.back()

    def _skip(self) -> None:
        if self.measurement is not None:
            self.measurement.skip()

    def _save(self) -> None:
        result = self._result()
        if result is not None:
            self.setFocus()
            self.saving.setEnabled(False)
            self._show_refusal("")
            self.save_requested.emit(result)

    def _report(self) -> None:
        result = self._result()
        if result is not None:
            self.report_requested.emit(result)

    def _result(self) -> Result | None:
        return None if self.snapshot is None else self.snapshot.result or self.snapshot.inconclusive

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Return continues, or activates the button with the focus."""
        focus = self.window().focusWidget()
        if event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and not event.isAutoRepeat():
            if isinstance(focus, QAbstractButton) and self.isAncestorOf(focus):
                focus.click()
            else:
                self.go_on()
        else:
            super().keyPressEvent(event)

    def _has_focus(self) -> bool:
        focus = self.window().focusWidget()
        return focus is None or focus is self or self.isAncestorOf(focus) or not focus.isEnabled()

    def _order_stops(self) -> None:
        """Set the tab order: page, drawings, buttons."""
        buttons = self._buttons.findChildren(QPushButton)
        drawings = [self.drawings] if self.drawings.focusPolicy() != Qt.FocusPolicy.NoFocus else []
        set_tab_order([*self.page.tab_stops(), *drawings, *buttons])

    def _focus_page(self) -> None:
        snapshot = self.snapshot
        if snapshot is None or snapshot.is_automatic:
            self.running.setFocus()
        elif snapshot.page.last:
            self.saving.setFocus()
        elif not self.page.focus_first():
            (self.going if self.going.isEnabled() else self.leaving).setFocus()

    # --- layout ---

    def _show_buttons(self) -> None:
        snapshot, measurement = self.snapshot, self.measurement
        has_page = snapshot is not None
        page = Page("", "", "") if snapshot is None else snapshot.page
        is_last = has_page and page.last
        is_automatic = snapshot is not None and snapshot.is_automatic
        is_waiting = snapshot is not None and snapshot.is_waiting
        by_hand = measurement is not None and measurement.by_hand
        self.leaving.setVisible(not is_last)
        self.closing.setVisible(is_last)
        self.projecting.setVisible(bool(page.places_m) and not is_last)
        self.running.setVisible(has_page and not by_hand and not is_last)
        self.running.setText("Pause" if is_automatic else "Run automatically")
        self.running.setIcon(theme.icon("pause" if is_automatic else "fast-forward"))
        self.backing.setVisible(has_page)
        self.backing.setEnabled(not is_automatic and page.share > 0.0 and not self._is_saved)
        self.skipping.setVisible(has_page and page.may_skip)
        self.skipping.setEnabled(not is_automatic)
        self.going.setVisible(not is_last)
        self.going.setEnabled(has_page and not is_automatic and is_waiting)
        self.going.setText(continue_text(page, by_hand, is_waiting))
        self.saving.setVisible(is_last)
        self.reporting.setVisible(is_last or (snapshot is not None and snapshot.inconclusive is not None))
        self.saving.setEnabled(is_last and not self._is_saved)
        self.saving.setText("Saved" if self._is_saved else "Save to the profile")

    def _build(self) -> None:
        self._heading = theme.label("", "muted")
        self._share = theme.label("", "small")
        self._progress = progress_bar("How much of the whole is done")
        self.refusal = theme.label("", "alarm")
        theme.wrap(self.refusal)
        self.refusal.setContentsMargins(3 * theme.GRID, theme.GRID, 2 * theme.GRID, theme.GRID)
        self.busy = progress_bar("Computing or playing")
        keep = self.busy.sizePolicy()
        keep.setRetainSizeWhenHidden(True)
        self.busy.setSizePolicy(keep)
        self.busy_words = theme.label(" ", "small")
        body, closed = QWidget(), QWidget()
        # From the outside in: a widget that gets another parent has the style of all within it looked up again.
        self._scrolled = scroll_in(self, body)
        across = QHBoxLayout(body)
        across.setContentsMargins(0, 0, 0, 0)
        across.setSpacing(0)
        across.addWidget(closed, 1)
        head = QHBoxLayout()
        head.addWidget(self._heading, 1)
        head.addWidget(self._share)
        column = QVBoxLayout(closed)
        column.setContentsMargins(3 * theme.GRID, 2 * theme.GRID, 2 * theme.GRID, 0)
        column.setSpacing(theme.GRID)
        column.addLayout(head)
        column.addWidget(self._progress)
        column.addSpacing(theme.GRID)
        self._body = QStackedWidget(closed)
        self.page, self.result = PageView(self._body), ResultView(self._body)
        for view in (self.page, self.result):
            self._body.addWidget(view)
        column.addWidget(self._body, 1)
        column.addWidget(self.busy)
        column.addWidget(self.busy_words)
        self.drawings = DrawingColumn()
        across.addWidget(self.drawings, 1)
        self._buttons = self._button_line()
        around = self.layout()
        assert around is not None
        for part in (self.refusal, self._buttons):  # last, as the tab key reaches them
            around.addWidget(part)

    def _button_line(self) -> QWidget:
        self.leaving = _button("Cancel", "Leave; the profile stays as it is", self.cancel)
        self.closing = _button("Close", "Back to the choice of tile and calibration", self.cancel)
        tip = "Fill a screen with the tile at its true size, for a projector"
        self.projecting = _button("Show on the floor…", tip, self.projection_requested.emit)
        self.running = _button(
            "Run automatically", "Let the simulator press, page after page; or pause", self._run_automatically
        )
        self.backing = _button(
            "Back",
            with_native_keys(
                "The previous page, or place; what was measured since is discarded, other places stay (Alt+Left)"
            ),
            self._back,
        )
        self.backing.setShortcut("Alt+Left")
        self.skipping = _button("Skip", "Leave out this sensor, place or load, and what was measured of it", self._skip)
        self.going = _button("Continue", "Go on (Return)", self.go_on)
        self.going.setProperty("role", "primary")
        self.reporting = _button("Report…", "Write a page with pictures, figures and raw data", self._report)
        self.saving = _button("Save to the profile", "Use this result from now on; the earlier one is kept", self._save)
        self.saving.setProperty("role", "primary")
        line = QWidget()
        theme.fill(line, "panel")
        line.setFixedHeight(6 * theme.GRID)
        layout = QHBoxLayout(line)
        layout.setContentsMargins(3 * theme.GRID, 0, 2 * theme.GRID, 0)
        layout.setSpacing(theme.GRID)
        for button in (self.leaving, self.closing, self.projecting):
            layout.addWidget(button)
        layout.addStretch(1)
        for button in (self.running, self.backing, self.skipping, self.reporting, self.going, self.saving):
            layout.addWidget(button)
        for button in (self.going, self.saving):
            button.setMinimumWidth(12 * theme.GRID)
        return line


def continue_text(page: Page, by_hand: bool, is_waiting: bool) -> str:
    """Return the label of Continue: what it will begin, or what is going on."""
    press = page.press
    if page.questions or (press is None and page.sound is None):
        return "Continue"
    if press is None:
        words = ("Play", "Playing…") if plays_sound(page) else ("Listen", "Listening…")
    elif press.position is not None:
        words = "Move", "Moving…"
    elif press.force_n <= 0.0:
        words = "Read", "Reading…"
    elif press.footstep:
        words = "Step", "Waiting for a footstep" if by_hand else "Stepping…"
    else:
        words = "Press", "Waiting for the press" if by_hand else "Pressing…"
    return words[0] if is_waiting else words[1]


def _button(text: str, tip: str, do: Callable[[], None]) -> QPushButton:
    button = QPushButton(text)
    button.setToolTip(tip)
    button.setAccessibleDescription(tip)
    button.clicked.connect(lambda _=False: do())
    return button
