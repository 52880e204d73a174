"""What can stand on the canvas. Each node is one class in one family's file; `REGISTRY` finds them all.

Packages of other people bring nodes by entry points (docs/plugins.md); none takes the place of one that is there.
"""

import importlib
import pkgutil

from underfoot.patch.node import NodeType, Registry
from underfoot.plugins import NODES, declared, refuse


def discover() -> Registry:
    """Every node that the modules of this folder and plug-ins declare, by its type's name in files.

    >>> "tile-output" in discover()
    True
    """
    found: dict[str, NodeType] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if isinstance(value, NodeType):
                found[value.type] = value
    for name, value in declared(NODES):
        if isinstance(value, NodeType) and found.setdefault(value.type, value) is not value:
            refuse(name, f"there is a node {value.type} already")
    return found


REGISTRY = discover()
