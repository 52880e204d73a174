"""The editor of a protocol: questions, stimuli, stages and sounds, checked during typing."""

import json
from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, Qt, QTimer, Signal
from PySide6.QtGui import QKeyEvent, QKeySequence
from PySide6.QtWidgets import (
    QButtonGroup,
    QHBoxLayout,
    QPushButton,
    QScrollArea,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from underfoot.errors import UnderfootError
from underfoot.experiments.declared import fields_of
from underfoot.experiments.draft import Draft, unused_path
from underfoot.experiments.mistake_places import in_form
from underfoot.experiments.protocol import Protocol, Sounds
from underfoot.widgets import theme
from underfoot.widgets.controls.question import ask
from underfoot.widgets.experiment.choice import facts_of
from underfoot.widgets.experiment.field_rows import FieldRows
from underfoot.widgets.experiment.question_table import QuestionTable
from underfoot.widgets.experiment.stage_page import StagePage
from underfoot.widgets.experiment.stimulus_page import AskToRun, StimulusPage, ask_nothing

PAGES = ("S&tudy", "&Questions", "St&imuli", "Sta&ges", "S&ounds")
_PAGE_OF_FIELD = {"participant": 1, "stimuli": 2, "stages": 3, "sounds": 4}
"""The page of a mistake, by the first word of its place."""
_FIELDS = ("title", "about", "seed", "limit_m_s2", "present_s")
_CHECK_DELAY_MS = 150


class ProtocolEditor(QWidget):
    """Edits a draft. `saved` carries the file after each save; `closed` is emitted when the editor is left."""

    saved = Signal(object)
    closed = Signal()
    notified = Signal(str)

    def __init__(self, sessions: Path, own_patches: Path) -> None:
        """Create the editor; `sessions` is the folder of sessions, `own_patches` the folder of the user's presets."""
        super().__init__()
        self._sessions, self._own_patches = sessions, own_patches
        self.draft: Draft | None = None
        self.ask_to_run: AskToRun = ask_nothing
        self._path: Path | None = None
        self._saved_text = ""
        self.title = theme.label("", "title")
        self.save_button, self.close_button = QPushButton("Save"), QPushButton("Close")
        self.save_button.setProperty("role", "primary")
        self.save_button.setToolTip("Save the protocol, and go on with it (Ctrl+S)")
        self.close_button.setToolTip("Back to the studies; what was saved is chosen there (Esc)")
        self.problem, self.note = theme.label("", "alarm"), theme.label("", "muted")
        for label in (self.problem, self.note):
            label.setWordWrap(True)
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
        self.close_button.clicked.connect(self.ask_to_leave)

    @property
    def is_changed(self) -> bool:
        """Whether there are unsaved changes."""
        return self.draft is not None and json.dumps(self.draft.raw) != self._saved_text

    def edit(self, draft: Draft, path: Path | None = None, note: str = "") -> None:
        """Show a draft of the protocol in the file `path`, or a new one; `note` is a remark for the user."""
        self.draft, self._path = draft, path
        raw = draft.raw
        raw["participant"] = [dict(one) for one in raw.get("participant") or ()]
        raw["sounds"] = dict(raw.get("sounds") or {})
        self.title.setText("Edit a study" if path is not None else "A new study")
        self.note.setText(note)
        self.note.setVisible(bool(note))
        while (old := self.pages.widget(0)) is not None:
            self.pages.removeWidget(old)
            old.deleteLater()
        questions = QuestionTable(raw["participant"], rows_seen=8)
        self.questions = questions
        self.stimuli, self.stages = StimulusPage(draft, self._own_patches, self.ask_to_run), StagePage(draft)
        self.stimuli.notified.connect(self.notified)
        self.rows = {
            "study": FieldRows(fields_of(Protocol, _FIELDS), raw),
            "sounds": FieldRows(fields_of(Sounds, Sounds.__struct_fields__), raw["sounds"]),
        }
        pages = (_scrolled(self.rows["study"]), questions, self.stimuli, self.stages, _scrolled(self.rows["sounds"]))
        for page in pages:
            self.pages.addWidget(page)
        changes = [questions.changed, self.stimuli.changed, self.stages.changed]
        for changed in (*changes, *(rows.changed for rows in self.rows.values())):
            changed.connect(lambda *_: self._check_timer.start())
        self._saved_text = json.dumps(raw)
        self.show_page(0)
        self._check()
        self.rows["study"].controls["title"].setFocus()

    def show_page(self, index: int) -> None:
        """Show the page with this index."""
        if index == _PAGE_OF_FIELD["stages"]:
            self.stages.refresh()
        self.tabs.button(index).setChecked(True)
        self.pages.setCurrentIndex(index)

    def save_protocol(self) -> None:
        """Save the protocol, if it has no mistakes."""
        self._check()
        if self.draft is None or self.problem.text():
            return
        path = self._path or unused_path(str(self.draft.raw["title"]), self.draft.folder, self._sessions)
        try:
            self.draft.save(path)
        except UnderfootError as error:
            self.notified.emit(str(error))
            return
        self._path, self._saved_text = path, json.dumps(self.draft.raw)
        self.title.setText("Edit a study")
        self.saved.emit(path)

    def ask_to_leave(self) -> None:
        """Leave the editor, after a question if there are unsaved changes."""
        if not self.is_changed:
            self._end()
            self.closed.emit()
            return
        text = "The protocol has changes that are not saved."
        ask(self.window(), "Close without saving", text, "Discard the changes", self._discard, "Go on with it")

    def unsaved(self) -> bytes:
        """Return the unsaved draft as bytes, to be restored later; b"" without changes."""
        if self.draft is None or not self.is_changed:
            return b""
        return json.dumps({"path": str(self._path or ""), "protocol": self.draft.raw}).encode()

    def mark_unsaved(self) -> None:
        """Mark the draft as stored in no file."""
        self._saved_text = ""

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

    def _discard(self) -> None:
        self._end()
        self.closed.emit()

    def _end(self) -> None:
        self._check_timer.stop()
        self.stimuli.background.stop()
        self.draft, self._saved_text = None, ""

    def _check(self) -> None:
        if self.draft is None:
            return
        trouble = self.draft.first_mistake()
        self.problem.setText(in_form(trouble, self.draft.raw))
        theme.set_role(self.problem, "alarm")
        index = (
            _PAGE_OF_FIELD.get(trouble.removeprefix("$.").split(".")[0].split("[")[0].split(":")[0], 0)
            if trouble
            else -1
        )
        for at, text in enumerate(PAGES):
            self.tabs.button(at).setText(f"{text}  •" if at == index else text)
        self.save_button.setEnabled(not trouble)
        self.facts.setText("" if trouble else facts_of(self.draft.checked()))
        self.problem.setVisible(bool(trouble))

    def _lay_out(self) -> None:
        head, tabs = QHBoxLayout(), QHBoxLayout()
        head.addWidget(self.title, 1)
        head.addWidget(self.save_button)
        head.addWidget(self.close_button)
        tabs.setSpacing(theme.GRID // 2)
        for at, text in enumerate(PAGES):
            tab = QPushButton(text)
            tab.setCheckable(True)
            tab.setProperty("role", "tab")
            self.tabs.addButton(tab, at)
            tabs.addWidget(tab)
        tabs.addStretch(1)
        self.facts = theme.label("", "muted")
        self.facts.setWordWrap(True)
        column = QVBoxLayout(self)
        column.setContentsMargins(*[2 * theme.GRID] * 4)
        column.setSpacing(theme.GRID)
        column.addLayout(head)
        column.addWidget(self.note)
        column.addLayout(tabs)
        column.addWidget(self.pages, 1)
        column.addWidget(self.problem)
        column.addWidget(self.facts)


def ask_to_delete(parent: QWidget, title: str, sessions: int, then: Callable[[], object]) -> None:
    """Ask whether to delete one of the user's protocols; its sessions are kept."""
    kept = f" Its {sessions} {'session stays' if sessions == 1 else 'sessions stay'}." if sessions else ""
    ask(parent, "Delete protocol", f"Delete the protocol “{title}”? Its file goes to the trash.{kept}", "Delete", then)


def _is_own_key(event: QKeyEvent) -> bool:
    return event.matches(QKeySequence.StandardKey.Save) or event.key() == Qt.Key.Key_Escape


def _scrolled(rows: FieldRows) -> QScrollArea:
    """Return rows at the top of a scrolling page."""
    inside = QWidget()
    inside.setProperty("role", "ground")
    inside.setAttribute(Qt.WidgetAttribute.WA_StyledBackground)
    column = QVBoxLayout(inside)
    column.setContentsMargins(0, 0, theme.GRID, 0)
    column.addWidget(rows)
    column.addStretch(1)
    area = QScrollArea()
    area.setWidgetResizable(True)
    area.setWidget(inside)
    return area
