"""The Recordings workspace: the list, the open recording on its time axis, its steps, and the floor."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from PySide6.QtCore import QPoint, Qt
from PySide6.QtGui import QAction, QShortcut
from PySide6.QtWidgets import QHBoxLayout, QStackedWidget, QToolButton, QWidget

from underfoot.engine.survey_process import Progress
from underfoot.floor.profile_parts import InUse, lines_of
from underfoot.records.notes import Notes
from underfoot.records.recording import Mark
from underfoot.records.survey import Survey
from underfoot.widgets import theme
from underfoot.widgets.controls.elided_label import ElidedLabel
from underfoot.widgets.controls.file_dialog import documents_folder
from underfoot.widgets.controls.key_names import with_native_keys
from underfoot.widgets.controls.menu import Menu
from underfoot.widgets.controls.panels import column, splitter, tool_button, with_header
from underfoot.widgets.controls.scrolled import scrolling
from underfoot.widgets.recordings.comparison_view import MOST, ComparisonView
from underfoot.widgets.recordings.exporting import Exporting
from underfoot.widgets.recordings.keys import SHORTCUTS
from underfoot.widgets.recordings.mark_editing import MarkEditing
from underfoot.widgets.recordings.playback import Playback
from underfoot.widgets.recordings.read_ahead import ReadAhead
from underfoot.widgets.recordings.reader import OpenedRecording, OverviewEnvelopes, RecordingReader
from underfoot.widgets.recordings.readout import CursorReadout, facts_of
from underfoot.widgets.recordings.recording_follower import RecordingFollower
from underfoot.widgets.recordings.recording_list import RecordingList
from underfoot.widgets.recordings.step_notes import StepNotes
from underfoot.widgets.recordings.steps import RecordedSteps
from underfoot.widgets.recordings.surveyor import Surveyor
from underfoot.widgets.recordings.timeline import ZOOM, Timeline
from underfoot.widgets.recordings.tracks import RecordingContent
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.workspace import Workspace, WorkspaceContext

NOTHING = "Choose a recording, drop one here, or record something with Ctrl+R."
TITLE_PX = 100
"""Minimum width of a longer name of a recording: at 900 pixels no more is left beside what is being done with it."""


class RecordingsWorkspace(Workspace):
    """Shows recordings; it never waits for a file."""

    shortcuts = SHORTCUTS

    def __init__(self, settings: Settings, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        theme.fill(self, "ground")
        self._asked: Path | None = None
        """The recording that was asked for last: one before it may still be reported as opened."""
        self._renaming: Path | None = None
        """Its survey waits until it has its name: a recording that is read cannot be renamed."""
        self._survey_again = False
        self.make(self._parts(settings))

    def _parts(self, settings: Settings) -> Iterator[None]:
        self.reader = RecordingReader(self)
        self.follower = RecordingFollower(self.reader, self)
        self.recordings = RecordingList(documents_folder, settings.recordings, self._use_here)
        self.timeline = Timeline()
        self.axis = self.timeline.axis
        yield
        self.steps = RecordedSteps()
        yield
        self.comparison = ComparisonView()
        self.surveyor = Surveyor(self)
        self.exporting = Exporting(self)
        self.read_ahead = ReadAhead(self.axis, self.reader, self)
        self.readout = CursorReadout(self.axis, self.reader, self)
        self.playback = Playback(self.axis, self)
        self.marks = MarkEditing(self.axis, self.reader, self, self.notified.emit)
        self.notes = StepNotes(self.axis, self.steps, self.reader, self, self.notified.emit)
        yield
        yield from self._build()
        yield
        self._connect()
        self.axis.show_content(None, with_native_keys(NOTHING))
        self._enable()

    # --- as a workspace ---

    def attach(self, context: WorkspaceContext) -> None:
        self.playback.attach(context)
        self.follower.attach(context.controller.recording)
        context.controller.recording.file_changed.connect(lambda _: self._list_recorded())

    def open_file(self, path: Path) -> None:
        """Open a recording, and add it to the list."""
        self.recordings.add(path)
        self.open(path)

    def menu_actions(self) -> Sequence[QAction]:
        return [self._export_action]

    def set_active(self, active: bool) -> None:
        if active:
            self.recordings.refresh()
            self.follower.show_begun()

    def close_down(self) -> None:
        self.exporting.close_down()
        self.notes.close_down()
        self.readout.close_down()
        self.surveyor.close()
        self.comparison.close_down()
        self.recordings.close_down()
        self.reader.close()

    # --- the recording ---

    def _list_recorded(self) -> None:
        self.recordings.refresh()
        if self.isVisible() and self._asked is None:
            self.follower.show_begun()

    def open(self, path: Path) -> None:
        """Open a recording; show errors."""
        self._show_page(self._opened_page)
        self._close_recording(f"Opening {path.name}…")
        self._show_name(path.stem)
        self.recordings.mark(path)
        self._asked = path.absolute()
        self.reader.open(self._asked)

    def _open_if_other(self, path: Path) -> None:
        """Open the recording that was chosen, or go back to it."""
        if self._is_open(path):
            self._show_page(self._opened_page)
        else:
            self.open_file(path)

    def _compare(self, paths: Sequence[Path]) -> None:
        """Compare several recordings, or the feet of one."""
        if len(paths) > MOST:
            self.notified.emit(f"{len(paths)} are chosen; up to {MOST} are compared here, more by underfoot compare.")
            return
        self._show_page(self.comparison)
        self.comparison.compare(paths, self.follower.is_written)

    def _compare_feet(self) -> None:
        if self.axis.content is not None:
            self._compare([self.axis.content.opened.path])
            self.comparison.table.setFocus()

    def _end_comparison(self) -> None:
        """Go back to the open recording."""
        self._show_opened_page()
        self.axis.setFocus()

    def _show_opened_page(self) -> None:
        self._show_page(self._opened_page)
        if self.axis.content is not None:
            self.recordings.mark(self.axis.content.opened.path)

    def _show_page(self, page: QWidget) -> None:
        if page is self._opened_page:
            self.comparison.clear()
        self._pages.setCurrentWidget(page)
        self._enable()

    def _close_recording(self, note: str) -> None:
        """Show no recording, but a note."""
        self.playback.stop()
        self.surveyor.stop()
        self.axis.show_content(None, note)
        self.readout.clear()
        self._show_name("")
        self.facts.set_full_text("")
        self._say("")
        self.steps.show_steps(())
        self.steps.show_wait("")
        self._enable()

    def _show_opened(self, opened: OpenedRecording) -> None:
        if opened.path != self._asked:
            return
        survey = opened.survey or Survey()
        content = RecordingContent(opened, contacts=survey.contacts, steps=survey.steps, balance=survey.balance)
        content.visible_steps = self.steps.matching(survey.steps)
        self.readout.map.set_floor(opened.floor)
        self.axis.show_content(content)
        self.steps.show_steps(content.steps)
        if self._pages.currentWidget() is self._opened_page:  # others may have been chosen with it meanwhile
            self.recordings.mark(opened.path)
        self._show_name(opened.path.stem, opened.calibrations)
        self.facts.set_full_text(*facts_of(opened))
        self._enable()
        self.follower.follow(opened.path)
        if self.follower.grows:
            self._show_growing()
        elif opened.survey is None or not opened.is_drawn:
            if opened.path == self._renaming:
                self._survey_again = True
            else:
                self._survey()
        self.readout.choose_tile(0)
        self.axis.set_cursor(0.0)

    def _show_growing(self) -> None:
        """Say that a recording is being written: steps are looked for when it is whole."""
        self.surveyor.stop()
        self._say("recording…")
        self.steps.show_wait("after the recording")

    def _show_extended(self, opened: OpenedRecording) -> None:
        """Show a recording that has grown; follow its end if that was visible."""
        content, view = self.axis.content, self.axis.view
        if content is None or content.opened.path != opened.path:
            return
        more_s = opened.length_s - content.opened.length_s
        follows, sees_all = view.end_s >= self.axis.length_s - 0.5, view.begin_s <= 0.0
        content.opened = opened
        self.facts.set_full_text(*facts_of(opened))
        self._show_growing()
        if follows:
            self.axis.set_view(0.0 if sees_all else view.begin_s + more_s, view.end_s + more_s)

    def _show_overview(self, overview: OverviewEnvelopes) -> None:
        if (content := self.axis.content) is None:
            return
        if len(overview.levels["force"][0]) and not (content.overview and len(content.overview.levels["force"][0])):
            loads = overview.levels["force"][-1].high[:, :-1] - overview.baseline_n[:-1]
            self.readout.choose_tile(int(np.argmax(np.nanmean(loads, axis=0))))
        content.overview = overview
        self.axis.redraw()

    def _survey(self) -> None:
        if self.axis.content is not None:
            opened = self.axis.content.opened
            self._say("")
            self.surveyor.begin(opened.path)
            self.steps.show_wait("looking for steps…" if opened.survey is None else "")

    def _show_survey(self, survey: Survey) -> None:
        content = self.axis.content  # to show an hour takes 0.2 s: not twice a second
        if content is not None and (survey.whole or len(survey.contacts) > 1.1 * len(content.contacts)):
            content.show_survey(list(survey.contacts), list(survey.steps))
            content.balance = survey.balance[:]
            self._filter()
            if survey.whole or len(survey.steps) > 1.5 * self.steps.every:
                self.steps.show_steps(content.steps, self.axis.view.step)
            if survey.whole:
                self.readout.describe_selection()
                self.recordings.refresh()

    def _show_marks(self, marks: list[Mark]) -> None:
        if self.axis.content is not None:
            self.axis.content.opened.marks[:] = marks
            self.axis.redraw()

    def _show_notes(self, notes: Notes) -> None:
        content = self.axis.content
        if content is not None and content.opened.notes != notes:
            content.opened = replace(content.opened, notes=notes)
            self.facts.set_full_text(*facts_of(content.opened))
            self._show_survey(Survey([*content.contacts], [*content.steps], whole=True, balance=content.balance))

    def _show_progress(self, progress: Progress) -> None:
        if not progress.text:
            self._say("")
            self.steps.show_wait("")
            self.reader.reread()
            return
        self._say(f"{100.0 * progress.share:.0f} %  ·  {progress.text}")
        if self.axis.content is not None and not self.axis.content.opened.is_drawn:
            self.reader.reread()

    def _show_name(self, name: str, calibrations: InUse | None = None) -> None:
        self.title.set_full_text(name, "\n".join(lines_of(calibrations or {})))
        self.title.setMinimumWidth(min(self.title.sizeHint().width(), TITLE_PX))  # the figures behind it are hidden

    def _say(self, text: str) -> None:
        """Show what is being done, the share first: in a narrow window the rest is cut off."""
        self.progress.set_full_text(text)
        self.progress.setVisible(bool(text))

    def _fail(self, why: str) -> None:
        self.notified.emit(why)
        if self.axis.content is None:
            self.axis.show_content(None, why)

    def _filter(self) -> None:
        if self.axis.content is not None:
            self.axis.content.visible_steps = self.steps.matching(self.axis.content.steps)
            self.axis.redraw()

    def _choose_step(self, number: int) -> None:
        """Show the curve, time and tile of a step selected on the axis or in the table."""
        if self.axis.content is None:
            return
        step = self.axis.content.steps[number].step
        self.axis.choose_step(number)
        self.steps.choose(number)
        self.readout.choose_tile(self.axis.content.opened.floor.index(step.tile))
        self.axis.set_cursor(step.start_s)
        self.axis.select(step.start_s, step.end_s)

    # --- actions of the user ---

    def export(self) -> bool:
        """Ask for a file, and export the recording, or its selected stretch, to it; or save the comparison."""
        if self._pages.currentWidget() is self.comparison:
            self.comparison.save()
        elif self.axis.content is not None:
            self.exporting.ask(self.axis.content.opened.path, self.axis.length_s, self.axis.selection)
        else:
            self.notified.emit("No recording is open: choose one in the list, then export it.")
        return True

    def _rename(self, path: Path, name: str) -> None:
        """Give a recording another name, unless it is in use."""
        if use := self._use_here(path):
            self._show_kept(path, use)
        else:
            if self._is_open(path):
                self.playback.stop()
                self._survey_again |= self.surveyor.is_busy
                self.surveyor.stop()
            self.comparison.reader.stop()  # until it has its name
            self._renaming = path
            self.reader.rename(path, name)

    def _use_here(self, path: Path) -> str:
        """Return why a recording can be neither renamed nor deleted now, with what to do; "" if it can."""
        if self.follower.is_written(path):
            return with_native_keys(f"{path.name} is being recorded; stop that with Ctrl+R first")
        exported = f"{path.name} is being exported; stop that, or wait until it is done"
        return exported if self.exporting.is_reading(path) else ""

    def _show_renamed(self, old: Path, new: Path) -> None:
        self._renaming = None
        if self._asked == old:
            self._asked = new
        content = self.axis.content
        if content is not None and self._is_open(old):
            content.opened = replace(content.opened, path=new)
            self._show_name(new.stem, content.opened.calibrations)
            self._go_on_with_survey()
        self.comparison.show_renamed(old, new)
        self.recordings.show_renamed(old, new)

    def _show_kept(self, path: Path, why: str) -> None:
        """Say why a recording keeps its name."""
        self._renaming = None
        self.comparison.show_renamed(path, path)
        self.recordings.show_problem(why)
        if self._is_open(path):
            self._go_on_with_survey()

    def _go_on_with_survey(self) -> None:
        """Go on with the survey of the open recording, if the request for another name stopped it."""
        if self._survey_again:
            self._survey()
        self._survey_again = False

    def _is_open(self, path: Path) -> bool:
        return self.axis.content is not None and self.axis.content.opened.path == path

    def _close_deleted(self, paths: Sequence[Path]) -> None:
        """End a comparison with one of these, and close the open recording if it is one."""
        if set(paths) & set(self.comparison.paths):
            self._show_opened_page()
        if any(map(self._is_open, paths)):
            self._close_recording(with_native_keys(NOTHING))
            self.reader.close_file()

    def _show_menu(self, on_axis: Iterable[tuple[str, str, Callable[[], object]]], place: QPoint) -> None:
        """Offer what can be done at the cursor, or with the stretch."""
        menu = Menu(self.axis)
        for keys, text, do in on_axis:
            menu.addAction(f"{text}\t{keys}", do)
        menu.addAction("Show all\t0", self.axis.show_all)
        menu.addAction(self._export_action)
        menu.open_once(place)

    def _enable(self) -> None:
        is_open = self.axis.content is not None
        self._export_action.setEnabled(is_open)
        for widget in self._needs_one:
            widget.setEnabled(is_open)
        for shortcut in self._on_axis:  # what they change is not seen during a comparison
            shortcut.setEnabled(is_open and self._pages.currentWidget() is self._opened_page)

    # --- layout ---

    def _connect(self) -> None:
        reader, axis = self.reader, self.axis
        reader.opened.connect(self._show_opened)
        reader.extended.connect(self._show_extended)
        self.follower.ended.connect(self._survey)
        self.follower.to_show.connect(self.open)
        reader.overview_read.connect(self._show_overview)
        reader.marked.connect(self._show_marks)
        reader.notes_read.connect(self._show_notes)
        reader.renamed.connect(self._show_renamed)
        reader.not_renamed.connect(self._show_kept)
        reader.failed.connect(self._fail)
        self.surveyor.progressed.connect(self._show_progress)
        self.surveyor.found.connect(self._show_survey)
        for part in (self.steps, self.comparison, self.recordings, self.exporting, self.playback):
            part.notified.connect(self.notified)
        self.surveyor.failed.connect(self.notified)
        axis.step_chosen.connect(self._choose_step)
        self.steps.chosen.connect(self._choose_step)
        self.steps.filtered.connect(self._filter)
        self.steps.comparison_wanted.connect(self._compare_feet)
        self.comparison.closed.connect(self._end_comparison)
        self.recordings.chosen.connect(self._open_if_other)
        self.recordings.compared.connect(self._compare)
        self.recordings.deleted.connect(self._close_deleted)
        self.recordings.rename_requested.connect(self._rename)
        self.exporting.progressed.connect(self.export_state.setText)
        self.exporting.progressed.connect(lambda text: self.stopping.setVisible(bool(text)))
        on_axis: tuple[tuple[str, str, Callable[[], object]], ...] = (
            ("M", "Mark", self.marks.add),
            ("Shift+M", "Mark with words…", self.marks.ask),
            ("Shift+Backspace", "Remove the mark", self.marks.remove),
            ("P", "Play or stop", self.playback.play_or_stop),
            ("L", "Loop", self.playback.looping.click),
        )
        axis.menu_requested.connect(partial(self._show_menu, on_axis))
        self._on_axis = [QShortcut(keys, self, do) for keys, _, do in on_axis]
        self._on_axis.append(QShortcut("Space", self, self.playback.play_or_stop))
        notes = (("X", "Leave out…, or take in again", self.notes.leave_out), ("W", "Body weight…", self.notes.weigh))
        for key, text, do in notes:
            self._on_axis.append(QShortcut(key, self, do))
            self.steps.table.offer(f"{text}\t{key}", do)
        renaming = QShortcut("F2", self, self.recordings.edit_name)
        deleting = QShortcut("Delete", self.recordings, self.recordings.ask_to_delete)
        for shortcut in (*self._on_axis, renaming, deleting):
            shortcut.setAutoRepeat(False)
            shortcut.setContext(Qt.ShortcutContext.WidgetWithChildrenShortcut)
        self.axis.forward_keys_of(self.steps)
        self.focused_first = self.axis

    def _build(self) -> Iterator[None]:
        # From the outside in: a widget that gets another parent has the style of all within it looked up again.
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        down = splitter("recordings down", Qt.Orientation.Vertical)
        layout.addWidget(self.recordings)
        self._pages = QStackedWidget()
        layout.addWidget(self._pages, 1)
        self._opened_page = scrolling(down)
        self._pages.addWidget(self._opened_page)
        self._pages.addWidget(self.comparison)
        head, shrinking = self._head(), ((self.facts,), (self.playback.button, self.export_button))
        timeline = with_header(head, self.timeline, shrinking)
        column(timeline, self.readout.text, body=timeline, parent=down)
        yield
        below = splitter("recordings below", Qt.Orientation.Horizontal)
        down.addWidget(below)
        down.setStretchFactor(0, 1)
        down.setSizes([500, 220])
        below.addWidget(self.steps)
        floor = with_header([theme.label("Floor at the cursor", "title"), None], self.readout.map)
        floor.setMinimumWidth(20 * theme.GRID)
        below.addWidget(floor)
        below.setStretchFactor(0, 1)
        below.setSizes([820, 208])

    def _head(self) -> list[QWidget | None]:
        self.title, self.facts = ElidedLabel("title"), ElidedLabel("muted")
        self.progress, self.export_state = ElidedLabel("small"), theme.label("", "small")
        zoom = [
            self._button("", "−", "Show more (−)", partial(self.axis.zoom, 1.0 / ZOOM)),
            self._button("", "+", "Show less, and finer (+)", partial(self.axis.zoom, ZOOM)),
            self._button("", "All", "Show the whole recording (0)", self.axis.show_all),
        ]
        marking = self._button(
            "", "Mark", "Mark the cursor's time in the recording (M; Shift+M with a text)", self.marks.add
        )
        play = (self.playback.patch, self.playback.button, self.playback.looping)
        self.export_button = self._button(
            "export", "Export…", "Write it, or the selected stretch, for other programs (Ctrl+Shift+E)", self.export
        )
        self.progress.setMinimumWidth(6 * theme.GRID)
        self.progress.hide()
        self._export_action = QAction("Export recording…", self)
        self._export_action.triggered.connect(self.export)
        self.stopping = self._button("stop", "", "Stop the export", self.exporting.stop)
        self.stopping.hide()
        self._needs_one: list[QWidget] = [*zoom, marking, *play, self.export_button]
        shown = (self.title, self.facts, self.progress, None, self.export_state, self.stopping)
        return [*shown, *self._needs_one]

    def _button(self, icon: str, text: str, tip: str, do: Callable[[], object]) -> QToolButton:
        button = tool_button(icon, text, tip)
        button.clicked.connect(lambda _=False: do())
        return button
