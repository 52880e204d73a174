"""Edits of a patch's groups: create, extend and dissolve them."""

from collections.abc import Collection, Iterable

from msgspec.structs import replace

from underfoot.patch.groups import Group, chain, check_members, without
from underfoot.patch.patch import Patch


def grouped(patch: Patch, members: Iterable[str], title: str = "", colour: str = "grey", within: str = "") -> Patch:
    """Return the patch with a group around these nodes and notes; `SplitGroup` if it would split another one.

    Around all that the group `within` has, the new group still lies in it, and not around it.
    """
    ids = {one.id for one in patch.canvas_items()}
    chosen = tuple(dict.fromkeys(member for member in members if member in ids))
    around = chain(patch.groups, within)
    inner = (i for i, one in enumerate(patch.groups) if one.id not in around and set(one.members) <= set(chosen))
    at = min(inner, default=len(patch.groups))
    group = Group(patch.free_id("group"), chosen, title, colour)
    groups = (*patch.groups[:at], group, *patch.groups[at:])
    check_members(groups, ids)
    return replace(patch, groups=groups)


def put_into(patch: Patch, members: Collection[str], id: str) -> Patch:
    """Return the patch with nodes and notes in this group, in those that contain it, and in groups that are put into it
    whole; in no other.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = Patch().add("gain", REGISTRY).add("mix", REGISTRY).add("noise", REGISTRY)
    >>> patch = grouped(grouped(patch, ["gain"]), ["mix", "noise"])
    >>> [group.members for group in put_into(patch, ["mix", "noise"], "group").groups]
    [('gain', 'mix', 'noise'), ('mix', 'noise')]
    >>> [group.members for group in put_into(patch, ["mix"], "group").groups]
    [('gain', 'mix'), ('noise',)]
    """
    around, groups, whole = set(chain(patch.groups, id)), list[Group](), list[Group]()
    for group in patch.groups:
        if group.id in around:
            groups.append(replace(group, members=tuple(dict.fromkeys((*group.members, *members)))))
        elif set(group.members) <= set(members):
            whole.append(group)
        else:
            groups += without([group], members)
    return replace(patch, groups=(*groups, *whole))


def taken_out(patch: Patch, members: Collection[str], id: str) -> Patch:
    """Return the patch with these nodes and notes no longer in this group, which is removed if it becomes empty.

    They stay in the groups that contain it; of a group inside it, `members` has all or none.

    >>> from underfoot.nodes import REGISTRY
    >>> patch = grouped(Patch().add("gain", REGISTRY).add("mix", REGISTRY), ["gain", "mix"])
    >>> [group.members for group in taken_out(patch, ["gain"], "group").groups]
    [('mix',)]
    """
    groups = [one for group in patch.groups for one in (without([group], members) if group.id == id else [group])]
    return replace(patch, groups=tuple(groups))


def ungrouped(patch: Patch, ids: Collection[str]) -> Patch:
    """Return the patch without these groups; their members stay."""
    return replace(patch, groups=tuple(group for group in patch.groups if group.id not in ids))


def published(patch: Patch, id: str, end: str, on: bool) -> Patch:
    """Return the patch with a parameter, "node.parameter", shown or hidden on this group, which contains its node."""
    group = patch.group(id)
    shown = (*(one for one in group.published if one != end), *([end] if on else ()))
    return patch.with_item(replace(group, published=shown))
