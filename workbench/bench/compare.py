"""Comparison of two runs of the bench: what got slower or faster, beyond the noise of both."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from underfoot.documents import read_document
from underfoot.files import read_file

FORMAT, VERSION = "underfoot-bench", 1
_LEAST_NOISE = 0.05
"""A relative change of less than this is noise, whatever the rows' own spread."""


class Time(msgspec.Struct, frozen=True):
    """A time of one run: row, time of one unit (less is better), and slowness and spread as in `timing.Timed`."""

    row: str
    value: float
    unit: str
    slowness: float
    spread: float

    @property
    def at_best(self) -> float:
        """The time scaled to the processor at its best."""
        return self.value / self.slowness


class Times(msgspec.Struct, frozen=True):
    """The times of one run, as in its file."""

    times: list[Time]


@dataclass(frozen=True)
class Change:
    """A row of both runs: its times on the processor at its best, and the noise of such times."""

    row: str
    unit: str
    before: float
    now: float
    noise: float

    @property
    def by(self) -> float:
        """Relative change of the time; negative if it got faster.

        >>> Change("modes", "ns", 2.0, 1.5, 0.05).by
        -0.25
        """
        return self.now / self.before - 1.0

    @property
    def is_noise(self) -> bool:
        """Whether the ratio of the times is within noise."""
        return max(self.now, self.before) <= (1.0 + self.noise) * min(self.now, self.before)


@dataclass(frozen=True)
class Changes:
    """Rows that got slower, and faster, by decreasing change; the number unchanged, and rows of only one run."""

    slower: tuple[Change, ...]
    faster: tuple[Change, ...]
    same: int
    only_before: tuple[str, ...]
    only_now: tuple[str, ...]

    def lines(self) -> list[str]:
        """Return the lines of a terminal report."""
        counts = f"{len(self.slower)} slower, {len(self.faster)} faster, {self.same} the same within their noise"
        found = [f"compared: {counts}"]
        for word, changes in (("slower", self.slower), ("faster", self.faster)):
            for change in changes:
                times = f"{change.before:.4g} -> {change.now:.4g} {change.unit}"
                by, noise = 100.0 * abs(change.by), 100.0 * change.noise
                found.append(f"  {word} by {by:5.1f} % (noise {noise:.0f} %)  {change.row}: {times}")
        for text, rows in (("before, not now", self.only_before), ("now, not before", self.only_now)):
            if rows:
                found.append(f"  measured {text}: {', '.join(rows)}")
        return found


def read(path: Path) -> list[Time]:
    """Read the times in a file written by the bench; raise `BadFile` if it is not one."""
    return read_document(read_file(path), str(path), FORMAT, VERSION, Times).times


def changes(before: Sequence[Time], now: Sequence[Time]) -> Changes:
    """Compare rows of the same name and unit.

    >>> a, b = Time("modes", 2.0, "ns", 1.0, 0.01), Time("modes", 6.0, "ns", 2.0, 0.02)
    >>> changes([a], [b]).slower[0].by
    0.5
    """
    earlier = {(time.row, time.unit): time for time in before}
    later = {(time.row, time.unit): time for time in now}
    both = [
        Change(key[0], key[1], earlier[key].at_best, one.at_best, max(_LEAST_NOISE, earlier[key].spread + one.spread))
        for key, one in later.items()
        if key in earlier
    ]
    significant = sorted((change for change in both if not change.is_noise), key=lambda change: -abs(change.by))
    return Changes(
        tuple(change for change in significant if change.by > 0.0),
        tuple(change for change in significant if change.by < 0.0),
        len(both) - len(significant),
        tuple(row for row, unit in earlier if (row, unit) not in later),
        tuple(row for row, unit in later if (row, unit) not in earlier),
    )
