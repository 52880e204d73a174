"""Parameter grids: every combination of the values given on a command line."""

import itertools
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from underfoot.errors import BadValue, require

MOST_FILES = 100_000

Values = Mapping[str, Any]
"""Values by "node.parameter"."""


def grid_of(settings: Sequence[str]) -> list[Values]:
    """Return all combinations of values, the last varying fastest, from texts such as "node.parameter=1,2,3".

    Raises `BadValue` for a malformed text, or too many combinations.

    >>> grid_of(["impact.stiffness=1e4,1e5", "tone.shape=sine"])
    [{'impact.stiffness': 10000.0, 'tone.shape': 'sine'}, {'impact.stiffness': 100000.0, 'tone.shape': 'sine'}]
    """
    axes: dict[str, list[Any]] = {}
    for text in settings:
        name, equals, values = text.partition("=")
        node, dot, parameter = name.partition(".")
        if not (equals and dot and node and parameter and values):
            raise BadValue(f"--set is {text!r}; allowed: NODE.PARAMETER=VALUE,..., as impact.stiffness=1e4,1e5")
        require(name not in axes, "--set", text, f"each parameter once; {name} was set before")
        axes[name] = [_value(one) for one in re.findall(r"(?:\[.*\]|[^,])+", values)]
    count = 1
    for several in axes.values():
        count *= len(several)
    require(count <= MOST_FILES, "--set", f"{count} combinations", f"at most {MOST_FILES}")
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _value(text: str) -> Any:
    """Parse a number, a list, or a word."""
    try:
        return json.loads(text)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        return text
