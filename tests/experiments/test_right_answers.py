"""Right answers: from a column of a table to feedback, scores in the table of trials, and shares by condition."""

import pytest
from made_studies import TD, made_protocol, walked
from msgspec import structs

from underfoot.errors import BadFile
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.conditions import with_conditions
from underfoot.experiments.simulation import SimulationSettings, jobs_of, simulate, simulated_rows, summaries
from underfoot.experiments.study import Study
from underfoot.experiments.table import rows_of

TABLE = "stimulus,like,level_m_s2,place,corrAns\nsoft,TD,0.2,heel,snow\nfirm,TD,0.6,heel,sand\nhard,TD,0.8,toe,sand\n"
WORDS = {"answers": ["sand", "snow", "ice"], "sessions": 2, "repeats": 2}


@pytest.fixture
def words(tmp_path):
    path = tmp_path / "conditions.csv"
    path.write_text(TABLE)
    stimuli = {"TD": {**TD, "correct": "ice"}, "X": {"correct": "ice"}}
    made = made_protocol("absolute-identification", WORDS, stimuli, feedback=True)
    return with_conditions(made, path.parent, path)[0]


def always(word):
    return lambda page: {page.questions[0].name: word}


def test_words_are_chosen_and_told_right_or_wrong(words):
    study = Study(words, "P1")
    assert study.page.questions[0].allowed == "sand, snow, ice"
    told = {page.feedback for page in walked(study, always("sand"))} | {study.page.feedback}
    assert told == {"", "The last one: right.", "The last one: it was snow."}
    rows = rows_of(words, "P1", study.entries)
    assert {(row["stimulus"], row["correct"], row["right"]) for row in rows} == {
        ("soft", "snow", 0),
        ("firm", "sand", 1),
        ("hard", "sand", 1),
    }


def test_shares_of_right_answers_are_those_of_each_condition(words):
    from statsmodels.stats.proportion import proportion_confint  # here: all processes of the tests read this file

    study = Study(words, "P1")
    walked(study, always("sand"))
    (found,) = analysed(rows_of(words, "P1", study.entries), words, Settings())
    (table,) = [table for table in found.tables if table.title == "Right answers"]
    lines = {line[0]: line for line in table.rows}
    assert set(lines) == {"all", "place: heel", "place: toe", "soft", "firm", "hard"}
    assert lines["all"][2:4] == (8, 12)
    assert lines["place: heel"][2:5] == (4, 8, 0.5)
    assert lines["place: heel"][5:] == pytest.approx(proportion_confint(4, 8, method="wilson"))
    (confusions,) = [table for table in found.tables if table.title.endswith("answers to each stimulus")]
    assert confusions.columns == ("stimulus", "sand", "snow", "ice")
    assert [line.at for line in found.drawings[0].lines] == [1 / 3]  # chance, and no mean of the thesis
    assert sorted(confusions.rows) == [("firm", 4, 0, 0), ("hard", 4, 0, 0), ("soft", 4, 0, 0)]


def test_a_spoiled_trial_has_no_score_and_the_analysis_says_that_it_is_left_out(words):
    study = Study(words, "P1")
    study.spoil("a phone rang")
    study.answer({"answer": "sand"})
    spoiled, answered = rows = rows_of(words, "P1", study.entries)
    assert ("right" in spoiled, "right" in answered) == (False, True)
    (found,) = analysed(rows, words, Settings())
    assert found.remarks == ["1 spoiled trial is left out: a phone rang."]


@pytest.mark.parametrize(
    ("standard", "correct", "scores"), [("", "no", {0}), ("X", "comparison", {0, 1}), ("X", "standard", {0, 1})]
)
def test_constant_stimuli_are_scored_by_yes_and_no_and_by_the_interval(standard, correct, scores):
    parameters = {"comparisons": ["TD"], "standard": standard, "blocks": 4}
    stimuli = {"TD": {**TD, "correct": correct}, "X": {}}
    protocol = made_protocol("constant-stimuli", parameters, stimuli, feedback=True)
    study = Study(protocol, "P1")
    assert study.learnable_answers == ({} if standard else {1: correct})  # nobody can answer "comparison"
    pages = walked(study, always("first" if standard else "yes"))
    assert {page.feedback for page in pages} - {"", "The last one: right."} == {"The last one: wrong."}
    rows = rows_of(protocol, "P1", study.entries)
    assert {row["right"] for row in rows} == scores
    if standard:
        assert all(row["right"] == ((row["comparison_at"] == "first") == (correct == "comparison")) for row in rows)


def test_staircases_beside_silence_are_told_and_scored_and_go_on_where_they_were_not_before():
    """Practice with feedback told nothing: something was in one of both, so that one answer is right."""
    parameters = {"followed": ["TD"], "standard": "X", "down_after": 3, "reversals": 2, "last": 2}
    protocol = made_protocol("staircases", parameters, feedback=True)
    study = Study(protocol, "P1")
    told = [page.feedback for page in (*walked(study, always("first"))[1:], study.page)]
    at = [entry.trial.facts["comparison_at"] for entry in study.entries]
    assert told == [f"The last one: {'right' if one == 'first' else 'wrong'}." for one in at]
    rows = rows_of(protocol, "P1", study.entries)
    assert [(row["correct"], row["right"]) for row in rows] == [(one, one == "first") for one in at]
    before = [structs.replace(one, trial=structs.replace(one.trial, correct="")) for one in study.entries]
    assert Study(protocol, "P1", before).is_done
    vibrating = made_protocol("staircases", parameters | {"standard": "WC"}, {"TD": TD, "WC": TD})
    assert {page.trial.correct for page in walked(Study(vibrating, "P1"), always("first"))} == {""}


def test_right_answers_of_pairs_are_of_pairs_in_either_order_and_not_of_the_first_of_the_two():
    """A factor of one of the two, such as its set, is none of the pair."""
    stimuli = {name: {**TD, "factors": {"set": name}} for name in ("sand", "ice")}
    protocol = made_protocol("pairs", {"blocks": 4, "judged": "same"}, stimuli)
    study = Study(protocol, "P1")
    walked(study, lambda page: {"same": "no" if page.trial.intervals[1].stimulus == "sand" else "yes"})
    (found,) = analysed(rows_of(protocol, "P1", study.entries), protocol, Settings())
    table = next(table for table in found.tables if table.title == "Right answers")
    assert [row[:4] for row in table.rows] == [
        ("all", 1, 8, 16), ("ice ice", 1, 4, 4), ("ice sand", 1, 4, 8), ("sand sand", 1, 0, 4),
    ]  # fmt: skip


def test_labels_are_right_whatever_their_case():
    stimuli = {"TD": {**TD, "correct": "Snow"}, "X": {}}
    protocol = made_protocol("free-labels", {}, stimuli)
    study = Study(protocol, "P1")
    walked(study, always(" snow "))
    rows = {row["stimulus"]: row for row in rows_of(protocol, "P1", study.entries)}
    assert rows["TD"]["right"] == 1
    assert "right" not in rows["X"]


def test_a_right_answer_that_cannot_be_given_is_one_line():
    with pytest.raises(BadFile, match=r"stimuli.TD.correct is 'ice'; allowed: sand, snow \(of 'main'\)$"):
        made_protocol(
            "absolute-identification", {"answers": ["sand", "snow"]}, {"TD": {**TD, "correct": "ice"}, "X": {}}
        )
    with pytest.raises(BadFile, match=r"stimuli.X.correct is ''; allowed: sand, snow \(of 'main'\)$"):
        made_protocol(
            "absolute-identification", {"answers": ["sand", "snow"]}, {"TD": {**TD, "correct": "sand"}, "X": {}}
        )
    with pytest.raises(BadFile, match=r"stimuli.TD.correct is 'first'; allowed: yes, no \(of 'main'\)$"):
        made_protocol("constant-stimuli", {}, {"TD": {**TD, "correct": "first"}})
    with pytest.raises(BadFile, match=r"answers is \['sand'\]; allowed: two or more, or none"):
        made_protocol("absolute-identification", {"answers": ["sand"]})


def test_simulated_people_choose_words_at_their_rate(words, tmp_path):
    found = [one for job in jobs_of(words, tmp_path, 80, SimulationSettings(), 80) for one in simulate(job)]
    (rate,) = [summary for summary in summaries(found) if summary.name == "rate" and summary.share == 1.0]
    assert abs(rate.bias) < 4.0 * rate.spread / 80**0.5
    rows = [row for k in range(4) for row in simulated_rows(words, k, 1, {})[0]]
    assert {row["answer"] for row in rows} == {"sand", "snow", "ice"}
