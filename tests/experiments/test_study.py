"""A study goes from page to page, and stands where it stood when it is given its entries again."""

import pytest
from made_studies import first_answers, made_protocol, preset_protocol, trials, walked
from msgspec.structs import replace

from underfoot.errors import BadFile, BadValue
from underfoot.experiments.study import Study, is_over
from underfoot.experiments.table import rows_of
from underfoot.patch import preset_files


@pytest.mark.parametrize("name", preset_files.protocols())
def test_every_preset_runs_to_its_end_and_goes_on_from_anywhere(name):
    if name == "detection-bayesian":
        pytest.importorskip("questplus")
    study = Study(preset_protocol(name), "P1")
    pages = walked(study)
    assert study.page.share == 1.0
    assert ["Thank you" in f"{page.title} {page.text}" for page in (pages[-1], study.page)] == [True, False]  # once
    shares = [page.share for page in pages]
    assert shares == sorted(shares)
    for at in (0, 1, len(pages) - 1):
        again = Study(study.protocol, "P1", study.entries[:at])
        assert again.page == pages[at]
    half = Study(study.protocol, "P1", study.entries[: len(pages) // 2])
    assert walked(half) == pages[len(pages) // 2 :]


@pytest.mark.parametrize("name", sorted(set(preset_files.protocols()) - {"detection-bayesian"}))
def test_a_pilot_has_two_trials_of_each_stage(name):
    study = Study(preset_protocol(name).pilot(), "1")
    pages = walked(study)
    counted = [page.stage for page in pages if page.trial is not None]
    assert all(counted.count(stage.id) == 2 for stage in study.protocol.stages if stage.kind == "trials")
    assert not [page for page in pages if page.kind == "pause" and page.title == "Pause"]
    assert "participant" not in [page.stage for page in pages]
    assert Study(study.protocol, "1", study.entries).page == study.page


def test_a_rest_comes_after_so_many_trials_without_a_pause_also_within_a_block():
    """Seven stimuli a block: a rest behind four; the pause behind the block begins the count anew."""
    stimuli = {f"S{k}": {"patch": "stimulus-td"} for k in range(7)}
    study = Study(made_protocol("rating", {"blocks": 2}, stimuli, block_pause_s=60.0, rest_s=20.0, rest_every=4), "P1")
    pages = walked(study)
    paused = {k: page.seconds for k, page in enumerate(pages) if page.kind == "pause"}
    assert paused == {4: 20.0, 8: 60.0, 13: 20.0}
    assert walked(Study(study.protocol, "P1", study.entries[:5])) == pages[5:]
    unpaused = walked(Study(made_protocol("rating", {"blocks": 2}, stimuli, rest_s=20.0, rest_every=7), "P1"))
    assert [k for k, page in enumerate(unpaused) if page.kind == "pause"] == [7]
    ended = [replace(study.protocol.stages[0], id=id, most_trials=4) for id in ("first", "second")]
    assert [page.kind for page in walked(Study(replace(study.protocol, stages=ended), "P1"))] == ["trials"] * 8


def test_who_does_not_agree_does_not_take_part():
    study = Study(preset_protocol("detection-threshold"), "P1")
    with pytest.raises(BadValue, match="who does not agree does not take part"):
        study.answer({"agreed": "no"})
    assert study.page.kind == "consent"


def test_a_spoiled_trial_is_presented_again_and_does_not_move_a_staircase():
    study = Study(made_protocol("staircases", {"followed": ["TD"]}), "P1")
    trial = study.page.trial
    entry = study.spoil("door slammed")
    assert (entry.spoiled, entry.attempt) == ("door slammed", 1)
    assert (study.page.trial, study.page.attempt) == (trial, 2)
    study.answer({"felt": "yes"})
    again = Study(study.protocol, "P1", study.entries)
    assert again.page == study.page
    assert study.page.attempt == 1


def test_the_last_answer_can_be_taken_back_for_a_reason():
    study = Study(made_protocol("staircases", {"followed": ["TD"]}), "P1")
    trial = study.page.trial
    study.answer({"felt": "yes"})
    before = study.without_last("pressed the wrong key")
    assert (before.page.trial, before.page.attempt) == (trial, 2)
    assert before.entries[-1].spoiled == "pressed the wrong key"
    with pytest.raises(BadValue, match="cannot be repeated; allowed: an answered trial"):
        before.without_last("again")
    with pytest.raises(BadValue, match="why it is repeated"):
        study.without_last(" ")


def test_answers_are_checked_and_a_wrong_one_leaves_all_as_it_was():
    study = Study(made_protocol("rating"), "P1")
    page = study.page
    for wrong in ({"rating": 101.0}, {"felt": "yes"}, {"rating": "much"}):
        with pytest.raises(BadValue):
            study.answer(wrong)
    assert study.page == page


def test_what_was_not_answered_is_no_answer():
    study = Study(made_protocol("rating", {"blocks": 1}), "P1")
    with pytest.raises(BadValue, match=r"Please answer: .* \(0 .* to 100"):
        study.answer({})
    assert not study.entries
    named = Study(made_protocol("free-labels", {"sorts": "knock, hum"}), "P1")
    assert named.answer({}).answers == {"label": ""}


def test_pauses_come_behind_blocks_and_long_ones_in_their_turn():
    study = Study(preset_protocol("compliance-rating"), "P1")
    pauses = [(page.seconds, page.stage) for page in walked(study) if page.kind == "pause"]
    assert pauses == [(120.0, "main")] * 5 + [(300.0, "main")] + [(120.0, "main")] * 5


def test_feedback_names_the_right_number():
    study = Study(preset_protocol("identification-impact"), "P1")
    while study.page.trial is None:
        study.answer(first_answers(study.page))
    correct = study.page.trial.correct
    study.answer({"number": correct % 8 + 1})
    assert study.page.feedback == f"The last one: it was {correct}."
    study.answer({"number": study.page.trial.correct})
    assert study.page.feedback == "The last one: right."


def test_entries_of_another_participant_or_protocol_are_refused():
    study = Study(preset_protocol("detection-threshold"), "P1")
    walked(study, most=30)
    begun = "go on with the protocol, the participant and the version"
    with pytest.raises(BadFile, match=begun):
        Study(study.protocol, "P2", study.entries)
    of_earlier = replace(study.entries[-1], answers={**study.entries[-1].answers, "sort": "impact"})
    with pytest.raises(BadFile, match=f"does not ask for sort; {begun}"):
        Study(study.protocol, "P1", [*study.entries[:-1], of_earlier])
    with pytest.raises(BadFile):
        Study(preset_protocol("compliance-rating"), "P1", study.entries)


def test_the_level_of_a_participant_is_never_above_the_protocols():
    study = Study(preset_protocol("identification-impact"), "P1")
    while study.page.kind != "level":
        study.answer(first_answers(study.page))
    with pytest.raises(BadValue):
        study.answer({"gain_db": 1.0})
    study.answer({"gain_db": -6.0})
    assert study.gain_db == -6.0


def test_answers_to_questions_can_be_taken_back():
    """Who typed a wrong age, or the wrong foot, from which buttons follow, had to begin anew under another id."""
    protocol = preset_protocol("target-selection")
    study, at_once = (Study(protocol, "P1") for _ in range(2))
    for one in (study, at_once):
        one.answer({"agreed": "yes"})
        with pytest.raises(BadValue, match="cannot be repeated"):
            one.without_last("who agrees can stop instead")
    study.answer({"age": 52, "foot": "right"})
    at_once.answer({"age": 25, "foot": "left"})
    back = study.without_last("it is 25, and the left one")
    assert ([one.name for one in back.page.questions], back.page.attempt) == (["age", "foot"], 2)
    back.answer({"age": 25, "foot": "left"})
    again = Study(protocol, "P1", back.entries)
    pages = walked(again, most=5)
    assert trials(pages, "practice") == trials(walked(at_once, most=5), "practice") != []
    row = rows_of(protocol, "P1", again.entries)[0]
    assert (row["participant.age"], row["participant.foot"]) == (25, "left")


def test_a_level_and_last_answers_that_were_taken_back_count_no_more():
    """A level that was kept too early held for the whole session."""
    protocol = preset_protocol("identification-impact")
    study = Study(protocol, "P1")
    while study.page.kind != "level":
        study.answer(first_answers(study.page))
    study.answer({"gain_db": -3.0})
    assert study.without_last("kept too early").gain_db == 0.0
    while study.page.kind != "questions":
        study.answer(first_answers(study.page))
    study.answer({**first_answers(study.page), "comfort": 5})
    back = study.without_last("it was 4")
    assert (is_over(protocol, "P1", study.entries), is_over(protocol, "P1", back.entries)) == (True, False)
    assert not any("participant.after.comfort" in row for row in rows_of(protocol, "P1", back.entries))
