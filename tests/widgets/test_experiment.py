"""The Experiment workspace by real clicks and keys, on a window that plays the simulated floor."""

import os
import signal
from contextlib import closing

import pytest
from made_studies import protocol_text
from on_screen import place_on
from PySide6.QtCore import Qt
from PySide6.QtWidgets import QMessageBox
from windows import dialog_of, threads_that_make

from underfoot.errors import BadFile
from underfoot.experiments.store import SessionFile
from underfoot.floor.contacts import ContactTracker
from underfoot.studies.equipment import EquipmentChoice
from underfoot.studies.phase import Phase
from underfoot.widgets.experiment.experimenter_view import WHY_FIRST
from underfoot.widgets.experiment.session_start import ANOTHER_ID, GO_ON

pytest.importorskip("statsmodels")
LEFT = Qt.MouseButton.LeftButton
CONSTANT = {"patch": "stimulus-wc", "scaled_by": "gain.gain", "measured_m_s2": 6.5, "level_m_s2": 2.0}
CONSENT = {"id": "consent", "kind": "consent", "title": "Taking part", "text": "You can stop at any time."}
AGE = {"name": "age", "text": "How old are you?", "kind": "count", "low": 18, "high": 99}


def rated(**stage):
    return {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}, **stage}


def test_a_pilot_on_oneself_goes_from_the_choice_to_the_end_by_keys(bench):
    bench.choose(stages=[CONSENT, rated()], participant=[AGE], stimuli={"WC": CONSTANT, "X": {}})
    bench.until(Phase.PAGE)
    assert bench.person.hint.text() == "Press 1 for yes or 2 for no, or click."
    bench.key(Qt.Key.Key_1)
    bench.wait(lambda: bench.person.form.fields)
    bench.qtbot.keyClicks(bench.person.form.fields["age"], "31")
    bench.qtbot.keyClick(bench.person.form.fields["age"], Qt.Key.Key_Return)
    bench.rate(trials=2)
    bench.until(Phase.END)
    answers = [entry.answers for entry in bench.entries()]
    assert answers[:2] == [{"agreed": "yes"}, {"age": 31}]
    assert [round(answer["rating"], 3) for answer in answers[2:]] == [52.0, 52.0]
    bench.wait(lambda: bench.workspace.experimenter.next.text() == "Back to the studies")
    assert bench.workspace.experimenter.page.text().endswith("100 %")
    bench.click(bench.workspace.experimenter.next)
    assert bench.person is None
    overview = bench.workspace.overview
    assert bench.workspace.stack.currentWidget() is overview
    assert bench.workspace.start.participant.text() == ""  # the next session is another's
    assert overview.state.text() == "P1 has come to the end of the study. The answers are kept."


def test_on_the_simulated_floor_somebody_stands_there_while_keys_begin_what_is_felt(bench):
    stages = [CONSENT, rated(), {"id": "rest", "kind": "questions", "questions": [AGE]}]
    bench.choose(stages=stages, stimuli={"WC": CONSTANT, "X": {}})
    bench.until(Phase.PAGE)
    assert not bench.runner.watch.contacts
    bench.runner.answer({"agreed": "yes"})
    for _ in range(2):
        bench.until(Phase.READY)
        bench.wait(lambda: bench.runner.watch.is_on)
        bench.key(Qt.Key.Key_Space)
        bench.until(Phase.ANSWERING)
        bench.key(Qt.Key.Key_Right)
        bench.key(Qt.Key.Key_Return)
    bench.until(Phase.PAGE)
    bench.wait(lambda: not bench.runner.watch.contacts)
    trials = [entry.facts for entry in bench.entries() if entry.trial]
    assert [facts["most_force_n"] > 300.0 for facts in trials] == [True, True]


def test_what_nobody_answered_is_asked_for_and_units_may_be_typed(bench):
    mass = {"name": "mass", "text": "What do you weigh?", "kind": "number", "low": 30, "high": 200, "unit": "kg"}
    foot = {"name": "foot", "text": "With which foot?", "kind": "choice", "options": ["right", "left"]}
    bench.choose(stages=[rated()], participant=[mass, foot], stimuli={"WC": CONSTANT})
    bench.until(Phase.PAGE)
    bench.wait(lambda: bench.person.form.fields)
    person = bench.person
    bench.click(person.go)
    assert person.hint.text() == "Please answer: What do you weigh? (30 to 200 kg)"
    bench.qtbot.keyClicks(person.form.fields["mass"], "7 stone")
    bench.click(person.go)
    assert person.hint.text() == "What do you weigh? The answer is '7 stone'; allowed: 30 to 200 kg"
    person.form.fields["mass"].clear()
    bench.qtbot.keyClicks(person.form.fields["mass"], "70,5 kg")
    bench.click(person.go)
    assert person.hint.text() == "Please answer: With which foot? (right, left)"
    assert not bench.runner.study.entries
    bench.click(person.form.buttons[1])
    bench.click(person.go)
    assert bench.runner.study.entries[0].answers == {"mass": 70.5, "foot": "left"}


def test_a_pilot_needs_one_click_and_the_space_bar_and_lies_apart(bench, monkeypatch):
    path = bench.folder / "made.json"
    many = {"kind": "rating", "parameters": {"blocks": 30}}
    path.write_text(protocol_text(stages=[{**rated(start="step"), "method": many}], stimuli={"WC": CONSTANT}))
    bench.workspace.study_list.open_protocol(path)
    tracks = threads_that_make(ContactTracker, monkeypatch)
    bench.click(bench.workspace.start.pilot_button)
    bench.wait(lambda: bench.person is not None and bench.person.isVisible())
    assert tracks[0] == "background"  # or the window's thread would compile, where the engine has not started yet
    for _ in range(2):
        bench.until(Phase.READY)
        assert bench.person.hint.text() == "Step on the tile. Space steps on the simulated floor."
        bench.key(Qt.Key.Key_Space)
        bench.until(Phase.ANSWERING)
        bench.key(Qt.Key.Key_Right)
        bench.key(Qt.Key.Key_Return)
    bench.until(Phase.END)
    bench.key(Qt.Key.Key_Space)
    assert bench.workspace.findings.analyse_button.text() == "Analyse 0 sessions"
    assert bench.workspace.overview.state.text().startswith("Pilot 1 is done.")
    file = SessionFile.open(bench.workspace.sessions.root / "made-pilot" / "1.session")
    assert [entry.facts["most_force_n"] > 300.0 for entry in file.entries()] == [True, True]
    file.close()


def test_a_step_with_the_mouse_on_the_simulated_floor_begins_a_trial(bench):
    bench.choose(stages=[rated(start="step")], stimuli={"WC": CONSTANT})
    desk = bench.workspace.experimenter
    bench.until(Phase.READY)
    tile = bench.window.controller.target.floor.tiles[0]
    bench.qtbot.mousePress(desk.map, LEFT, pos=place_on(desk.map, tile))
    bench.until(Phase.PRESENTING)
    bench.wait(lambda: bench.runner.watch.now_s > bench.runner.began_s + 0.3)
    bench.qtbot.mouseRelease(desk.map, LEFT, pos=place_on(desk.map, tile))
    bench.until(Phase.ANSWERING)
    slider = desk.form.sliders["rating"]
    assert desk.window().focusWidget() is desk  # so keys answer, and do not choose tiles
    bench.qtbot.keyClick(desk, Qt.Key.Key_Return)
    shown = bench.runner.watch.now_s
    bench.wait(lambda: bench.runner.watch.now_s > shown + 0.1)  # it was gone at the next tick
    assert desk.news.text() == "Move the slider to answer: How strong was it?"
    bench.qtbot.mouseClick(slider, LEFT, pos=slider.rect().center())
    bench.qtbot.keyClick(desk, Qt.Key.Key_Return)
    bench.until(Phase.END)
    (entry,) = bench.entries()
    assert entry.answers["rating"] == pytest.approx(50.0, abs=0.5)  # in the middle, where an unmoved one would be
    assert entry.facts["onset_after_step_s"] >= 0.0
    assert entry.facts["most_force_n"] > 300.0


def test_what_the_answers_say_is_drawn_while_the_study_runs(bench):
    parameters = {"identified": ["A", "B"], "sessions": 1, "repeats": 3}
    stage = {"id": "main", "kind": "trials", "method": {"kind": "absolute-identification", "parameters": parameters}}
    bench.choose(stages=[stage], stimuli={"A": CONSTANT, "B": {**CONSTANT, "level_m_s2": 1.0}})
    for _ in range(5):
        bench.until(Phase.READY)
        bench.key(Qt.Key.Key_Space)
        bench.until(Phase.ANSWERING)
        bench.key(Qt.Key.Key_1)
    bench.wait(lambda: bench.workspace.experimenter.drawings.plots)
    titles = [plot.drawing.title for plot in bench.workspace.experimenter.drawings.plots]
    assert titles == ["Learning", "All: confusions"]
    bench.workspace.running.background.join()


def test_where_words_are_typed_control_and_space_play_again(bench):
    stage = {"id": "main", "kind": "trials", "plays": 2, "method": {"kind": "free-labels", "parameters": {"sorts": ""}}}
    bench.choose(stages=[stage], stimuli={"WC": CONSTANT})
    bench.until(Phase.READY)
    bench.key(Qt.Key.Key_Space)
    bench.until(Phase.ANSWERING)
    assert bench.person.hint.text().endswith("Ctrl+Space plays it again (1 left).")
    field = bench.person.form.fields["label"]
    bench.qtbot.keyClicks(field, "a hum")
    bench.qtbot.keyClick(field, Qt.Key.Key_Space, Qt.KeyboardModifier.ControlModifier)
    bench.until(Phase.PRESENTING)
    bench.until(Phase.ANSWERING)
    field = bench.person.form.fields["label"]
    bench.qtbot.keyClicks(field, "a knock")
    bench.qtbot.keyClick(field, Qt.Key.Key_Return)
    bench.until(Phase.END)
    (entry,) = bench.entries()
    assert (entry.answers["label"], entry.facts["plays"]) == ("a knock", 2)


def test_words_are_learned_chosen_by_their_keys_and_told(bench):
    parameters = {"answers": ["sand", "snow", "ice"], "sessions": 1, "repeats": 1}
    main = {"id": "main", "kind": "trials", "method": {"kind": "absolute-identification", "parameters": parameters}}
    stages = [{"id": "learn", "kind": "learn"}, {**main, "feedback": True}]
    stimuli = {"a": {**CONSTANT, "correct": "snow"}, "b": {**CONSTANT, "correct": "ice"}}
    bench.choose(stages=stages, stimuli=stimuli)
    bench.until(Phase.PAGE)
    assert bench.person.text.text() == "1: snow,  2: ice"
    bench.key(Qt.Key.Key_Return)
    bench.until(Phase.READY)
    assert not bench.workspace.experimenter.repeat.isEnabled()  # nothing was answered
    bench.key(Qt.Key.Key_Space)
    bench.until(Phase.ANSWERING)
    assert [button.text() for button in bench.person.form.buttons] == ["1  sand", "2  snow", "3  ice"]
    bench.key(Qt.Key.Key_2)
    bench.until(Phase.READY)
    _, first = bench.entries()
    told = "The last one: right." if first.trial.correct == "snow" else "The last one: it was ice."
    assert (first.answers, bench.person.text.text()) == ({"answer": "snow"}, told)
    bench.wait(bench.workspace.experimenter.repeat.isEnabled)


def test_the_experimenter_ends_a_pause_with_the_button(bench):
    bench.choose(stages=[{"id": "rest", "kind": "pause", "seconds": 3600.0}, rated()], stimuli={"WC": CONSTANT})
    bench.until(Phase.PAUSE)
    desk = bench.workspace.experimenter
    bench.wait(lambda: desk.next.text() == "End the pause")
    bench.qtbot.keyClick(desk, Qt.Key.Key_Space)  # too easily hit
    assert bench.runner.phase is Phase.PAUSE
    bench.click(desk.next)
    bench.until(Phase.READY)
    bench.wait(lambda: desk.next.text() == "Next")
    bench.qtbot.keyClick(bench.window.focusWidget(), Qt.Key.Key_Space)  # with one keyboard, it is the participant's
    bench.until(Phase.PRESENTING, Phase.ANSWERING)


def test_stop_note_and_present_again_by_the_experimenter(bench):
    """F12, panic in each window, did nothing in the participant's, which has the keys."""
    bench.choose(stages=[rated()], stimuli={"WC": CONSTANT})
    desk = bench.workspace.experimenter
    bench.until(Phase.READY)
    for key, why in ((Qt.Key.Key_Escape, "Stopped by the participant."), (Qt.Key.Key_F12, "Stopped: panic.")):
        bench.key(key)
        assert (bench.runner.phase, bench.runner.hint) == (Phase.STOPPED, why)
        bench.wait(lambda: desk.pause.text() == "Go on")
        bench.click(desk.pause)
        bench.until(Phase.READY)
    away = (path := bench.runner.file.path).rename(path.with_suffix(".away"))
    bench.key(Qt.Key.Key_F12)  # its time cannot be noted, which was an error of the program
    assert bench.runner.phase is Phase.STOPPED
    assert "is not there any more" in bench.window.status.message
    away.rename(path)
    bench.wait(lambda: desk.pause.text() == "Go on")
    bench.click(desk.pause)
    bench.until(Phase.READY)
    bench.qtbot.keyClicks(desk.note_field, "shoes changed")
    bench.click(desk.note_button)
    assert not desk.spoil.isEnabled()  # nothing was felt that could be presented again
    bench.key(Qt.Key.Key_Space)
    bench.wait(desk.spoil.isEnabled)
    bench.click(desk.spoil)
    bench.wait(lambda: desk.news.text() == WHY_FIRST)
    bench.qtbot.keyClicks(desk.note_field, "fire drill")
    bench.click(desk.spoil)
    bench.wait(lambda: not desk.news.isVisible())
    bench.until(Phase.READY)
    assert bench.runner.page.attempt == 2
    bench.person.close()
    assert bench.window.status.message.endswith("“Participant's window” opens it again.")
    bench.click(desk.window_button)
    assert bench.person.isVisible()
    assert [note.text for note in bench.runner.file.notes()][-1] == "shoes changed"
    assert bench.entries()[0].spoiled == "fire drill"


def test_a_note_that_the_disk_refuses_stays_to_be_kept_later(bench, monkeypatch):
    def refuse(file, text):
        raise BadFile(f"{file.path} cannot be written: database or disk is full")

    bench.choose(stages=[rated()], stimuli={"WC": CONSTANT})
    desk = bench.workspace.experimenter
    bench.until(Phase.READY)
    bench.qtbot.keyClicks(desk.note_field, "shoes changed")
    with monkeypatch.context() as full:
        full.setattr(SessionFile, "add_note", refuse)
        bench.click(desk.note_button)
    assert desk.note_field.text() == "shoes changed"
    bench.click(desk.note_button)
    assert not desk.note_field.text()
    assert [note.text for note in bench.runner.file.notes()] == ["shoes changed"]


def test_leaving_and_coming_back_goes_on_at_the_next_trial(bench):
    bench.choose(stages=[CONSENT, rated()], stimuli={"WC": CONSTANT, "X": {}})
    bench.until(Phase.PAGE)
    yes = next(button for button in bench.person.form.buttons if button.text() == "yes")
    bench.click(yes)
    bench.until(Phase.READY)
    key = bench.runner.page.key
    bench.click(bench.workspace.experimenter.leave)
    assert bench.workspace.start.begin_button.text() == "Go on"
    said = bench.workspace.overview.state.text()  # so that nobody goes on with the session of somebody else
    assert said.startswith("P1 was begun on ")
    assert said.endswith(", and goes on there. Somebody else needs another id.")
    bench.begin()
    bench.until(Phase.READY)
    assert bench.runner.page.key == key


def test_equipment_is_not_opened_for_a_session_that_another_window_has(bench):
    """Its plate could be moved and its trigger taken away before that was found."""
    bench.choose(stages=[rated()], stimuli={"WC": CONSTANT})
    path = bench.runner.file.path
    bench.workspace.running.leave()
    start, state = bench.workspace.start, bench.workspace.overview.state
    start.equipment = EquipmentChoice(trigger=str(bench.folder / "no port"))
    with closing(SessionFile.open(path)) as other:
        other.hold()
        bench.click(start.begin_button)
        bench.wait(lambda: state.text().endswith("is gone on with in another window or terminal; end it there first"))
    bench.type_id("P2")
    bench.click(start.begin_button)
    bench.wait(lambda: "no port cannot be opened: " in state.text())
    assert (bench.window.controller.is_lent, start.begin_button.text()) == (False, "Begin")  # it left an empty session
    start.equipment = EquipmentChoice()


def test_a_sound_server_that_hangs_holds_no_window_up_and_its_study_can_be_stopped(bench, null_sink):
    start, running, state = bench.workspace.start, bench.workspace.running, bench.workspace.overview.state
    bench.choose(stages=[rated()], stimuli={"WC": CONSTANT}, sounds={"noise": "pink"})
    running.leave()
    start.equipment = EquipmentChoice(masking="")
    server = min(null_sink.threads())
    os.kill(server, signal.SIGSTOP)
    try:
        bench.click(start.begin_button)
        assert (state.text(), start.begin_button.text()) == ("Opening masking sound…", "Stop")
        bench.click(start.begin_button)
        assert (state.text(), start.begin_button.text()) == ("Stopped.", "Go on")
        assert not bench.window.controller.is_lent
    finally:
        os.kill(server, signal.SIGCONT)
        running.opener.join()
    bench.begin()
    bench.until(Phase.READY)
    assert not bench.runner.messages
    start.equipment = EquipmentChoice()


def test_the_window_asks_before_it_closes_on_a_participant(bench):
    bench.choose(stages=[rated()], stimuli={"WC": CONSTANT})
    bench.until(Phase.READY)
    bench.window.close()
    box = dialog_of(bench.window, QMessageBox)
    assert "answers are kept" in box.text()
    bench.click(next(button for button in box.buttons() if button.text() == "Go on with it"))
    assert bench.window.isVisible()
    assert bench.runner.phase is Phase.READY


def test_an_answer_that_the_disk_refuses_is_not_left_unasked(bench):
    """It was said when it was lost; and of the last one the window closed without a word."""
    bench.choose(stages=[CONSENT], stimuli={"WC": CONSTANT})
    bench.until(Phase.PAGE)
    path = bench.runner.file.path
    away = path.rename(path.with_suffix(".away"))
    bench.key(Qt.Key.Key_1)
    for leave in (bench.workspace.experimenter.leave.click, bench.window.close):
        leave()
        box = dialog_of(bench.window, QMessageBox)
        assert box.text().endswith("and go on. The last answer is lost if the study is left now.")
        bench.click(next(button for button in box.buttons() if button.text() == "Stay"))
        bench.wait(lambda box=box: not box.isVisible())
        assert bench.runner.phase is Phase.STOPPED
    away.rename(path)
    bench.click(bench.workspace.experimenter.leave)
    assert [entry.answers for entry in bench.entries()] == [{"agreed": "yes"}]


def test_the_patch_plays_again_behind_a_study(bench):
    patch = bench.window.controller.session.patch
    bench.choose(stages=[rated()], stimuli={"WC": CONSTANT})
    assert not bench.window.main_bar.target.isEnabled()
    bench.until(Phase.READY)
    assert bench.window.controller.session.patch != patch
    bench.click(bench.workspace.experimenter.leave)
    assert bench.window.controller.session.patch == patch
    assert bench.window.main_bar.target.isEnabled()


def test_a_session_of_a_study_that_was_changed_goes_on_with_the_earlier_form_where_the_person_says_so(bench):
    workspace, start = bench.workspace, bench.workspace.start
    bench.choose(stages=[CONSENT, rated()], stimuli={"WC": CONSTANT, "X": {}})
    bench.until(Phase.PAGE)
    bench.runner.answer({"agreed": "yes"})
    workspace.running.leave()
    (bench.folder / "made.json").write_text(protocol_text(stages=[CONSENT, rated(practice=True)]))
    workspace.study_list.open_protocol(bench.folder / "made.json")

    bench.type_id("P1")
    bench.click(start.begin_button)
    question = dialog_of(bench.window, QMessageBox)
    assert question.text() == "P1 was begun with an earlier form of this study. Go on with that one?"
    bench.click(next(button for button in question.buttons() if button.text() == ANOTHER_ID))
    assert bench.runner is None
    assert start.participant.selectedText() == "P1"  # what is typed next is another's id

    bench.click(start.begin_button)
    question = dialog_of(bench.window, QMessageBox)
    bench.click(next(button for button in question.buttons() if button.text() == GO_ON))
    bench.wait(lambda: bench.person is not None and bench.person.isVisible())
    assert bench.runner.protocol.stage("main").practice is False
    bench.rate(trials=2)
    bench.until(Phase.END)
    assert [entry.stage for entry in bench.entries()] == ["consent", "main", "main"]


def test_an_id_that_looks_like_a_name_is_refused(bench):
    start = bench.workspace.start
    start.participant.clear()
    bench.qtbot.keyClicks(start.participant, "Ann Other")
    assert not start.begin_button.isEnabled()
    assert "names are not asked for" in bench.workspace.overview.state.text()


def test_an_id_that_differs_from_one_with_a_session_in_letter_case_only_is_refused(bench):
    folder, start = bench.workspace.sessions.of(bench.workspace.study_list.study), bench.workspace.start
    folder.mkdir(parents=True)
    (folder / "P01.session").touch()
    for typed, can_begin, button in (("p01", False, "Begin"), ("P01", True, "Go on"), ("p012", True, "Begin")):
        bench.type_id(typed)
        assert (start.begin_button.isEnabled(), start.begin_button.text()) == (can_begin, button)
        assert ("P01 has a session already" in bench.workspace.overview.state.text()) is not can_begin


def test_a_session_file_of_another_id_is_not_gone_on_with(bench):
    study, start = bench.workspace.study_list.study, bench.workspace.start
    bench.workspace.sessions.claim(study)
    path = bench.workspace.sessions.path(study, "P2")
    SessionFile.create(path, study.protocol, "P1", study.folder).close()
    bench.type_id("P2")
    bench.click(start.begin_button)
    said = f"{path} is the session of P1, not of P2; rename the file, or type another id"
    assert bench.workspace.overview.state.text() == said


def test_a_protocol_that_was_edited_in_another_program_begins_as_its_file_says(bench):
    """It began as it was when the window read it, until the window was opened anew, and nobody knew."""
    path, state = bench.folder / "made.json", bench.workspace.overview.state
    bench.choose(title="First", stages=[rated()], stimuli={"WC": CONSTANT})
    bench.workspace.running.leave()
    path.write_text(protocol_text(title="Second", stages=[rated()], stimuli={"WC": CONSTANT}))
    bench.begin("P2")
    assert bench.runner.protocol.title == bench.workspace.overview.title.text() == "Second"
    bench.workspace.running.leave()
    path.write_text("{")
    for button in (bench.workspace.start.pilot_button, bench.workspace.start.begin_button):
        bench.type_id("P3")
        bench.click(button)
        assert bench.runner is None
        assert state.text().startswith(f"{path} ")
    path.unlink()
    bench.begin("P2")
    assert bench.runner.protocol.title == "Second"


def test_a_new_user_makes_a_study_and_runs_it_on_oneself(bench):
    """From the window of `make run` to a finished pilot of two trials: every action is a click or a key."""
    window, workspace, actions = bench.window, bench.workspace, []

    def key(widget, *keys):
        for one in keys:
            actions.append(one)
            bench.qtbot.keyClick(widget, one)

    bench.qtbot.keyClick(window, Qt.Key.Key_4, Qt.KeyboardModifier.ControlModifier)
    bench.click(workspace.study_list.new)
    bench.qtbot.keyClick(workspace.protocol_editor, Qt.Key.Key_S, Qt.KeyboardModifier.ControlModifier)
    bench.qtbot.keyClick(workspace.protocol_editor, Qt.Key.Key_Escape)
    actions += ["Ctrl+4", "New study…", "Ctrl+S", "Esc"]
    assert window.focusWidget() is workspace.start.participant
    key(workspace.start.participant, "P", "1", Qt.Key.Key_Return)
    bench.wait(lambda: bench.person is not None and bench.person.isVisible())
    for _ in range(2):
        bench.until(Phase.READY)
        key(bench.person, Qt.Key.Key_Space)
        bench.until(Phase.ANSWERING)
        key(bench.person, Qt.Key.Key_Right, Qt.Key.Key_Return)
    bench.until(Phase.END)
    key(bench.person, Qt.Key.Key_Return)
    assert bench.runner is None
    file = SessionFile.open(workspace.sessions.root / "my-study" / "P1.session")
    assert [round(entry.answers["rating"]) for entry in file.entries()] == [52, 52]
    file.close()
    assert workspace.findings.analyse_button.text() == "Analyse 1 session"
    assert len(actions) == 14


def test_a_foot_of_the_mouse_on_the_simulated_floor_answers_in_the_participants_window(bench):
    foot = {"by": "halves", "tiles": ["t1"], "dwell_s": 0.3}
    stage = {"id": "main", "kind": "trials", "foot": foot,
             "method": {"kind": "constant-stimuli", "parameters": {"blocks": 1, "question": "Felt it?"}}}  # fmt: skip
    bench.choose(stages=[stage], stimuli={"WC": CONSTANT})
    bench.until(Phase.READY)
    bench.key(Qt.Key.Key_Space)
    bench.until(Phase.ANSWERING)
    assert bench.person.foot.isVisible()
    assert not bench.person.form.isVisible()
    # Where the simulated foot's leaving and this press come in one block, no sample between them is without load.
    bench.wait(lambda: not bench.runner.watch.is_loaded)
    bench.wait(lambda: bench.person.hint.text() == "Step on your answer.")
    assert bench.person.text.text() == "Felt it?"
    floor_map, tile = bench.workspace.experimenter.map, bench.window.controller.target.floor.tiles[0]
    place = place_on(floor_map, tile, 0.08)
    bench.qtbot.mousePress(floor_map, LEFT, pos=place)
    bench.until(Phase.END)
    bench.qtbot.mouseRelease(floor_map, LEFT, pos=place)
    (entry,) = bench.entries()
    assert (entry.answers, entry.facts["answered_by"]) == ({"felt": "no"}, "foot")
