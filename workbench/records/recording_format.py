"""Recordings: a session in one SQLite file that is consistent at any moment.

Blocks of force samples and of vibration are blobs of little-endian numbers; commands and the patch are JSON text. The
file is in WAL mode and committed every 50 ms: if the writer is killed, the file opens and has lost at most the last
block. `gaps` lists missing frames between blocks. Further tables have the blocks' envelopes (`records.envelopes`) and
the user's marks.
"""

from datetime import datetime
from typing import Any

from numpy.typing import NDArray

SUFFIXES = (".underfoot", ".uf")
APPLICATION_ID = 0x55464F54  # "UFOT"
VERSION = 4
"""Version 1 lacks `commanded` and `measured`, version 2 `envelope` and `mark`; missing tables read as empty. A mark set
in an earlier file adds only that table, which an earlier Underfoot ignores. Up to version 3, `vibration` has all tiles
in each block, and not only those that moved."""
FRAMES = ("vibration", "commanded", "measured")
"""Tables with one row per session frame: drive, commanded and measured acceleration of tiles."""
TYPES = {"force": "<f8"} | dict.fromkeys(FRAMES, "<f4")
"""Types of numbers, by table."""
Rows = NDArray[Any]
"""Rows of a table: float64 of forces, else float32."""
MARKS = "create table if not exists mark (id integer primary key, frame integer not null, text text not null);"
"""How the table of marks is made, also in a file of an earlier version."""
LEFT_OUT = (
    "create table if not exists left_out (frame integer not null, tile text not null, why text not null, "
    "who text not null, at text not null);"
)
BODY_WEIGHTS = (
    "create table if not exists body_weight (person integer primary key, weight_n real not null, "
    "source text not null, who text not null, at text not null);"
)
"""How the tables of what is noted of steps are made, with the first note. An earlier Underfoot passes over them, and
counts steps that are left out."""


def name_now() -> str:
    """Return the name of a recording that begins now, without a suffix: day and time of this computer, to a second."""
    return f"{datetime.now():%Y-%m-%d %H.%M.%S}"
