"""One line of the table of `underfoot bench --stress`, and how much is tried."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Outcome:
    """What was tried, how often, what was found, and whether that is as it should be."""

    what: str
    times: int
    found: str
    passed: bool

    def data(self) -> dict[str, Any]:
        """As plain data."""
        return {"what": self.what, "times": self.times, "found": self.found, "passed": self.passed}


@dataclass(frozen=True)
class Effort:
    """How much a row tries: `times` and `seconds`, each None for what the row does by itself."""

    times: int | None = None
    seconds: float | None = None
    seed: int = 1

    def count(self, default: int) -> int:
        """How often, where the row's own number is `default`.

        >>> Effort().count(20), Effort(times=3).count(20)
        (20, 3)
        """
        return default if self.times is None else self.times

    def length_s(self, default: float) -> float:
        """How long, where the row's own length is `default`."""
        return default if self.seconds is None else self.seconds


def spread(values: Sequence[float], unit: str, digits: int = 2) -> str:
    """Median and largest of what was measured.

    >>> spread([0.1, 0.2, 0.9], "s")
    'median 0.2 s, largest 0.9 s'
    """
    if not len(values):
        return "never"
    middle, most = (f"{round(float(value), digits):g} {unit}" for value in (np.median(values), max(values)))
    return f"median {middle}, largest {most}"
