"""Node types of the canvas. Each is one class in its family's module; `REGISTRY` collects them.

Plug-ins add nodes through entry points (docs/plugins.md); they cannot replace an existing one.
"""

from typing import TypeGuard

from underfoot.patch.node import NodeType, Registry
from underfoot.plugins import NODES, add_declared, values_in


def discover() -> Registry:
    """Return the nodes declared by this package's modules and by plug-ins, keyed by their type name in files.

    >>> "tile-output" in discover()
    True
    """
    found = {value.type: value for value in values_in(__name__) if _is_node(value)}
    add_declared(found, NODES, _is_node, lambda node: node.type)
    return found


def _is_node(value: object) -> TypeGuard[NodeType]:
    return isinstance(value, NodeType)


REGISTRY = discover()
