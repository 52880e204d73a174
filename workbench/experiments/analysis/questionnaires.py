"""Answers to questionnaires: the frequency of each option, and medians."""

from collections.abc import Sequence
from statistics import mean, median

from underfoot.errors import require
from underfoot.experiments.analysis.findings import Cell, Findings, Table
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import Question
from underfoot.experiments.table import OF_PERSON, Row, grouped


def questionnaires(rows: Sequence[Row], protocol: Protocol) -> list[Findings]:
    """Return the answers to the questions of a protocol's stages, over people; [] if there are none.

    The options of a choice are ordered, as in a Likert item. The median is one of the options; of two middle ones, the
    lower.
    """
    people = [part[0] for part in grouped(rows, "participant").values()]
    found = []
    for stage in protocol.stages:
        for question in stage.questions:
            column = f"{OF_PERSON}{stage.id}.{question.name}"
            given = [person[column] for person in people if person.get(column, "") != ""]
            if given and question.kind != "text":
                found.append(_table(f"{stage.id}: {question.text}", question, given))
    return [Findings("Questionnaires", tables=found)] if found else []


def _table(title: str, question: Question, given: Sequence[Cell]) -> Table:
    if question.kind == "choice":
        places = sorted(question.options.index(str(one)) for one in given if str(one) in question.options)
        lines = [(option, places.count(place)) for place, option in enumerate(question.options)]
        middle = f"Median: {question.options[places[(len(places) - 1) // 2]]}." if places else ""
        return Table(title, ("answer", "people"), tuple(lines), middle)
    for one in given:
        require(isinstance(one, int | float), title, one, "a number")
    values = [float(one) for one in given]
    line = (len(values), mean(values), median(values), min(values), max(values))
    return Table(title, ("people", "mean", "median", "least", "most"), (line,), question.unit)
