"""The editor of a protocol: questions, stimuli, stages and sounds, checked during typing."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from PySide6.QtCore import QEvent, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QApplication,
    QButtonGroup,
    QHBoxLayout,
    QPushButton,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from underfoot.errors import UnderfootError
from underfoot.experiments.declared import NamedChoice, fields_of
from underfoot.experiments.draft import Draft, unused_path
from underfoot.experiments.draft_edits import DraftEdit
from underfoot.experiments.languages import names_of_languages
from underfoot.experiments.mistake_places import in_form
from underfoot.experiments.protocol import Protocol, Sounds
from underfoot.quantities import counted
from underfoot.widgets import theme
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.panels import one_of_several
from underfoot.widgets.controls.question import ask
from underfoot.widgets.controls.scrolled import Pages
from underfoot.widgets.controls.undo_actions import UndoActions
from underfoot.widgets.experiment.draft_copy import DraftCopy
from underfoot.widgets.experiment.draft_history import DraftHistory
from underfoot.widgets.experiment.field_rows import FieldRows
from underfoot.widgets.experiment.item_list import ItemList
from underfoot.widgets.experiment.overview import facts_of
from underfoot.widgets.experiment.question_table import QuestionTable
from underfoot.widgets.experiment.stage_page import StagePage
from underfoot.widgets.experiment.stimulus_page import AskToRun, StimulusPage, ask_nothing
from underfoot.widgets.experiment.studies import SessionFolder, StudyFile

PAGES = ("S&tudy", "&Questions", "St&imuli", "Sta&ges", "S&ounds")
_PAGE_OF_FIELD = {"participant": 1, "stimuli": 2, "stages": 3, "sounds": 4}
"""The page of a mistake, by the first word of its place."""
_FIELDS = ("title", "about", "language", "seed", "counterbalanced", "double_blind", "limit_m_s2", "present_s")
_CHECK_DELAY_MS = 150


class ProtocolEditor(QWidget):
    """Edits a new protocol, a copy of one, or one of the user's own."""

    opened = Signal()
    saved = Signal(object)
    """The file that was just saved."""
    closed = Signal(bool)
    """The editor was left; carries whether anything was saved since it was opened."""
    notified = Signal(str)

    def __init__(self, own: Path, own_patches: Path, sessions: SessionFolder) -> None:
        """Create the editor; `own` is the folder of the user's protocols, `own_patches` that of the user's presets."""
        super().__init__()
        self._own, self._own_patches, self._sessions = own, own_patches, sessions
        self.draft: Draft | None = None
        self.ask_to_run: AskToRun = ask_nothing
        self._path: Path | None = None
        self._saved_text, self._has_saved = "", False
        self.title = theme.label("", "title")
        self.save_button, self.close_button = QPushButton("Save"), QPushButton("Close")
        self.save_button.setProperty("role", "primary")
        self.save_button.setToolTip(with_native_keys("Save the protocol, and go on with it (Ctrl+S)"))
        self.close_button.setToolTip("Back to the studies; what was saved is chosen there (Esc)")
        self.problem, self.note = theme.paragraph("", "alarm"), theme.paragraph("", "muted")
        self.history = DraftHistory(self)
        self.copy = DraftCopy(own, self._unsaved, self.notified.emit, self)
        self.undo_actions = UndoActions(self.history.stack, self)
        self.pages = QStackedWidget()
        self.tabs = QButtonGroup(self)
        self.stimuli: StimulusPage
        self.stages: StagePage
        self.rows: dict[str, FieldRows] = {}
        self._check_timer = QTimer(self, singleShot=True, interval=_CHECK_DELAY_MS)
        self._check_timer.timeout.connect(self._check)
        self._lay_out()
        self.tabs.idClicked.connect(self.show_page)
        self.save_button.clicked.connect(self.save_protocol)
        self.close_button.clicked.connect(lambda: self.ask_to_leave())  # without whether it is checked
        self.history.restored.connect(self._restore)
        self.undo_actions.used.connect(self.notified)

    @property
    def is_changed(self) -> bool:
        """Whether there are unsaved changes."""
        return self.draft is not None and json.dumps(self.draft.raw) != self._saved_text

    def make_new(self) -> None:
        """Open the editor with a new protocol of two trials."""
        self._edit(Draft.new(self._own))

    def make_copy(self, study: StudyFile) -> None:
        """Open the editor with a copy of a study; show errors."""
        draft = Draft.of(study.protocol, self._own)
        draft.raw["title"] = f"{study.title}, my own"
        try:
            draft.take_patches(study.folder)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self._edit(draft)

    def edit_study(self, study: StudyFile) -> None:
        """Open the editor with a study, if it is the user's own."""
        if study.is_own:
            count = len(self._sessions.files(study))
            begun = f"{counted(count, 'session was', 'sessions were')} begun with it as it is"
            note = (
                f"{begun}: they stay, and go on as they were begun, but are analysed here only while it is unchanged."
            )
            self._edit(Draft.of(study.protocol, self._own), study.path, note if count else "")

    def restore_unsaved(self) -> None:
        """Open the editor with the draft that a window left unsaved when it was closed or crashed; show errors."""
        try:
            text = self.copy.found()
            if not text:
                return
            found = json.loads(text)
            draft = Draft(found["protocol"], self._own)
            path = Path(found["path"]) if found["path"] else None
            self._edit(draft, path, "Not saved when the window closed.")
            self.history.restore(found.get("history"))
        except (UnderfootError, ValueError, KeyError, TypeError, AttributeError):
            self.copy.put_aside()
            return
        self._saved_text = ""  # the draft is in no file of its own

    def _unsaved(self) -> str:
        """Return the text of an unsaved draft, from which `restore_unsaved` opens it; "" without one."""
        if self.draft is None or not self.is_changed:
            return ""
        return json.dumps({"path": str(self._path or ""), "protocol": self.draft.raw, "history": self.history.saved()})

    def _edit(self, draft: Draft, path: Path | None = None, note: str = "") -> None:
        """Show a draft of the protocol in the file `path`, or a new one; `note` is a remark for the user."""
        self.draft, self._path, self._has_saved = draft, path, False
        raw = draft.raw
        raw["participant"] = [dict(one) for one in raw.get("participant") or ()]
        raw["sounds"] = dict(raw.get("sounds") or {})
        self.title.setText("Edit a study" if path is not None else "A new study")
        self.note.setText(note)
        self.note.setVisible(bool(note))
        while (old := self.pages.widget(0)) is not None:
            self.pages.removeWidget(old)
            old.deleteLater()
        self.questions = QuestionTable(raw["participant"], rows_seen=8)
        self.stimuli, self.stages = StimulusPage(draft, self._own_patches, self.ask_to_run), StagePage(draft)
        self.stimuli.notified.connect(self.notified)
        self._study, self._sounds = Pages(), Pages()
        for page in (self._study, self.questions, self.stimuli, self.stages, self._sounds):
            self.pages.addWidget(page)
        for changed in (self.questions.changed, self.stimuli.changed, self.stages.changed):
            changed.connect(self._record)
        for chosen in (self.stimuli.chosen, self.stages.chosen):
            chosen.connect(lambda _: self.history.settle(draft.raw))
        self._saved_text = json.dumps(raw)
        self.history.begin(raw)
        self.show_page(0)
        self._check()
        self.rows["study"].controls["title"].setFocus()
        self.opened.emit()

    def _show_rows(self) -> None:
        """Show the fields of the study itself and of its sounds."""
        assert self.draft is not None
        raw, fields = self.draft.raw, fields_of(Protocol, _FIELDS)
        names, declared = names_of_languages(self.draft.folder), fields["language"]
        fields["language"] = NamedChoice(declared.default, values=names, doc=declared.doc, label=declared.label)
        self.rows = {
            "study": FieldRows(fields, raw),
            "sounds": FieldRows(fields_of(Sounds, Sounds.__struct_fields__), raw["sounds"]),
        }
        for area, rows in ((self._study, self.rows["study"]), (self._sounds, self.rows["sounds"])):
            _fill(area, rows)
            rows.changed.connect(self._record)

    def _record(self) -> None:
        """Record an edit for undo, and check it soon."""
        if self.draft is not None:
            self.history.record(self.draft.raw)
            self._check_timer.start()
            self.copy.update_soon()

    def _restore(self, raw: dict[str, Any], edit: DraftEdit) -> None:
        """Show an earlier or later state of the draft, at the place where it differs."""
        if self.draft is None:
            return
        self.draft.raw.clear()
        self.draft.raw.update(raw)
        self._show_rows()
        self.questions.show_questions(raw["participant"])
        for part, page in (("stimuli", self.stimuli), ("stages", self.stages)):
            page.show_names(edit.index if edit.part == part else page.list.currentRow())
        shown = _PAGE_OF_FIELD.get(edit.part, 0)
        if isinstance(current := self.pages.widget(shown), ItemList):
            current.rebuild_detail(current.refresh)
        self.history.settle(self.draft.raw)
        self._turn_to(shown)
        self._focus_on(edit)
        self._check()
        self.copy.update_soon()

    def _focus_on(self, edit: DraftEdit) -> None:
        """Give the focus to what was restored, unless it is on that page already."""
        page, focus = self.pages.currentWidget(), QApplication.focusWidget()
        if page is not None and (focus is None or not page.isAncestorOf(focus)):
            controls = self.rows["sounds"].controls if edit.part == "sounds" else self.rows["study"].controls
            controls.get(edit.merge.rpartition(".")[2], page).setFocus()

    def show_page(self, index: int) -> None:
        """Show the page with this index, with what other pages have renamed."""
        if index == 0:
            self._show_rows()
        if isinstance(page := self.pages.widget(index), ItemList):
            page.refresh()
        self._turn_to(index)

    def _turn_to(self, index: int) -> None:
        self.tabs.button(index).setChecked(True)
        self.pages.setCurrentIndex(index)

    def save_protocol(self) -> None:
        """Save the protocol, if it has no mistakes."""
        self._check()
        if self.draft is None or self.problem.text():
            return
        path = self._path or unused_path(str(self.draft.raw["title"]), self.draft.folder, self._sessions.root)
        try:
            self.draft.save(path)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self._path, self._saved_text, self._has_saved = path, json.dumps(self.draft.raw), True
        self.copy.update()
        self.title.setText("Edit a study")
        self.saved.emit(path)

    def ask_to_leave(self, then: Callable[[], object] = lambda: None) -> None:
        """Leave the editor, after a question if there are unsaved changes, and call `then`."""

        def leave() -> None:
            self._end()
            then()

        if not self.is_changed:
            leave()
            return
        text = "The protocol has changes that are not saved."
        ask(self.window(), "Close without saving", text, "Discard the changes", leave, "Go on with it")

    def close_down(self) -> None:
        """End what is measured, whose level would come when nothing is copied any more; copy what is unsaved."""
        if self.draft is not None:
            self.stimuli.background.stop()
            self.stimuli.background.join()
        self.copy.close()

    def event(self, event: QEvent) -> bool:
        # In this editor, Ctrl+S saves the protocol and Escape closes it, instead of the window's own shortcuts.
        if isinstance(event, QKeyEvent) and event.type() == QEvent.Type.ShortcutOverride and _is_own_key(event):
            event.accept()
            return True
        return super().event(event)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        if event.matches(QKeySequence.StandardKey.Save):
            self.save_protocol()
        elif event.key() == Qt.Key.Key_Escape:
            self.ask_to_leave()
        else:
            super().keyPressEvent(event)

    def _end(self) -> None:
        self._check_timer.stop()
        self.stimuli.background.stop()
        self.draft, self._saved_text = None, ""
        self.copy.update()
        self.history.stack.clear()
        self.closed.emit(self._has_saved)

    def _check(self) -> None:
        if self.draft is None:
            return
        trouble = self.draft.first_mistake()
        self.problem.setText(in_form(trouble, self.draft.raw))
        field = re.split(r"[.:[]", trouble.removeprefix("$."))[0]
        index = _PAGE_OF_FIELD.get(field, 0) if trouble else -1
        for at, text in enumerate(PAGES):
            self.tabs.button(at).setText(f"{text}  •" if at == index else text)
        self.save_button.setEnabled(not trouble)
        self.facts.setText("" if trouble else facts_of(self.draft.checked()))
        self.problem.setVisible(bool(trouble))

    def _lay_out(self) -> None:
        head, tabs = QHBoxLayout(), QHBoxLayout()
        head.addWidget(self.title, 1)
        for action in (self.undo_actions.undo, self.undo_actions.redo):
            button = QToolButton()
            button.setDefaultAction(action)
            button.setProperty("role", "flat")
            button.setFocusPolicy(Qt.FocusPolicy.TabFocus)
            head.addWidget(button)
        head.addWidget(self.save_button)
        head.addWidget(self.close_button)
        tabs.setSpacing(theme.GRID // 2)
        for at, text in enumerate(PAGES):
            tab = one_of_several(text, "")
            tab.setFocusPolicy(Qt.FocusPolicy.ClickFocus)  # or a click would leave it in the page that goes
            self.tabs.addButton(tab, at)
            tabs.addWidget(tab)
        tabs.addStretch(1)
        self.facts = theme.paragraph("", "muted")
        column = QVBoxLayout(self)
        column.setContentsMargins(theme.MARGINS)
        column.setSpacing(theme.GRID)
        column.addLayout(head)
        column.addWidget(self.note)
        column.addLayout(tabs)
        column.addWidget(self.pages, 1)
        column.addWidget(self.problem)
        column.addWidget(self.facts)


def _is_own_key(event: QKeyEvent) -> bool:
    return event.matches(QKeySequence.StandardKey.Save) or event.key() == Qt.Key.Key_Escape


def _fill(area: Pages, rows: FieldRows) -> None:
    """Show rows at the top of a scrolling page."""
    inside = QWidget(area.inside)
    theme.fill(inside, "ground")
    column = QVBoxLayout(inside)
    column.setContentsMargins(0, 0, theme.GRID, 0)
    column.addWidget(rows)
    column.addStretch(1)
    area.show_page(inside)
