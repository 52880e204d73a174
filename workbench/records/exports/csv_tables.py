"""CSV: the force table that Underfoot reads, and beside it tables of steps, contacts, marks, and of the stretch."""

from contextlib import ExitStack
from pathlib import Path

import numpy as np

from underfoot.files import replaced, written
from underfoot.records.exports import ExportFormat, ExportSource
from underfoot.records.tables import contact_table, step_table


def _write(export: ExportSource, path: Path) -> None:
    forces = export.forces
    beside = {name: path.with_suffix(f".{name}.csv") for name in ("steps", "contacts", "marks", "stretch")}
    with ExitStack() as stack:  # which moves the tables into place together: an export can be stopped at any of them
        part = stack.enter_context(replaced(path))
        steps = stack.enter_context(step_table(beside["steps"]))
        contacts = stack.enter_context(contact_table(beside["contacts"], forces.floor))
        with written(path), part.open("w", encoding="utf-8", newline="\n") as file:
            names = [f"{id}.{corner}" for id in forces.floor.ids for corner in range(1, 5)]
            file.write(",".join(["time_s", *names]) + "\n")
            for time_s, force_n in export.pieces("Writing forces"):
                table = np.column_stack([time_s, force_n.reshape(len(force_n), -1)])
                kept = table[np.isfinite(table).all(axis=1)]
                file.writelines(",".join(map(repr, row)) + "\n" for row in kept.tolist())
        for found in export.found("Writing steps and contacts"):
            steps(found.steps)
            contacts(found.rows)
    forces.floor.save(path.with_suffix(".floor.json"))
    with replaced(beside["marks"]) as part, written(beside["marks"]):
        lines = [f'{time_s:.6f},"{text.replace(chr(34), chr(34) * 2)}"\n' for time_s, text in export.marks()]
        part.write_text("time_s,text\n" + "".join(lines), encoding="utf-8")
    # In a table of its own: a remark before the forces would be the header to readers that know no remarks.
    with replaced(beside["stretch"]) as part, written(beside["stretch"]):
        part.write_text(f"from_s,length_s\n{export.from_s:.10g},{export.length_s:.10g}\n", encoding="utf-8")


FORMAT = ExportFormat(
    ".csv",
    "CSV tables: NAME.csv with forces, NAME.floor.json, NAME.steps.csv, NAME.contacts.csv, NAME.marks.csv, "
    "NAME.stretch.csv (where in the recording 0 s was)",
    "vibration, commands; samples that one tile of several lost are left out",
    _write,
)
