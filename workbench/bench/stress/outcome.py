"""A line of the table of `underfoot bench --stress`, and the amount of testing."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Outcome:
    """The result of a test: its subject, number of trials, finding, and whether it passed."""

    what: str
    times: int
    found: str
    passed: bool


@dataclass(frozen=True)
class Effort:
    """The amount of testing: `times` and `seconds`; None uses each test's default."""

    times: int | None = None
    seconds: float | None = None
    seed: int = 1

    def count(self, default: int) -> int:
        """Return the number of repetitions; `default` is the test's own.

        >>> Effort().count(20), Effort(times=3).count(20)
        (20, 3)
        """
        return default if self.times is None else self.times

    def length_s(self, default: float) -> float:
        """Return the duration in seconds; `default` is the test's own."""
        return default if self.seconds is None else self.seconds


def spread(times_s: Sequence[float], digits: int = 2) -> str:
    """Return the median and maximum of measured times as text.

    >>> spread([0.1, 0.2, 0.9])
    'median 0.2 s, largest 0.9 s'
    """
    if not len(times_s):
        return "never"
    middle, most = (f"{round(float(time_s), digits):g} s" for time_s in (np.median(times_s), max(times_s)))
    return f"median {middle}, largest {most}"
