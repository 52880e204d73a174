"""What is done to the program on purpose: processes killed, files damaged, strangers' datagrams, full disks.

Each file is a row of the table: its `run(scale, tell)` gives lines `Tried`. What a row starts ends with it.
"""

import time
from collections.abc import Mapping, Sequence
from importlib import import_module

from underfoot.bench.stress.tried import Scale, Tell, Tried
from underfoot.errors import require

ROWS = (
    "kills",
    "damage",
    "datagrams",
    "full_disk",
    "surroundings",
    "sinks",
    "endurance",
    "full_duplex",
    "two_clocks",
    "whole_floor",
    "trials",
)
"""The rows, which are modules of this package."""

_USUAL = Scale()
Table = Mapping[str, Sequence[Tried]]


def run(row: str = "", scale: Scale = _USUAL, tell: Tell = lambda line: None) -> dict[str, list[Tried]]:
    """Try one row, or all of them: lines by the names of rows."""
    require(row in ("", *ROWS), "stress", row, ", ".join(ROWS))
    found = {}
    for name in [row] if row else ROWS:
        began = time.monotonic()
        tell(f"stress: {name}")
        found[name] = list(import_module(f"{__name__}.{name}").run(scale, tell))
        tell(f"stress: {name} took {time.monotonic() - began:.0f} s")
    return found


def text(table: Table) -> str:
    """The table for a terminal.

    >>> print(text({"damage": [Tried("patch", 10, "all refused in one line", True)]}))
    stress: 1 tried, all passed
    damage
      patch                                                         10  all refused in one line
    """
    lines = [one for tried in table.values() for one in tried]
    failed = sum(not one.passed for one in lines)
    told = [f"stress: {len(lines)} tried, {f'{failed} failed' if failed else 'all passed'}"]
    for name, tried in table.items():
        told.append(name)
        told += [f"  {one.what:55} {one.times:8}  {one.found}{'' if one.passed else '   FAILED'}" for one in tried]
    return "\n".join(told)
