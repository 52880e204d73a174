"""Orders of stages and of stimuli by Williams's Latin squares: who gets which, and how balanced a study is so far."""

from collections import Counter
from contextlib import closing
from itertools import pairwise
from math import lcm

import pytest
from made_studies import TD, protocol_text, trials, walked

from underfoot.commands.participant import pilot_id
from underfoot.errors import BadFile, BadValue
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.latin_square import Turn, number_of_row, row_of, rows_of
from underfoot.experiments.plan import plan_of
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Study
from underfoot.experiments.table import rows_of as table_of

STIMULI = dict.fromkeys(("A", "B", "C"), TD)


def rated(id, **parameters):
    return {"id": id, "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 2, **parameters}}}


def made(stages, counterbalanced=(), stimuli=STIMULI):
    return Protocol.loads(protocol_text(stages=stages, stimuli=stimuli, counterbalanced=counterbalanced))


TWO = made(
    [{"id": "read", "kind": "read"}, rated("one"), {"id": "rest", "kind": "pause"}, rated("two")], ["one", "two"]
)


@pytest.mark.parametrize("size", range(2, 12))
def test_each_condition_is_as_often_in_each_place_and_after_each_other(size):
    rows = [row_of(size, number) for number in range(1, rows_of(size) + 1)]
    places = Counter(place for row in rows for place in enumerate(row))
    following = Counter(pair for row in rows for pair in pairwise(row))
    assert (len(places), len(set(places.values()))) == (size * size, 1)
    assert (len(following), len(set(following.values()))) == (size * (size - 1), 1)


@pytest.mark.parametrize(
    ("participant", "order"), [("P01", ["one", "two"]), ("P02", ["two", "one"]), ("7", ["one", "two"])]
)
def test_stages_change_places_by_the_number_in_the_id(participant, order):
    stages = [page.stage for page in walked(Study(TWO, participant))]
    assert list(dict.fromkeys(stages)) == ["read", order[0], "rest", order[1]]
    assert list(dict.fromkeys(row["stage"] for row in plan_of(TWO, participant))) == order


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("rating", {"blocks": 6}),
        ("magnitude-estimation", {"blocks": 6}),
        ("constant-stimuli", {"blocks": 6}),
        ("free-labels", {"repeats": 6}),
        ("absolute-identification", {"sessions": 3, "repeats": 2}),
    ],
)
def test_stimuli_of_successive_blocks_have_successive_rows(kind, parameters):
    """So that one person, over all rows, has each stimulus as often in each place."""
    stage = {"id": "main", "kind": "trials"}
    protocol = made([{**stage, "method": {"kind": kind, "parameters": {**parameters, "order": "counterbalanced"}}}])
    found = trials(walked(Study(protocol, "P02")))
    names = ["ABC"[k] for number in (2, 3, 4, 5, 6, 1) for k in row_of(3, number)]
    assert [trial.intervals[0].stimulus for trial in found] == names
    assert [trial.facts["block_row"] for trial in found[::3]] == [2, 3, 4, 5, 6, 1]


def test_a_second_stage_goes_on_with_the_next_rows_and_the_report_says_whose_they_are():
    """Both followed the number alike, so that everybody felt the same order twice."""
    stages = [rated("practice", order="counterbalanced"), rated("other"), rated("main", order="counterbalanced")]
    protocol = made(stages)
    study = Study(protocol, "P01")
    pages = walked(study)
    assert [[trial.facts["block_row"] for trial in trials(pages, stage)[::3]] for stage in ("practice", "main")] == [
        [1, 2],
        [3, 4],
    ]
    *_, found = analysed(table_of(protocol, "P01", study.entries), protocol, Settings())
    assert [table.note.partition("fewest. ")[2] for table in found.tables] == [
        "The number in an id is its row. Above 6 it begins at row 1 again.",
        "The number in an id, and 2 more, is its row. Above 6 it begins at row 1 again.",
    ]


@pytest.mark.parametrize(("stages", "size"), [(2, 2), (2, 3), (2, 4), (3, 3), (3, 4), (4, 5)])
def test_every_order_of_stages_meets_every_order_of_stimuli(stages, size):
    """Both followed the number alike, so that of two stages and three stimuli odd ids had rows 1, 3 and 5."""
    pairs = [(number_of_row(f"P{k}", stages), Turn(f"P{k}", stages).row(size)) for k in range(1, 201)]
    orders, rows = rows_of(stages), rows_of(size)
    assert len(set(pairs[: orders * rows])) == orders * rows
    assert set(Counter(row for _, row in pairs[: lcm(orders, rows)]).values()) == {lcm(orders, rows) // rows}
    if size % 2:  # half of the people do for places
        places = Counter((o, place) for o, row in pairs[: orders * size] for place in enumerate(row_of(size, row)))
        assert (len(places), len(set(places.values()))) == (orders * size * size, 1)


def test_the_report_has_who_met_which_pair_of_orders_and_whose_ids_are_next():
    protocol = made([rated(id, order="counterbalanced") for id in ("one", "two")], ["one", "two"])
    rows = []
    for number in range(1, 8):
        study = Study(protocol, f"P{number}")
        walked(study)
        rows += table_of(protocol, f"P{number}", study.entries)
    *_, found = analysed(rows, protocol, Settings())
    first, second = found.tables[2], found.tables[4]
    assert first.rows == ((1, 1, 0), (2, 1, 0), (3, 1, 0), (4, 1, 1), (5, 0, 1), (6, 0, 1))
    assert second.rows == ((1, 0, 1), (2, 0, 1), (3, 1, 0), (4, 1, 0), (5, 1, 0), (6, 1, 1))
    for table in (first, second):
        assert "the rows of ids with the number 8, 9, 10, 11, 12. Above 12 it begins again." in table.note


def test_who_had_which_row_is_in_the_table_and_the_balance_in_the_report():
    protocol = made([rated("one", order="counterbalanced"), rated("two")], ["one", "two"])
    rows = []
    for participant in ("P01", "P02", "P03"):
        study = Study(protocol, participant)
        walked(study)
        rows += table_of(protocol, participant, study.entries)
    assert {(row["participant"], row["stages_row"]) for row in rows} == {("P01", 1), ("P02", 2), ("P03", 1)}
    *_, found = analysed(rows, protocol, Settings())
    stages, stimuli, _ = found.tables
    assert stages.rows == ((1, "one, two", 2), (2, "two, one", 1))
    assert stages.note.startswith("Not balanced: row 2 has fewest.")
    assert stimuli.note.startswith("Not balanced: rows 3, 5, 6 have fewest.")
    assert [row[1:] for row in stimuli.rows[:3]] == [("A, B, C", 1), ("B, C, A", 1), ("C, A, B", 0)]
    assert [row[2] for row in stimuli.rows[3:]] == [1, 0, 0]
    *_, sorted_otherwise = analysed(rows[::-1], protocol, Settings())
    assert [table.rows for table in sorted_otherwise.tables] == [table.rows for table in found.tables]


def test_a_table_of_another_program_need_not_have_the_rows_and_what_is_no_row_is_refused():
    protocol = made([rated("one"), rated("two")], ["one", "two"])
    study = Study(protocol, "P01")
    walked(study)
    rows = table_of(protocol, "P01", study.entries)
    without = [{name: value for name, value in row.items() if name != "stages_row"} for row in rows]
    assert [found.title for found in analysed(without, protocol, Settings())] == ["Rating: one", "Rating: two"]
    with pytest.raises(BadValue, match="trial 1 of P01: stages_row is 'first'; allowed: a number"):
        analysed([row | {"stages_row": "first"} for row in rows], protocol, Settings())


def test_an_interrupted_session_goes_on_in_its_order(tmp_path):
    file = SessionFile.create(tmp_path / "a.session", TWO, "P02")
    study = file.study(TWO)
    for _ in range(3):
        file.add(study.answer({q.name: q.default for q in study.page.questions}), [])
    assert file.study(TWO).page == study.page
    file.close()


def test_a_session_that_was_begun_with_other_rows_goes_on_with_them_to_its_end():
    """Earlier versions gave each stage the row of the number alone; what a person had answered was refused."""
    protocol = made([rated(id, order="counterbalanced") for id in ("one", "two")], ["one", "two"])
    earlier = Study(made([rated("one", order="counterbalanced")]), "P03")
    begun = [page.trial for page in walked(earlier) if page.trial is not None]
    assert begun[0].facts["block_row"] != trials(walked(Study(protocol, "P03")), "one")[0].facts["block_row"]
    for kept in (1, 4, 6):  # within a block, in the next one, and with a stage to come
        study = Study(protocol, "P03", earlier.entries[:kept])
        walked(study)
        assert [entry.trial for entry in study.entries[:6]] == begun
        assert study.is_done


@pytest.mark.parametrize("protocol", [TWO, made([rated("one", order="counterbalanced")])])
def test_an_id_without_a_number_is_refused_before_there_is_a_session(protocol, tmp_path):
    with pytest.raises(BadValue, match="participant is 'Ann'; allowed: an id with a number"):
        SessionFile.create(tmp_path / "a.session", protocol, "Ann")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("protocol", [TWO, made([rated("one", order="counterbalanced")])])
def test_a_pilot_in_a_file_without_a_number_has_the_first_order(protocol, tmp_path):
    """It was refused for its name."""
    person = pilot_id("my try", follows_number=protocol.follows_number)
    with closing(SessionFile.create(tmp_path / "my try.session", protocol.pilot(), person)) as file:
        assert file.study(protocol.pilot()).page == Study(protocol.pilot(), "P01").page
    assert not made([rated("one")]).follows_number


@pytest.mark.parametrize("named", [["one"], ["one", "one"], ["one", "three"]])
def test_stages_that_cannot_change_places_are_refused(named):
    with pytest.raises(BadFile, match=r"counterbalanced is .*; allowed: two or more stages of this protocol"):
        made([rated("one"), rated("two")], named)
