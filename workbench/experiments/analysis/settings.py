"""How an analysis is done: what can be chosen, and the parameters of the method whose trials they are."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Settings:
    """`given` are the method's checked parameters. `bootstrap` is how many draws intervals of curves are made of, 0 for
    the regression's covariance; `with_lapses` gives curves a lapse rate."""

    given: Mapping[str, Any] = field(default_factory=dict)
    bootstrap: int = 399
    with_lapses: bool = False
