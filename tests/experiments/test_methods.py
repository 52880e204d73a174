"""Methods: the trials that the thesis's designs ask for, and levels that follow answers as the rules say."""

import math
from collections import Counter
from itertools import pairwise, product

import pytest
from made_studies import TD, first_answers, made_protocol, preset_protocol, trials, walked
from msgspec import structs

from underfoot.errors import BadFile, BadValue
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.duration import usual_trials
from underfoot.experiments.methods.bayesian import quest_of
from underfoot.experiments.methods.staircases import Staircase, move
from underfoot.experiments.study import Study
from underfoot.experiments.table import rows_of
from underfoot.experiments.trials import NOTHING, Presentation
from underfoot.floor.layout import default_floor
from underfoot.studies.target import require_on_floor


def trials_of(name, participant="P1", answers=None):
    study = Study(preset_protocol(name), participant)
    return trials(walked(study, answers) if answers else walked(study))


def test_identification_has_every_stimulus_twice_a_session_in_an_order_of_ones_own():
    first, second = trials_of("identification-impact"), trials_of("identification-impact", "P2")
    assert len(first) == 96
    for session in range(1, 7):
        assert set(Counter(t.correct for t in first if t.block == session).values()) == {2}
    assert [t.correct for t in first] != [t.correct for t in second]


def test_constant_stimuli_have_each_pair_once_a_block_and_the_standard_first_in_half():
    found = trials_of("stiffness-vibration")
    assert len(found) == 420
    assert all(len({t.facts["comparison"] for t in found if t.block == block}) == 21 for block in range(1, 21))
    places = Counter((t.facts["comparison"], t.facts["comparison_at"]) for t in found)
    assert set(places.values()) == {10}
    orders = [tuple(t.facts["comparison_at"] for t in found if t.facts["comparison"] == one) for one, _ in places]
    assert len(set(orders)) == 21  # of each pair another one


def test_of_an_odd_number_of_blocks_the_standard_is_first_in_one_more_or_one_less():
    made = made_protocol("constant-stimuli", {"comparisons": ["TD"], "standard": "X", "blocks": 3})
    people = (trials(walked(Study(made, f"P{number}"))) for number in range(12))
    assert {sum(t.facts["comparison_at"] == "second" for t in found) for found in people} == {1, 2}


def test_one_interval_of_constant_stimuli_is_answered_with_yes_or_no():
    study = Study(made_protocol("constant-stimuli", {"comparisons": ["TD"], "blocks": 3}), "P1")
    assert [question.name for question in study.page.questions] == ["felt"]
    assert len(walked(study)) == 3


@pytest.mark.parametrize(
    ("kind", "beside", "alone", "of_two"),
    [
        ("constant-stimuli", {"standard": "X"}, "Did you feel it?", "Which was stronger?"),
        ("staircases", {"followed": ["TD"], "standard": "WC"}, "Did you feel it?", "Which was stronger?"),
        ("staircases", {"followed": ["TD"], "standard": "X", "down_after": 2}, "Did you feel it?", "In which one did"),
        ("bayesian", {"followed": "TD", "intervals": "two"}, "Did you feel it?", "In which one did you feel it?"),
        ("adjustment", {"followed": ["TD"], "standard": "WC"}, "Set it to where you only just", "like the other one"),
        ("magnitude-estimation", {"standard": "TD"}, "How strong was it?", "The first one is 10. How strong was the"),
    ],
)
def test_who_writes_no_question_has_the_usual_one_also_beside_a_standard(kind, beside, alone, of_two):
    """It is asked to compare there: "did you feel it?" has no answer of two intervals, of which both are felt."""
    first = {name: value for name, value in beside.items() if name == "followed"}
    stimuli = {"TD": TD, "WC": {**TD, "patch": "stimulus-wc"}, "X": {}}
    for given, words in ((first, alone), (beside, of_two), ({**beside, "question": "Own?"}, "Own?")):
        (question,) = Study(made_protocol(kind, given, stimuli), "P1").page.questions
        assert words in question.doc


def test_adjustments_begin_once_a_block_on_each_side_in_an_order_of_ones_own():
    stimuli = {name: {**TD, "level_m_s2": level} for name, level in (("A", 0.4), ("B", 0.8), ("S", 0.2))}
    parameters = {"followed": ["A", "B"], "standard": "S", "blocks": 6, "below": [-30.0, -14.0]}
    made = made_protocol("adjustment", parameters, stimuli)
    found, other = (trials(walked(Study(made, person))) for person in ("P1", "P2"))
    keys = [(trial.block, trial.facts["comparison"], trial.facts["series"]) for trial in found]
    assert sorted(keys) == sorted(product(range(1, 7), "AB", ("ascending", "descending")))
    assert keys != [(trial.block, trial.facts["comparison"], trial.facts["series"]) for trial in other]
    starts = {series: [t.facts["start_at"] for t in found if t.facts["series"] == series] for _, _, series in keys}
    assert [len(set(of)) for of in starts.values()] == [12, 12]
    assert -30.0 <= min(starts["ascending"]) < max(starts["ascending"]) <= -14.0
    assert 8.0 <= min(starts["descending"]) < max(starts["descending"]) <= 15.0
    assert {(t.facts["comparison"], t.facts["standard_at"]) for t in found} == {("A", -6.0206), ("B", -12.0412)}
    assert found[0].intervals[0] == Presentation(found[0].facts["comparison"], found[0].facts["start_at"])


@pytest.mark.parametrize(
    ("given", "refused"),
    [
        ({"standard": "X"}, "standard is 'X'; allowed: a stimulus that vibrates, or none"),
        ({"standard": "K"}, "standard is 'K'; allowed: one on the same plate"),
        ({"standard": "S", "below": [-20.0, -3.0]}, r"below is .* below it: the standard is at -6.02"),
        ({"standard": "S", "above": [-7.0, 9.0]}, r"above is .* above it: the standard is at -6.02"),
        ({"above": [8.0, 25.0]}, r"above is \[8.0, 25.0\]; allowed: the lower first, within reach"),
        ({"reach": [-130.0, 20.0]}, r"reach is .*; allowed: -120 to 60 dB"),
        ({"reach": [-40.0, 40.0]}, "goes up to 40 dB; lower that, or its level"),
        ({"steps": [0.5, 2.0]}, "steps is .*; allowed: the large one first"),
        ({"parameter": "out.tiles"}, "parameter is 'out.tiles'; allowed: numbers of TD: dynamic.frequency, dynamic"),
        ({"parameter": "gain.gain"}, "parameter is 'gain.gain'; allowed: numbers of TD: "),  # which the level moves
        ({"parameter": "out.level"}, "parameters.parameter: stimuli.TD.settings: out.level is -40.0; allowed: 0 to"),
    ],
)
def test_adjustments_of_which_answers_would_say_nothing_are_refused(given, refused):
    stimuli = {"TD": TD, "X": {}, "S": {**TD, "level_m_s2": 0.215}, "K": {**TD, "stiffness_n_mm": 90.0}}
    with pytest.raises(BadFile, match=refused):
        made_protocol("adjustment", {"followed": ["TD"], **given}, stimuli)


def test_ratings_are_228_with_the_plate_that_does_not_vibrate():
    found = trials_of("compliance-rating")
    assert len(found) == 228
    assert set(Counter(t.intervals[0].stimulus for t in found).values()) == {12}


def test_targets_are_240_every_button_six_times():
    found = trials_of("target-selection")
    buttons = Counter((t.facts["width_m"], t.facts["distance_m"], t.facts["bearing_rad"]) for t in found)
    assert (len(found), len(buttons), set(buttons.values())) == (240, 40, {6})
    assert Counter(t.block for t in found) == {1: 120, 2: 120}


@pytest.mark.parametrize(("foot", "away"), [("right", -1.0), ("left", 1.0)])
def test_a_target_lies_at_its_distance_on_the_side_away_from_the_preferred_foot(foot, away):
    given = {"distances_m": [0.4], "bearings_deg": [30.0], "repeats": 1, "preferred_foot": foot}
    (trial, *_) = trials(walked(Study(made_protocol("target-selection", given), "P1")))
    assert (trial.facts["x_m"], trial.facts["y_m"]) == pytest.approx((away * 0.2, 0.4 * math.cos(math.pi / 6.0)))


def test_the_foot_that_somebody_prefers_has_the_buttons_on_its_other_side():
    """The study asked for the foot, and the buttons lay for the right one all the same."""
    protocol = preset_protocol("target-selection")

    def first_buttons(foot):
        study = Study(protocol, "P1")
        walked(study, lambda page: {"age": 30, "foot": foot} if page.stage == "participant" else first_answers(page), 3)
        again = Study(protocol, "P1", study.entries)
        assert again.page == study.page  # as where the session goes on
        return [page.trial.facts for page in walked(again, most=9) if page.trial is not None]

    right, left = first_buttons("right"), first_buttons("left")
    assert [{**facts, "x_m": -facts["x_m"]} for facts in left] == right
    assert any(facts["x_m"] < -0.05 for facts in right)
    with pytest.raises(BadValue, match=r"has a button at x 1\.\d\d, .* which is not on the floor"):
        require_on_floor(protocol, default_floor(6, 3))  # all of the right foot's buttons are on it
    unasked = structs.replace(protocol, participant=())
    with pytest.raises(
        BadValue, match="preferred_foot is 'asked'; allowed: right or left, or asked with a question foot"
    ):
        unasked.check()


def ideal(threshold_db, nothing_db=-1001.0):
    """Feels all above a threshold, and nothing below; where there is nothing it is `nothing_db` strong."""

    def answers(page):
        if page.kind == "consent":
            return {"agreed": "yes"}
        if page.trial is None:
            return {question.name: question.default for question in page.questions}
        return {"felt": "yes" if page.trial.facts.get("level_db", nothing_db) > threshold_db else "no"}

    return answers


def test_staircases_of_an_ideal_participant_turn_around_the_threshold():
    """A step of 3 dB goes back and forth over a threshold: every reversal that counts is within a step of it."""
    found = trials_of("detection-threshold", answers=ideal(2.0))
    for block in (1, 2, 3):
        for which in ("above", "below"):
            levels = [t.facts["level_db"] for t in found if t.block == block and t.facts.get("staircase") == which]
            assert all(abs(level - 2.0) < 3.0 for level in levels[-8:])
            steps = [round(abs(b - a), 6) for a, b in pairwise(levels)]
            assert steps[-8:] == [3.0] * 8
            assert steps[0] == 10.0
    starts = next(t.facts["level_db"] for t in found if t.facts.get("staircase") == "above")
    assert 8.0 <= starts <= 15.0


def test_every_tenth_trial_is_announced_and_about_13_percent_are_catch_trials():
    shares = []
    for k in range(30):
        found = trials_of("detection-threshold", f"P{k}", ideal(0.0))
        assert [t.number for t in found if t.facts.get("announced")] == [t.number for t in found if t.number % 10 == 0]
        drawn = [t for t in found if not t.facts.get("announced")]
        shares.append(sum(bool(t.facts.get("catch")) for t in drawn) / len(drawn))
    assert sum(shares) / 30 == pytest.approx(0.13, abs=0.02)


def test_a_false_alarm_begins_both_staircases_anew():
    caught = []

    def answers(page):
        said = ideal(0.0)(page)
        if page.trial is not None and page.trial.facts.get("catch") and not caught:
            caught.append(page.trial.number)
            return {"felt": "yes"}
        return said

    found = trials_of("detection-threshold", answers=answers)
    runs = {t.facts["run"] for t in found if t.block == 1 and "run" in t.facts}
    assert runs == {0, 1}
    assert {t.facts["run"] for t in found if t.block > 1 and "run" in t.facts} == {0}
    again = [t for t in found if t.block == 1 and t.facts.get("run") == 1 and "level_db" in t.facts]
    assert abs(again[0].facts["level_db"]) >= 8.0


def test_two_answers_of_yes_are_needed_for_each_step_down_and_one_of_no_for_a_step_up():
    """Levitt's rule: a third yes is the first of the next two."""
    given = {"down_after": 2, "up_after": 1, "change_after": 9, "steps_db": (1.0,), "up_steps": 1.0}
    one, levels = Staircase(0.0), []
    for answer in "YYYYNYYN":
        move(one, answer == "Y", {**given, "lowest_db": -9.0, "highest_db": 9.0})
        levels.append(one.level_db)
    assert levels == [0.0, -1.0, -1.0, -2.0, -1.0, -1.0, -2.0, -1.0]
    assert one.reversals_db == [-2.0, -1.0, -2.0]


@pytest.mark.parametrize("standard", ["TD", ""])
def test_pairs_of_staircases_follow_each_other_in_an_order_of_ones_own(standard):
    given = {"followed": list("abcd"), "standard": standard, "reversals": 2, "last": 2}
    protocol, orders = made_protocol("staircases", given, dict.fromkeys([*"abcd", "TD"], TD)), set()
    for person in range(8):
        found = trials(walked(Study(protocol, f"P{person}")))
        assert len({(t.block, t.facts["comparison"]) for t in found}) == 4
        orders.add(order := "".join(dict.fromkeys(t.facts["comparison"] for t in found)))
        assert sorted(order) == list("abcd")
    assert len(orders) > 4


def test_staircases_of_all_stimuli_take_turns_and_a_false_alarm_begins_all_of_the_block_anew():
    middles, caught = {"low": -2.0, "mid": 1.0, "high": 4.0}, []
    parameters = {"followed": list(middles), "pairs": 2, "interleaved": "all", "catch_share": 0.1}
    protocol = made_protocol("staircases", parameters, dict.fromkeys(middles, TD))

    def answers(page):
        facts = page.trial.facts
        if facts.get("catch") and page.trial.number > 30 and not caught:
            caught.append(page.trial.number)
            return {"felt": "yes"}
        return {"felt": "yes" if facts.get("level_db", -100.0) > middles.get(facts.get("comparison"), 0.0) else "no"}

    study = Study(protocol, "P1")
    pages = walked(study, answers)
    assert max(page.share for page in pages) < 1.0
    assert usual_trials(protocol, protocol.stages[0])[1] == 2
    found = [t for t in trials(pages) if not t.facts.get("catch")]
    each = Counter((t.block, t.facts["comparison"], t.facts["staircase"]) for t in found)
    assert len(each) == 2 * 3 * 2
    turns = [a.facts["comparison"] != b.facts["comparison"] for a, b in pairwise(found[:60])]
    assert 0.5 < sum(turns) / len(turns) < 0.85  # two of three others
    again = [t for t in found if t.facts["run"] == 1]
    assert {t.block for t in again} == {1}
    assert {(t.facts["comparison"], t.facts["staircase"]) for t in again} == {key[1:] for key in each}
    estimates = analysed(rows_of(protocol, "P1", study.entries), protocol, Settings())[0].tables[0].rows
    assert {line[1]: line[2] for line in estimates} == {
        f"threshold {name}": pytest.approx(middle, abs=1.5) for name, middle in middles.items()
    }


def test_a_participant_who_always_says_yes_comes_to_an_end():
    found = trials_of("detection-threshold", answers=ideal(-1000.0, 0.0))
    assert 100 < len(found) < 2000


@pytest.mark.parametrize(("felt", "worst", "bound_db"), [("yes", min, -20.0), ("no", max, 16.0)])
def test_a_level_stays_between_its_bounds_and_what_never_turns_is_given_up(felt, worst, bound_db):
    """No foot gets more than a protocol allows."""
    parameters = {"followed": ["TD"], "lowest_db": -20.0, "highest_db": 16.0, "most_trials": 12}
    found = trials(walked(Study(made_protocol("staircases", parameters), "P1"), lambda page: {"felt": felt}))
    assert Counter(t.facts["staircase"] for t in found) == {"above": 12, "below": 12}
    assert worst(t.facts["level_db"] for t in found) == bound_db


def test_so_many_equal_answers_in_a_row_move_a_level_and_another_one_begins_the_count_anew():
    rule = {"down_after": 2, "up_after": 3, "steps_db": (8.0, 2.0), "change_after": 1, "up_steps": 1.0}
    one, levels = Staircase(0.0), []
    for answer in "ynyynnynnnyy":
        move(one, answer == "y", rule | {"lowest_db": -60.0, "highest_db": 60.0})
        levels.append(one.level_db)
    assert levels == [0.0] * 3 + [-8.0] * 6 + [-6.0] * 2 + [-8.0]
    assert one.reversals_db == [-8.0, -6.0]


def test_a_weighted_step_up_is_so_many_steps_down():
    parameters = {"followed": ["TD"], "steps_db": [4.0, 1.0], "up_steps": 3.0}
    found = trials(walked(Study(made_protocol("staircases", parameters), "P1"), ideal(2.0)))
    levels = [t.facts["level_db"] for t in found if t.facts["staircase"] == "above"]
    steps = {round(later - level, 6) for level, later in pairwise(levels)}
    assert steps == {-4.0, 12.0, -1.0, 3.0}


@pytest.mark.parametrize(
    ("parameters", "wrong"),
    [
        ({"standard": "X"}, "down_after is 1; allowed: 2 or more, or up_steps above 1, where the standard is no vib"),
        ({"standard": "X", "up_after": 3}, "down_after is 1"),
        ({"standard": "A", "catch_share": 0.1}, "catch_share is 0.1; allowed: 0 with a standard"),
        ({"standard": "A", "empty_every": 10}, "empty_every is 10; allowed: 0 with a standard"),
    ],
)
def test_staircases_whose_answers_would_say_nothing_are_refused(parameters, wrong):
    """A rule for even chances went down for ever beside silence; catch trials of one interval asked for one of two."""
    stimuli = {"TD": TD, "A": TD, "X": {}}
    with pytest.raises(BadFile, match=f"parameters.{wrong}"):
        made_protocol("staircases", {"followed": ["TD"], **parameters}, stimuli)
    for rule in ({"down_after": 3}, {"up_steps": 3.0}):
        made_protocol("staircases", {"followed": ["TD"], "standard": "X", **rule}, stimuli)


@pytest.mark.parametrize("threshold_db", [-9.5, 12.3])
def test_bayesian_levels_come_near_the_threshold(threshold_db):
    """It lies far from 0 dB, where they begin."""
    pytest.importorskip("questplus")
    protocol = made_protocol("bayesian", {"trials": 30}, {"TD": TD})
    found = trials(walked(Study(protocol, "P1"), ideal(threshold_db)))
    assert len(found) == 30
    assert all(abs(t.facts["level_db"] - threshold_db) < 6.0 for t in found[-10:])
    assert all(t.intervals == (Presentation("TD", t.facts["level_db"]),) for t in found)


def test_of_two_intervals_half_are_guessed_and_of_one_as_often_as_yes_is_said_to_nothing():
    pytest.importorskip("questplus")
    given = {"range_db": (-6.0, 6.0), "step_db": 3.0, "guesses": 0.1}
    guessed = [quest_of(given | {"intervals": n}).param_domain["lower_asymptote"] for n in ("one", "two")]
    assert guessed == [[0.1], [0.5]]
    found = trials(walked(Study(made_protocol("bayesian", {"trials": 40, "catch_share": 0.3}), "P1"), ideal(0.0)))
    assert len(found) == 40
    assert 5 < sum(trial.intervals == (Presentation(NOTHING),) for trial in found) < 20


@pytest.mark.parametrize(
    ("kind", "parameters", "other"),
    [
        ("staircases", {"followed": ["TD"], "standard": "X", "down_after": 2}, "X"),
        ("bayesian", {"intervals": "two", "trials": 60}, NOTHING),
    ],
)
def test_of_two_intervals_one_has_the_level_and_either_is_as_often_the_first(kind, parameters, other):
    if kind == "bayesian":
        pytest.importorskip("questplus")
    found = trials(walked(Study(made_protocol(kind, parameters), "P1"), most=60))
    for trial in found:
        level, nothing = Presentation("TD", trial.facts["level_db"]), Presentation(other)
        first = trial.facts["comparison_at"] == "first"
        assert trial.intervals == ((level, nothing) if first else (nothing, level))
        assert kind == "staircases" or trial.correct == trial.facts["comparison_at"]
    assert 0.3 < sum(trial.facts["comparison_at"] == "first" for trial in found) / len(found) < 0.7


def test_free_labels_have_every_stimulus_once():
    found = trials_of("free-labels")
    assert len({t.intervals[0].stimulus for t in found}) == len(found) == 16
