"""Node types of the canvas. Each is one class in its family's module; `REGISTRY` collects them.

Plug-ins add nodes through entry points (docs/plugins.md); they cannot replace an existing one.
"""

import importlib
import pkgutil

from underfoot.patch.node import NodeType, Registry
from underfoot.plugins import NODES, declared, refuse


def discover() -> Registry:
    """Return the nodes declared by this package's modules and by plug-ins, keyed by their type name in files.

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
