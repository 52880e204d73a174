"""Simulated participants: estimates fall around the truth, and the same people come of any order and number of jobs."""

import math
import sys
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from made_studies import TD, made_protocol, preset_protocol, protocol_text, walked
from scipy.stats import binomtest, f_oneway, norm

from underfoot.drawing.svg import svg
from underfoot.errors import BadMeasurement, BadValue
from underfoot.experiments.analysis import constant
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.power import power_of
from underfoot.experiments.analysis.report import text_of
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.observers import OBSERVERS, truths_of
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.simulation import SimulationSettings, jobs_of, simulate, simulated_rows, summaries
from underfoot.experiments.study import Study
from underfoot.experiments.table import rows_of
from underfoot.patch import preset_files

pytest.importorskip("statsmodels")
NAMES = [name for name in preset_files.protocols() if name != "detection-bayesian"]
PEOPLE = 12


@cache
def found_of(name, people, each=20, **settings):
    folder = preset_files.protocols()[name].parent
    how = SimulationSettings(**settings)
    return [one for part in jobs_of(preset_protocol(name), folder, people, how, each) for one in simulate(part)]


@pytest.mark.parametrize("name", NAMES)
def test_estimates_lie_around_the_truth(name):
    """Every mean over people lies within 2.8 standard errors of the truth, or within a twentieth of it."""
    for summary in summaries(found_of(name, PEOPLE)):
        if summary.share < 1.0 or summary.name in ("pse 0.86", "slope 0.86", "jnd 0.86", "intercept 0.86"):
            continue  # table 6.3's PSE of 151.6 lies beyond the stiffest plate: its mean over people has no bound
        assert math.isfinite(summary.truth), summary.name
        allowed = max(
            2.8 * summary.spread_of(PEOPLE), 0.05 * abs(summary.truth), 0.25 if "threshold" in summary.name else 0.02
        )
        assert abs(summary.median - summary.truth) <= allowed + summary.spread * 0.4, summary


def test_why_somebody_has_no_threshold_is_said():
    made = made_protocol("staircases", {"followed": ["TD"], "pairs": 1}, most_trials=6)
    (found,) = analysed(simulated_rows(made, 0, 1, {})[0], made, Settings())
    assert found.tables[0].note.endswith(" Empty: no staircase of theirs has 8 reversals yet.")
    made = made_protocol("staircases", {"followed": ["TD"], "pairs": 1})
    (found,) = analysed(simulated_rows(made, 0, 1, {})[0], made, Settings())
    assert "Empty" not in found.tables[0].note


@pytest.mark.parametrize("standard", ["L40", "", "X"])
def test_where_only_the_level_differs_it_is_judged_and_the_curve_goes_around_threshold_or_standard(standard):
    """Beside silence, X, what is not felt is guessed."""
    levels = {f"L{k}": k / 100 for k in (10, 25, 40, 55, 70)}
    stimuli = {n: {**TD, "level_m_s2": v, "factors": {"level_m_s2": v}} for n, v in levels.items()}
    made = made_protocol("constant-stimuli", {"comparisons": list(levels), "standard": standard, "blocks": 30},
                         {**stimuli, "X": {}})  # fmt: skip
    how = SimulationSettings(truth=(("threshold_m_s2", 0.5),))
    found = {one.name: one for one in summaries(simulate(jobs_of(made, Path(), PEOPLE, how)[0])) if one.share == 1.0}
    half = "pse" if standard == "L40" else "threshold"
    assert set(found) == {half, "slope", "intercept"} | ({"jnd"} if standard != "X" else set())
    assert found[half].truth == pytest.approx(0.4 if standard == "L40" else 0.5)
    assert found["slope"].truth == pytest.approx(1.0 / (0.25 * found[half].truth))
    for one in found.values():
        assert abs(one.median - one.truth) < 4.0 * one.spread_of(PEOPLE) + 0.05 * abs(one.truth), one
    rows = simulated_rows(made, 0, 1, {})[0]
    told = text_of(analysed(rows, made, Settings(bootstrap=0)))
    assert ("PSE" in told, "threshold" in told) == (standard == "L40", standard != "L40")
    as_table = text_of(
        analysed(rows, None, Settings(bootstrap=0))
    )  # which does not know whether the standard is silent
    assert ("as if the standard vibrates" in as_table, "as if the standard vibrates" in told) == (bool(standard), False)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (lambda trial: "yes", "Empty: the answers are all alike"),
        (lambda trial: "yes" if trial.block % 2 else "no", "From -inf to inf: the slope may be 0"),
    ],
    ids=["alike", "half of each"],
)
def test_why_a_curve_has_no_numbers_or_no_bounds_is_said_below_them(answer, words):
    levels = {f"L{k}": {**TD, "level_m_s2": k / 100} for k in (10, 25, 40, 55, 70)}
    made = made_protocol("constant-stimuli", {"comparisons": list(levels), "blocks": 8}, levels)
    study = Study(made, "P1")
    walked(study, lambda page: {"felt": answer(page.trial)})
    (found,) = analysed(rows_of(made, "P1", study.entries), made, Settings(bootstrap=0))
    assert found.tables[0].note.startswith(f"Along level, m/s^2. Intervals by covariance. {words}")


def test_any_number_is_judged_around_the_middle_of_its_own_where_it_was_taken_for_a_stiffness():
    """A JND of latency, 10 to 80 ms, was planned with people whose PSE was 134.5 ms."""
    late = {f"D{k}": {**TD, "factors": {"latency_ms": k}} for k in (10, 20, 40, 60, 80)}
    parameters = {"comparisons": list(late), "standard": "TD", "blocks": 40}
    made = made_protocol("constant-stimuli", parameters, {"TD": TD, **late})
    found = {one.name: one for one in summaries(simulate(jobs_of(made, Path(), PEOPLE)[0])) if one.share == 1.0}
    assert (found["pse"].truth, found["slope"].truth) == pytest.approx((45.0, 1.0 / 14.0))
    assert found["jnd"].truth == pytest.approx(14.0 * norm.ppf(0.75))
    assert abs(found["jnd"].median - found["jnd"].truth) < 2.0
    assert abs(found["pse"].bias) < 4.0 * found["pse"].spread / math.sqrt(PEOPLE)


def test_estimates_of_two_stages_are_beside_the_truth_of_their_own():
    """One PSE at each of two standards: together they had one truth, and a bias of half of what lies between."""
    levels = {f"L{k}": {**TD, "level_m_s2": k / 10} for k in range(2, 11)}
    stages = [
        {
            "id": name,
            "kind": "trials",
            "method": {
                "kind": "constant-stimuli",
                "parameters": {"standard": f"L{at}", "comparisons": [f"L{at + k}" for k in (-2, -1, 1, 2)]},
            },
        }
        for name, at in (("soft", 4), ("loud", 8))
    ]
    made = Protocol.loads(protocol_text(stages=stages, stimuli=levels))
    found = {one.name: one for one in summaries(simulate(jobs_of(made, Path(), 10)[0])) if one.share == 1.0}
    assert set(found) == {
        f"{name} in {stage}" for name in ("pse", "slope", "jnd", "intercept") for stage in ("soft", "loud")
    }
    for stage, truth in (("soft", 0.4), ("loud", 0.8)):
        one = found[f"pse in {stage}"]
        assert one.truth == pytest.approx(truth)
        assert abs(one.bias) < 0.04


@pytest.mark.parametrize("standard", ["gravel", ""])
def test_two_patches_without_a_number_are_compared_by_the_share_that_is_judged_more(standard):
    """A binomial's mean and spread: 40 trials of 0.6, and of 0.58 where a fifth of the answers are at chance."""
    parameters = {"standard": standard, "comparisons": ["snow"], "blocks": 40, "judged_more": "not chosen"}
    made = made_protocol("constant-stimuli", parameters, {"gravel": {"patch": "gravel"}, "snow": {"patch": "snow"}})
    for mistakes, share in ((0.0, 0.6), (0.2, 0.58)):
        how = SimulationSettings(truth=(("judged_more", 0.6), ("mistakes", mistakes)))
        found = [one for job in jobs_of(made, Path(), 60, how, 60) for one in simulate(job)]
        (whole,) = [summary for summary in summaries(found) if summary.share == 1.0]
        assert whole.name == "share snow"
        assert whole.truth == pytest.approx(share)
        assert abs(whole.bias) < 4.0 * math.sqrt(share * (1.0 - share) / 40 / 60)
        assert whole.spread == pytest.approx(math.sqrt(share * (1.0 - share) / 40), rel=0.3)
    rows, _ = simulated_rows(made, 0, 1, {})
    (findings,) = analysed(rows, made, Settings())
    (line,) = findings.tables[0].rows
    judged = sum((row.get("felt") == "yes") or (row.get("interval") not in (None, row.get("comparison_at")))
                 for row in rows)  # fmt: skip
    assert line[:5] == ("S1", "snow", standard, judged, 40)
    p = binomtest(judged, 40).pvalue
    assert line[8] == pytest.approx(p) if standard else math.isnan(line[8])
    assert [drawing.title for drawing in findings.drawings] == ["Judged more, so far"]
    (remark,) = findings.remarks
    assert remark.startswith("No psychometric curve: ")


def test_the_same_people_come_of_any_jobs_in_any_order():
    one = found_of("detection-threshold", 9, each=9)
    parts = found_of("detection-threshold", 9, each=2)
    assert one == parts
    assert summaries(reversed(one)) == summaries(one)
    assert found_of("detection-threshold", 3, seed=2) != found_of("detection-threshold", 3)


def test_a_truth_that_is_set_is_what_is_found():
    found = found_of("detection-threshold", 16, truth=(("threshold_m_s2", 1.5),))
    (last,) = [summary for summary in summaries(found) if summary.share == 1.0]
    assert last.truth == pytest.approx(20.0 * math.log10(1.5 / 0.43))
    assert last.mean == pytest.approx(last.truth, abs=0.8)


def summary_of_staircases(people, parameters, **truth):
    made = made_protocol("staircases", {"followed": ["TD"], **parameters})
    jobs = jobs_of(made, Path(), people, SimulationSettings(truth=tuple(truth.items())))
    found = summaries(one for job in jobs for one in simulate(job))
    return next(one for one in found if one.share == 1.0)


def test_two_down_one_up_is_held_against_the_level_that_is_felt_in_71_of_100():
    found = summary_of_staircases(PEOPLE, {"pairs": 3, "down_after": 2, "steps_db": [2.0]})
    at_half = 20.0 * math.log10(0.46 / TD["level_m_s2"])
    assert found.truth == pytest.approx(at_half + 2.0 * 0.58, abs=0.05)  # 0.719 of what is no guess or lapse
    assert abs(found.bias) < 0.4


@pytest.mark.parametrize("catch", [False, True])
def test_levels_in_ones_own_unit_are_the_axis_and_a_catch_trial_without_it_is_in_no_curve(catch):
    """Each was a condition of its own, with a curve of one level; and a stimulus without it ended the analysis.

    Simulated people took decibels for N/mm, and failed all catch trials.
    """
    stimuli = {f"d{db}": {**TD, "level_m_s2": 10.0 ** (db / 20.0), "factors": {"db": db}} for db in (-9, -6, -3, 0, 3)}
    stimuli |= {"loud": {**TD, "level_m_s2": 6.0, "correct": "yes"}, "X": {"correct": "no"}} if catch else {}
    made = made_protocol("constant-stimuli", {"blocks": 30}, stimuli)
    rows, person = simulated_rows(made, 0, 1, {"threshold_m_s2": 10.0 ** (-4.5 / 20.0)})
    truths = person.observers["main"].truths()
    assert truths["threshold"] == pytest.approx(-4.5)
    assert truths["slope"] == pytest.approx(1.0 / (20.0 * math.log10(1.25)))
    assert all(one.covers(truths[one.name]) for one in constant.estimates(rows, Settings(bootstrap=0)))
    assert [row["right"] for row in rows if "right" in row] == ([1] * 60 if catch else [])
    (found,) = analysed(rows, made, Settings(bootstrap=0))
    shares = next(table for table in found.tables if table.title == "Share judged more")
    assert (shares.columns, [row[0] for row in shares.rows]) == (("db", "share"), [-9.0, -6.0, -3.0, 0.0, 3.0])
    told = "30 trials are in no curve: their stimuli have no db."  # not those of nothing, which have no place
    assert (told in found.remarks) is catch


def test_a_power_law_is_over_the_level_also_where_it_is_said_in_decibels():
    stimuli = {f"d{db}": {**TD, "level_m_s2": 10.0 ** (db / 20.0), "factors": {"db": db}} for db in (-12, -6, 0, 6)}
    made = made_protocol("magnitude-estimation", {"blocks": 3}, stimuli)
    rows, _ = simulated_rows(made, 0, 1, {"numbers_spread": 0.0, "exponent": 0.7})
    (found,) = analysed(rows, made, Settings())
    assert found.tables[0].rows[0][1:3] == ("exponent", pytest.approx(0.7, abs=1e-5))


def test_plates_that_vibrate_alike_are_rated_and_given_numbers_by_their_stiffness():
    """They were felt as one, so that a simulated study of stiffness found nothing, whatever the people."""
    stimuli = {f"k{k}": {"stiffness_n_mm": k, "factors": {"stiffness_n_mm": k}} for k in (60, 120, 240)}
    rated = made_protocol("rating", {"blocks": 2}, stimuli)
    rows, _ = simulated_rows(rated, 0, 1, {"rating_spread": 0.0, "without": 10.0, "doubling": 20.0})
    assert {row["stimulus"]: row["rating"] for row in rows} == {"k60": 10.0, "k120": 30.0, "k240": 50.0}
    made = made_protocol("magnitude-estimation", {"blocks": 2}, stimuli)
    rows, person = simulated_rows(made, 0, 1, {"numbers_spread": 0.0, "exponent": 0.7})
    (found,) = analysed(rows, made, Settings())
    assert found.tables[0].rows[0][1:3] == ("exponent", pytest.approx(0.7, abs=1e-5))
    assert person.observers["main"].truths()["exponent"] == pytest.approx(0.7)


@pytest.mark.parametrize(("louder", "found"), [((80, 1.0), 33.0), ((320, 3.0), 41.0)])
def test_where_no_number_differs_or_the_level_does_too_it_is_the_level_that_is_rated(louder, found):
    stimuli = {
        name: {**TD, "level_m_s2": level, "factors": {"frequency_hz": hz, "place": name}}
        for name, (hz, level) in {"heel": (80, 1.0), "toe": louder}.items()
    }
    rows, _ = simulated_rows(made_protocol("rating", {"blocks": 1}, stimuli), 0, 1, {"rating_spread": 0.0})
    assert {row["stimulus"]: row["rating"] for row in rows} == {"heel": 33.0, "toe": found}


def test_beside_silence_what_is_not_felt_is_guessed():
    """Simulated people compared the level with that of the protocol, at 0 dB, wherever their threshold was."""
    found = summary_of_staircases(
        PEOPLE, {"standard": "X", "pairs": 3, "down_after": 3, "steps_db": [2.0]}, threshold_m_s2=1.0
    )
    at_half = 20.0 * math.log10(1.0 / TD["level_m_s2"])
    assert found.truth == pytest.approx(at_half + 2.0 * 0.23, abs=0.05)  # 0.794 of right answers: 0.59 are no guesses
    assert abs(found.bias) < 0.8  # it begins so far below that all is guessed: some of its first turns count


def test_a_weighted_staircase_tends_to_three_quarters():
    found = summary_of_staircases(PEOPLE, {"pairs": 3, "up_steps": 3.0, "steps_db": [0.5]})
    at_half = 20.0 * math.log10(0.46 / TD["level_m_s2"])
    assert found.truth == pytest.approx(at_half + 2.0 * 0.7084, abs=0.05)  # (0.75 - 0.02) / 0.96 are felt
    assert abs(found.bias) < 0.5


@pytest.mark.parametrize("truth", [{"guesses": 0.5}, {"lapses": 0.5}, {"guesses": 0.5, "lapses": 0.5}])
def test_staircases_that_tend_to_no_level_have_no_truth(truth):
    found = summary_of_staircases(2, {"pairs": 1}, **truth)
    assert (math.isnan(found.truth), math.isnan(found.covered)) == (True, True)


def test_a_truth_that_cannot_be_is_refused():
    protocol = preset_protocol("detection-threshold")
    with pytest.raises(BadValue, match="truth is 'first_rate'; allowed: threshold_m_s2, spread_db"):
        truths_of(protocol, {"first_rate": 0.5})  # of those who name stimuli; nobody does here
    with pytest.raises(BadValue, match="guesses is 2"):
        truths_of(protocol, {"guesses": 2.0})


@pytest.mark.parametrize(
    ("kind", "parameters", "names"),
    [
        ("staircases", {"standard": "TD"}, {"equal_db", "spread_db", "guesses", "lapses"}),
        ("staircases", {"standard": "X", "down_after": 2}, {"threshold_m_s2", "spread_db", "guesses", "lapses"}),
        ("constant-stimuli", {"comparisons": ["K60", "K90"], "standard": "K90"}, {"pse_0", "slope_0", "mistakes"}),
        (
            "constant-stimuli",
            {"comparisons": ["D10", "D80"], "standard": "TD"},
            {"pse_share", "pse_spread", "mistakes"},
        ),
        ("constant-stimuli", {"comparisons": ["L1", "L2"]}, {"threshold_m_s2", "level_spread", "mistakes"}),
        ("constant-stimuli", {"comparisons": ["L1", "L2"], "standard": "TD"}, {"level_spread", "mistakes"}),
        ("constant-stimuli", {"comparisons": ["TD"], "standard": "X"}, {"judged_more", "mistakes"}),
        ("adjustment", {}, {"threshold_m_s2", "spread_share", "start_share"}),
        ("adjustment", {"standard": "TD"}, {"error_share", "spread_share", "start_share"}),
    ],
)
def test_only_what_answers_depend_on_can_be_true_of_people(kind, parameters, names):
    """Held against the answers: another truth changes some of them for these names, and none for any other."""
    levels = {f"L{k}": {**TD, "level_m_s2": 0.3 * k} for k in (1, 2)}
    plates = {f"K{k}": {"factors": {"stiffness_n_mm": k}} for k in (60, 90)}
    late = {f"D{k}": {**TD, "factors": {"latency_ms": k}} for k in (10, 80)}
    parameters = parameters if kind == "constant-stimuli" else {"followed": ["TD"], **parameters}
    made = made_protocol(kind, parameters, {"TD": TD, "X": {}, **levels, **plates, **late})
    assert set(truths_of(made, {})) == names
    usual = _answers_of(made, {})
    others = {
        name: min(20.0 * one.default, one.high) or 0.2 * one.high for name, one in OBSERVERS[kind].parameters.items()
    }
    assert {name for name, other in others.items() if _answers_of(made, {name: other}) != usual} == names


def _answers_of(protocol, truth):
    rows, _ = simulated_rows(protocol, 0, 1, truth)
    return [(row.get("felt"), row.get("interval"), row.get("level_db")) for row in rows]


def test_where_all_trials_are_practice_it_is_said_that_nothing_is_estimated():
    made = made_protocol("rating", {"blocks": 1}, practice=True)
    found = power_of(summaries(simulate(jobs_of(made, Path(), 1, SimulationSettings())[0])), 1)
    assert found.title == "1 simulated participant"
    assert found.remarks == ["Nothing is estimated: there are no trials, or all are practice."]


def test_estimates_of_simulated_people_have_their_units_in_tables_and_plots():
    found = power_of(summaries(found_of("stiffness-vibration", PEOPLE)), PEOPLE)
    units = dict(row[:2] for row in found.tables[0].rows)
    assert (units["pse 0.43"], units["slope 0.43"], units["intercept 0.43"]) == ("N/mm", "mm/N", "")
    assert [drawing.y for drawing in found.drawings] == ["error"] * 2 + ["error, N/mm"] * 4 + ["error, mm/N"] * 2


def test_what_is_true_of_the_people_stands_beside_the_estimates():
    protocol = preset_protocol("free-labels")
    summed = summaries(found_of("free-labels", 2))
    estimates, people = power_of(summed, 2, truths_of(protocol, {"labels_differ": 0.5})).tables
    assert ("labels_differ", 0.5) in [row[:2] for row in people.rows]
    assert people.note == "People differ: labels_differ. At 0 they are all alike."
    alike = power_of(summed, 2, truths_of(protocol, {"labels_differ": 0.0})).tables[1]
    assert alike.note.startswith("All people are alike")
    assert estimates.rows


@pytest.mark.parametrize(("name", "estimate"), [("target-selection", "rate"), ("free-labels", "impact WS")])
def test_spread_falls_with_the_trials(name, estimate):
    """With the blocks, and where there is one block, with the trials in it."""
    by_share = {
        summary.share: summary.spread for summary in summaries(found_of(name, PEOPLE)) if summary.name == estimate
    }
    assert by_share[0.5] > by_share[1.0]


def test_without_statsmodels_curves_are_fitted_and_tests_between_conditions_name_the_extra(monkeypatch):
    for module in [name for name in sys.modules if name.partition(".")[0] == "statsmodels"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "statsmodels", None)
    found = {}
    for name in ("identification-impact", "detection-threshold", "stiffness-vibration", "compliance-rating"):
        protocol = preset_protocol(name)
        rows, _ = simulated_rows(protocol, 0, 1, {})
        try:
            found[name] = bool(analysed(rows, protocol, Settings(bootstrap=0)))
        except BadValue as error:
            found[name] = str(error)
    needed = found.pop("compliance-rating")
    assert needed == 'the analysis needs the package statsmodels: pip install "underfoot[analysis]"'
    assert set(found.values()) == {True}


@pytest.mark.parametrize("name", NAMES)
def test_every_study_is_analysed_with_tables_and_pictures(name):
    protocol = preset_protocol(name)
    rows = [row for k in range(4) for row in simulated_rows(protocol, k, 1, {})[0]]
    found, *others = analysed(rows, protocol, Settings(bootstrap=0))
    asks = any(question.kind != "text" for stage in protocol.stages for question in stage.questions)
    assert [other.title for other in others] == ["Questionnaires"] * asks
    assert found.tables
    assert found.drawings or name == "free-labels"
    for table in found.tables:
        assert all(len(row) == len(table.columns) for row in table.rows), table.title
    assert not [remark for remark in found.remarks if "columns" in remark]


DRAWN_LATER = ("compliance-rating", "free-labels", "target-selection")
"""Protocols of which twenty answers draw nothing yet."""


@pytest.mark.parametrize("name", NAMES)
def test_what_the_first_few_answers_say_can_be_drawn(name):
    """As the window does while a study runs: what they do not say yet is left out of the picture."""
    protocol = preset_protocol(name)
    rows = simulated_rows(protocol, 0, 1, {})[0]
    drawings = []
    for answered in (4, 8, 20):
        with suppress(BadMeasurement):
            for found in analysed(rows[:answered], protocol, Settings(bootstrap=0)):
                drawings += found.drawings
    assert all(svg(drawing).startswith("<svg") for drawing in drawings)
    assert bool(drawings) == (name not in DRAWN_LATER)


def test_the_ratings_of_people_who_feel_amplitude_show_it_and_nothing_else():
    protocol = preset_protocol("compliance-rating")
    rows = [row for k in range(8) for row in simulated_rows(protocol, k, 1, {"doubling": 10.0})[0]]
    left_early = [{**row, "participant": "S9"} for row in rows if not row["practice"]][:10]  # nobody else was tested
    (found,) = analysed([*rows, *left_early], protocol, Settings())
    assert "Tests are of who has rated every condition. Left out of them: S9." in found.remarks
    (effects,) = [table for table in found.tables if table.title.startswith("Effects of")]
    p = {row[0]: row[4] for row in effects.rows}
    assert p["amplitude"] < 1e-4
    (against,) = [table for table in found.tables if table.title == "Each against X"]
    assert len(against.rows) == 18
    assert np.mean([row[2] > 0.0 for row in against.rows]) == 1.0


def test_an_estimate_that_goes_with_age_is_found_by_rank_and_one_that_goes_with_shoes_by_group():
    """Seven people whose threshold rises with their age, the four youngest of them barefoot; some of them comment.

    One more has no threshold, since the session ended early, and nobody's was compared.
    """
    protocol = preset_protocol("detection-threshold")
    rows = []
    for k in range(7):
        mine, _ = simulated_rows(protocol, k, 1, {"threshold_m_s2": 0.2 * 1.5**k})
        asked = {"age": 20 + 5 * k, "shoes": "bare" if k < 4 else "hard", "comment": f"{k}", "after.hard": "bhbhbhb"[k]}
        rows += [row | {f"participant.{name}": answer for name, answer in asked.items()} for row in mine]
    early = {"participant": "S8", "participant.age": 20, "participant.shoes": "hard", "participant.comment": "7"}
    rows += [row | early for row in simulated_rows(protocol, 7, 1, {})[0][:4]]
    (found,) = analysed(rows, protocol, Settings())
    (table,) = [table for table in found.tables if table.title == "Who takes part"]
    rows = {row[0]: row for row in table.rows}
    assert rows["threshold TD, age"][2] == pytest.approx(1.0)
    thresholds = [row[2] for row in found.tables[0].rows][:7]
    test = f_oneway(thresholds[:4], thresholds[4:])
    assert rows["threshold TD, shoes"][2:5] == (pytest.approx(test.statistic), "1, 5", pytest.approx(test.pvalue))
    assert not [name for name in rows if "comment" in name or "after" in name]
    (groups,) = [table for table in found.tables if table.title == "Groups by shoes"]
    means = [np.mean(thresholds[:4]), np.mean(thresholds[4:])]
    of_people = (("bare", 4, pytest.approx(means[0])), ("hard", 3, pytest.approx(means[1])))
    assert groups.rows == tuple(("threshold TD", *row) for row in of_people)
