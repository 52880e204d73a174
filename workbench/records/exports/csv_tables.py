"""CSV: the force table that Underfoot reads, and beside it tables of steps, their curves and all else that it has."""

from collections.abc import Iterable, Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from underfoot.files import replaced, written
from underfoot.records.exports import ExportFormat, ExportSource
from underfoot.records.survey import STANCE
from underfoot.records.tables import contact_table, step_table


def _write(export: ExportSource, path: Path) -> None:
    floor = export.forces.floor
    with ExitStack() as stack:  # which moves all files into place together, the forces last: it can end at any of them

        def write(suffix: str, lines: Iterable[str]) -> None:
            file_path = path.with_suffix(suffix)
            part = stack.enter_context(replaced(file_path))
            with written(file_path), part.open("w", encoding="utf-8", newline="\n") as file:
                file.writelines(f"{line}\n" for line in lines)

        write(path.suffix, _force_lines(export))
        write(".floor.json", [floor.dumps().decode()])
        write(".marks.csv", _mark_lines(export))
        # In a table of its own: a remark before the forces would be the header to readers that know no remarks.
        write(".stretch.csv", ["from_s,length_s", f"{export.from_s:.10g},{export.length_s:.10g}"])
        used = [one.replace(" ", ",") for one in export.calibrations]
        write(".calibrations.csv", ["tile,calibration,made,digest", *used])
        steps = stack.enter_context(step_table(path.with_suffix(".steps.csv"), recorded=True))
        contacts = stack.enter_context(contact_table(path.with_suffix(".contacts.csv"), floor))

        def curve_lines() -> Iterator[str]:
            yield "step," + ",".join(map(str, range(STANCE)))  # in percent of stance
            for rows, stances in export.found("Writing steps and contacts"):
                steps(one.step for one in stances)
                contacts(rows)
                yield from (f"{one.step.step},{','.join(map(str, one.force_n))}" for one in stances)

        write(".curves.csv", curve_lines())


def _force_lines(export: ExportSource) -> Iterator[str]:
    yield ",".join(["time_s", *(f"{id}.{corner}" for id in export.forces.floor.ids for corner in range(1, 5))])
    for time_s, force_n in export.pieces("Writing forces"):
        table = np.column_stack([time_s, force_n.reshape(len(force_n), -1)])
        yield from (",".join(map(repr, row)) for row in table[np.isfinite(table).all(axis=1)].tolist())


def _mark_lines(export: ExportSource) -> Iterator[str]:
    yield "time_s,text"
    for time_s, text in export.marks():
        yield f'{time_s:.6f},"{text.replace(chr(34), chr(34) * 2)}"'


FORMAT = ExportFormat(
    ".csv",
    "CSV tables: NAME.csv with forces, NAME.floor.json, NAME.steps.csv, NAME.curves.csv (force over stance), "
    "NAME.contacts.csv, NAME.marks.csv, NAME.stretch.csv (where in the recording 0 s was), NAME.calibrations.csv",
    "vibration, commands; samples that one tile of several lost are left out",
    _write,
)
