"""Decides which edits of a patch the engine receives as single numbers, and which need a new program."""

from underfoot.engine.commands import Set
from underfoot.patch.effective import effective_patch
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch


def moved_numbers(old: Patch, new: Patch, registry: Registry) -> list[Set] | None:
    """Return the numbers that differ between two patches; None if anything else audible differs.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("gain", REGISTRY)
    >>> moved_numbers(patch, patch.set("gain", "gain", 2.0, REGISTRY), REGISTRY)
    [Set(node='gain', name='gain', value=2.0)]
    >>> moved_numbers(patch, patch.add("gain", REGISTRY), REGISTRY) is None
    True
    """
    old, new = effective_patch(old, registry), effective_patch(new, registry)
    if old.wires != new.wires or old.seed != new.seed or len(old.nodes) != len(new.nodes):
        return None
    moved = []
    for before, after in zip(old.nodes, new.nodes, strict=True):
        if (before.id, before.type) != (after.id, after.type):
            return None
        if before.parameters == after.parameters:
            continue
        type = registry[after.type]
        was, now = type.values(before.parameters), type.values(after.parameters)
        for name, parameter in type.parameters.items():
            if was[name] != now[name]:
                if not parameter.is_ramped:
                    return None
                moved.append(Set(after.id, name, now[name]))
    return moved
