"""A new study, made in the Experiment workspace by real clicks and keys, and run on oneself."""

import copy

import pytest
from made_studies import TD, protocol_text
from msgspec import structs
from PySide6.QtCore import QPoint, QPointF, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication, QFileDialog, QMessageBox, QScrollArea, QTableWidget
from study_hand import CTRL, Hand
from windows import choose_file, dialog_of, quiet_window

from underfoot.experiments.foot import FootAnswer
from underfoot.experiments.protocol import FIELDS_OF_KIND, Protocol, Sounds, Stage
from underfoot.experiments.questions import Question
from underfoot.experiments.stimuli import Stimulus
from underfoot.experiments.store import SessionFile
from underfoot.nodes import REGISTRY
from underfoot.patch import preset_files
from underfoot.patch.patch import Patch
from underfoot.widgets.experiment import question_table


@pytest.fixture
def made(qtbot, tmp_path):
    return Hand(qtbot, tmp_path)


def test_a_new_study_has_two_trials_and_no_mistake_and_is_listed_beside_the_presets(made):
    count = len(made.workspace.study_list.studies)
    made.click(made.workspace.study_list.new)
    made.type(made.protocol_editor.rows["study"].controls["title"], "Gravel or sand?")
    made.keep()
    assert made.protocols() == ["gravel-or-sand.json"]
    assert len(made.workspace.study_list.studies) == count + 1
    assert made.workspace.study_list.study.protocol.title == "Gravel or sand?"
    assert made.workspace.study_list.list.currentItem().text() == "Gravel or sand?  (own)"
    assert Protocol.load(made.workspace.study_list.study.path) == made.workspace.study_list.study.protocol
    assert len(made.opened().study_list.studies) == count + 1


def test_a_study_is_saved_again_and_again_while_it_is_made_into_one_file(made):
    count = len(made.workspace.study_list.studies)
    made.click(made.workspace.study_list.new)
    title = made.protocol_editor.rows["study"].controls["title"]
    for words in ("Gravel or sand?", "Gravel, or sand?"):
        made.type(title, words)
        made.qtbot.waitUntil(made.protocol_editor.save_button.isEnabled)
        made.qtbot.keyClick(title, Qt.Key.Key_S, CTRL)
        assert made.workspace.stack.currentWidget() is made.protocol_editor
        assert made.said[-1] == f"Saved as {made.folder / 'protocols' / 'gravel-or-sand.json'}"
        assert not made.protocol_editor.is_changed
    assert made.protocols() == ["gravel-or-sand.json"]
    assert len(made.workspace.study_list.studies) == count + 1
    made.qtbot.keyClick(title, Qt.Key.Key_Escape)
    assert made.workspace.stack.currentWidget() is made.workspace.overview
    assert made.workspace.start.participant.hasFocus()
    assert made.workspace.overview.title.text() == "Gravel, or sand?"


def test_a_mistake_is_said_by_its_stage_and_field_and_cannot_be_saved(made):
    made.click(made.workspace.study_list.new)
    made.page(3)
    made.type(made.protocol_editor.stages.form.parameters.controls["blocks"], "0")
    made.qtbot.waitUntil(lambda: bool(made.protocol_editor.problem.text()))
    said = "Stage main, Blocks is 0; allowed: whole numbers 1 to 1000"
    assert made.protocol_editor.problem.text() == said
    assert not made.protocol_editor.save_button.isEnabled()
    assert "•" in made.protocol_editor.tabs.button(3).text()
    made.type(made.protocol_editor.stages.form.parameters.controls["blocks"], "many")
    made.qtbot.waitUntil(lambda: "'many'" in made.protocol_editor.problem.text())
    made.type(made.protocol_editor.stages.form.parameters.controls["blocks"], "4")
    made.qtbot.waitUntil(lambda: not made.protocol_editor.problem.text())
    assert made.protocol_editor.facts.text() == "rating: 8 trials, begun by key  ·  less than a minute"


def telling(stimuli):
    """The places of the first stimulus with each set of fields, and of the one with most to write in each field."""
    fields = [structs.astuple(stimulus) for stimulus in stimuli]
    shapes = [tuple(map(bool, values)) for values in fields]
    longest = {max(range(len(fields)), key=lambda k: len(str(fields[k][field]))) for field in range(len(fields[0]))}
    return sorted(longest | {shapes.index(shape) for shape in shapes})


@pytest.mark.parametrize("name", preset_files.protocols())
def test_a_copy_of_a_preset_that_nobody_touches_differs_in_its_title_alone(made, name):
    row = [study.name for study in made.workspace.study_list.studies].index(name)
    made.workspace.study_list.list.setCurrentRow(row)
    preset = made.workspace.study_list.study.protocol
    made.click(made.workspace.study_list.copy_button)
    for at in range(5):
        made.page(at)
    for place in telling([*preset.stimuli.values()]) if preset.stimuli else ():
        made.protocol_editor.stimuli.list.setCurrentRow(place)
    for place in range(made.protocol_editor.stages.list.count()):
        made.protocol_editor.stages.list.setCurrentRow(place)
    assert not made.protocol_editor.is_changed
    made.keep()
    mine = made.workspace.study_list.study.protocol
    assert mine.title == f"{preset.title}, my own"
    assert (mine.stages, mine.stimuli, mine.participant, mine.sounds) == (
        preset.stages, preset.stimuli, preset.participant, preset.sounds)  # fmt: skip


def test_tab_goes_through_the_table_of_questions_and_out_of_it(made):
    made.click(made.workspace.study_list.new)
    made.page(1)
    questions = made.protocol_editor.questions
    made.click(questions.add)
    made.qtbot.keyClicks(QApplication.focusWidget(), "How old are you?")
    passed = []
    while len(passed) < 6:
        made.qtbot.keyClick(QApplication.focusWidget(), Qt.Key.Key_Tab)
        passed.append(questions.table.currentColumn())
    assert questions.questions[0]["text"] == "How old are you?"
    assert passed == [2, 3, 4, 5, 6, 6]
    assert questions.add.hasFocus()
    questions.table.setCurrentCell(0, 0)
    questions.table.setFocus()
    made.qtbot.keyClick(questions.table, Qt.Key.Key_Tab, Qt.KeyboardModifier.ShiftModifier)
    assert not questions.table.isAncestorOf(QApplication.focusWidget())
    assert not questions.table.hasFocus()


def test_a_question_shows_only_what_its_kind_of_answer_has(made):
    made.click(made.workspace.study_list.new)
    made.page(1)
    questions = made.protocol_editor.questions
    made.click(questions.add)

    def row():
        items = [questions.table.item(0, column) for column in range(3, 7)]
        return [item.text() if item.flags() & Qt.ItemFlag.ItemIsEditable else None for item in items]

    for kind, shown in {
        "count": ["0", "100", None, ""],
        "choice": [None, None, "", None],
        "number": ["0", "100", None, ""],
        "text": [None] * 4,
    }.items():
        made.choose(questions.table.cellWidget(0, 2), kind)
        assert row() == shown
    assert questions.questions == [{"name": "q1", "text": "", "kind": "text"}]


def test_tab_stops_only_at_what_can_be_set(made):
    made.click(made.workspace.study_list.new)
    for page in range(5):
        made.page(page)
        passed = []
        made.protocol_editor.tabs.button(page).setFocus()
        while QApplication.focusWidget() not in passed and len(passed) < 30:
            passed.append(QApplication.focusWidget())
            made.qtbot.keyClick(passed[-1], Qt.Key.Key_Tab)
        assert [part for part in passed if type(part) is QScrollArea] == []


def test_the_lists_have_the_names_that_are_read_out(made):
    made.click(made.workspace.study_list.new)
    editor = made.protocol_editor
    assert [page.list.accessibleName() for page in (editor.stimuli, editor.stages)] == ["Stimuli", "Stages"]


def test_questions_stages_and_sounds_are_set_by_their_controls(made):
    made.click(made.workspace.study_list.new)
    made.page(1)
    made.click(made.protocol_editor.questions.add)
    made.protocol_editor.questions.table.item(0, 0).setText("age")
    made.protocol_editor.questions.table.item(0, 1).setText("How old are you?")
    made.choose(made.protocol_editor.questions.table.cellWidget(0, 2), "count")
    made.page(3)
    stages = made.protocol_editor.stages
    made.click(stages.add)
    made.type(stages.form.rows.controls["id"], "hello")
    for _ in range(2):  # the second time it is at the top already
        made.click(stages.up)
    made.choose(stages.form.rows.controls["kind"], "consent")
    stages.list.setCurrentRow(1)
    made.choose(stages.form.method.controls["method"], "Constant stimuli")
    assert stages.form.parameters.controls["blocks"].text() == "20"  # and not the new study's one block of ratings
    made.choose(stages.form.parameters.controls["standard"], "A")
    made.choose(stages.form.method.controls["method"], "Up-down staircases")
    assert stages.form.parameters.controls["followed"].placeholderText() == "all that vibrate"
    made.type(stages.form.parameters.controls["followed"], "A")
    question = stages.form.parameters.controls["question"]
    assert question.placeholderText() == "Which was stronger?"  # the standard is kept
    made.choose(stages.form.parameters.controls["standard"], "nothing")
    assert question.placeholderText() == "In which one did you feel it?"
    made.choose(stages.form.parameters.controls["standard"], "(none)")
    assert question.placeholderText() == "Did you feel it?"
    made.type(stages.form.parameters.controls["steps_db"], "8, 2")
    made.type(stages.form.parameters.controls["highest_db"], "12 dB")
    made.type(stages.form.parameters.controls["above_db"], "6, 10")
    made.type(stages.form.further.controls["block_pause_s"], "1500 ms")
    made.click(stages.form.foot)
    made.choose(stages.form.foot_rows.controls["by"], "halves")
    made.type(stages.form.foot_rows.controls["tiles"], "t3")
    assert stages.form.fields.text() == "yes: left half  ·  no: right half"
    made.page(4)
    made.choose(made.protocol_editor.rows["sounds"].controls["noise"], "pink")
    made.keep()
    protocol = made.workspace.study_list.study.protocol
    assert [(one.name, one.kind) for one in protocol.participant] == [("age", "count")]
    assert [stage.kind for stage in protocol.stages] == ["consent", "trials"]
    method = protocol.stages[1].method
    assert (method.kind, method.parameters["steps_db"]) == ("staircases", [8.0, 2.0])
    assert protocol.stages[1].block_pause_s == 1.5
    assert (protocol.stages[1].foot.by, protocol.stages[1].foot.tiles) == ("halves", ("t3",))
    assert protocol.sounds.noise == "pink"


def test_a_form_that_is_made_anew_stays_where_it_was(made):
    made.click(made.workspace.study_list.new)
    made.page(3)
    page = made.protocol_editor.stages
    page.detail.ensureWidgetVisible(page.form.foot)
    made.qtbot.waitUntil(lambda: page.detail.verticalScrollBar().value() > 0)
    before, scrolled = page.form, page.detail.verticalScrollBar().value()
    page.form.foot.setFocus()
    made.qtbot.keyClick(page.form.foot, Qt.Key.Key_Space)
    assert page.form is not before
    assert page.form.foot_rows is not None
    assert page.focusWidget() is page.form.foot
    made.qtbot.waitUntil(lambda: page.detail.verticalScrollBar().value() == scrolled)


def test_a_stage_leads_to_another_and_knows_it_by_its_new_name(made):
    made.click(made.workspace.study_list.new)
    made.page(3)
    stages = made.protocol_editor.stages
    made.type(made.protocol_editor.rows["study"].controls["counterbalanced"], "main, bye")
    for name in ("bye", "hello"):  # each comes behind the one that is chosen
        stages.list.setCurrentRow(0)
        made.click(stages.add)
        made.type(stages.form.rows.controls["id"], name)
    made.choose(stages.form.order.controls["next"], "bye")
    stages.list.setCurrentRow(2)
    made.choose(stages.form.order.controls["next"], "the end of the study")
    made.type(stages.form.rows.controls["id"], "goodbye")
    assert [stages.list.item(k).text().partition("  →  ")[2] for k in range(3)] == ["", "bye", "end"]
    stages.list.setCurrentRow(1)
    assert stages.form.order.controls["next"].currentText() == "goodbye"
    made.page(0)
    assert made.protocol_editor.rows["study"].controls["counterbalanced"].text() == "main, goodbye"
    made.keep()
    assert [stage.next for stage in made.workspace.study_list.study.protocol.stages] == ["", "goodbye", "end"]


def controls_of(made):
    """The fields that the form shows of each document, over all stages and stimuli of what is edited."""
    protocol_editor = made.protocol_editor
    found = {"Protocol": {*protocol_editor.rows["study"].controls, "participant", "sounds", "stimuli", "stages"},
             "Sounds": {*protocol_editor.rows["sounds"].controls}, "Question": set(question_table.COLUMNS),
             "Stage": set(), "FootAnswer": set(), "Stimulus": set()}  # fmt: skip
    made.page(3)
    for place in range(protocol_editor.stages.list.count()):
        protocol_editor.stages.list.setCurrentRow(place)
        form = protocol_editor.stages.form
        for rows in (form.rows, form.further, form.order):
            found["Stage"] |= set(rows.controls)
        found["Stage"] |= {name for name in ("method", "foot", "questions") if getattr(form, name) is not None}
        found["FootAnswer"] |= set(form.foot_rows.controls if form.foot_rows else ())
    made.page(2)
    for place in range(protocol_editor.stimuli.list.count()):
        protocol_editor.stimuli.list.setCurrentRow(place)
        found["Stimulus"] |= {
            *protocol_editor.stimuli.form.levels.controls,
            "patch",
            "settings",
            "scaled_by",
            "factors",
        }
    return found


def test_the_form_can_set_every_field_that_a_protocol_has(made):
    foot = {"id": "foot", "kind": "trials", "foot": {}, "method": {"kind": "rating", "parameters": {}}}
    others = [{"id": kind, "kind": kind, "stimulus": "TD" if kind == "level" else "",
               "questions": [{"name": "a", "text": "?"}] if kind == "questions" else []}
              for kind in FIELDS_OF_KIND if kind != "trials"]  # fmt: skip
    path = made.folder / "made.json"
    path.write_text(protocol_text(stimuli={"TD": TD, "X": {}}, stages=[foot, *others]))
    made.workspace.study_list.open_protocol(path)
    made.click(made.workspace.study_list.copy_button)
    found = controls_of(made)
    for document in (Protocol, Sounds, Question, Stage, FootAnswer, Stimulus):
        assert found[document.__name__] >= set(document.__struct_fields__) - {"format", "version"}, document


def test_a_stimulus_is_a_patch_of_ones_own_with_a_setting_and_a_measured_level(made):
    own = made.folder / "presets"
    own.mkdir()
    Patch.load(preset_files.patches()["stimulus-td"], REGISTRY).save(own / "mine.json")
    made.click(made.workspace.study_list.new)
    made.page(2)
    stimuli = made.protocol_editor.stimuli
    made.type(stimuli.form.name, "B")
    words = next(stimuli.form.patch.itemText(k) for k in range(stimuli.form.patch.count())
                 if stimuli.form.patch.itemText(k).startswith("My presets"))  # fmt: skip
    made.choose(stimuli.form.patch, words)
    assert stimuli.form.scaling.currentText() == "gain.gain"
    made.choose(stimuli.form.adding, "gain.gain")
    made.type(stimuli.form.rows.controls["gain.gain"], "0.5")
    made.click(stimuli.form.measure)
    assert stimuli.form.measure.text() == "Measuring… Stop"
    made.click(stimuli.form.measure)
    assert stimuli.form.measure.text() == "Measure the level"
    assert made.protocol_editor.draft.raw["stimuli"]["B"]["measured_m_s2"] == 0.0
    made.click(stimuli.form.measure)
    made.type(stimuli.form.name, "C")  # while it is measured
    made.qtbot.waitUntil(lambda: stimuli.form.measure.text() == "Measure the level", timeout=120_000)
    measured = made.protocol_editor.draft.raw["stimuli"]["C"]["measured_m_s2"]
    assert 0.1 < measured < 20.0
    made.click(stimuli.form.measure)
    made.type(stimuli.form.rows.controls["gain.gain"], "0.25")
    with made.qtbot.waitSignal(stimuli.notified) as said:
        pass
    assert said.args[0].startswith("The level is not taken")
    assert made.protocol_editor.draft.raw["stimuli"]["C"]["measured_m_s2"] == measured
    made.keep()
    stimulus = made.workspace.study_list.study.protocol.stimuli["C"]
    assert (stimulus.patch, stimulus.level_m_s2) == ("patches/mine.json", measured)
    assert (made.folder / "protocols" / "patches" / "mine.json").read_bytes() == (own / "mine.json").read_bytes()


def test_a_stimulus_keeps_its_place_in_the_stages_under_another_name(made):
    path = made.folder / "made.json"
    stage = {"id": "main", "kind": "trials", "method": {"kind": "constant-stimuli", "parameters": {"standard": "TD"}}}
    path.write_text(protocol_text(stimuli={"TD": TD, "X": {}}, stages=[stage]))
    made.workspace.study_list.open_protocol(path)
    made.click(made.workspace.study_list.copy_button)
    made.page(2)
    made.type(made.protocol_editor.stimuli.form.name, "loud")
    made.keep()
    protocol = made.workspace.study_list.study.protocol
    assert list(protocol.stimuli) == ["loud", "X"]
    assert protocol.stages[0].method.parameters["standard"] == "loud"


def test_ones_own_is_edited_again_and_deleted_after_asking(made, monkeypatch):
    monkeypatch.setenv("XDG_DATA_HOME", str(made.folder))  # where the trash is
    made.click(made.workspace.study_list.new)
    made.keep()
    path = made.workspace.study_list.study.path
    sessions = made.folder / "studies" / path.stem
    sessions.mkdir(parents=True)
    SessionFile.create(sessions / "P1.session", made.workspace.study_list.study.protocol, "P1").close()
    made.click(made.workspace.study_list.edit)
    assert made.protocol_editor.note.text().startswith("1 session was begun with it")
    made.type(made.protocol_editor.rows["study"].controls["present_s"], "0.2")
    made.keep()
    assert made.protocols() == [path.name]
    assert Protocol.load(path).present_s == 0.2
    count = len(made.workspace.study_list.studies)
    made.click(made.workspace.study_list.delete)
    made.answer("Cancel")
    assert path.exists()
    listed = made.workspace.study_list.list
    listed.setFocus()
    QTest.keyClick(listed, Qt.Key.Key_Delete)
    made.answer("Delete")
    assert not path.exists()
    assert len(made.workspace.study_list.studies) == count - 1
    assert (sessions / "P1.session").exists()
    made.click(made.workspace.study_list.new)  # another of the same title: its file and sessions are its own
    made.keep()
    assert made.protocols() == ["my-study-2.json"]


def test_a_title_of_any_length_is_saved(made):
    made.click(made.workspace.study_list.new)
    made.type(made.protocol_editor.rows["study"].controls["title"], "Ice " * 100)
    made.keep()
    assert made.protocols() == ["-".join(["ice"] * 20) + ".json"]
    assert made.workspace.study_list.study.title == "Ice " * 100


def test_stimuli_come_from_a_table_after_asking(made):
    workspace, protocol_editor = made.workspace, made.protocol_editor
    made.click(workspace.study_list.new)
    made.page(2)
    table = made.folder / "trials.csv"
    table.write_text("stimulus,like,level_m_s2,place\nheel,A,2,back\ntoe,A,1,front\n")
    choose_file(workspace, table, lambda: made.click(protocol_editor.stimuli.table))
    box = dialog_of(workspace, QMessageBox)
    assert box.text().startswith("Present the 2 lines of trials.csv in the place of A, nothing?")
    made.click(next(button for button in box.buttons() if button.text() == "Present them"))
    made.page(3)
    made.click(protocol_editor.save_button)
    saved = workspace.study_list.study.protocol
    assert {name: (one.level_m_s2, one.factors) for name, one in saved.stimuli.items()} == {
        "heel": (2.0, {"place": "back"}),
        "toe": (1.0, {"place": "front"}),
    }
    assert saved.stages[0].method.parameters["rated"] == ["heel", "toe"]
    made.click(protocol_editor.close_button)
    made.click(workspace.study_list.new)
    made.page(2)
    table.write_text("stimulus,like\nheel,B\n")
    protocol_editor.stimuli.import_table(table)
    assert made.said[-1] == f"{table}, line 2: like is 'B'; allowed: a stimulus of the protocol (A, nothing)"
    assert list(protocol_editor.draft.raw["stimuli"]) == ["A", "nothing"]


@pytest.mark.parametrize("width", [960, 1024, 1280])  # 1920 at 200 %, the least width, a usual one
def test_no_field_of_a_study_is_cut_in_a_narrow_window(made, width):
    made.workspace.resize(width, 540)
    made.click(made.workspace.study_list.copy_button)
    for page in range(5):
        made.page(page)
        areas = [area for area in made.protocol_editor.findChildren(QScrollArea) if area.isVisible()]
        made.qtbot.waitUntil(lambda areas=areas: all(a.widget().width() <= a.viewport().width() for a in areas))
    made.page(1)
    table = made.protocol_editor.findChild(QTableWidget)
    assert table.columnWidth(question_table.COLUMNS.index("text")) >= question_table.TEXT_PX
    assert table.horizontalHeader().length() >= table.viewport().width()


def test_save_means_the_study_that_is_made_also_when_tab_has_left_its_last_field(qtbot, tmp_path):
    window = quiet_window(qtbot, tmp_path)
    window.workspaces.choose("Experiment")
    editor = window.workspaces["Experiment"].protocol_editor
    editor.make_new()
    window.main_bar.play.setFocus()
    qtbot.keyClick(window.main_bar.play, Qt.Key.Key_S, CTRL)
    assert not any(dialog.isVisible() for dialog in window.findChildren(QFileDialog))
    assert not editor.is_changed
    qtbot.keyClick(editor, Qt.Key.Key_Escape)
    qtbot.keyClick(window, Qt.Key.Key_S, CTRL)
    dialog_of(window, QFileDialog).reject()  # without a study, Save means the patch


def test_the_wheel_over_a_choice_scrolls_the_form_and_chooses_nothing(made):
    made.click(made.workspace.study_list.new)
    editor, window = made.protocol_editor, made.workspace.window()
    made.page(1)
    made.click(editor.questions.add)
    made.page(3)
    before = copy.deepcopy(editor.draft.raw)
    boxes = {
        1: lambda: [editor.questions.table.cellWidget(0, 2)],
        2: lambda: [editor.stimuli.form.patch, editor.stimuli.form.adding, editor.stimuli.form.scaling],
        3: lambda: [editor.stages.form.rows.controls["kind"]],
    }
    for page, of_page in boxes.items():
        made.page(page)
        for box in of_page():
            place = QPointF(box.mapTo(window, box.rect().center()))
            for angle in (-120, 120):
                QTest.wheelEvent(window.windowHandle(), place, QPoint(0, angle))
                assert editor.draft.raw == before, box.accessibleName()
