"""Counterbalanced orders: how many people have had which row of a Latin square so far."""

from collections import Counter
from collections.abc import Mapping, Sequence

from underfoot.experiments.analysis.findings import Findings, Table
from underfoot.experiments.latin_square import Turn, number_of_row, row_of, rows_of
from underfoot.experiments.method import BLOCK_ROW
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.study import turn_of
from underfoot.experiments.table import Row, counted, grouped


def counterbalance(rows: Sequence[Row], protocol: Protocol) -> list[Findings]:
    """Return the balance of a protocol's counterbalanced orders over people; [] if nothing is counterbalanced."""
    rows, tables, stages = counted(rows), list[Table](), len(protocol.counterbalanced)
    if stages and (had := _first(rows, _STAGES_ROW)):
        tables.append(_table("Order of stages", protocol.counterbalanced, had[_STAGES_ROW], _ITS_ROW))
    for (stage,), part in grouped([row for row in rows if BLOCK_ROW in row], "stage").items():
        use = protocol.stage(stage).method
        if use is not None:
            names = use.rule.listed_stimuli(use.given(protocol.stimuli))
            of_block = _first(part, BLOCK_ROW)[BLOCK_ROW]
            title = f"Order of stimuli, first block: {stage}"
            turn = turn_of(protocol, protocol.stage(stage), "1")
            its_row = _BEHIND.format(turn.rows_before) if turn.rows_before else _ITS_ROW
            tables.append(_table(title, names, of_block, "" if stages else its_row))
            if stages and (had := _first(part, BLOCK_ROW, _STAGES_ROW)):
                pairs = Counter(zip(had[BLOCK_ROW], had[_STAGES_ROW], strict=True))
                tables.append(_crossed(stage, pairs, len(names), turn))
    return [Findings("Counterbalance", tables=tables)] if tables else []


_STAGES_ROW = "stages_row"
_ITS_ROW = " The number in an id is its row."
_BEHIND = " The number in an id, and {} more, is its row."
_MOST_NAMED = 12


def _first(rows: Sequence[Row], *columns: str) -> dict[str, list[int]]:
    """Return columns of each person's first trial, by its number: spreadsheets can sort otherwise."""
    there = grouped((row for row in rows if all(name in row for name in columns)), "participant").values()
    first = [min(part, key=lambda row: float(row.get("trial", 0))) for part in there]
    return {name: [int(row[name]) for row in first] for name in columns if first}


def _table(title: str, names: Sequence[str], had: Sequence[int], whose: str) -> Table:
    """Return the number of people of each row, and which rows are next; `whose` says who gets them."""
    people: Mapping[int, int] = {number: had.count(number) for number in range(1, rows_of(len(names)) + 1)}
    lines = [(row, ", ".join(names[k] for k in row_of(len(names), row)), count) for row, count in people.items()]
    fewest = [row for row, count in people.items() if count == min(people.values())]
    note = "Every row has as many people."
    if len(fewest) < len(people):
        these = f"row {fewest[0]} has" if len(fewest) == 1 else f"rows {', '.join(map(str, fewest))} have"
        note = f"Not balanced: {these} fewest.{whose}"
        note += f" Above {len(people)} it begins at row 1 again." if whose else ""
    return Table(title, ("row", "order", "people"), tuple(lines), note)


def _crossed(stage: str, people: Mapping[tuple[int, int], int], size: int, turn: Turn) -> Table:
    """Return the number of people of each row of stimuli in each row of stages, and whose ids are next.

    `turn` is anybody's at the stage.
    """
    of_stimuli, of_stages = (range(1, rows_of(count) + 1) for count in (size, turn.stages))
    lines = tuple((row, *(people.get((row, other), 0) for other in of_stages)) for row in of_stimuli)
    numbers = range(1, len(of_stimuli) * len(of_stages) + 1)
    ids = {k: (turn._replace(participant=str(k)).row(size), number_of_row(str(k), turn.stages)) for k in numbers}
    least = min(people.get(pair, 0) for pair in ids.values())
    fewest = [str(k) for k, pair in ids.items() if people.get(pair, 0) == least]
    note = "Every pair of rows has as many people."
    if len(fewest) < len(ids):
        named = ", ".join([*fewest[:_MOST_NAMED], *(["…"] if len(fewest) > _MOST_NAMED else [])])
        note = f"Not balanced: fewest have the rows of ids with the number {named}. Above {len(ids)} it begins again."
    columns = ("row of stimuli", *(f"stages in row {row}" for row in of_stages))
    return Table(f"Order of stimuli by order of stages: {stage}", columns, lines, note)
