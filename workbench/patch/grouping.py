"""Edits of a patch's groups: a frame around nodes, nodes into it, and the frame away again."""

from collections.abc import Collection, Iterable

import msgspec

from underfoot.patch.groups import Group, chain, check_members, innermost
from underfoot.patch.patch import Patch


def grouped(patch: Patch, members: Iterable[str], title: str = "", colour: str = "grey") -> Patch:
    """The patch with a group around these nodes and notes; `BadValue` where it would cut another group in two."""
    ids = {one.id for one in patch.things()}
    chosen = tuple(dict.fromkeys(member for member in members if member in ids))
    inside = [i for i, group in enumerate(patch.groups) if set(group.members) <= set(chosen)]
    at = min(inside, default=len(patch.groups))
    group = Group(patch.free_id("group"), chosen, title, colour)
    groups = (*patch.groups[:at], group, *patch.groups[at:])
    check_members(groups, ids)
    return msgspec.structs.replace(patch, groups=groups)


def put_into(patch: Patch, members: Collection[str], id: str) -> Patch:
    """The patch with new nodes and notes, which are in no group, in this one and in those that it lies in."""
    around = set(chain(patch.groups, id))
    groups = tuple(
        msgspec.structs.replace(group, members=(*group.members, *members)) if group.id in around else group
        for group in patch.groups
    )
    return msgspec.structs.replace(patch, groups=groups)


def ungrouped(patch: Patch, ids: Collection[str]) -> Patch:
    """The patch without these groups; what was in them stays."""
    return msgspec.structs.replace(patch, groups=tuple(group for group in patch.groups if group.id not in ids))


def published(patch: Patch, end: str, on: bool) -> Patch:
    """The patch with a parameter, as "node.parameter", shown on the innermost group around its node, or not there."""
    around = innermost(patch.groups).get(end.partition(".")[0], "")
    groups = tuple(
        msgspec.structs.replace(group, published=(*(e for e in group.published if e != end), *([end] if on else ())))
        if group.id == around
        else group
        for group in patch.groups
    )
    return msgspec.structs.replace(patch, groups=groups)
