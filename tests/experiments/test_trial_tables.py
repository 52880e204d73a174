"""Tables of trials from other programs: what they say is read, and what they cannot say is one line."""

import json
import re
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from made_studies import TD, first_answers, made_protocol, preset_protocol, protocol_text, walked
from msgspec import structs

from underfoot.errors import BadFile, BadMeasurement, BadValue
from underfoot.experiments.analysis.analyses import ANALYSES, analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.excerpts import Excerpt
from underfoot.experiments.protocol import Protocol, Stage
from underfoot.experiments.questions import Question
from underfoot.experiments.simulation import simulated_rows
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Study
from underfoot.experiments.table import columns_of, factors_of, rows_of
from underfoot.experiments.trial_files import columns_of_study, csv_text, read_csv, value_of, write_bids, write_csv
from underfoot.patch import preset_files
from underfoot.studies.results import results_of, written_files
from underfoot.studies.session_lines import session_line

HEADER = "participant,method,trial"
ONE = np.ones((1, 1))


def analysis_of(tmp_path, text):
    path = tmp_path / "trials.csv"
    path.write_text(text)
    return analysed(results_of([path]).rows, None, Settings(bootstrap=0))


@pytest.mark.parametrize(
    ("method", "columns", "cells", "said"),
    [
        (
            "absolute-identification",
            "number,correct",
            "x,2",
            "trial 1 of P1: number is 'x'; allowed: a whole number",
        ),
        (
            "absolute-identification",
            "number,correct",
            "0,2",
            "trial 1 of P1: number is 0; allowed: a whole number",
        ),
        ("rating", "stimulus,rating", "a,soft", "trial 1 of P1: rating is 'soft'; allowed: a number"),
        ("rating", "stimulus,rating", "a,nan", "trial 1 of P1: rating is nan; allowed: a number"),
        ("rating", "practice,stimulus,rating", "no,a,5", "trial 1 of P1: practice is 'no'; allowed: true or false"),
        ("rating", "stimulus,rating,gain_db", "a,5,301", "trial 1 of P1: gain_db is 301; allowed: a number up to 300"),
        ("bayesian", "catch,level_db,felt", "no,1,yes", "trial 1 of P1: catch is 'no'; allowed: true or false"),
        ("constant-stimuli", "stimulus,felt", "a,Yes", "trial 1 of P1: felt is 'Yes'; allowed: yes or no"),
        ("staircases", "staircase,comparison,level_db,felt", "above,a,1,1", "trial 1 of P1: felt is 1; allowed: yes"),
        (
            "target-selection",
            "selected,time_s,width_m,distance_m,bearing_rad",
            "true,1,1,1,1",
            "trial 1 of P1: selected is True; allowed: yes or no",
        ),
        (
            "constant-stimuli",
            "stimulus,interval,comparison_at",
            "a,1,second",
            "trial 1 of P1: interval is 1; allowed: first or second",
        ),
        ("abx", "correct,answered", "A,a", "trial 1 of P1: answered is 'a'; allowed: A or B"),
        (
            "staircases",
            "staircase,comparison,level_db",
            "above,TD,",
            "the trials of staircases have no column level_db; allowed: a table with",
        ),
    ],
)
def test_a_cell_that_cannot_be_is_named_with_its_trial(method, columns, cells, said, tmp_path):
    with pytest.raises(BadValue) as raised:
        analysis_of(tmp_path, f"{HEADER},{columns}\nP1,{method},1,{cells}\n")
    assert str(raised.value).startswith(said)


def test_a_row_that_lacks_what_the_others_have_is_one_line(tmp_path):
    with pytest.raises(BadValue, match=r"^trial 2 of P1 has no rating; allowed: a rating wherever .*$"):
        analysis_of(tmp_path, f"{HEADER},stimulus,rating\nP1,rating,1,a,5\nP1,rating,2,a,\n")


def constant_stimuli(people, conditions="01", columns="stimulus,axis,condition", cells="a,{axis},{condition}"):
    """A table of constant stimuli: judgements of four levels in each condition, ten of each."""
    rows = [
        f"P{person},constant-stimuli,{trial},{cells.format(axis=axis, condition=condition)},{'yes' if yes else 'no'}"
        for person in range(1, people + 1)
        for condition in conditions
        for axis in range(1, 5)
        for trial, yes in enumerate(
            k < 1.8 * axis + 0.5 * person - person % 3 * (condition == "hard") for k in range(10)
        )
    ]
    return [f"{HEADER},{columns},felt", *rows]


def test_a_condition_that_somebody_lacks_is_compared_over_those_who_have_both(tmp_path):
    """Two lack one condition each: their values must not be paired with one another."""
    rows = constant_stimuli(people=6, conditions=("soft", "hard"))
    kept = [row for row in rows if not re.match("P1,.*,soft,|P2,.*,hard,", row)]
    assert len(kept) == len(rows) - 80
    (found,) = analysis_of(tmp_path, "\n".join(kept))
    only = [rows[0], *(row for row in rows if re.match("P[3-6],", row))]
    (expected,) = analysis_of(tmp_path, "\n".join(only))
    title = "Does condition change the threshold?"  # answered yes or no, without a standard
    tests = [next(table for table in one.tables if table.title == title) for one in (found, expected)]
    assert tests[0].rows == tests[1].rows
    assert tests[0].note == f"Left out, with no threshold in some condition: P1, P2. {tests[1].note}"


def test_curves_that_mix_a_further_factor_say_so(tmp_path):
    """Heel and toe have thresholds of their own: their common curve is shallower than both."""
    rows = constant_stimuli(people=2)
    for place, remarks in (("heel", []), (None, ["Each curve is over all values of place: they are told apart by"])):
        placed = [f"{row},{place or ('heel', 'toe')[k % 2]}" for k, row in enumerate(rows)]
        (found,) = analysis_of(tmp_path, "\n".join([f"{rows[0]},place", *placed[1:]]))
        assert [remark.partition(" condition only")[0] for remark in found.remarks if "place" in remark] == remarks


@pytest.mark.parametrize("stimulus", ["s{level}", "buzz"])
def test_what_another_program_notes_beside_the_trials_is_no_factor(stimulus, tmp_path):
    """The curve was over the response times."""
    rows = [f"{HEADER},stimulus,age,sex,thisRepN,thisN,rt,loudness,felt"]
    for person in (1, 2):
        trials = [(repeat, level) for repeat in range(10) for level in (3, 1, 4, 2)]
        for trial, (repeat, level) in enumerate(trials):
            noted = f"{20 + person},{'fm'[person % 2]},{repeat},{trial},{0.4 + trial * 7 % 40 / 100}"
            felt = "yes" if repeat < 2 * level - person else "no"
            named = stimulus.format(level=level)
            rows.append(f"P{person},constant-stimuli,{trial},{named},{noted},{level},{felt}")
    (found,) = analysis_of(tmp_path, "\n".join(rows))
    (shares,) = (table for table in found.tables if table.title == "Share judged more")
    assert shares.rows == tuple((level, pytest.approx((4 * level - 3) / 20)) for level in (1, 2, 3, 4))
    assert found.remarks[-1] == "No factors of the stimuli, and left out: age, sex, thisRepN, thisN, rt."


@pytest.mark.parametrize(
    ("axis", "levels", "beside"),
    [
        ("stiffness_n_mm", ("0", "0.43"), True),
        ("stiffness_n_mm", ("0", "1"), False),
        ("frequency", ("0", "0.43"), False),
    ],
)
def test_the_thesis_stands_beside_curves_over_stiffness_at_its_levels_only(axis, levels, beside, tmp_path):
    """Its slope of 0.025 mm/N stood beside one of 0.026 s."""
    columns = f"stimulus,{axis},level_m_s2"
    (found,) = analysis_of(tmp_path, "\n".join(constant_stimuli(people=4, conditions=levels, columns=columns)))
    (over_people,) = (table for table in found.tables if table.title == "Curves over people")
    assert ("thesis, median" in over_people.columns) == beside
    of, name, mean, *_, deviation, count, median = over_people.rows[0][:9]
    values = [row[2] for row in found.tables[0].rows if row[1] == name]
    told = (np.mean(values), np.std(values, ddof=1), len(values), np.median(values))
    assert (of, mean, deviation, count, median) == ("all people", *map(pytest.approx, told))
    (drawing,) = (one for one in found.drawings if one.title == "Thresholds over people")
    assert drawing.x_names == tuple(dict.fromkeys(row[1].partition(" ")[2] for row in found.tables[0].rows))
    assert list(drawing.series[0].y[: len(values)]) == values
    assert any("Thesis" in table.note for table in found.tables) == beside


def test_a_trial_without_its_condition_is_named(tmp_path):
    rows = constant_stimuli(people=2)
    rows[7] = rows[7].replace(",0,", ",,", 1)
    with pytest.raises(BadValue, match=r"^trial \d of P1 has no condition; allowed: a condition wherever"):
        analysis_of(tmp_path, "\n".join(rows))


@pytest.mark.parametrize("cell", ["3", "nan", "1e300", "9" * 400])
def test_a_factor_that_is_numbers_here_and_words_there_is_words(tmp_path, cell):
    rows = constant_stimuli(people=2, conditions=("soft", cell))
    (found,) = analysis_of(tmp_path, "\n".join(rows))
    (shares,) = (table for table in found.tables if table.title == "Share judged more")
    assert shares.columns[1:] == tuple(f"condition {value}" for value in sorted(["soft", str(value_of(cell))]))


def test_a_fault_of_the_analysis_is_not_told_as_the_tables(tmp_path, monkeypatch):
    broken = replace(ANALYSES["rating"], findings=lambda rows, settings: {}["a slip of ours"])
    monkeypatch.setitem(ANALYSES, "rating", broken)
    with pytest.raises(KeyError, match="a slip of ours"):
        analysis_of(tmp_path, f"{HEADER},stimulus,rating\nP1,rating,1,a,5\n")


@pytest.mark.parametrize(("no", "yes"), [("false", "true"), ("False", "True"), ("FALSE", "TRUE")])
def test_a_table_that_a_spreadsheet_saved_has_the_same_trials(tmp_path, no, yes):
    """Labels are sorted in one: it writes what is true in capitals, and every trial was practice."""
    rows = [f"P1,free-labels,{trial},{practice},a,x,knock" for trial, practice in enumerate((yes, no, no))]
    (found,) = analysis_of(tmp_path, "\n".join([f"{HEADER},practice,stimulus,label,sort", *rows]))
    (labels,) = (table for table in found.tables if table.title == "Labels")
    assert labels.rows == (("a", "x (2)"),)


@pytest.mark.parametrize("empty", ["NA", "n/a"])
def test_cells_that_another_program_left_empty_are_empty(tmp_path, empty):
    """R wrote NA as why a trial is spoiled, and no trial counted."""
    header, *lines = csv_text(simulated_rows(preset_protocol("identification-impact"), 0, 1, {})[0]).splitlines()
    filled = [",".join(cell or empty for cell in line.split(",")) for line in lines]
    found, as_written = (analysis_of(tmp_path, "\n".join([header, *of])) for of in (filled, lines))
    assert repr(found) == repr(as_written)


def test_numbers_of_stimuli_are_whole_however_a_program_writes_them(tmp_path):
    """Pandas writes 2.0 in a column with empty cells, such as the answer of a spoiled trial."""
    plain = [
        f"P1,absolute-identification,{k},,{answer},{right}" for k, (answer, right) in enumerate(["12", "22", "11"])
    ]
    written = [re.sub(r",,(\d),", r",,\1.0,", row) for row in plain]
    assert written != plain
    header = f"{HEADER},spoiled,number,correct"
    spoiled = "P1,absolute-identification,4,late,,1"
    found, expected = (analysis_of(tmp_path, "\n".join([header, *rows, spoiled])) for rows in (written, plain))
    assert repr([one.tables for one in found]) == repr([one.tables for one in expected])


@pytest.mark.parametrize(("one", "zero"), [("1", "0"), ("1.0", "0.0"), ("1.0", "0"), ("true", "false")])
def test_right_answers_count_however_a_program_writes_1(tmp_path, one, zero):
    """Pandas writes 1.0 in a column with empty cells: such trials were left out."""
    rows = [f"P1,free-labels,{trial},a,x,{right}" for trial, right in enumerate((one, one, zero, ""))]
    (found,) = analysis_of(tmp_path, "\n".join([f"{HEADER},stimulus,label,right", *rows]))
    (shares,) = (table for table in found.tables if table.title == "Right answers")
    assert shares.rows[0][:5] == ("all", 1, 2, 3, pytest.approx(2 / 3))


def test_staircases_of_a_table_that_was_sorted_by_level_are_those_that_were_climbed(tmp_path):
    """Down 2 dB after each yes, up after each no: the order of the trials is the staircase."""
    level, rows = 6, []
    for trial in range(1, 31):
        yes = level > (trial % 3)
        rows.append((level, f"P1,staircases,{trial},above,TD,{level},{'yes' if yes else 'no'}"))
        level += -2 if yes else 2
    header = f"{HEADER},staircase,comparison,level_db,felt"
    found = [
        analysis_of(tmp_path, "\n".join([header, *(row for _, row in order)]))[0].tables
        for order in (rows, sorted(rows))
    ]
    assert found[0][0].rows[0][2] == pytest.approx(1.5, abs=1.0)  # the threshold, in dB
    assert repr(found[1]) == repr(found[0])


def test_words_that_look_like_numbers_stay_words(tmp_path):
    rows = "P1,free-labels,1,7,12\nP1,free-labels,2,hum,12\nP2,free-labels,1,7,twelve\n"
    (found,) = analysis_of(tmp_path, f"{HEADER},stimulus,label\n{rows}")
    assert found.tables[0].rows == (("7", "12, twelve"), ("hum", "12"))


def test_a_pair_of_numbers_is_no_number(tmp_path):
    path = tmp_path / "trials.csv"
    path.write_text(f"{HEADER},stimulus,pair,rating\nP1,rating,1,a,1_2,5\nP1,rating,2,b,12,7\n")
    assert [row["pair"] for row in read_csv(path)] == ["1_2", 12]


def test_a_trial_that_two_files_have_counts_once(tmp_path):
    text = csv_text(simulated_rows(preset_protocol("identification-impact"), 0, 1, {})[0])
    paths = [tmp_path / "a.csv", tmp_path / "b.csv"]
    for path in paths:
        path.write_text(text)
    with pytest.raises(BadValue, match=r"b\.csv: S1's trial 1 of main is in a file before it, too"):
        results_of(paths)
    paths[1].write_text(text.replace("S1,", "S2,"))
    assert len(results_of(paths).rows) == 2 * len(results_of(paths[:1]).rows)
    paths[1].write_text(text.replace(",IT", ",WS"))  # the other set, by the same person in another study
    assert len(results_of(paths).rows) == 2 * len(results_of(paths[:1]).rows)


@pytest.mark.parametrize("left_out", [0, 1])
def test_of_two_sessions_of_one_id_one_counts_if_the_other_is_left_out(tmp_path, left_out):
    """Two computers had given one id: the study could not be analysed, and to leave one out was of no use."""
    protocol = made_protocol("rating", {"blocks": 1, "rated": ["TD"]})
    paths = [tmp_path / "P1.session", tmp_path / "P1-again.session"]
    for rating, path in enumerate(paths):
        with closing(SessionFile.create(path, protocol, "P1")) as file:
            file.add(
                file.study(protocol).answer({"rating": rating}), [Excerpt("force", 0, rating, 1.0, ("t1.1",), ONE)]
            )
            file.correct_id("P7")
    with pytest.raises(BadValue, match=r"analyse one of them, leave one out, or correct an id$"):
        results_of(paths)
    with closing(SessionFile.open(paths[left_out])) as file:
        file.leave_out("on the other computer")
    assert [session_line(path).participant for path in paths] == ["P7 (P1.session)", "P7 (P1-again.session)"]
    found = results_of(paths)
    assert [row["rating"] for row in found.rows] == [1 - left_out]
    assert found.remarks == ["Left out by the experimenter: P7 (on the other computer)."]
    found.write_bids(tmp_path / "bids")
    assert "left_out" not in (tmp_path / "bids" / "participants.tsv").read_text()
    (recorded,) = (tmp_path / "bids").rglob("*_physio.json")
    assert recorded.is_relative_to(tmp_path / "bids" / "sub-P7")
    assert json.loads(recorded.read_text())["StartTime"] == 1 - left_out


def test_what_the_experimenter_noted_is_in_the_report(tmp_path):
    """It was kept, and could be read nowhere."""
    protocol = made_protocol("rating", {"blocks": 1})
    with closing(SessionFile.create(tmp_path / "P1.session", protocol, "P1")) as file:
        file.add(file.study(protocol).answer({"rating": 40.0}))
        file.add_note("has changed shoes")
        at = file.notes()[0].at[:16].replace("T", " ")
    written_files([tmp_path / "P1.session"], "report", tmp_path, Settings(bootstrap=0), protocol)
    page = (tmp_path / "analysis.html").read_text()
    assert re.search(f"<td>P1</td><td>{at}:..</td><td>1</td><td>has changed shoes</td>", page)


def test_sessions_that_lack_answers_are_named_and_a_word_of_thanks_is_none(tmp_path):
    """They counted as the others, and nobody was told; who does not confirm the thanks has answered all the same."""
    made = made_protocol("rating", {"blocks": 2, "rated": ["TD"]})
    protocol = structs.replace(made, stages=(*made.stages, Stage(id="thanks", kind="read")))
    paths = [tmp_path / f"P{answers}.session" for answers in (1, 2, 3)]
    for answers, path in enumerate(paths, 1):
        with closing(SessionFile.create(path, protocol, path.stem)) as file:
            study = file.study(protocol)
            while len(study.entries) < answers:
                file.add(study.answer(first_answers(study.page)))
    assert results_of(paths).remarks == ["Not finished, and counted as far as they go: P1."]
    with closing(SessionFile.open(paths[0])) as file:
        file.correct_id("P9")
    assert results_of(paths).remarks == ["Not finished, and counted as far as they go: P9 (P1.session)."]
    with closing(SessionFile.open(paths[0])) as file:
        file.leave_out("went home")  # who does not count
    assert not any("Not finished" in remark for remark in results_of(paths).remarks)


def test_sessions_count_if_their_protocol_differs_in_words_alone(tmp_path):
    """Presets say something in other words from one version to the next, and nobody's earlier sessions counted."""
    asked = (Question("age", "How old?", "number"),)
    before = structs.replace(made_protocol("rating", {"blocks": 1, "rated": ["TD"]}), participant=asked)
    paths = [tmp_path / "P1.session"]
    with closing(SessionFile.create(paths[0], before, "P1")) as file:
        study = file.study(before)
        for answer in ({"age": 40.0}, {"rating": 40.0}):
            file.add(study.answer(answer))
    stages = tuple(structs.replace(stage, title="Softness", text="Cross it.") for stage in before.stages)
    asked = (Question("age", "How old are you?", "number"),)
    now = structs.replace(before, title="Study", about="It is.", double_blind=True, stages=stages, participant=asked)
    (found, *_) = results_of(paths, now).findings(Settings(bootstrap=0))
    assert (
        found.remarks[-1] == "Begun with other titles, texts or words of questions, blinding, or foot, and counted: P1."
    )
    assert found.tables
    with pytest.raises(BadMeasurement, match=r"^Begun with another version of the protocol, left out: P1\. Analyse"):
        results_of(paths, structs.replace(now, seed=2)).findings(Settings(bootstrap=0))


def test_who_prefers_the_left_foot_counts_with_the_others(tmp_path):
    """Their buttons lie on the other side, so that their sessions were another study's; bearings are alike for both."""
    paths = []
    for foot in ("right", "left"):
        given = {"repeats": 1, "widths_m": [0.1], "distances_m": [0.3], "preferred_foot": foot}
        protocol = made_protocol("target-selection", given)
        paths.append(tmp_path / f"{foot}.session")
        with closing(SessionFile.create(paths[-1], protocol, foot)) as file:
            study = file.study(protocol)
            while not study.is_done:
                file.add(study.answer({"selected": "yes", "time_s": 0.8}))
    found = results_of(paths)
    assert found.reworded == ("left",)
    places = [
        sorted((row["bearing_rad"], row["x_m"]) for row in found.rows if row["participant"] == foot)
        for foot in ("right", "left")
    ]
    assert places[1] == [(bearing, -x) for bearing, x in places[0]]
    assert found.findings(Settings(bootstrap=0))[0].tables


@pytest.mark.parametrize("damaged", [b"", b"not a database"])
def test_a_damaged_session_is_not_told_as_a_bad_table_and_the_others_count(damaged, tmp_path):
    """One damaged file of twenty stopped the analysis of the study, and there was no way to leave it out."""
    path, good = tmp_path / "P1.session", tmp_path / "P2.session"
    path.write_bytes(damaged)
    with pytest.raises(BadFile, match=f"^{re.escape(str(path))} is not a session of a study"):
        results_of([path])
    protocol = made_protocol("rating", {"blocks": 1, "rated": ["TD"]})
    with closing(SessionFile.create(good, protocol, "P2")) as file:
        file.add(file.study(protocol).answer({"rating": 40.0}))
    found = results_of([path, good], protocol)
    assert [row["participant"] for row in found.rows] == ["P2"]
    said = found.findings(Settings(bootstrap=0))[0].remarks[-1]
    assert said.startswith(f"Cannot be read, and does not count: {path} is not a session of a study")
    with pytest.raises(BadFile, match=r"P3.session cannot be read: no such file$"):  # a name typed wrong
        results_of([tmp_path / "P3.session", good])


def test_bids_of_a_long_title_is_written_and_an_id_of_signs_only_is_refused(tmp_path):
    row = {"participant": "P1", "method": "rating", "trial": 1, "rating": 5}
    paths = write_bids(tmp_path / "long", [row], "Ice " * 100)
    assert all(path.is_file() for path in paths)
    with pytest.raises(BadFile, match="id has signs only"):
        write_bids(tmp_path / "signs", [{**row, "participant": "_"}], "Ice")


def test_what_a_questionnaire_asked_is_in_every_row_of_its_participant_also_if_it_comes_last(tmp_path):
    likert = {"name": "real", "text": "It felt real.", "kind": "choice", "options": ["disagree", "agree"]}
    stages = [
        {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}},
        {"id": "after", "kind": "questions", "questions": [likert, {"name": "remarks", "text": "Remarks?"}]},
    ]
    study = Study(Protocol.loads(protocol_text(stages=stages)), "P1")
    said = {"real": "agree", "remarks": "cold, wet"}
    walked(study, lambda page: said if page.kind == "questions" else first_answers(page))
    rows = rows_of(study.protocol, "P1", study.entries)
    path = tmp_path / "trials.csv"
    write_csv(path, rows)
    for found in (rows, read_csv(path)):
        assert [row["participant.after.real"] for row in found] == ["agree", "agree"]
        assert [row["participant.after.remarks"] for row in found] == ["cold, wet", "cold, wet"]
    assert factors_of(rows) == ("level_m_s2",)
    write_bids(tmp_path / "bids", rows, "A study", study.protocol)
    listed = (tmp_path / "bids" / "participants.tsv").read_text().splitlines()
    assert listed == ["participant_id\tafter.real\tafter.remarks", "sub-P1\tagree\tcold, wet"]
    asked = json.loads((tmp_path / "bids" / "participants.json").read_text())
    assert asked["after.remarks"] == {"Description": "Remarks?"}
    made = json.loads((tmp_path / "bids" / "dataset_description.json").read_text())["GeneratedBy"]
    assert [one["Name"] for one in made] == ["Underfoot"]
    readme = tmp_path / "bids" / "README"
    assert readme.read_text().startswith("A study\n")
    readme.write_text("of the people who had the study")
    write_bids(tmp_path / "bids", rows, "A study", study.protocol)
    assert readme.read_text() == "of the people who had the study"


@pytest.mark.parametrize("name", preset_files.protocols())
def test_every_column_is_described_in_bids_and_on_the_page(name, tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "experiments.md").read_text()
    protocol = preset_protocol(name)
    rows = simulated_rows(protocol, 0, 1, {})[0]
    write_bids(tmp_path, rows, "study", protocol)
    sidecar = json.loads((tmp_path / "sub-S1" / "beh" / "sub-S1_task-study_beh.json").read_text())
    factors = {name for stimulus in protocol.stimuli.values() for name in stimulus.factors}
    own = [column for column in columns_of(rows) if column != "participant" and column not in factors]
    assert [column for column in own if sidecar[column]["Description"].startswith("Answer, or fact")] == []
    assert [column for column in own if "." not in column and f"`{column}`" not in page] == []


def test_a_magnitude_is_described_in_bids(tmp_path):
    write_bids(tmp_path, [{"participant": "P1", "magnitude": 4.0}], "loud")
    sidecar = json.loads((tmp_path / "sub-P1" / "beh" / "sub-P1_task-loud_beh.json").read_text())
    assert sidecar["magnitude"]["Description"] == "Answer: a number above 0, on a scale of the participant's own."


def test_tables_of_a_study_have_the_same_columns_whatever_came_first(tmp_path):
    """A catch trial before an announced one changed their places, and a questionnaire at the end came late."""
    protocol = preset_protocol("detection-threshold")
    people = [simulated_rows(protocol, person, 1, {})[0] for person in (0, 3)]
    assert columns_of(people[0]) != columns_of(people[1])
    for rows in people:
        assert columns_of_study(rows, protocol) == columns_of_study(people[0], protocol)
    likert = {"id": "after", "kind": "questions", "questions": [{"name": "real", "text": "Real?"}]}
    stages = [*json.loads(protocol_text())["stages"], likert]
    stimuli = {"X": {}, "TD": {**TD, "factors": {"place": "toe"}}}
    study = Study(Protocol.loads(protocol_text(stages=stages, stimuli=stimuli)), "P1")
    first = study.answer(first_answers(study.page))
    rows = rows_of(study.protocol, "P1", [first])
    walked(study)
    whole = [row | {"participant": "P2"} for row in rows_of(study.protocol, "P2", study.entries)]
    assert columns_of_study(rows, study.protocol) == columns_of_study(whole, study.protocol)
    assert columns_of_study(rows, study.protocol)[-2:] == ["place", "participant.after.real"]
    write_bids(tmp_path, [*rows, *whole], "loud", study.protocol)
    headers = {path.read_text().splitlines()[0] for path in tmp_path.rglob("*_beh.tsv")}
    assert len(headers) == 1


def test_a_study_and_the_csv_of_it_are_analysed_by_the_same_factors_in_the_same_order(tmp_path):
    """The one followed the stimulus that came first; two with as many values took each other's place as the axis."""
    pairs = ({"hard": 1, "wide": 3}, {"wide": 1, "hard": 2}, {"wide": 2, "hard": 3})
    stimuli = {f"S{k}": {**TD, "factors": factors} for k, factors in enumerate(pairs)}
    protocol = made_protocol("rating", {"blocks": 2}, {**stimuli, "X": {}})
    for person in range(4):
        rows = simulated_rows(protocol, person, 1, {})[0]
        write_csv(tmp_path / "a.csv", rows, columns_of_study(rows, protocol))
        assert factors_of(rows) == factors_of(read_csv(tmp_path / "a.csv")) == ("level_m_s2", "hard", "wide")


def test_what_bids_takes_for_its_own_has_another_name_there(tmp_path):
    """Its validator missed the sound files of a factor, and ids and response times were those of the study's column."""
    row = {"participant": "P1", "trial": 1, "response_s": 0.5, "response_time": "fast", "stim_file": "knock.wav"}
    row["TaskName"] = "of a factor"
    write_bids(tmp_path, [{**row, "participant.participant_id": "x", "participant.HED": "y"}], "loud")
    header, line = (tmp_path / "sub-P1" / "beh" / "sub-P1_task-loud_beh.tsv").read_text().splitlines()
    cells = dict(zip(header.split("\t"), line.split("\t"), strict=True))
    assert (cells["response_time"], cells["study.response_time"]) == ("0.5", "fast")
    assert cells["study.stim_file"] == "knock.wav"
    sidecar = json.loads((tmp_path / "sub-P1" / "beh" / "sub-P1_task-loud_beh.json").read_text())
    assert (sidecar["TaskName"], sidecar["response_time"]["Units"]) == ("loud", "s")
    listed = (tmp_path / "participants.tsv").read_text()
    assert listed == "participant_id\tparticipant.participant_id\tparticipant.HED\nsub-P1\tx\ty\n"


def test_a_button_that_a_simulated_person_misses_was_there_until_it_vanished():
    rows = simulated_rows(preset_protocol("target-selection"), 0, 1, {})[0]
    assert {row["time_s"] for row in rows if row["selected"] == "no"} == {2.0}
