"""What can stand on the canvas. Each node is one class in one family's file; `REGISTRY` finds them all."""

import importlib
import pkgutil

from underfoot.patch.node import NodeType, Registry


def discover() -> Registry:
    """Every node that the modules of this folder declare, by its type's name in files.

    >>> "tile-output" in discover()
    True
    """
    found: dict[str, NodeType] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if isinstance(value, NodeType):
                found[value.type] = value
    return found


REGISTRY = discover()
