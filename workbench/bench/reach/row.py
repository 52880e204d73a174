"""A row of the table of requirements, and the timing for one."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from underfoot.bench.timing import Run, Timed

TO_COMPARE = "to compare"
"""Requirement of a figure that only serves comparison."""

SPEED = "times real time"
"""Unit of speeds: more is better."""

SLACK = 1.3
"""Allowed factor over the best time seen: more than the spread of two runs on a shared machine."""


@dataclass(frozen=True)
class Reach:
    """A requirement on a model, from `low` to `high`, and the measured value.

    A time or a speed has the `slowness` of the processor during the measurement, by which its bounds are scaled, and
    the `spread` of such measurements (`timing.Timed`); other figures have no spread.
    """

    model: str
    what: str
    measured: float
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf
    slowness: float = 1.0
    spread: float | None = None

    @property
    def met(self) -> bool:
        """Whether it is met; NaN is not.

        >>> Reach("tones", "error", 5e-16, high=1e-12).met
        True
        """
        return bool(self.low <= self.measured <= self.high)

    @property
    def asked(self) -> str:
        """The requirement in words.

        >>> Reach("floors", "gravel", 47.0, "times real time", low=40.0).asked
        'at least 40'
        >>> Reach("impacts", "cost of a soft blow", 6.0, "times").asked
        'to compare'
        """
        if self.low == -math.inf and self.high == math.inf:
            return TO_COMPARE
        if self.low == -math.inf:
            return f"at most {self.high:.4g}"
        return f"at least {self.low:.4g}" if self.high == math.inf else f"{self.low:.5g} to {self.high:.5g}"

    def data(self) -> dict[str, Any]:
        """Return it as plain data; an absent bound is None."""
        bounds = {
            name: value if math.isfinite(value) else None for name, value in (("low", self.low), ("high", self.high))
        }
        return asdict(self) | {"measured": float(self.measured)} | bounds | {"asked": self.asked, "met": self.met}


@dataclass(frozen=True)
class Timing:
    """A time to be measured, in `unit`, of which there are `a_second` per second.

    It must be at most `SLACK` times `best`, the best time seen, scaled by how slow the processor is.
    """

    model: str
    what: str
    run: Run
    unit: str
    a_second: float = 1.0
    best: float = math.inf

    def reach(self, took: Timed) -> Reach:
        """Return the row of a measured time.

        >>> Timing("modes", "10 modes", Run(print), "ns", 1e9, best=1.1).reach(Timed(2e-9, 1.5, 0.02)).asked
        'at most 2.145'
        """
        beside = {"slowness": took.slowness, "spread": took.spread}
        most = SLACK * self.best * took.slowness
        return Reach(self.model, self.what, took.seconds * self.a_second, self.unit, high=most, **beside)
