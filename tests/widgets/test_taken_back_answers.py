"""Answers that the experimenter takes back, in the window, by the hands of both."""

import pytest
from PySide6.QtCore import Qt

from underfoot.studies.phase import Phase
from underfoot.widgets.experiment.experimenter_view import WHY_FIRST

pytest.importorskip("statsmodels")
AGE = {"name": "age", "text": "How old are you?", "kind": "count", "low": 18, "high": 99}
TIRED = {"name": "tired", "text": "How tired are you?", "kind": "count", "low": 0, "high": 100}


def test_answers_to_questions_are_taken_back_for_a_reason_also_the_last_ones(bench):
    """Who saw a wrong age, or the wrong answer to the last question, could not take it back."""
    after = {"id": "after", "kind": "questions", "title": "Afterwards", "questions": [TIRED]}
    bench.choose(stages=[after], participant=[AGE])
    desk = bench.workspace.experimenter

    def answer(name, keys):
        bench.wait(lambda: name in bench.person.form.fields)
        field = bench.person.form.fields[name]
        assert field.text() == ""
        bench.qtbot.keyClicks(field, keys)
        bench.qtbot.keyClick(field, Qt.Key.Key_Return)

    def take_back(why, attempt):
        bench.wait(desk.repeat.isEnabled)
        bench.qtbot.keyClicks(desk.note_field, why)
        bench.click(desk.repeat)
        bench.wait(lambda: f"attempt {attempt}" in desk.page.text())

    bench.until(Phase.PAGE)
    bench.wait(desk.page.text)
    assert not desk.repeat.isEnabled()  # nothing is answered
    answer("age", "52")
    bench.wait(desk.repeat.isEnabled)
    bench.click(desk.repeat)
    bench.wait(lambda: desk.news.text() == WHY_FIRST)
    take_back("it is 25", 2)
    answer("age", "26")
    take_back("25 at last", 3)
    answer("age", "25")
    answer("tired", "9")
    bench.until(Phase.END)
    take_back("it was 6", 2)
    answer("tired", "6")
    bench.until(Phase.END)
    kept = [({**entry.answers}, entry.attempt, entry.spoiled) for entry in bench.entries()]
    assert kept == [
        ({"age": 52}, 1, "it is 25"),
        ({"age": 26}, 2, "25 at last"),
        ({"age": 25}, 3, ""),
        ({"tired": 9}, 1, "it was 6"),
        ({"tired": 6}, 2, ""),
    ]
