"""Settings of an analysis: options, and the parameters of the method that ran the trials."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from underfoot.experiments.method import Method


@dataclass(frozen=True)
class Settings:
    """`given` are the method's checked parameters. `bootstrap` is the number of draws for intervals of curves, 0 for
    the regression's covariance; `with_lapses` gives curves a lapse rate. `is_beside_silence`: nothing vibrates in the
    standard; None without the protocol.
    """

    given: Mapping[str, Any] = field(default_factory=dict)
    bootstrap: int = 399
    with_lapses: bool = False
    is_beside_silence: bool | None = None

    def of(self, method: type[Method]) -> dict[str, Any]:
        """Return the parameters of the `method` that ran the trials, its usual ones where they are not known."""
        return {name: parameter.default for name, parameter in method.parameters.items()} | dict(self.given)
