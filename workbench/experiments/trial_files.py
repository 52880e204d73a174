"""Trials for other programs: tidy CSV with a row per trial, BIDS behavioural files, and import of CSVs.

BIDS: Brain Imaging Data Structure 1.10, behavioural recordings: `sub-ID_task-NAME_beh.tsv` with a JSON sidecar that
describes its columns.
"""

import csv
import io
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from underfoot.csv_tables import read_csv_table
from underfoot.errors import BadFile
from underfoot.experiments.columns import DESCRIPTIONS, FIRST_COLUMNS, RESPONSE_S
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import Question
from underfoot.experiments.table import OF_PERSON, Row, columns_of, why_left_out
from underfoot.files import make_folder, write_file
from underfoot.version import __version__

_BIDS_RESPONSE_S = "response_time"
_LEFT_OUT = "left_out"
_BIDS_OWN = (_BIDS_RESPONSE_S, "participant_id", "onset", "duration", "stim_file", "HED", "TaskName", _LEFT_OUT)
"""Columns that mean something else in BIDS than a study's of that name: a file in its folder of stimuli, its tags, what
the file is of, why somebody does not count."""
_OF_STUDY = "study."
"""Prefix of such columns in a behavioural file."""
_README = """A study of vibration under feet. sub-*/beh/ has a row for each trial of a participant (_beh.tsv), whose
columns are described beside it, and what was recorded of the trial: forces (_physio.tsv.gz) and vibration
(_stim.tsv.gz). participants.tsv has what participants were asked of themselves, and in questionnaires.
"""
_TEXT_COLUMNS = (
    "participant",
    "stage",
    "method",
    "stimulus",
    "other",
    "comparison",
    "set",
    "label",
    "sort",
    "answered_by",
)
"""Columns of text, also where a cell looks like a number."""
_MISSING = ("", "NA", "n/a")
"""Cells that are empty; R and BIDS write something there."""


def csv_text(rows: Sequence[Row], columns: Sequence[str] = ()) -> str:
    """Return a table of trials as CSV with a header, of these columns or of all; missing values are empty cells.

    >>> print(csv_text([{"participant": "P1", "trial": 1, "rating": 40.0}]).splitlines()[0])
    participant,stage,method,practice,trial,block,attempt,spoiled,rating
    """
    return _table(rows, columns or columns_of(rows), ",", "")


def write_csv(path: str | Path, rows: Sequence[Row], columns: Sequence[str] = ()) -> None:
    """Write a table of trials with these columns, or with all; an interrupted write leaves no partial file."""
    write_file(path, csv_text(rows, columns).encode())


def columns_of_study(rows: Sequence[Row], protocol: Protocol | None) -> list[str]:
    """Return the columns of a study's table in an order that does not depend on who took part, and on what came first.

    They are those that the table has of its own, as they are described, then the protocol's factors and questions, also
    of what nobody has got to yet, then others as they appear.
    """
    there = columns_of(rows)
    own = [column for column in DESCRIPTIONS if column in there]
    if protocol is not None:
        own += [*protocol.factors, *_questions(protocol)]
    return list(dict.fromkeys([*FIRST_COLUMNS, *own, *there]))


def described_columns(rows: Sequence[Row], protocol: Protocol | None) -> tuple[tuple[str, str], ...]:
    """Return the columns of a study's table, each with what it holds and its unit.

    >>> described_columns([{"participant": "P1", "plays": 2}], None)[-1]
    ('plays', 'How often the trial was presented.')
    """
    described = {column: _described(column, protocol) for column in columns_of_study(rows, protocol)}
    return tuple((column, " ".join(told.values())) for column, told in described.items())


def read_csv(path: str | Path) -> list[Row]:
    """Return the trials of a CSV, for the analysis; raise `BadFile` if it is not a table of trials.

    The columns participant, method and trial are required; stage defaults to "main", and block to 1. Numeric cells
    become numbers, except in a column of labels, in which a number can be a label. NA of R, and n/a of BIDS, is empty.
    """
    table = read_csv_table(path, "a table of trials")
    for column in ("participant", "method", "trial"):
        if column not in table.names:
            raise BadFile(f"{path} has no column {column}; allowed: a CSV with participant, method, trial and answers")
    found: list[Row] = []
    for _, cells in table.rows:
        line = dict(zip(table.names, cells, strict=True))
        row: dict[str, Any] = {
            name: cell if name in _TEXT_COLUMNS else value_of(cell)
            for name, cell in line.items()
            if cell not in _MISSING
        }
        row["participant"] = line["participant"]
        found.append({"stage": "main", "block": 1, **row})
    if not found:
        raise BadFile(f"{path} has no trials")
    return found


def write_bids(folder: str | Path, rows: Sequence[Row], task: str, protocol: Protocol | None = None) -> list[Path]:
    """Write each participant's behavioural file and sidecar, and the required files of a data set, under `folder`.

    Returns the paths of the files; raises `BadFile` if they cannot be written.
    """
    folder = Path(folder)
    name = bids_task(task)
    written = []
    maker = {"Name": "Underfoot", "Version": __version__}
    description = {"Name": task, "BIDSVersion": "1.10.0", "DatasetType": "raw", "GeneratedBy": [maker]}
    written.append(_json(make_folder(folder) / "dataset_description.json", description))
    if not any(folder.glob("README*")):  # who has the data set may have written a better one
        about = "" if protocol is None else f"{protocol.about}\n\n"
        write_file(folder / "README", f"{task}\n\n{about}{_README}".encode())
        written.append(folder / "README")
    people = list(dict.fromkeys(str(row["participant"]) for row in rows))
    labels = {person: bids_label(person) for person in people}
    if "" in labels.values():
        raise BadFile("a participant's id has signs only; BIDS allows letters and digits only")
    if len({label.casefold() for label in labels.values()}) < len(people):
        raise BadFile(
            "two participants have the same id without signs and letter case; BIDS allows letters and digits only, and "
            "some file systems make no difference of case"
        )
    in_table = columns_of_study(rows, protocol)
    columns = [_bids_name(column) for column in in_table if column != "participant"]
    for person, label in labels.items():
        mine = [
            {_bids_name(name): value for name, value in row.items()}
            for row in rows
            if str(row["participant"]) == person
        ]
        stem = make_folder(folder / f"sub-{label}" / "beh") / f"sub-{label}_task-{name}_beh"
        write_file(stem.with_suffix(".tsv"), _table(mine, columns, "\t", "n/a").encode())
        sidecar = {column: _described(column, protocol) for column in columns}
        written += [stem.with_suffix(".tsv"), _json(stem.with_suffix(".json"), {"TaskName": task, **sidecar})]
    asked = [column for column in in_table if column.startswith(OF_PERSON)]
    excluded = {str(row["participant"]): why for row in rows if (why := why_left_out(row))}
    write_file(folder / "participants.tsv", _participants(rows, labels, asked, excluded).encode())
    sidecar = {_of_participant(column): _described(column, protocol) for column in asked}
    if excluded:
        sidecar[_LEFT_OUT] = {"Description": "Why the participant is left out of the analysis; n/a for who counts."}
    return [*written, folder / "participants.tsv", _json(folder / "participants.json", sidecar)]


def _participants(
    rows: Sequence[Row], labels: Mapping[str, str], asked: Sequence[str], excluded: Mapping[str, str]
) -> str:
    """Return a line for each participant, with the answers about them and to questionnaires, and who is left out."""
    first = {str(row["participant"]): row for row in reversed(rows)}
    lines = [
        {
            "participant_id": f"sub-{label}",
            **{_of_participant(column): first[person].get(column, "") for column in asked},
            _LEFT_OUT: excluded.get(person, ""),
        }
        for person, label in labels.items()
    ]
    columns = ["participant_id", *map(_of_participant, asked), *([_LEFT_OUT] if excluded else [])]
    return _table(lines, columns, "\t", "n/a")


def _of_participant(column: str) -> str:
    """Return the name in the list of participants of a column with their answers."""
    return column if (name := column.removeprefix(OF_PERSON)) in _BIDS_OWN else name


def bids_label(text: str) -> str:
    """Return a label with the characters that BIDS allows: letters and digits.

    >>> bids_label("P-01")
    'P01'
    """
    return re.sub(r"[^A-Za-z0-9]", "", text)


def bids_task(title: str) -> str:
    """Return the label of a study's task in names of files, which cannot be longer than 255 letters.

    >>> bids_task("Thin ice?"), bids_task("氷"), len(bids_task("ice " * 100))
    ('Thinice', 'study', 80)
    """
    return bids_label(title)[:80] or "study"


def _bids_name(column: str) -> str:
    """Return BIDS's name for the response time, and another name for what BIDS takes for its own."""
    return _BIDS_RESPONSE_S if column == RESPONSE_S else f"{_OF_STUDY}{column}" if column in _BIDS_OWN else column


def _described(column: str, protocol: Protocol | None) -> dict[str, str]:
    """Return what BIDS says of a column: what was asked is described by the question, with its unit."""
    questions = {} if protocol is None else _questions(protocol)
    if column in questions:
        asked = questions[column]
        return {"Description": asked.text, **({"Units": asked.unit} if asked.unit else {})}
    if column == _BIDS_RESPONSE_S:  # without its unit, the validator takes it for text
        return {"Description": DESCRIPTIONS[RESPONSE_S], "Units": "s"}
    is_factor = protocol is not None and column.removeprefix(_OF_STUDY) in protocol.factors
    plain = "Factor of the stimulus." if is_factor else "Answer, or fact of the trial."
    return {"Description": DESCRIPTIONS.get(column, plain)}


def _questions(protocol: Protocol) -> dict[str, Question]:
    """Return the questions about a participant and of questionnaires, by their columns."""
    about = {f"{OF_PERSON}{question.name}": question for question in protocol.participant}
    return about | {
        f"{OF_PERSON}{stage.id}.{question.name}": question for stage in protocol.stages for question in stage.questions
    }


def _table(rows: Sequence[Row], columns: Sequence[str], delimiter: str, missing: str) -> str:
    text = io.StringIO()
    writer = csv.writer(text, delimiter=delimiter, lineterminator="\n")
    writer.writerow(columns)
    for row in rows:
        writer.writerow([_cell(row.get(column, missing), missing) for column in columns])
    return text.getvalue()


def _cell(value: object, missing: str) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if value in ("", None):
        return missing
    return " ".join(value.split()) if isinstance(value, str) else repr(value)


def value_of(cell: str) -> bool | int | float | str:
    """Return the value of a cell: a truth value, a number, or text. Spreadsheets write truth values in capitals.

    >>> value_of("2"), value_of("0.5"), value_of("true"), value_of("FALSE"), value_of("WS"), value_of("1_2")
    (2, 0.5, True, False, 'WS', '1_2')
    """
    if cell.lower() in ("true", "false"):
        return cell.lower() == "true"
    if "_" in cell:  # a number only in Python
        return cell
    try:
        return int(cell) if re.fullmatch(r"[+-]?\d+", cell) else float(cell)
    except ValueError:
        return cell


def _json(path: Path, document: Mapping[str, Any]) -> Path:
    write_file(path, json.dumps(document, indent=1).encode() + b"\n")
    return path
