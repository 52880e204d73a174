"""Tables that commands write: UTF-8 CSV with a header, beside the file and moved into place, whole or not at all.

A table is open for the length of a `with` block, and written line by line as rows come: only a block that ends well
replaces what was there. `BadFile` says where it cannot.
"""

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from underfoot.files import replaced, written
from underfoot.floor.contacts import ContactRows
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor

_STEP_COLUMNS = {
    "step": "d",
    "tile": "s",
    "side": "s",
    "start_s": ".6f",
    "contact_ms": ".3f",
    "peak1_n": ".3f",
    "valley_n": ".3f",
    "peak2_n": ".3f",
    "impulse_ns": ".4f",
    "loading_kn_s": ".4f",
    "path_mm": ".3f",
    "net_mm": ".3f",
    "person": "d",
    "cadence_per_min": ".3f",
    "step_length_mm": ".3f",
    "step_width_mm": ".3f",
    "swing_ms": ".3f",
    "double_support_ms": ".3f",
    "heading_deg": ".2f",
    "heading_error_deg": ".2f",
}


@contextmanager
def step_table(path: str | Path) -> Iterator[Callable[[Iterable[Step]], None]]:
    """Write the step table: what it gives takes steps, a line each. A figure that there is not (NaN) is an empty
    cell.

    >>> import tempfile
    >>> folder = tempfile.TemporaryDirectory()
    >>> with step_table(Path(folder.name) / "steps.csv") as write:
    ...     write([Step(1, "t1", "left", 0.2, 600.0, 760.0, 500.0, 740.0, 320.0, math.nan, 210.0, 200.0)])
    >>> header, line = (Path(folder.name) / "steps.csv").read_text().splitlines()
    >>> print(header.partition(",person")[0])
    step,tile,side,start_s,contact_ms,peak1_n,valley_n,peak2_n,impulse_ns,loading_kn_s,path_mm,net_mm
    >>> line
    '1,t1,left,0.200000,600.000,760.000,500.000,740.000,320.0000,,210.000,200.000,0,,,,,,,'
    >>> folder.cleanup()
    """
    with _table(path, ",".join(_STEP_COLUMNS)) as lines:
        yield lambda steps: lines(_step_line(step) for step in steps)


def step_lines(steps: Iterable[Step]) -> list[str]:
    """The step table of these steps, its header first, a text a line."""
    return [",".join(_STEP_COLUMNS), *map(_step_line, steps)]


@contextmanager
def contact_table(path: str | Path, floor: Floor) -> Iterator[Callable[[ContactRows], None]]:
    """Write the contact table, in the floor's frame: what it gives takes rows, a line for each contact and sample."""
    with _table(path, "time_s,contact,x_m,y_m,force_n,tiles") as lines:
        yield lambda rows: lines(_contact_lines(rows, floor))


@contextmanager
def _table(path: str | Path, header: str) -> Iterator[Callable[[Iterable[str]], None]]:
    with replaced(path) as part:
        with written(path):
            file = part.open("w", encoding="utf-8", newline="\n")

        def lines(texts: Iterable[str]) -> None:
            with written(path):
                file.writelines(f"{text}\n" for text in texts)

        try:
            lines([header])
            yield lines
            with written(path):
                file.flush()
        finally:
            file.close()


def _step_line(step: Step) -> str:
    cells = ((getattr(step, name), form) for name, form in _STEP_COLUMNS.items())
    return ",".join("" if isinstance(v, float) and math.isnan(v) else format(v, form) for v, form in cells)


def _contact_lines(rows: ContactRows, floor: Floor) -> Iterator[str]:
    columns = (rows.time_s, rows.contact, rows.x_m, rows.y_m, rows.force_n)
    table = zip(*(column.tolist() for column in columns), rows.tiles(floor), strict=True)
    return (f"{t:.6f},{contact},{x:.6f},{y:.6f},{force:.3f},{tiles}" for t, contact, x, y, force, tiles in table)
