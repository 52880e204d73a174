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

from underfoot.plugins import SCENES, add_declared, require_declared

if TYPE_CHECKING:
    from underfoot.scenes.scene import Scene


@cache
def discover() -> "Mapping[str, type[Scene]]":
    """Return all scenes by the names of their folders, with "-" for "_"; then those of plug-ins.

    >>> "frozen-pond" in discover()
    True
    """
    from underfoot.scenes.scene import Scene

    def is_scene(value: object) -> TypeGuard[type[Scene]]:
        if not (inspect.isclass(value) and issubclass(value, Scene) and not inspect.isabstract(value)):
            return False
        require_declared(value, Scene)
        return True

    found: dict[str, type[Scene]] = {}
    for folder in pkgutil.iter_modules(__path__):
        if folder.ispkg:
            for value in vars(importlib.import_module(f"{__name__}.{folder.name}")).values():
                if is_scene(value):
                    found[_name_of(value)] = value
    add_declared(found, SCENES, is_scene, _name_of)
    for name, scene in found.items():
        scene.name, scene.folder = name, Path(inspect.getfile(scene)).parent
    return MappingProxyType(found)


def _name_of(scene: "type[Scene]") -> str:
    return scene.__module__.rpartition(".")[2].replace("_", "-")
