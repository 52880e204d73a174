"""The page of stages in the protocol editor, with the parameters that their methods declare."""

import copy
from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import Any

import msgspec
from PySide6.QtCore import Qt, Signal
from PySide6.QtWidgets import QCheckBox, QLineEdit, QVBoxLayout, QWidget

from underfoot.errors import UnderfootError
from underfoot.experiments.declared import NamedChoice, fields_of
from underfoot.experiments.draft import Draft
from underfoot.experiments.foot import FootAnswer, fields_in_words
from underfoot.experiments.method import StimulusName
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import END, FIELDS_OF_KIND, Stage
from underfoot.experiments.questions import asked
from underfoot.experiments.stimuli import Stimulus
from underfoot.parameters import Choice, Parameter, ask
from underfoot.widgets import theme
from underfoot.widgets.experiment.field_rows import FieldRows
from underfoot.widgets.experiment.item_list import ItemList
from underfoot.widgets.experiment.question_table import QuestionTable

_NAMES = {method.name: kind for kind, method in METHODS.items()}
_DEFAULT_KIND = "rating"
_FIRST = ("id", "kind", "title", "text")
_SPECIAL = ("questions", "method", "foot", "stimulus")
"""Fields of a stage that hold others, or name others of the protocol."""


class StagePage(ItemList):
    """Edits `raw["stages"]` of a draft."""

    def __init__(self, draft: Draft) -> None:
        super().__init__("stage", "Stages", self._add, self._copy, self._remove, self._move)
        self.draft = draft
        self.form: StageForm | None = None
        self.show_names(0)

    @property
    def _stages(self) -> list[dict[str, Any]]:
        found: list[dict[str, Any]] = self.draft.raw["stages"]
        return found

    def names(self) -> list[str]:
        return [_words(stage) for stage in self._stages]

    def _show_form(self, index: int) -> None:
        if not 0 <= index < len(self._stages):
            self.form = None
            self.show_detail(theme.label("No stage yet: Add makes one."))
            return
        others = [str(stage["id"]) for stage in self._stages if stage is not self._stages[index]]
        self.form = form = StageForm(self._stages[index], self.draft.raw["stimuli"], others)
        form.changed.connect(lambda: self._update_name(index))
        form.renamed.connect(self._follow)
        form.rebuilt.connect(lambda: self.rebuild_detail(lambda: self._show_form(index)))
        self.show_detail(form)

    def _update_name(self, index: int) -> None:
        self.rename(index, _words(self._stages[index]))
        self.changed.emit()

    def _follow(self, old: str, new: str) -> None:
        """Update references to a stage after a change of its id."""
        for stage in self._stages:
            if stage.get("next") == old:
                stage["next"] = new
        raw = self.draft.raw
        if isinstance(raw.get("counterbalanced"), list):  # else what is typed there is no list yet
            raw["counterbalanced"] = [new if id == old else id for id in raw["counterbalanced"]]

    def _add(self) -> None:
        self._insert(self.list.currentRow() + 1, {"id": "", "kind": "read", "title": "", "text": ""})

    def _copy(self, index: int) -> None:
        self._insert(index + 1, {**copy.deepcopy(self._stages[index]), "next": ""})

    def _insert(self, index: int, stage: dict[str, Any]) -> None:
        taken = {stage.get("id") for stage in self._stages}
        stem = stage["id"] or "stage"
        stage["id"] = next(f"{stem}-{k}" for k in range(1, 10_000) if f"{stem}-{k}" not in taken)
        self._stages.insert(index, stage)
        self._show_edited(index)

    def _remove(self, index: int) -> None:
        del self._stages[index]
        self._show_edited(index)

    def _move(self, index: int, by: int) -> None:
        stages = self._stages
        stages[index], stages[index + by] = stages[index + by], stages[index]
        self._show_edited(index + by)


class StageForm(QWidget):
    """The form of one stage: the fields of its kind and the parameters of its method."""

    changed = Signal()
    rebuilt = Signal()
    renamed = Signal(str, str)
    """Carries the old and the new id."""

    def __init__(self, stage: dict[str, Any], stimuli: Mapping[str, Any], others: Sequence[str]) -> None:
        """Build the form; `others` are the ids of the other stages."""
        super().__init__()
        self._stage, self._stimuli, self._others = stage, stimuli, others
        self._id = str(stage.get("id", ""))
        self._column = QVBoxLayout(self)
        self._column.setContentsMargins(0, 0, theme.GRID, 0)
        self._column.setSpacing(theme.GRID)
        wanted = FIELDS_OF_KIND.get(str(stage.get("kind")), ())
        declared = fields_of(Stage, ["id", "kind", *(name for name in wanted if name not in _SPECIAL)])
        parameters: dict[str, Parameter] = {}
        for name in ("id", "kind", *wanted):
            if name == "stimulus":
                parameters[name] = ask(name, StimulusName("", doc="Its level is set to where it is just felt."))
            elif name in declared:
                parameters[name] = declared[name]
        first = {name: parameters.pop(name) for name in _FIRST if name in parameters}
        self.rows = self._rows(first, stage)
        self.method: FieldRows | None = None
        self.parameters: FieldRows | None = None
        self.foot: QCheckBox | None = None
        self.foot_rows: FieldRows | None = None
        self.questions: QuestionTable | None = None
        if "questions" in wanted:
            self._show_questions()
        if "method" in wanted:
            self._show_method()
            self._column.addWidget(theme.label("TRIALS", "heading"))
        self.further = self._rows(parameters, stage)
        if "foot" in wanted:
            self._show_foot()
        self._column.addWidget(theme.label("ORDER", "heading"))
        self.order = self._rows({"next": self._next_stage_field()}, stage)
        self._column.addStretch(1)

    def _rows(self, parameters: dict[str, Parameter], values: dict[str, Any]) -> FieldRows:
        rows = FieldRows(parameters, values, list(self._stimuli))
        rows.changed.connect(self._set)
        self._column.addWidget(rows)
        return rows

    def _next_stage_field(self) -> NamedChoice:
        """Return the choice of stages that can follow this one."""
        following = {"the next in the list": "", "the end of the study": END, **{id: id for id in self._others}}
        declared = fields_of(Stage, ["next"])["next"]
        choice = NamedChoice("", values=following, doc=declared.doc, label=declared.label)
        ask("next", choice)
        return choice

    def _set(self, name: str) -> None:
        """Tell an edit once all that follows from it is done: it is one step of undo."""
        if name == "id" and (new := str(self._stage["id"])) not in {"", END, *self._others}:
            self.renamed.emit(self._id, new)
            self._id = new
        if name == "kind":
            kind = self._stage["kind"]
            for field in set(Stage.__struct_fields__) - {"id", "kind", "next", *FIELDS_OF_KIND[kind]}:
                self._stage.pop(field, None)
            if kind == "trials":
                self._stage["method"] = {"kind": _DEFAULT_KIND, "parameters": {}}
        self.changed.emit()
        if name == "kind":
            self.rebuilt.emit()

    def _show_questions(self) -> None:
        self._stage["questions"] = [dict(one) for one in self._stage.get("questions") or ()]
        self.questions = QuestionTable(self._stage["questions"])
        self.questions.changed.connect(self.changed)
        self._column.addWidget(self.questions)

    def _show_method(self) -> None:
        use = self._stage["method"] = dict(self._stage.get("method") or {"kind": _DEFAULT_KIND, "parameters": {}})
        use["parameters"] = dict(use.get("parameters") or {})
        kind = use["kind"]
        self._column.addWidget(theme.label("METHOD", "heading"))
        names = {"method": METHODS[kind].name if kind in METHODS else kind}
        choice = ask("method", Choice(next(iter(_NAMES)), options=tuple(_NAMES), doc=""))
        self.method = FieldRows({"method": choice}, names)
        self.method.changed.connect(lambda _: self._choose_method(_NAMES[names["method"]]))
        self._column.addWidget(self.method)
        if kind in METHODS:
            about = theme.paragraph(METHODS[kind].about, "small")
            self._column.addWidget(about)
            self.parameters = self._rows(METHODS[kind].parameters, use["parameters"])
            self.parameters.changed.connect(lambda _: self._show_question())
            self._show_question()

    def _choose_method(self, kind: str) -> None:
        """Change the method; parameters of both are kept: those of one name and one default, as not the blocks are."""
        old, new = (METHODS[of].parameters if of in METHODS else {} for of in (self._stage["method"]["kind"], kind))
        both = {name for name in old.keys() & new.keys() if old[name].default == new[name].default}
        stays = {name: value for name, value in self._stage["method"]["parameters"].items() if name in both}
        self._stage["method"] = {"kind": kind, "parameters": stays}
        self.changed.emit()
        self.rebuilt.emit()

    def _show_foot(self) -> None:
        foot = self._stage.get("foot")
        self._column.addWidget(theme.label("ANSWER BY FOOT", "heading"))
        self.foot = QCheckBox("An answer can be given by stepping on the floor")
        self.foot.setAccessibleName(self.foot.text())
        self.foot.setChecked(foot is not None)
        self.foot.toggled.connect(self._switch_foot)
        self._column.addWidget(self.foot, 0, Qt.AlignmentFlag.AlignLeft)
        if foot is not None:
            self._stage["foot"] = foot = dict(foot)
            self.foot_rows = self._rows(fields_of(FootAnswer, FootAnswer.__struct_fields__), foot)
            self.fields = theme.paragraph("", "small")
            self._column.addWidget(self.fields)
            self.changed.connect(self._show_fields)
            self._show_fields()

    def _questions(self) -> tuple[Parameter, ...]:
        """Return what is asked after each trial; raise an error if the method has a mistake, which appears below."""
        method, given = METHODS[self._stage["method"]["kind"]], self._stage["method"]["parameters"]
        return method.questions_for(method.checked(given, msgspec.convert(self._stimuli, dict[str, Stimulus])))

    def _show_question(self) -> None:
        """Show what is asked where no words are typed for it."""
        line = self.parameters.controls.get("question") if self.parameters is not None else None
        with suppress(UnderfootError, msgspec.ValidationError):
            if isinstance(line, QLineEdit):
                line.setPlaceholderText(asked(self._questions()[0]))

    def _show_fields(self) -> None:
        """Show the answer of each field on the floor; nothing if the stage has a mistake."""
        text = ""
        with suppress(UnderfootError, KeyError, msgspec.ValidationError):
            text = fields_in_words(msgspec.convert(self._stage["foot"], FootAnswer), self._questions())
        self.fields.setText(text)

    def _switch_foot(self, on: bool) -> None:
        self._stage["foot"] = {} if on else None
        self.changed.emit()
        self.rebuilt.emit()


def _words(stage: dict[str, Any]) -> str:
    method = (stage.get("method") or {}).get("kind", "")
    what = METHODS[method].name if method in METHODS else stage.get("kind", "")
    return f"{stage.get('id', '')}  ·  {what}" + (f"  →  {stage['next']}" if stage.get("next") else "")
