"""Individual parts: values that differ from those of their type."""

from typing import TypeVar

import msgspec
from msgspec.structs import replace

from underfoot.arguments import ranges_of

Part = TypeVar("Part", bound=msgspec.Struct)


def varied(part: Part, **factors: float) -> Part:
    """Return a part with each named value times its factor, limited to its range.

    >>> from underfoot.models.tile.suspension import Suspension
    >>> one = varied(Suspension(damping=0.8), damping=1.2, mass_kg=2.0)
    >>> one.damping, one.mass_kg
    (0.9, 5.4)
    """
    values = {}
    for name, factor in factors.items():
        low, high = ranges_of(type(part))[name]
        values[name] = min(max(getattr(part, name) * factor, low), high)
    return replace(part, **values)
