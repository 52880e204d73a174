"""`underfoot compare`: the steps of recordings, of left and right, or of persons side by side."""

import json
import math
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import OUTPUT, FileOrPreset, require_outputs_writable
from underfoot.commands.surveying import survey_progress, survey_told
from underfoot.errors import BadValue

if TYPE_CHECKING:
    from underfoot.records.comparison import Figures, Group
    from underfoot.records.survey import Stance


@click.command()
@click.argument("recordings", metavar="RECORDING...", type=FileOrPreset("walks"), nargs=-1, required=True)
@click.option(
    "--by",
    type=click.Choice(["recording", "side", "person"]),
    default="recording",
    show_default=True,
    help="What is compared: the recordings, or left and right, or the persons of each; person 1 of another recording "
    "can be somebody else.",
)
@click.option("-o", "--output", type=OUTPUT, help="CSV file to write; force over stance beside it, as NAME.stance.csv.")
@click.option("--json", "as_json", is_flag=True, help="Print measures and force over stance as JSON.")
def compare(recordings: tuple[Path, ...], by: str, output: Path | None, as_json: bool) -> None:
    """Compare the steps of RECORDINGs: mean ± SD of each measure, and differences from the first.

    A RECORDING can also be a force CSV, a C3D file, or a preset walk. Steps that `underfoot steps` or the window left
    out do not count.
    """
    from underfoot.records.comparison import STANCE_SUFFIX, compared, comparison_data, names_of, write_comparison
    from underfoot.records.tables import require_table_name

    twice = [path for k, path in enumerate(recordings) if _real(path) in map(_real, recordings[:k])]
    if twice:
        raise BadValue(f"{twice[0]} is given twice; allowed: each recording once")
    if len(recordings) == 1 and by == "recording":
        raise BadValue(f"{recordings[0]} is one recording; allowed: two or more, or --by side, or --by person")
    if output is not None:
        require_table_name(output)
    beside = None if output is None else output.with_suffix(STANCE_SUFFIX)
    require_outputs_writable(output, beside, inputs=recordings)
    with report_compiling(None):
        stances = [_stances_in(path) for path in recordings]
    groups = compared(dict(zip(names_of(recordings), stances, strict=True)), by)
    if len(groups) < 2:
        known = "of which sides are known" if by == "side" else "that belong to a person"
        told = f"the steps {known} are of {groups[0].name} alone" if groups else f"there are no steps {known}"
        raise BadValue(f"--by {by} gives nothing to compare: {told}; allowed: steps of two")
    if output is not None:
        write_comparison(groups, output)
    print(json.dumps(comparison_data(groups)) if as_json else "\n".join(_lines(groups)))


def _real(path: Path) -> str:
    return os.path.realpath(path)


def _stances_in(path: Path) -> "Sequence[Stance]":
    """Return the steps in a file."""
    from underfoot.floor.step_finder import find_steps
    from underfoot.records.force_files import read_force_file
    from underfoot.records.recording import Recording, is_recording
    from underfoot.records.survey import survey_of

    if not is_recording(path):
        forces, floor = read_force_file(path)
        found = find_steps([(forces.time_s, forces.force_n)], floor, forces.rate_hz)
        return survey_of(found, forces.seconds, survey_progress(path, forces.seconds)).steps
    with Recording(path) as recording:
        return survey_told(recording).steps


def _lines(groups: "Sequence[Group]") -> list[str]:
    """Return a table to be read: a line per measure that any group has."""
    rows = [["", *(group.name for group in groups)]]
    rows += [[what, *(str(getattr(group, what)) for group in groups)] for what in ("steps", "persons")]
    for measure in groups[0].figures:
        figures = [group.figures[measure] for group in groups]
        if any(one.count for one in figures):
            rows.append([measure, *map(_text, figures)])
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    return [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True))])
        for row in rows
    ]


def _text(one: "Figures") -> str:
    """Return mean, SD and difference; what rounds to 0 has no minus. Means below 10 have two decimals.

    >>> from underfoot.records.comparison import Figures
    >>> _text(Figures(2, 616.7, 1.0, -0.1, -0.02))
    '616.7 ± 1.0 +0.0 %'
    >>> _text(Figures(2, 1.234, 0.056))
    '1.23 ± 0.06'
    """
    if not one.count:
        return "-"
    form = "z.1f" if abs(one.mean) >= 10.0 else "z.2f"
    spread = f" ± {one.sd:{form}}" if math.isfinite(one.sd) else ""
    share = f" {one.difference_percent:+z.1f} %" if math.isfinite(one.difference_percent) else ""
    return f"{one.mean:{form}}{spread}{share}"
