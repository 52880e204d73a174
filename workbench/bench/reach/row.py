"""One line of the table of reaches."""

import math
from dataclasses import asdict, dataclass
from typing import Any

TO_COMPARE = "to compare"
"""What is asked where nothing is: a figure that explains others."""


@dataclass(frozen=True)
class Reach:
    """What a model is asked to keep, from `low` to `high`, and what was measured."""

    model: str
    what: str
    measured: float
    unit: str = ""
    low: float = -math.inf
    high: float = math.inf

    @property
    def met(self) -> bool:
        """Whether it is kept; what is not a number is not.

        >>> Reach("tones", "error", 5e-16, high=1e-12).met
        True
        """
        return bool(self.low <= self.measured <= self.high)

    @property
    def asked(self) -> str:
        """What is asked, in words.

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
        """As plain data; a bound that is not there is None."""
        bounds = {
            name: value if math.isfinite(value) else None for name, value in (("low", self.low), ("high", self.high))
        }
        return asdict(self) | {"measured": float(self.measured)} | bounds | {"asked": self.asked, "met": self.met}
