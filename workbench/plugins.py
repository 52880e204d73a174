"""What packages declare: Underfoot's own, file by file, and plug-ins, found by their entry points.

A plug-in that cannot be loaded is reported once and left out.
"""

import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from importlib import import_module
from multiprocessing import parent_process
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType
from typing import TypeGuard, TypeVar

from underfoot.errors import in_one_line, kind_and_words

T = TypeVar("T")

NODES, TRANSPORTS, SCENES = "underfoot.nodes", "underfoot.transports", "underfoot.scenes"
"""Entry point groups."""


def values_in(package: str) -> Iterator[object]:
    """Yield every value in the modules of a package that is imported, or is being imported.

    >>> import underfoot.nodes
    >>> underfoot.nodes.REGISTRY["gain"] in values_in("underfoot.nodes")
    True
    """
    for module in iter_modules(sys.modules[package].__path__):
        yield from vars(import_module(f"{package}.{module.name}")).values()


def add_declared(
    found: dict[str, T], group: str, is_one: Callable[[object], TypeGuard[T]], name_of: Callable[[T], str]
) -> None:
    """Add what a group's plug-ins declare to `found`, by name. What has a name that is taken is refused.

    `is_one` says of an object whether it is of the group; it raises `TypeError` for one that is incomplete.

    >>> found = {}
    >>> add_declared(found, "underfoot.none", lambda value: True, str)
    >>> found
    {}
    """
    kind = group.removeprefix("underfoot.").removesuffix("s")
    for plugin, where, values in _loaded(group) if _may_declare(group) else ():
        was_seen = False
        for value in values:
            try:
                if not is_one(value):
                    continue
                if found.setdefault(name_of(value), value) is not value:
                    refuse(plugin, f"there is a {kind} {name_of(value)} already")
            except TypeError as error:
                refuse(plugin, str(error))
            was_seen = True
        if not was_seen:
            refuse(plugin, f"no complete {kind} is in {where}")


def require_declared(found: type, base: type) -> None:
    """Raise `TypeError` if a class lacks something that `base` annotates, apart from a name of its objects."""
    missing = [name for name in inspect.get_annotations(base) if name != "name" and not hasattr(found, name)]
    if missing:
        raise TypeError(f"{found.__qualname__} does not declare {', '.join(missing)}")


def _loaded(group: str) -> Iterator[tuple[str, str, list[object]]]:
    """Yield name, place and objects of a group's entry points; for a module, all its values."""
    from importlib.metadata import entry_points

    for point in sorted(entry_points(group=group), key=lambda point: (point.name, point.value)):
        try:
            found = point.load()
        except (Exception, SystemExit) as error:  # untrusted code can raise anything
            refuse(point.name, kind_and_words(error))
            continue
        yield point.name, point.value, list(vars(found).values()) if isinstance(found, ModuleType) else [found]


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
        print(f"underfoot: plug-in {name} is left out: {in_one_line(reason)}", file=sys.stderr, flush=True)
