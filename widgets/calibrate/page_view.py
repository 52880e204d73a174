"""A page of a procedure: instruction, fields, where to press, and progress."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSizePolicy, QVBoxLayout, QWidget

from underfoot.calibration.procedure import Page, PageProgress
from underfoot.calibration.results.labels import label_of
from underfoot.floor.layout import Tile
from underfoot.parameters import Numbers, Parameter
from underfoot.quantities import pretty_text, pretty_unit, quantity
from underfoot.widgets import theme
from underfoot.widgets.calibrate.quantity_views import QuantityRow
from underfoot.widgets.calibrate.tile_picture import TilePicture, press_text
from underfoot.widgets.controls.fields import Field, ParameterEditor
from underfoot.widgets.controls.panels import progress_bar
from underfoot.widgets.controls.parameter_editor import editor_for
from underfoot.widgets.controls.scrolled import Scrolled
from underfoot.widgets.controls.tab_order import tab_stops

FORM_PX = 52 * theme.GRID
LOADS = {"none": "nothing on the tile", "standing": "a person on the tile", "corner": "a foot on a corner"}
"""Descriptions of the loads of a sound."""


class PageView(QWidget):
    """Shows a page and its live reading; `values` are the user's input."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._page = Page("", "", "")
        self._entered: dict[str, dict[str, Any]] = {}
        self._calibration = ""
        self._set_up: dict[str, dict[str, tuple[Parameter, Any]]] = {}
        self._input_error = ""
        self.editors: list[ParameterEditor] = []
        self.title = theme.label("", "title")
        self.instruction = theme.label("")
        self.place_text = theme.label("", "force")
        self.hint = theme.label("", "muted")
        theme.wrap(self.title, self.instruction, self.place_text, self.hint)
        form = QWidget()
        self._fields = QVBoxLayout(form)
        self._fields.setContentsMargins(0, 0, 0, 0)
        self._fields.setSpacing(2 * theme.GRID)
        self._form = Scrolled(form)
        self._form.setMaximumWidth(FORM_PX)
        self.picture = TilePicture()
        self.bar = progress_bar("How much of this page's measurement is there")
        self.bar.setStyleSheet(f"QProgressBar::chunk {{ background: {theme.FORCE}; border-radius: 2px; }}")
        self.quantities = QuantityRow()
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(theme.GRID)
        for widget in (self.title, self.instruction, self._form):
            layout.addWidget(widget)
        layout.addSpacing(theme.GRID)
        layout.addWidget(self.place_text)
        layout.addWidget(self.picture, 1)
        layout.addWidget(self.bar)
        layout.addWidget(self.hint)
        layout.addWidget(self.quantities)
        self._spacer = QWidget()
        layout.addWidget(self._spacer)
        layout.setStretchFactor(self._spacer, 0)

    def set_tile(self, tile: Tile, calibration: str) -> None:
        """Set the tile of the pictures, and clear the input for another one.

        What was entered on the first page stays for the next tile of the same `calibration`: its weights, or the full
        scale of its accelerometer. An empty name keeps nothing.
        """
        self.picture.set_tile(tile)
        self._page = Page("", "", "")
        self._entered.clear()
        self._calibration = calibration

    def show_page(self, page: Page) -> None:
        """Show a page; if it is shown already, it keeps the input."""
        if _visible_content(page) == _visible_content(self._page):
            return
        if (page.key, page.questions) != (self._page.key, self._page.questions):
            self._make_fields(page)
        self._page, self._input_error = page, ""
        self.title.setText(page.title)
        self.instruction.setText(pretty_text(page.instruction))
        is_where = not page.questions or page.press is not None
        self.picture.show_load(page.key.removesuffix("-place") if page.sound is None else page.sound.load)
        self.picture.show_press(page.press, page.places_m)
        self.place_text.setText(_place_text(page))
        self.place_text.setVisible(bool(self.place_text.text()))
        for widget in (self.bar, self.quantities):
            widget.setVisible(page.wants_press)
        self.picture.setVisible(is_where)
        self._spacer.setSizePolicy(
            QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Maximum if is_where else QSizePolicy.Policy.Expanding
        )

    def show_live(self, live: PageProgress) -> None:
        """Show the progress of the page's measurement."""
        self.bar.setValue(round(1000 * min(max(live.ready, 0.0), 1.0)))
        self.picture.show_ready(live.ready)
        self.hint.setText(pretty_text(live.hint))
        self.quantities.show_quantities(live.quantities)

    def values(self) -> Mapping[str, Any]:
        """Return the input on the page, by name."""
        return {editor.parameter.name: editor.value() for editor in self.editors}

    def take_input_error(self) -> str:
        """Return why the last input is invalid, and forget it; "" if it is valid. The field has restored its value."""
        for editor in self.editors:
            for field in editor.findChildren(Field):
                field.commit()  # even if it still has the focus
        error, self._input_error = self._input_error, ""
        return error

    def tab_stops(self) -> list[QWidget]:
        """Return the controls that Tab reaches."""
        return tab_stops(self.editors)

    def focus_first(self) -> bool:
        """Give the first field the focus; return False if there is none."""
        stops = self.tab_stops()
        if stops:
            stops[0].setFocus(Qt.FocusReason.TabFocusReason)
        return bool(stops)

    def _store_input_error(self, editor: ParameterEditor, field: Field, text: str) -> None:
        """Keep a field's error message, which the field clears when it loses the focus."""
        is_bad = field.property("role") == "bad"
        name = editor.label.text()
        allowed = str(field.property("reason")).rpartition("; ")[2]
        self._input_error = f"{name}: {text} is not taken; {allowed}" if is_bad else ""

    def _make_fields(self, page: Page) -> None:
        if self._page.questions:
            self._keep_input()
        for editor in self.editors:
            self._fields.removeWidget(editor)
            editor.hide()
            editor.deleteLater()
        self.editors = [_labelled(editor_for(parameter)) for parameter in page.questions]
        self._form.setVisible(bool(self.editors))
        before = self._entered.get(page.key) or self._set_up_before(page)
        for editor in self.editors:
            if editor.parameter.name in before:
                editor.set_value(before[editor.parameter.name])
            self._fields.addWidget(editor)
            editor.show()  # at once, since the focus goes there next
            for field in editor.findChildren(Field):
                field.committed.connect(partial(self._store_input_error, editor, field))

    def _keep_input(self) -> None:
        page, values = self._page, dict(self.values())
        self._entered[page.key] = values
        if page.share == 0.0 and self._calibration:
            self._set_up[self._calibration] = {ask.name: (ask, values[ask.name]) for ask in page.questions}

    def _set_up_before(self, page: Page) -> dict[str, Any]:
        """Return what was entered on a first page, unless this tile is asked for something else.

        That is another default, as of its accelerometer, or another range, as of places on a tile of another size.
        """
        before = self._set_up.get(self._calibration, {}) if page.share == 0.0 else {}
        asked = {ask.name: ask for ask in page.questions}
        return {name: value for name, (ask, value) in before.items() if asked.get(name) == ask}


def plays_sound(page: Page) -> bool:
    """Return whether the page's sound is audible; silence is only recorded."""
    return page.sound is not None and bool(page.sound.signal.any())


def _place_text(page: Page) -> str:
    """Describe where to press, or how long the sound is and under which load."""
    if page.press is not None:
        return press_text(page.press)
    if page.sound is not None:
        seconds = len(page.sound.signal) / page.sound.rate_hz
        what, does = LOADS.get(page.sound.load), "Plays" if plays_sound(page) else "Listens"
        return f"{does} for {quantity(seconds, 's')}" + (f" with {what}" if what else "")
    return ""


def _labelled(editor: ParameterEditor) -> ParameterEditor:
    """Remove the unit from a label that is only the parameter's name, since the value has it; a list keeps it."""
    name, parameter = editor.parameter.name, editor.parameter
    if parameter.label == name.replace("_", " ").capitalize():
        unit = f", {pretty_unit(parameter.unit)}" if isinstance(parameter, Numbers) and parameter.unit else ""
        editor.label.setText(f"{label_of(name)}{unit}")
    return editor


def _visible_content(page: Page) -> tuple[object, ...]:
    """Return the visible content of a page."""
    return page.key, page.title, page.instruction, page.questions, page.press, page.places_m
