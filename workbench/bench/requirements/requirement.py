"""A row of the table of requirements, and the timing for one."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from underfoot.bench.timing import Run, Timed

COMPARISON_ONLY = "to compare"
"""Requirement of a figure that only serves comparison."""

SPEED = "times real time"
"""Unit of speeds: more is better."""

ALLOWED_FACTOR = 1.3
"""Allowed factor over the best time seen: more than the spread of two runs on a shared machine."""


@dataclass(frozen=True)
class Requirement:
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
    def is_met(self) -> bool:
        """Whether it is met; NaN is not.

        >>> Requirement("tones", "error", 5e-16, high=1e-12).is_met
        True
        """
        return bool(self.low <= self.measured <= self.high)

    @property
    def limits(self) -> str:
        """The requirement in words.

        >>> Requirement("floors", "gravel", 47.0, "times real time", low=40.0).limits
        'at least 40'
        >>> Requirement("impacts", "cost of a soft blow", 6.0, "times").limits
        'to compare'
        """
        if self.low == -math.inf and self.high == math.inf:
            return COMPARISON_ONLY
        if self.low == -math.inf:
            return f"at most {self.high:.4g}"
        return f"at least {self.low:.4g}" if self.high == math.inf else f"{self.low:.5g} to {self.high:.5g}"

    def data(self) -> dict[str, Any]:
        """Return it as plain data; an absent bound is None."""
        bounds = {
            name: value if math.isfinite(value) else None for name, value in (("low", self.low), ("high", self.high))
        }
        return asdict(self) | {"measured": float(self.measured)} | bounds | {"asked": self.limits, "met": self.is_met}


@dataclass(frozen=True)
class Timing:
    """A time to be measured, in `unit`, of which there are `per_second` per second.

    It must be at most `ALLOWED_FACTOR` times `best`, the best time seen, scaled by how slow the processor is.
    """

    model: str
    what: str
    run: Run
    unit: str
    per_second: float = 1.0
    best: float = math.inf

    def requirement(self, timed: Timed) -> Requirement:
        """Return the row of a measured time.

        >>> Timing("modes", "10 modes", Run(print), "ns", 1e9, best=1.1).requirement(Timed(2e-9, 1.5, 0.02)).limits
        'at most 2.145'
        """
        beside = {"slowness": timed.slowness, "spread": timed.spread}
        most = ALLOWED_FACTOR * self.best * timed.slowness
        return Requirement(self.model, self.what, timed.seconds * self.per_second, self.unit, high=most, **beside)
