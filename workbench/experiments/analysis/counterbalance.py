"""Counterbalanced orders: how many people have had which row of a Latin square so far."""

from collections.abc import Mapping, Sequence

from underfoot.experiments.analysis.findings import Findings, Table
from underfoot.experiments.latin_square import row_of, rows_of
from underfoot.experiments.method import BLOCK_ROW
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.table import Row, counted, grouped


def counterbalance(rows: Sequence[Row], protocol: Protocol) -> list[Findings]:
    """Return the balance of a protocol's counterbalanced orders over people; [] if nothing is counterbalanced."""
    rows, tables = counted(rows), []
    if protocol.counterbalanced and (had := _first(rows, "stages_row")):
        tables.append(_table("Order of stages", protocol.counterbalanced, had))
    for (stage,), part in grouped([row for row in rows if BLOCK_ROW in row], "stage").items():
        use = protocol.stage(stage).method
        if use is not None:
            given = METHODS[use.kind].checked(use.parameters, protocol.stimuli)
            names = next(given[name] for name in given if METHODS[use.kind].names_stimuli(name))
            tables.append(_table(f"Order of stimuli, first block: {stage}", names, _first(part, BLOCK_ROW)))
    return [Findings("Counterbalance", tables=tables)] if tables else []


def _first(rows: Sequence[Row], column: str) -> list[int]:
    """Return the value of each person's first trial, by its number: spreadsheets can sort otherwise."""
    there = grouped((row for row in rows if column in row), "participant").values()
    return [int(min(part, key=lambda row: float(row.get("trial", 0)))[column]) for part in there]


def _table(title: str, names: Sequence[str], had: Sequence[int]) -> Table:
    """Return the number of people of each row, and which rows are next."""
    people: Mapping[int, int] = {number: had.count(number) for number in range(1, rows_of(len(names)) + 1)}
    lines = [(row, ", ".join(names[k] for k in row_of(len(names), row)), count) for row, count in people.items()]
    fewest = [row for row, count in people.items() if count == min(people.values())]
    note = "Every row has as many people."
    if len(fewest) < len(people):
        note = f"Not balanced: row {', '.join(map(str, fewest))} has fewest. The number in an id is its row."
        note += f" Above {len(people)} it begins at row 1 again."
    return Table(title, ("row", "order", "people"), tuple(lines), note)
