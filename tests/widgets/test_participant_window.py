"""The participant's window by real keys and clicks: questions of many kinds, as people ask them."""

import pytest
from made_studies import TD
from PySide6.QtCore import QEvent, QPoint, QPointF, QSize, Qt
from PySide6.QtGui import QKeyEvent, QWheelEvent
from PySide6.QtWidgets import QApplication, QLabel, QPushButton

from underfoot.studies.phase import Phase
from underfoot.widgets.experiment.participant_window import WIDTH_PX


def ask(bench, *questions, **stage):
    """Begin a study that asks these questions first, and return the form of the participant's window."""
    rating = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}
    stages = [{"id": "asked", "kind": "questions", "questions": questions, **stage}, rating]
    bench.choose(stages=stages, stimuli={"TD": TD, "X": {}})
    bench.until(Phase.PAGE)
    return bench.person.form


def tired(**changes):
    return {"name": "tired", "text": "How tired are you?", "kind": "count", "low": 0, "high": 7, **changes}


def chosen(*options):
    return {"name": "which", "text": "Which one?", "kind": "choice", "options": options}


def turn(person, eighths):
    """Turn the wheel beside what is scrolled, by eighths of a degree: 120 are a notch."""
    beside = QPointF(4.0, 300.0)
    turned = QWheelEvent(
        beside, person.mapToGlobal(beside), QPoint(), QPoint(0, eighths), Qt.MouseButton.NoButton,
        Qt.KeyboardModifier.NoModifier, Qt.ScrollPhase.NoScrollPhase, False,
    )  # fmt: skip
    QApplication.sendEvent(person, turned)


def ask_one_by_one(bench, *questions):
    """Begin a study with a page for each question."""
    stages = [{"id": f"asked{k}", "kind": "questions", "questions": [one]} for k, one in enumerate(questions)]
    rating = {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}}
    bench.choose(stages=[*stages, rating], stimuli={"TD": TD, "X": {}})
    bench.until(Phase.PAGE)


def last_answer(bench, shown):
    """The answer on the page that was shown, once the next one is."""
    bench.wait(lambda: bench.person.shown != shown)
    (answer,) = bench.entries()[-1].answers.values()
    return answer


def test_the_number_that_is_read_on_a_button_answers_it(bench):
    asked = (
        (tired(), "5", 5),
        (tired(), "0", 0),
        (tired(low=1, high=7), "7", 7),
        (chosen("0", "2", "4"), "2", "2"),
        (chosen("never", "seldom", "often"), "2", "seldom"),
        (chosen("1 = not at all", "2", "3 = very"), "3", "3 = very"),
    )
    ask_one_by_one(bench, *(question for question, _, _ in asked))
    for _, keys, answer in asked:
        shown = bench.person.shown
        bench.qtbot.keyClicks(bench.person, keys)
        assert last_answer(bench, shown) == answer


def test_a_key_that_is_held_down_answers_and_begins_nothing(bench):
    """Held from before the question on, it answered as soon as that was asked, and so one trial after another."""
    form = ask(bench, tired())

    def hold(widget, key, text):
        event = QKeyEvent(QEvent.Type.KeyPress, key.value, Qt.KeyboardModifier.NoModifier, text, True)
        QApplication.sendEvent(widget, event)

    hold(bench.person, Qt.Key.Key_5, "5")
    assert not bench.entries()
    bench.key(Qt.Key.Key_5)
    bench.until(Phase.READY)
    for view in (bench.person, bench.workspace.experimenter):
        hold(view, Qt.Key.Key_Space, " ")
    assert bench.runner.phase is Phase.READY
    bench.key(Qt.Key.Key_Space)
    bench.until(Phase.ANSWERING)
    for _ in range(3):
        hold(bench.person, Qt.Key.Key_Right, "")
    assert next(iter(form.sliders.values())).position() > 0.55  # arrows move as long as they are held


def test_a_double_click_answers_one_page(bench):
    """The second click went on from the next page, such as an instruction, before anybody had seen it."""
    read = [{"id": f"read{k}", "kind": "read", "text": "Read this."} for k in (1, 2, 3)]
    bench.choose(stages=read, stimuli={"TD": TD})
    bench.until(Phase.PAGE)
    experimenter = bench.workspace.experimenter

    def double_click(button, then):
        bench.click(button)
        bench.until(then)
        for event in (bench.qtbot.mouseDClick, bench.qtbot.mouseRelease):
            event(button, Qt.MouseButton.LeftButton)
        assert bench.runner.phase is then

    double_click(bench.person.go, Phase.PAGE)
    assert [entry.stage for entry in bench.entries()] == ["read1"]
    double_click(experimenter.next, Phase.PAGE)
    assert len(bench.entries()) == 2
    double_click(experimenter.pause, Phase.STOPPED)
    bench.click(experimenter.pause)
    bench.until(Phase.PAGE)
    for event in (bench.qtbot.mouseDClick, bench.qtbot.mouseRelease):  # frightened: Stop always stops
        event(experimenter.pause, Qt.MouseButton.LeftButton)
    bench.until(Phase.STOPPED)
    bench.click(experimenter.pause)
    bench.until(Phase.PAGE)
    bench.click(bench.person.go)
    assert len(bench.entries()) == 3


def test_a_page_of_several_questions_is_answered_by_numbers_from_its_first_to_its_last(bench):
    """The focus was in the text below, out of sight: numbers went there, and buttons had Tab alone."""
    words = {"name": "words", "text": "What else?", "kind": "text"}
    ask(bench, tired(high=5), chosen("never", "seldom", "often"), tired(name="again"), words, title="Afterwards")
    person = bench.person
    bench.wait(lambda: person.scrolled.verticalScrollBar().maximum() == 0)
    assert person.hint.text().startswith("Numbers choose and go on to the next question")
    assert person.accessibleName() == f"Afterwards {person.hint.text()}"
    controls = [*person.form.buttons, *person.form.fields.values()]
    heard = {control.accessibleDescription() or control.accessibleName() for control in controls}
    assert heard == {"How tired are you?", "Which one?", "What else?"}  # a screen reader said 3 alone, and Words
    assert not person.text.isVisible()  # an empty line of it took the room of the last question
    for key in "32":
        bench.qtbot.keyClicks(person.focusWidget(), key)
    bench.qtbot.keyClick(person.focusWidget(), Qt.Key.Key_Return)  # refused: what lacks an answer has the focus
    assert person.hint.text() == "Please answer: How tired are you? (whole numbers 0 to 7)"
    bench.qtbot.keyClicks(person.focusWidget(), "7")
    assert person.hint.text().startswith("Numbers choose")  # what is answered was still asked for
    bench.qtbot.keyClicks(person.focusWidget(), "3 times")
    bench.qtbot.keyClick(person.focusWidget(), Qt.Key.Key_Tab)
    assert person.focusWidget() is person.go  # who has no mouse found no button
    bench.qtbot.keyClick(person.go, Qt.Key.Key_Backtab)
    bench.qtbot.keyClick(person.focusWidget(), Qt.Key.Key_Return)
    bench.wait(bench.entries)
    assert bench.entries()[0].answers == {"tired": 3, "which": "seldom", "again": 7, "words": "3 times"}


def test_the_page_is_hidden_while_a_screen_is_away_if_it_filled_it(bench):
    """One beside the experimenter's window, which the system moves along with it, was gone for the participant."""
    ask(bench, tired())
    app, person = QApplication.instance(), bench.person
    app.screenRemoved.emit(person.screen())
    assert person.isVisible()
    person.show_on(person.screen())
    app.screenRemoved.emit(person.screen())
    assert person.isHidden()
    bench.click(bench.workspace.experimenter.window_button)
    assert (person.isVisible(), person.isFullScreen()) == (True, False)


def test_numbers_of_two_digits_are_typed_and_answered_by_return(bench):
    typed = (("1", 1), ("10", 10), ("50", 0), ("37", 7))
    ask_one_by_one(bench, *[tired(high=10)] * 4)
    for count, (keys, answer) in enumerate(typed):
        shown = bench.person.shown
        assert bench.person.hint.text() == "Type a number from 0 to 10 and press Return, or click."
        bench.qtbot.keyClicks(bench.person, keys)
        assert [button.text() for button in bench.person.form.buttons if button.isChecked()] == [str(answer)]
        assert len(bench.entries()) == count
        bench.key(Qt.Key.Key_Return)
        assert last_answer(bench, shown) == answer


def test_a_screen_reader_says_the_value_of_a_slider_that_has_a_unit(bench):
    form = ask(
        bench, {"name": "level", "text": "How loud is it?", "kind": "number", "low": 0, "high": 20, "unit": "dB"}
    )
    bench.wait(lambda: form.sliders)
    slider = form.sliders["level"]
    assert not slider.accessibleDescription()  # nothing is answered yet
    bench.key(Qt.Key.Key_Right)
    assert slider.accessibleDescription() == "0.4 dB"


def test_a_level_is_moved_by_keys_buttons_and_the_wheel_and_is_an_answer_once_it_was(bench):
    """It is felt, and not seen: no number, and no place."""
    form = ask(bench, id="asked", kind="level", stimulus="TD")
    bench.wait(lambda: form.is_adjusted)
    bench.key(Qt.Key.Key_Return)
    assert bench.person.hint.text() == "Move it to answer: Lower it until you only just feel it."
    bench.key(Qt.Key.Key_Up)
    bench.wait(lambda: bench.person.title.text() == "It goes no further")
    bench.key(Qt.Key.Key_Return)
    assert bench.person.hint.text().startswith("Move it to answer")  # it was not moved, and nobody said so
    less = next(button for button in form.findChildren(QPushButton) if button.text() == "Less")
    for move in (
        lambda: bench.key(Qt.Key.Key_Down),
        lambda: bench.key(Qt.Key.Key_Left),
        lambda: bench.qtbot.mouseClick(less, Qt.MouseButton.LeftButton),
        lambda: [turn(bench.person, eighths) for eighths in (-60, -60, 120, 120)],
    ):
        move()
    assert bench.runner.adjusting.value == -2.5
    assert not [label.text() for label in bench.person.findChildren(QLabel) if "dB" in label.text()]
    bench.wait(lambda: not bench.person.hint.text().startswith("Move it"))
    bench.qtbot.keyClick(bench.workspace.experimenter, Qt.Key.Key_Return)  # who is told that it is right
    bench.until(Phase.READY)
    assert bench.entries()[0].answers["gain_db"] == -2.5


def test_space_plays_the_standard_and_what_is_adjusted_in_turn(bench):
    parameters = {"followed": ["TD"], "standard": "S", "blocks": 1, "question": "Make both equal."}
    stage = {"id": "main", "kind": "trials", "method": {"kind": "adjustment", "parameters": parameters}}
    bench.choose(stages=[stage], stimuli={"TD": TD, "S": TD})
    for _ in range(2):
        bench.until(Phase.READY)
        bench.key(Qt.Key.Key_Space)
        bench.until(Phase.ANSWERING)
        assert bench.person.hint.text().endswith("Return when it is right. Space plays the other one.")
        for key, told in (
            (Qt.Key.Key_Space, "The one to compare with"),
            (Qt.Key.Key_Right, "The one to set"),
            (Qt.Key.Key_Space, "The one to compare with"),
            (Qt.Key.Key_Space, "The one to set"),
        ):
            bench.key(key)
            bench.wait(lambda told=told: bench.person.title.text() == told)
        for told in ("The one to compare with", "The one to set"):  # on a touch screen
            bench.click(bench.person.again)
            bench.wait(lambda told=told: bench.person.title.text() == told)
        bench.key(Qt.Key.Key_Return)
    bench.until(Phase.END)
    assert not bench.person.again.isVisible()
    for entry in bench.entries():
        assert entry.answers["level_db"] == pytest.approx(entry.trial.facts["start_at"] + 0.5)
        assert (entry.facts["changes"], entry.facts["standard_plays"]) == (1, 3)


def test_return_presses_the_button_that_has_the_focus_and_keeps_a_note(bench):
    """It began the trial: beside Stop, and with a note that was kept."""
    form = ask(bench, chosen("yes", "no"))
    agreed = form.buttons[0]
    agreed.setFocus()
    bench.qtbot.keyClick(agreed, Qt.Key.Key_Return)
    bench.until(Phase.READY)
    assert bench.entries()[0].answers == {"which": "yes"}
    desk = bench.workspace.experimenter
    desk.note_field.setFocus()
    bench.qtbot.keyClicks(desk.note_field, "shoes changed")
    bench.qtbot.keyClick(desk.note_field, Qt.Key.Key_Return)
    assert [note.text for note in bench.runner.file.notes()][-1] == "shoes changed"
    assert bench.runner.phase is Phase.READY
    assert desk.focusWidget() is desk  # so that the next Return goes on
    desk.pause.setFocus()
    bench.qtbot.keyClick(desk.pause, Qt.Key.Key_Return)
    assert bench.runner.phase is Phase.STOPPED


def test_a_free_number_is_typed_and_zero_is_refused(bench):
    """A slider would suggest a range."""
    use = {"kind": "magnitude-estimation", "parameters": {"blocks": 1}}
    bench.choose(stages=[{"id": "main", "kind": "trials", "method": use}], stimuli={"TD": TD, "X": {}})
    for typed, answer in (("0", None), ("12,5", 12.5), ("0.02", 0.02)):
        if answer != 12.5:  # the refused number is selected, and typed over
            bench.until(Phase.READY)
            bench.key(Qt.Key.Key_Space)
            bench.until(Phase.ANSWERING)
        bench.qtbot.keyClicks(bench.person.focusWidget(), typed)
        bench.qtbot.keyClick(bench.person.focusWidget(), Qt.Key.Key_Return)
        if answer is None:
            assert "allowed: a number above 0" in bench.person.hint.text()
        else:
            bench.wait(lambda answer=answer: answer in [entry.answers["magnitude"] for entry in bench.entries()])


def test_the_words_of_every_answer_can_be_read(bench):
    words = ("strongly disagree", "neither agree nor disagree", "strongly agree", "salt & pepper", "rather not say")
    form = ask(bench, chosen(*words))
    for button, word in zip(form.buttons, words, strict=True):
        assert button.text().replace("&&", "&").endswith(word)
        width_px = button.fontMetrics().horizontalAdvance(word)
        bench.wait(lambda button=button, width_px=width_px: width_px < button.width() <= WIDTH_PX)
        assert button.shortcut().isEmpty()  # a single & would be a shortcut, and not be seen
    bench.click(form.buttons[3])
    bench.wait(bench.entries)
    assert bench.entries()[0].answers == {"which": "salt & pepper"}


def test_a_long_answer_is_read_to_its_end_in_several_lines(bench):
    long = "It began under the heel, went through the whole of the sole, and was over before the toes had left the tile"
    form = ask(bench, chosen(long, "no", "rather not say"))
    button = form.buttons[0]
    assert " ".join(button.text().split()) == f"1 {long}"
    size = button.fontMetrics().size(0, button.text())
    bench.wait(lambda: size.width() < button.width() <= WIDTH_PX and size.height() < button.height())
    bench.click(button)
    bench.wait(bench.entries)
    assert bench.entries()[0].answers == {"which": long}


def test_the_words_of_an_answer_can_be_read_on_a_narrow_screen(bench):
    words = ("under the heel ", "W", "踵の下から始まって", "🦶")
    longs = [(word * size)[:size].strip() for word in words for size in (50, 64)]
    ask_one_by_one(bench, *(chosen(long, "no", "rather not say") for long in longs))
    person = bench.person
    person.showNormal()
    for long in longs:
        shown, button = person.shown, person.form.buttons[0]

        def is_read(button=button):
            words = button.fontMetrics().size(0, button.text())
            is_whole = words.width() < button.width() and words.height() < button.height()
            assert seen(button)
            assert is_whole, f"{button.text()!r} on {person.width()} pixels"
            return True

        for width_px in (1280, 640, 1024):
            person.resize(width_px, 800)
            bench.wait(is_read)
            assert "".join(button.text().split()) == f"1{''.join(long.split())}"
        bench.click(button)
        assert last_answer(bench, shown) == long


def test_the_words_at_the_ends_of_a_slider_can_be_read_on_a_narrow_screen(bench):
    ends = {"low": "not compliant at all, at no time and in no way", "high": "the most compliant that I ever stood on"}
    bench.choose(
        stages=[{"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1, **ends}}}],
        stimuli={"TD": TD, "X": {}},
    )
    bench.person.showNormal()
    bench.person.resize(640, 800)
    bench.until(Phase.READY)
    bench.key(Qt.Key.Key_Space)
    bench.until(Phase.ANSWERING)
    words = [label for label in bench.person.form.findChildren(QLabel) if label.text() in ends.values()]
    assert len(words) == 2
    for label in words:
        bench.wait(lambda label=label: seen(label) and label.height() >= label.heightForWidth(label.width()))


def many(count):
    """So many questions to be answered in a field or by a button, by turns."""
    for number in range(count):
        yield tired(name=f"asked{number}", high=7 if number % 2 else 100)


def seen(widget):
    """Whether the whole widget is on the screen, in the participant's window."""
    return widget.visibleRegion().boundingRect() == widget.rect()


def test_a_page_taller_than_the_screen_scrolls_by_keys_and_wheel_and_can_be_answered(bench):
    form = ask(bench, *many(9))
    person, bar = bench.person, bench.person.scrolled.verticalScrollBar()
    person.showNormal()
    person.resize(1024, 600)
    fields, last = list(form.fields.values()), form.fields["asked8"]
    bench.wait(lambda: person.size() == QSize(1024, 600) and seen(fields[0]) and not seen(last))
    assert seen(person.go)
    assert seen(person.hint)

    bench.qtbot.keyClick(fields[0], Qt.Key.Key_PageDown)
    assert 0 < bar.value() < bar.maximum()
    person.setFocus()
    bench.qtbot.keyClick(person, Qt.Key.Key_End)
    assert bar.value() == bar.maximum()
    assert seen(last)
    bench.qtbot.keyClick(person, Qt.Key.Key_Home)
    assert bar.value() == 0
    turn(person, -120)
    assert bar.value() > 0
    for _ in range(40):  # and stays at the end
        turn(person, -120)
    assert bar.value() == bar.maximum()
    QApplication.sendEvent(person, QKeyEvent(QEvent.Type.KeyPress, 0x424, Qt.KeyboardModifier.NoModifier, "Ф"))

    fields[0].setFocus()
    while person.focusWidget() is not last:
        bench.qtbot.keyClick(person.focusWidget(), Qt.Key.Key_Tab)
        assert seen(person.focusWidget())
    for field in fields[1:]:
        bench.qtbot.keyClicks(field, "37")
    for button in form.buttons:
        if button.text() == "3":
            button.click()
    assert not seen(fields[0])
    bench.key(Qt.Key.Key_Return)  # refused: the field that is empty comes into sight
    assert person.focusWidget() is fields[0]
    bench.wait(lambda: seen(fields[0]))
    bench.qtbot.keyClicks(fields[0], "12")
    bench.click(person.go)
    bench.wait(bench.entries)
    answers = bench.entries()[0].answers
    assert (answers["asked0"], answers["asked8"], answers["asked7"]) == (12, 37, 3)


def test_a_long_text_can_be_read_to_its_end_and_a_short_one_stands_in_the_middle(bench):
    ask(bench, tired(), text="You will stand on a tile. " * 200)
    person, bar = bench.person, bench.person.scrolled.verticalScrollBar()
    bench.wait(lambda: bar.maximum() > 0 and not seen(person.form.buttons[0]))
    bench.qtbot.keyClick(person, Qt.Key.Key_End)
    bench.wait(lambda: all(seen(button) for button in person.form.buttons))
    bench.qtbot.keyClicks(person, "5")
    bench.wait(bench.entries)
    bench.until(Phase.READY, Phase.PRESENTING, Phase.ANSWERING)
    bench.wait(lambda: bar.maximum() == 0)


def test_what_to_do_is_read_before_a_trial_and_what_was_right_after_the_last_of_a_block(bench):
    """The text of a stage of trials was never shown, nor feedback before a pause or another stage."""
    use = {"kind": "absolute-identification", "parameters": {"identified": ["TD", "X"], "sessions": 2, "repeats": 1}}
    stage = {"id": "main", "kind": "trials", "text": "Feel it, then name it.", "feedback": True, "practice": True}
    after = {"id": "thanks", "kind": "read", "text": "Thank you."}
    bench.choose(stages=[{**stage, "method": use, "block_pause_s": 600.0}, after], stimuli={"TD": TD, "X": {}})
    told = []
    for following in (Phase.READY, Phase.PAUSE, Phase.READY, Phase.PAGE):
        bench.until(Phase.READY)
        told.append((bench.person.title.text(), bench.person.text.text()))
        assert bench.workspace.experimenter.page.text().startswith("main  ·  practice, not counted  ·  trial ")
        bench.key(Qt.Key.Key_Space)
        bench.until(Phase.ANSWERING)
        bench.key(Qt.Key.Key_1)
        bench.until(following)
        if following is Phase.PAUSE:
            told.append((bench.person.title.text(), bench.person.text.text()))
            bench.click(bench.workspace.experimenter.next)
    told.append((bench.person.title.text(), bench.person.text.text()))
    said = [page.split("\n")[0] for _, page in told]
    assert said[0] == said[3] == "Feel it, then name it."
    assert {said[1], said[2]} == {said[4], said[5]} == {"The last one: right.", "The last one: it was 2."}
    assert [title for title, _ in told] == ["Practice", "Practice", "Pause", "Practice", "Practice", ""]
    assert told[-1][1].endswith("\n\nThank you.")
    bench.click(bench.workspace.experimenter.leave)  # who is thanked has come to the end
    assert bench.workspace.overview.state.text() == "P1 has come to the end of the study. The answers are kept."
    bench.type_id("P1")
    assert bench.workspace.overview.state.text().endswith(", and has come to the end. Somebody else needs another id.")


def test_a_foot_is_asked_nothing_while_the_study_is_stopped(bench):
    use = {"kind": "constant-stimuli", "parameters": {"blocks": 1, "question": "Felt it?"}}
    foot = {"by": "halves", "tiles": ["t1"]}
    bench.choose(stages=[{"id": "main", "kind": "trials", "foot": foot, "method": use}], stimuli={"TD": TD})
    bench.until(Phase.READY)
    bench.key(Qt.Key.Key_Space)
    bench.until(Phase.ANSWERING)
    bench.wait(lambda: (bench.person.text.text(), bench.person.foot.isVisible()) == ("Felt it?", True))
    bench.key(Qt.Key.Key_Escape)
    bench.until(Phase.STOPPED)
    assert (bench.person.text.text(), bench.person.foot.isVisible()) == ("", False)


def test_on_the_simulated_floor_space_presses_the_button_that_is_shown(bench):
    given = {"widths_m": [0.1], "distances_m": [0.05], "bearings_deg": [0.0], "repeats": 1, "sessions": 1,
             "origin_m": [0.1525, 0.1525], "visible_s": 60.0, "pause_s": 0.1}  # fmt: skip
    buttons = {"id": "main", "kind": "trials", "method": {"kind": "target-selection", "parameters": given}}
    bench.choose(stages=[buttons, {"id": "asked", "kind": "questions", "questions": [tired()]}])
    bench.wait(lambda: bench.runner.target is not None and bench.person.target is not None)
    bench.key(Qt.Key.Key_Space)
    bench.until(Phase.PAGE)
    assert not any(label.isVisible() for label in (bench.person.title, bench.person.text))  # questions have their room
    (entry,) = bench.entries()
    assert entry.answers["selected"] == "yes"
    bench.wait(lambda: not bench.runner.watch.is_loaded)  # the foot is off again
