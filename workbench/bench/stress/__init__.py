"""Stress tests of the program: killed processes, damaged files, foreign datagrams, full disks.

Each module is one row group of the table; its `run(effort, progress)` yields `Outcome` lines and ends all that it
starts.
"""

import time
from collections.abc import Mapping, Sequence
from importlib import import_module

from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.errors import require

ROWS = (
    "kills",
    "damage",
    "datagrams",
    "full_disk",
    "surroundings",
    "clock_steps",
    "sinks",
    "busy",
    "endurance",
    "full_duplex",
    "two_clocks",
    "whole_floor",
    "trials",
)
"""The rows, which are modules of this package."""

_USUAL = Effort()
Table = Mapping[str, Sequence[Outcome]]


def run(row: str = "", effort: Effort = _USUAL, progress: Progress = lambda line: None) -> dict[str, list[Outcome]]:
    """Run one row of the table, or all of them; return outcomes by the names of rows."""
    require(row in ("", *ROWS), "stress", row, ", ".join(ROWS))
    found = {}
    for name in [row] if row else ROWS:
        began = time.perf_counter()
        progress(f"stress: {name}")
        found[name] = list(import_module(f"{__name__}.{name}").run(effort, progress))
        progress(f"stress: {name} took {time.perf_counter() - began:.0f} s")
    return found


def text(table: Table) -> str:
    """Return the table as text for a terminal.

    >>> print(text({"damage": [Outcome("patch", 10, "all refused in one line", True)]}))
    stress: 1 tried, all passed
    damage
      patch                                                         10  all refused in one line
    """
    lines = [outcome for outcomes in table.values() for outcome in outcomes]
    failed = sum(not line.passed for line in lines)
    report = [f"stress: {len(lines)} tried, {f'{failed} failed' if failed else 'all passed'}"]
    for name, outcomes in table.items():
        report.append(name)
        report += [
            f"  {outcome.what:55} {outcome.times:8}  {outcome.found}{'' if outcome.passed else '   FAILED'}"
            for outcome in outcomes
        ]
    return "\n".join(report)
