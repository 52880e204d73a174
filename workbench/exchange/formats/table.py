"""CSV: each tile's acceleration over time, in m/s^2."""

from pathlib import Path

import numpy as np

from underfoot.clock import RATE_HZ
from underfoot.exchange.format import Export, Format
from underfoot.files import write_file
from underfoot.quantities import counted


def write(export: Export, path: Path) -> tuple[str, ...]:
    """Write one line per frame: the time in seconds, and a column per tile."""
    played = export.acceleration_by_tile
    frames = len(next(iter(played.values())))
    rows = np.column_stack([np.arange(frames) / RATE_HZ, *played.values()])
    head = ",".join(["time_s", *(f"{tile}_m_s2" for tile in played)])
    lines = [head, *(",".join([f"{row[0]:.6f}", *(f"{value:.7g}" for value in row[1:])]) for row in rows.tolist())]
    write_file(path, ("\n".join(lines) + "\n").encode())
    return (f"{frames / RATE_HZ:.3f} s, {counted(len(played), 'tile')}, seven digits",)


FORMAT = Format(
    "csv",
    "Data of the waveform",
    (".csv",),
    frozenset(("unit", "tiles", "waveform", "spectrum", "frequency", "range", "onsets")),
    write,
    note=f"{RATE_HZ} lines a second, in m/s^2",
)
