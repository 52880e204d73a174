"""Individual parts: values that differ from those of their type."""

from collections.abc import Mapping
from typing import TypeVar

import msgspec
from msgspec.structs import replace

Part = TypeVar("Part", bound=msgspec.Struct)


def varied(part: Part, ranges: Mapping[str, tuple[float, float]], **factors: float) -> Part:
    """Return a part with each named value times its factor, limited to its range.

    >>> from underfoot.models.tile.suspension import SUSPENSION_RANGES, Suspension
    >>> one = varied(Suspension(damping=0.8), SUSPENSION_RANGES, damping=1.2, mass_kg=2.0)
    >>> one.damping, one.mass_kg
    (0.9, 5.4)
    """
    values = {}
    for name, factor in factors.items():
        low, high = ranges[name]
        values[name] = min(max(getattr(part, name) * factor, low), high)
    return replace(part, **values)
