"""Scenes: the floor as an interactive surface. Each folder here declares one.

A folder of `underfoot.scenes` is a scene where its `__init__.py` has a class made of `Scene`: the workspace, the
command and the tests of all scenes follow from that. docs/scenes.md writes one.
"""

import importlib
import inspect
import pkgutil
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeGuard

from underfoot.plugins import SCENES, declared, refuse

if TYPE_CHECKING:
    from underfoot.scenes.scene import Scene


@cache
def discover() -> "Mapping[str, type[Scene]]":
    """Return all scenes by the names of their folders, with "-" for "_"; then those of plug-ins.

    >>> "frozen-pond" in discover()
    True
    """
    from underfoot.scenes.scene import Scene

    found: dict[str, type[Scene]] = {}
    for folder in pkgutil.iter_modules(__path__):
        if not folder.ispkg:
            continue
        package = importlib.import_module(f"{__name__}.{folder.name}")
        for value in vars(package).values():
            if _is_scene(value, Scene):
                value.name, value.folder = folder.name.replace("_", "-"), Path(str(package.__file__)).parent
                found[value.name] = value
    for plugin, value in declared(SCENES):
        if not _is_scene(value, Scene):
            continue
        name = value.__module__.rpartition(".")[2].replace("_", "-")
        if name in found:
            refuse(plugin, f"there is a scene {name!r} already")
            continue
        value.name, value.folder = name, Path(inspect.getfile(value)).parent
        found[name] = value
    return MappingProxyType(found)


def _is_scene(value: object, scene: type) -> "TypeGuard[type[Scene]]":
    return inspect.isclass(value) and issubclass(value, scene) and not inspect.isabstract(value)
