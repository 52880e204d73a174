"""Answers by foot: which floors have the fields, which steps are answers, and a whole session of them."""

import pytest
from made_studies import TD, made_protocol
from people import taking_part

from underfoot.errors import BadFile, BadValue
from underfoot.experiments.foot import FootAnswer
from underfoot.experiments.questions import felt_or_stronger
from underfoot.experiments.study import method_of
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import default_floor
from underfoot.parameters import Count, Number
from underfoot.studies.foot_answers import FootAnswers, fields_on
from underfoot.studies.phase import Phase
from underfoot.studies.target import FloorTarget

FLOOR = default_floor(2, 2)
QUESTION = felt_or_stronger("Which one?", are_two=True)


def foot_on(tile, x_m=0.0, force_n=300.0, start_s=10.5):
    x, y = FLOOR.tiles[tile].to_floor((x_m, 0.0))
    return OngoingContact(1, x, y, force_n, (tile,), start_s)


def watched(rule="dwell", by="tiles", one=QUESTION, **foot):
    return FootAnswers(FootAnswer(rule=rule, by=by, dwell_s=0.5, **foot), one, FLOOR, 10.0)


def answers(watch, *moments):
    """What was answered, given (contacts, seconds) one after the other."""
    return [watch.judged(contacts, now_s) for contacts, now_s in moments]


def test_a_foot_that_stays_on_a_tile_answers_once_the_time_is_up():
    found = answers(watched(), ([], 10.0), ([foot_on(1)], 11.0), ([foot_on(1)], 11.49), ([foot_on(1)], 11.5))
    assert found == [None, None, None, {"interval": "second"}]


def test_a_foot_that_goes_on_to_another_tile_begins_anew():
    watch = watched()
    assert answers(watch, ([foot_on(0)], 11.0), ([foot_on(1)], 11.4), ([foot_on(1)], 11.8)) == [None] * 3
    assert watch.judged([foot_on(1)], 11.9) == {"interval": "second"}
    assert watch.facts == {"answered_by": "foot", "foot_after_s": 1.4}


def test_release_answers_when_the_foot_has_left_and_not_when_it_was_too_short():
    watch = watched("release")
    assert answers(watch, ([foot_on(0)], 11.0), ([], 11.2)) == [None, None]
    moments = ([foot_on(0)], 12.0), ([foot_on(0)], 12.6), ([], 12.7)
    assert answers(watch, *moments) == [None, None, {"interval": "first"}]


@pytest.mark.parametrize("contacts", [
    [foot_on(0, force_n=99.0)], [foot_on(0), foot_on(1)], [foot_on(3)], [foot_on(0, start_s=9.0)],
], ids=["too light", "two feet", "no field", "there before"])  # fmt: skip
def test_what_is_no_answer(contacts):
    assert answers(watched(), *((contacts, 10.0 + 0.1 * k) for k in range(20))) == [None] * 20


def test_who_stood_on_a_field_before_the_question_is_asked_to_step_off():
    watch = watched()
    hints = []
    for contacts in ([foot_on(0, start_s=9.0)], [foot_on(3, start_s=9.0)], [], [foot_on(0)]):  # on t4 is no field
        watch.judged(contacts, 11.0)
        hints.append(watch.hint)
    on = "Step on your answer."
    assert hints == [f"Please step off first. {on}", on, on, on]


def test_halves_of_a_tile_have_a_strip_between_them():
    found = []
    for x_m in (-0.07, -0.01, 0.01, 0.07):
        watch = watched(by="halves", tiles=("t3",))
        found.append(answers(watch, ([foot_on(2, x_m)], 11.0), ([foot_on(2, x_m)], 11.6))[1])
    assert found == [{"interval": "first"}, None, None, {"interval": "second"}]


def test_the_tiles_of_a_slider_are_spread_over_it_and_numbers_need_a_tile_each():
    rating = fields_on(FootAnswer(), Number(50.0, 0.0, 100.0), FLOOR)
    assert [field.value for field in rating] == pytest.approx([0.0, 100 / 3, 200 / 3, 100.0])
    assert [field.value for field in fields_on(FootAnswer(tiles=("t4", "t1")), Count(1, 1, 2), FLOOR)] == [1, 2]
    with pytest.raises(BadValue, match="8 answers by foot need 8 tiles, and there are 4"):
        fields_on(FootAnswer(), Count(1, 1, 8), FLOOR)
    with pytest.raises(BadValue, match=r"foot.tiles is 't9'; allowed: tiles of the floor: t1, t2, t3, t4"):
        fields_on(FootAnswer(tiles=("t9",)), Count(1, 1, 2), FLOOR)


@pytest.mark.parametrize(("kind", "foot", "says"), [
    ("free-labels", {}, "what is asked cannot be answered by foot"),
    ("absolute-identification", {"by": "halves", "tiles": ["t1", "t1"]}, "allowed: ids of tiles, each once"),
    ("absolute-identification", {"tiles": ["t1"]}, "allowed: at least 2, one for each answer"),
    ("rating", {"dwell_s": 0.0}, "dwell_s"),
])  # fmt: skip
def test_a_protocol_that_a_foot_cannot_answer_is_refused(kind, foot, says):
    with pytest.raises(BadFile, match=r"stages\[0\].*" + says):
        made_protocol(kind, foot=foot)


@pytest.mark.parametrize("rule", ["dwell", "release"])
def test_a_session_is_answered_by_foot_from_first_to_last_trial(rule, session, until, tmp_path):
    """Steps on the simulated tile begin a trial, and steps on its halves answer it."""
    wanted = ["yes", "no"]
    foot = {"by": "halves", "rule": rule, "dwell_s": 0.2}
    protocol = made_protocol("constant-stimuli", {"blocks": 1}, {"TD": TD, "X": {}}, start="step", foot=foot)
    with taking_part(session, protocol, tmp_path / "a.session", until) as person:
        runner = person.runner
        for word in wanted:
            person.until_phase(Phase.READY)
            person.step(0.15)
            person.until_phase(Phase.ANSWERING)
            before = len(runner.study.entries)
            person.press(500.0, -0.08 if word == "yes" else 0.08)
            if rule == "release":
                person.until(lambda: runner.foot.share >= 1.0, "the foot stays")
                assert runner.foot.on.value == word
                person.press(0.0)
            person.until(lambda n=before: len(runner.study.entries) > n, "the foot answers")
            person.press(0.0)
        entries = runner.file.entries()
    assert [entry.answers["felt"] for entry in entries] == wanted
    assert all(entry.facts["answered_by"] == "foot" for entry in entries)
    assert all(0.0 <= entry.facts["foot_after_s"] <= entry.facts["response_s"] + 0.1 for entry in entries)


def test_a_floor_without_the_fields_is_refused_before_the_first_page(session, until, tmp_path):
    protocol = made_protocol("rating", {"blocks": 1}, {"TD": TD}, foot={})
    with (
        pytest.raises(BadValue, match="stage 'main': 2 answers by foot need 2 tiles, and there are 1"),
        taking_part(session, protocol, tmp_path / "a.session", until),
    ):
        pass


def test_a_foot_that_stands_where_a_button_appears_has_not_pressed_it_until_it_comes_again():
    """It was selected at once, 0 s after its appearance, by who had not stepped back from the one before."""
    protocol = made_protocol("target-selection", {"repeats": 1})
    given = protocol.stages[0].method.given(protocol.stimuli)
    trial = method_of(protocol, protocol.stages[0], "P1").trial
    x_m, y_m = trial.facts["x_m"], trial.facts["y_m"]
    stands = OngoingContact(1, x_m, y_m, 300.0, (0, 1), 9.0, loads=(3, 4))
    has_left_a_tile = OngoingContact(1, x_m, y_m, 300.0, (1,), 9.1, loads=(4,))
    came = OngoingContact(2, x_m, y_m, 300.0, (1,), 10.4, loads=(5,))
    button = FloorTarget.of(trial, given, 10.0, 10.0, [stands])
    assert button.judged([stands], 10.0, 10.0) is button.judged([has_left_a_tile], 10.2, 10.2) is None
    assert button.judged([came], 10.5, 10.5) == {"selected": "yes", "time_s": 0.5}
