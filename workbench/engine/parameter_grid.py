"""Parameter grids: every combination of the values given on a command line."""

import itertools
import json
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
        given = _parts_of(values)
        require(all(one.strip() for one in given), "--set", text, "a value before and after each comma")
        axes[name] = [_value(one) for one in given]
    count = 1
    for several in axes.values():
        count *= len(several)
    require(count <= MOST_FILES, "--set", f"{count} combinations", f"at most {MOST_FILES}")
    return [dict(zip(axes, values, strict=True)) for values in itertools.product(*axes.values())]


def _parts_of(values: str) -> list[str]:
    """Split values at commas, except those of lists.

    >>> _parts_of("[1,2],[3,4]"), _parts_of("[[1,2],[3,4]],sine")
    (['[1,2]', '[3,4]'], ['[[1,2],[3,4]]', 'sine'])
    """
    parts, depth = [""], 0
    for letter in values:
        depth += (letter == "[") - (letter == "]")
        if letter == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += letter
    return parts


def _value(text: str) -> object:
    """Parse a number, a list, or a word."""
    try:
        return json.loads(text)
    except ValueError:
        pass
    try:
        return float(text)
    except ValueError:
        return text
