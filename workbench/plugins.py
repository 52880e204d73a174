"""Packages that bring something to Underfoot: what they declare as entry points is found here.

A plug-in that cannot be loaded is said once, and left out: the program runs without it.
"""

import sys
from collections.abc import Iterator
from importlib.metadata import entry_points
from multiprocessing import parent_process
from types import ModuleType

NODES, TRANSPORTS, SCENES = "underfoot.nodes", "underfoot.transports", "underfoot.scenes"
"""Groups of entry points."""


def declared(group: str) -> Iterator[tuple[str, object]]:
    """What the entry points of a group name, each with its plug-in's name; all values of a module where one is named.

    >>> list(declared("underfoot.none"))
    []
    """
    for point in sorted(entry_points(group=group), key=lambda point: (point.name, point.value)):
        try:
            found = point.load()
        except Exception as error:  # a stranger's code: it can raise anything
            refuse(point.name, f"{type(error).__name__}: {error}")
            continue
        values = list(vars(found).values()) if isinstance(found, ModuleType) else [found]
        yield from ((point.name, value) for value in values)


def refuse(name: str, reason: str) -> None:
    """Say why a plug-in, or a part of one, is left out."""
    if parent_process() is None:  # which has children that find the same
        print(f"underfoot: plug-in {name} is left out: {' '.join(reason.split())[:300]}", file=sys.stderr, flush=True)
