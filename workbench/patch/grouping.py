"""Edits of a patch's groups: create, extend and dissolve them."""

from collections.abc import Collection, Iterable

import msgspec

from underfoot.patch.groups import Group, chain, check_members, innermost
from underfoot.patch.patch import Patch


def grouped(patch: Patch, members: Iterable[str], title: str = "", colour: str = "grey") -> Patch:
    """Return the patch with a group around these nodes and notes; `SplitGroup` if it would split another one."""
    ids = {one.id for one in patch.canvas_items()}
    chosen = tuple(dict.fromkeys(member for member in members if member in ids))
    inside = [i for i, group in enumerate(patch.groups) if set(group.members) <= set(chosen)]
    at = min(inside, default=len(patch.groups))
    group = Group(patch.free_id("group"), chosen, title, colour)
    groups = (*patch.groups[:at], group, *patch.groups[at:])
    check_members(groups, ids)
    return msgspec.structs.replace(patch, groups=groups)


def put_into(patch: Patch, members: Collection[str], id: str) -> Patch:
    """Return the patch with new, ungrouped nodes and notes added to this group and to those that contain it."""
    around = set(chain(patch.groups, id))
    groups = tuple(
        msgspec.structs.replace(group, members=(*group.members, *members)) if group.id in around else group
        for group in patch.groups
    )
    return msgspec.structs.replace(patch, groups=groups)


def ungrouped(patch: Patch, ids: Collection[str]) -> Patch:
    """Return the patch without these groups; their members stay."""
    return msgspec.structs.replace(patch, groups=tuple(group for group in patch.groups if group.id not in ids))


def published(patch: Patch, end: str, on: bool) -> Patch:
    """Return the patch with a parameter, "node.parameter", shown or hidden on the innermost group of its node."""
    around = innermost(patch.groups).get(end.partition(".")[0], "")
    groups = tuple(
        msgspec.structs.replace(group, published=(*(e for e in group.published if e != end), *([end] if on else ())))
        if group.id == around
        else group
        for group in patch.groups
    )
    return msgspec.structs.replace(patch, groups=groups)
