"""Node types of the canvas. Each is one class in its family's module; `REGISTRY` collects them.

Plug-ins add nodes through entry points (docs/plugins.md); they cannot replace an existing one.
"""

import importlib
import pkgutil
from typing import TypeGuard

from underfoot.patch.node import NodeType, Registry
from underfoot.plugins import NODES, add_declared


def discover() -> Registry:
    """Return the nodes declared by this package's modules and by plug-ins, keyed by their type name in files.

    >>> "tile-output" in discover()
    True
    """
    found: dict[str, NodeType] = {}
    for module in pkgutil.iter_modules(__path__):
        for value in vars(importlib.import_module(f"{__name__}.{module.name}")).values():
            if _is_node(value):
                found[value.type] = value
    add_declared(found, NODES, _is_node, lambda node: node.type)
    return found


def _is_node(value: object) -> TypeGuard[NodeType]:
    return isinstance(value, NodeType)


REGISTRY = discover()
