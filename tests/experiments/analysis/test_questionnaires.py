"""Questionnaires in the analysis: counts of options, medians, and nothing where nobody was asked."""

import pytest
from made_studies import protocol_text

from underfoot.errors import BadValue
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.protocol import Protocol

OPTIONS = ["disagree", "neither", "agree"]
STAGES = [
    {"id": "main", "kind": "trials", "method": {"kind": "rating", "parameters": {"blocks": 1}}},
    {"id": "after", "kind": "questions", "questions": [
        {"name": "real", "text": "It felt real.", "kind": "choice", "options": OPTIONS},
        {"name": "firm", "text": "How firm?", "kind": "number"},
        {"name": "remarks", "text": "Remarks?"},
    ]},
]  # fmt: skip


def rows_of_people(answers):
    return [
        {"participant": f"P{k}", "stage": "main", "method": "rating", "trial": trial, "block": 1, "stimulus": name,
         "rating": 50.0, **answer}
        for k, answer in enumerate(answers, 1) for trial, name in enumerate(("TD", "X"), 1)
    ]  # fmt: skip


def test_each_person_counts_once_and_options_stay_in_their_order():
    protocol = Protocol.loads(protocol_text(stages=STAGES))
    said = [("agree", 10.0), ("disagree", 20.0), ("agree", 60.0), ("neither", 30.0)]
    rows = rows_of_people([{"participant.after.real": a, "participant.after.firm": n} for a, n in said])
    choice, number = analysed(rows, protocol, Settings())[-1].tables
    assert choice.title == "after: It felt real."
    assert choice.rows == (("disagree", 1), ("neither", 1), ("agree", 2))
    assert choice.note == "Median: neither."
    assert number.rows == ((4, 30.0, 25.0, 10.0, 60.0),)
    words = rows_of_people([{"participant.after.firm": "quite"}])  # as another program, or a hand, wrote it
    with pytest.raises(BadValue, match=r"after: How firm\? is 'quite'; allowed: a number"):
        analysed(words, protocol, Settings())


def test_without_answers_there_is_no_table():
    protocol = Protocol.loads(protocol_text(stages=STAGES))
    assert [found.title for found in analysed(rows_of_people([{}]), protocol, Settings())] == ["Rating: main"]
