"""Plug-ins: packages that extend Underfoot, found by their entry points.

A plug-in that cannot be loaded is reported once and left out.
"""

import sys
from collections.abc import Iterator
from contextlib import suppress
from multiprocessing import parent_process
from pathlib import Path
from types import ModuleType

NODES, TRANSPORTS, SCENES = "underfoot.nodes", "underfoot.transports", "underfoot.scenes"
"""Entry point groups."""


def declared(group: str) -> Iterator[tuple[str, object]]:
    """Yield the objects of a group's entry points with the plug-in's name; for a module, all its values.

    >>> list(declared("underfoot.none"))
    []
    """
    if not _may_declare(group):
        return
    from importlib.metadata import entry_points

    for point in sorted(entry_points(group=group), key=lambda point: (point.name, point.value)):
        try:
            found = point.load()
        except Exception as error:  # untrusted code can raise anything
            refuse(point.name, f"{type(error).__name__}: {error}")
            continue
        values = list(vars(found).values()) if isinstance(found, ModuleType) else [found]
        yield from ((point.name, value) for value in values)


def _may_declare(group: str) -> bool:
    """Whether some installed package names the group. Most start without a plug-in, and need not import
    `importlib.metadata` and what it reads messages with: 0.03 s.
    """
    header = f"[{group}]"
    for folder in map(Path, sys.path):
        if folder.is_file():
            return True  # packages in an archive
        for file in folder.glob("*.*-info/entry_points.txt"):
            with suppress(OSError):
                if header in file.read_text("utf-8", "replace"):
                    return True
    return False


def refuse(name: str, reason: str) -> None:
    """Report why a plug-in, or a part of one, is left out."""
    if parent_process() is None:  # its children find the same
        print(f"underfoot: plug-in {name} is left out: {' '.join(reason.split())[:300]}", file=sys.stderr, flush=True)
