"""The page of stimuli in the protocol editor: patches, settings, and levels measured on the simulated plate."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import msgspec
from PySide6.QtCore import Signal
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QMessageBox,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.errors import UnderfootError
from underfoot.experiments.conditions import read_conditions
from underfoot.experiments.declared import fields_of
from underfoot.experiments.draft import Draft
from underfoot.experiments.stimuli import Stimulus, parameters_of, patch_path, usually_scaled
from underfoot.parameters import Number, Parameter
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.quantities import counted, quantity
from underfoot.studies.levels import measured_peak_m_s2
from underfoot.widgets import theme
from underfoot.widgets.background import BackgroundWorker
from underfoot.widgets.controls.choice_box import ChoiceBox, name_control
from underfoot.widgets.controls.file_dialog import ask_file
from underfoot.widgets.controls.question import message_box
from underfoot.widgets.controls.undo_actions import DocumentLine
from underfoot.widgets.experiment.field_rows import CONTROL_PX, LABEL_PX, LEAST_CONTROL_PX, FieldRows
from underfoot.widgets.experiment.item_list import ItemList

LEVELS = ("level_m_s2", "measured_m_s2", "stiffness_n_mm", "correct")
NOTHING, FILE = "(no vibration)", "A file…"


AskToRun = Callable[[Path, Callable[[], object]], object]
"""Asks whether the nodes beside a patch file may run, then calls the function."""


def ask_nothing(path: Path, then: Callable[[], object]) -> None:
    """Call `then` without a question; nodes that are not allowed to run are refused when the file is read."""
    then()


class StimulusPage(ItemList):
    """Edits `raw["stimuli"]` of a draft; `own` is the folder of the user's presets."""

    notified = Signal(str)

    def __init__(self, draft: Draft, own: Path, ask: AskToRun) -> None:
        super().__init__("stimulus", "Stimuli", self._add_new, self._copy, self._remove, self._move)
        self.draft, self._own, self._ask_to_run = draft, own, ask
        self.background = BackgroundWorker(self)
        self.form: StimulusForm | None = None
        self.table = QPushButton("Table…")
        self.table.setToolTip("Stimuli from a table of conditions (CSV): one a line")
        self.table.clicked.connect(self._ask_table)
        self.buttons.addWidget(self.table, 1, 2)
        self.background.found.connect(self._show_measured)
        self.background.failed.connect(self._show_measuring_error)
        self.show_names(0)

    @property
    def _stimuli(self) -> dict[str, dict[str, Any]]:
        found: dict[str, dict[str, Any]] = self.draft.raw["stimuli"]
        return found

    def _name(self, index: int) -> str:
        return list(self._stimuli)[index]

    def names(self) -> list[str]:
        return list(self._stimuli)

    def _show_form(self, index: int) -> None:
        if not 0 <= index < len(self._stimuli):
            self.form = None
            self.show_detail(theme.label("No stimulus yet: Add makes one."))
            return
        name = self._name(index)
        self.form = form = StimulusForm(name, self._stimuli[name], self.draft, self._own)
        form.changed.connect(self.changed)
        form.renamed.connect(lambda new: self._rename(index, new))
        form.rebuilt.connect(lambda: self.rebuild_detail(lambda: self._show_form(index)))
        form.notified.connect(self.notified)
        form.patch_requested.connect(lambda path: self._ask_to_run(path, lambda: form.set_patch_file(path)))
        form.measure.clicked.connect(lambda: self._measure(name))
        self.show_detail(form)
        self._show_measuring()

    def _add_new(self) -> None:
        self._add({"patch": "", "settings": {}, "factors": {}})

    def _copy(self, index: int) -> None:
        self._add(dict(self._stimuli[self._name(index)]))

    def _add(self, stimulus: dict[str, Any]) -> None:
        names = [chr(ord("A") + k) for k in range(26)] + [f"S{k}" for k in range(1, 1000)]
        self._stimuli[next(name for name in names if name not in self._stimuli)] = stimulus
        self._show_edited(len(self._stimuli) - 1)

    # --- a table of conditions ---

    def _ask_table(self) -> None:
        ask_file(self.window(), "A table of conditions", "Tables (*.csv *.tsv *.txt)", self.import_table)

    def import_table(self, path: Path) -> None:
        """Replace all stimuli by the rows of a table, after a question; show errors."""
        try:
            conditions = read_conditions(path, self.draft)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        count = counted(len(conditions), "line")
        box = message_box(
            self.window(),
            "Stimuli from a table",
            f"Present the {count} of {path.name} in the place of {', '.join(self._stimuli) or 'no stimuli'}? "
            "What a stage names alone stays.",
        )
        take = box.addButton("Present them", QMessageBox.ButtonRole.AcceptRole)
        box.addButton(QMessageBox.StandardButton.Cancel)
        take.clicked.connect(lambda: self._import_conditions(conditions))
        box.open()

    def _import_conditions(self, conditions: Mapping[str, Any]) -> None:
        self.draft.take_conditions(conditions)
        self._show_edited(0)

    def _remove(self, index: int) -> None:
        del self._stimuli[self._name(index)]
        self._show_edited(index)

    def _move(self, index: int, by: int) -> None:
        items = list(self._stimuli.items())
        items[index], items[index + by] = items[index + by], items[index]
        self.draft.raw["stimuli"] = dict(items)
        self._show_edited(index + by)

    def _rename(self, index: int, new: str) -> None:
        old = self._name(index)
        if new != old and new not in self._stimuli:
            self.draft.rename_stimulus(old, new)
            self.rename(index, new)
        self.changed.emit()

    # --- the level ---

    def _measure(self, name: str) -> None:
        """Measure the level in a thread; a second press stops the measurement."""
        if self.background.is_busy:
            self.background.stop()
            return
        stimulus = self._stimuli[name]
        try:
            played = _played(stimulus)
            patch = played.at(0.0, self.draft.folder)
        except (UnderfootError, msgspec.ValidationError) as error:
            self.notified.emit(str(error))
            return
        self.background.compute(lambda task: [(stimulus, played, measured_peak_m_s2(patch, task.is_stopped))])
        self._show_measuring()

    def _show_measured(self, found: list[tuple[dict[str, Any], Stimulus, float]]) -> None:
        """Take the level of a stimulus, which may have another name now, if it is still as it was measured."""
        ((stimulus, played, peak_m_s2),) = found
        name = next((name for name, one in self._stimuli.items() if one is stimulus), "")
        if not name or _played(stimulus) != played:
            self.notified.emit("The level is not taken: its stimulus was changed while it was measured. Measure again.")
        else:
            peak = float(f"{peak_m_s2:.4g}")
            stimulus["measured_m_s2"] = peak
            if not stimulus.get("scaled_by") or not stimulus.get("level_m_s2"):
                stimulus["level_m_s2"] = peak
            self._show_form(self.list.currentRow())
            self.notified.emit(f"{name}: {quantity(peak, 'm/s^2')} under the simulated footstep")
            self.changed.emit()
        self._show_measuring()

    def _show_measuring_error(self, why: str) -> None:
        self._show_measuring()
        self.notified.emit(why)

    def _show_measuring(self) -> None:
        if self.form is not None:
            self.form.measure.setText("Measuring… Stop" if self.background.is_busy else "Measure the level")


class StimulusForm(QWidget):
    """The form of one stimulus: name, patch, settings of the patch, level, factors."""

    changed = Signal()
    renamed = Signal(str)
    rebuilt = Signal()
    """The available settings have changed, so the form must be rebuilt."""
    notified = Signal(str)
    patch_requested = Signal(object)
    """The `Path` of a patch was chosen."""

    def __init__(self, name: str, stimulus: dict[str, Any], draft: Draft, own: Path) -> None:
        super().__init__()
        self._stimulus, self._draft = stimulus, draft
        for field in ("settings", "factors"):
            stimulus[field] = dict(stimulus.get(field) or {})
        self.name = DocumentLine(name)
        self.name.textEdited.connect(self.renamed)
        self.patch = ChoiceBox()
        for text, value in _patches(own).items():
            self.patch.addItem(text, value)
        if self.patch.findData(stimulus.get("patch", "")) < 0:
            self.patch.insertItem(1, stimulus["patch"], stimulus["patch"])
        self.patch.setCurrentIndex(self.patch.findData(stimulus.get("patch", "")))
        self.patch.activated.connect(self._choose_patch)
        self.measure = QPushButton("Measure the level")
        self.measure.setToolTip("The peak under a simulated footstep on the simulated plate, by the rule of table 6.1")
        self._parameters = self._patch_parameters()
        self.settings = QWidget()
        self.levels = FieldRows(fields_of(Stimulus, LEVELS if stimulus.get("patch") else LEVELS[2:]), stimulus)
        self.levels.changed.connect(self.changed)
        self.factors = DocumentLine("; ".join(f"{key}: {value}" for key, value in stimulus["factors"].items()))
        self.factors.setPlaceholderText("what the analysis compares, such as waveform: C; amplitude: 0.5")
        self.factors.textEdited.connect(self._set_factors)
        self._lay_out()

    def _lay_out(self) -> None:
        column = QVBoxLayout(self)
        column.setContentsMargins(0, 0, theme.GRID, 0)
        column.addLayout(_row("Name", self.name))
        column.addLayout(_row("Patch", self.patch))
        if self._stimulus.get("patch"):
            set_now = {name: p for name, p in self._parameters.items() if name in self._stimulus["settings"]}
            self.rows = FieldRows(set_now, self._stimulus["settings"])
            self.rows.changed.connect(self.changed)
            column.addLayout(_row("Settings", self._setting_chooser(), self._patch_chooser()))
            column.addWidget(self.rows)
            column.addLayout(_row("Scaled by", self._scale_chooser()))
        column.addWidget(self.levels)
        if self._stimulus.get("patch"):
            column.addLayout(_row("", self.measure))
        column.addLayout(_row("Factors", self.factors, wide=True))
        column.addStretch(1)

    def _patch_parameters(self) -> dict[str, Parameter]:
        """Return the parameters of the patch by "node.parameter"."""
        name = self._stimulus.get("patch", "")
        if not name:
            return {}
        try:
            return parameters_of(name, self._draft.folder)
        except UnderfootError:
            return {}

    def _setting_chooser(self) -> QComboBox:
        """Return a box to choose a parameter of the patch to set."""
        box = self.adding = ChoiceBox()
        box.setAccessibleName("Add a setting")
        box.addItem("Add…", "")
        for name in self._parameters:
            if name not in self._stimulus["settings"]:
                box.addItem(name, name)
        box.activated.connect(lambda at: self._add_setting(box.itemData(at)))
        return box

    def _patch_chooser(self) -> QComboBox:
        box = ChoiceBox()
        box.setAccessibleName("Remove a setting")
        box.addItem("Remove…", "")
        for name in self._stimulus["settings"]:
            box.addItem(name, name)
        box.setEnabled(bool(self._stimulus["settings"]))
        box.activated.connect(lambda at: self._remove_setting(box.itemData(at)))
        return box

    def _scale_chooser(self) -> QComboBox:
        box = self.scaling = ChoiceBox()
        box.setAccessibleName("Scaled by")
        box.setToolTip("The number of the patch to which its acceleration is proportional: the level is set by it")
        box.addItem("(nothing: it plays as it is)", "")
        for name, parameter in self._parameters.items():
            if isinstance(parameter, Number):
                box.addItem(name, name)
        box.setCurrentIndex(max(box.findData(self._stimulus.get("scaled_by", "")), 0))
        box.activated.connect(lambda at: self._set("scaled_by", box.itemData(at)))
        return box

    def _set(self, field: str, value: object) -> None:
        self._stimulus[field] = value
        self.changed.emit()

    def _add_setting(self, name: str) -> None:
        if name:
            node, _, parameter = name.partition(".")
            patch = Patch.load(patch_path(self._stimulus["patch"], self._draft.folder))
            default = self._parameters[name].default
            self._stimulus["settings"][name] = patch.node(node).parameters.get(parameter, default)
            self._rebuild()

    def _remove_setting(self, name: str) -> None:
        if self._stimulus["settings"].pop(name, None) is not None:
            self._rebuild()

    def _set_factors(self, text: str) -> None:
        pairs = (part.partition(":") for part in text.split(";") if part.strip())
        self._set("factors", {key.strip(): _parsed_value(value.strip()) for key, _, value in pairs})

    def _choose_patch(self, at: int) -> None:
        chosen = self.patch.itemData(at)
        if chosen == FILE:
            dialog = ask_file(self.window(), "A patch", "Patches (*.json)", self.patch_requested.emit)
            dialog.rejected.connect(lambda: self.patch.setCurrentIndex(self.patch.findData(self._stimulus["patch"])))
        elif isinstance(chosen, Path):
            self.patch_requested.emit(chosen)
        else:
            self._present(chosen)

    def set_patch_file(self, path: Path) -> None:
        """Use the patch in a file, which is copied to the protocol's folder."""
        try:
            Patch.load(path)
            self._present(self._draft.take_patch(path))
        except UnderfootError as error:
            self.patch.setCurrentIndex(self.patch.findData(self._stimulus["patch"]))
            self.notified.emit(str(error))

    def _present(self, name: str) -> None:
        self._stimulus |= {"patch": name, "settings": {}, "scaled_by": "", "level_m_s2": 0.0, "measured_m_s2": 0.0}
        self._stimulus["scaled_by"] = usually_scaled(self._patch_parameters())
        self._rebuild()

    def _rebuild(self) -> None:
        self.changed.emit()
        self.rebuilt.emit()


def _played(stimulus: Mapping[str, Any]) -> Stimulus:
    """Return a stimulus with its patch and settings alone, as it is measured."""
    return msgspec.convert({"patch": stimulus["patch"], "settings": stimulus.get("settings", {})}, Stimulus)


def _patches(own: Path) -> Mapping[str, Any]:
    """Return the available patches by display name: presets by name, the user's own by file."""
    found: dict[str, Any] = {NOTHING: ""}
    for preset in preset_files.all_presets(own):
        text = f"{preset.family}: {preset.name}" if preset.family else preset.title
        found[text] = preset.path if preset.is_user_preset else preset.path.stem
    return {**found, FILE: FILE}


def _parsed_value(text: str) -> int | float | str:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _row(text: str, *controls: QWidget, wide: bool = False) -> QHBoxLayout:
    row = QHBoxLayout()
    label = theme.label(text, "muted")
    label.setFixedWidth(LABEL_PX + theme.GRID)
    row.setSpacing(0)
    row.addWidget(label)
    for control in controls:
        if not wide:
            control.setMinimumWidth(LEAST_CONTROL_PX // len(controls))
            control.setMaximumWidth(CONTROL_PX // len(controls))
        if text:
            name_control(control, control.accessibleName() or text)
        row.addWidget(control, 100)
    if not wide:
        row.addStretch(1)
    return row
