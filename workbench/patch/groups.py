"""Annotations of a patch: notes, and groups of nodes. They do not affect the output."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from numbers import Real

import msgspec
from msgspec.structs import replace

from underfoot.arguments import choice, is_text
from underfoot.errors import BadValue, require
from underfoot.parameters import require_identifier
from underfoot.patch.wiring import node_id, renamed_end

COLOURS = ("grey", "teal", "amber", "violet", "green", "red")
"""Colours of a group's frame."""

LONGEST_LABEL, LONGEST_NOTE = 80, 4000
"""Largest numbers of characters."""

FURTHEST = 1e6
"""Largest distance from the canvas's centre, in pixels."""

NARROWEST, WIDEST = 64.0, 2000.0
"""Smallest and largest width of a note, in pixels."""


class Note(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Text on the canvas."""

    id: str
    text: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    width: float = 200.0


class Group(msgspec.Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """Frame around nodes and notes; when collapsed, a sub-patch that is drawn as one node at `at`.

    Groups are nested or disjoint; an outer one precedes those inside it.
    """

    id: str
    members: tuple[str, ...] = ()
    title: str = ""
    colour: str = "grey"
    collapsed: bool = False
    at: tuple[float, float] = (0.0, 0.0)
    published: tuple[str, ...] = ()
    """Parameters of inner nodes, as "node.parameter", that are also set on the collapsed node."""


def innermost(groups: Iterable[Group]) -> dict[str, str]:
    """Return the innermost group of each grouped node and note.

    >>> innermost([Group("a", ("x", "y")), Group("b", ("y",))])
    {'x': 'a', 'y': 'b'}
    """
    return {member: group.id for group in groups for member in group.members}


def parents(groups: Iterable[Group]) -> dict[str, str]:
    """Return the parent of each group, or "".

    >>> parents([Group("a", ("x", "y")), Group("b", ("y",))])
    {'a': '', 'b': 'a'}
    """
    inner: dict[str, str] = {}
    found = {}
    for group in groups:
        found[group.id] = inner.get(group.members[0], "")
        inner.update(dict.fromkeys(group.members, group.id))
    return found


def chain(groups: Iterable[Group], id: str) -> list[str]:
    """Return a group and its ancestors, the outermost first.

    >>> chain([Group("a", ("x", "y")), Group("b", ("y",))], "b")
    ['a', 'b']
    """
    above = parents(groups)
    found: list[str] = []
    while id:
        found.insert(0, id)
        id = above[id]
    return found


def without(groups: Iterable[Group], gone: Collection[str]) -> tuple[Group, ...]:
    """Return the groups without these members and groups; groups that become empty are removed."""
    kept = []
    for group in groups:
        if group.id in gone:
            continue
        if not gone or not any(member in gone for member in group.members):
            kept.append(group)
            continue
        members = tuple(member for member in group.members if member not in gone)
        published = tuple(end for end in group.published if node_id(end) not in gone)
        if members:
            kept.append(replace(group, members=members, published=published))
    return tuple(kept)


def renamed(groups: Iterable[Group], names: Mapping[str, str]) -> tuple[Group, ...]:
    """Return the groups with some members renamed."""
    return tuple(
        replace(
            group,
            members=tuple(names.get(member, member) for member in group.members),
            published=tuple(renamed_end(end, names) for end in group.published),
        )
        if any(member in names for member in group.members)
        else group
        for group in groups
    )


def check_notes_and_groups(
    notes: Iterable[Note], groups: Iterable[Group], nodes: Iterable[str], parameters: Collection[str]
) -> None:
    """Raise `BadValue` if an id is taken, a text is too long, or groups overlap. `parameters` are all parameters, as
    "node.parameter"."""
    seen = set(nodes)
    for i, note in enumerate(notes):
        _check_id(f"notes[{i}]", note.id, seen)
        allowed = f"text of at most {LONGEST_NOTE} characters"
        require(is_text(note.text) and len(note.text) <= LONGEST_NOTE, f"notes[{i}].text", note.text, allowed)
        check_place(f"notes[{i}]", note.at)
        is_width = NARROWEST <= note.width <= WIDEST
        require(is_width, f"notes[{i}].width", note.width, f"{NARROWEST:g} to {WIDEST:g}")
    members = frozenset(seen)
    for i, group in enumerate(groups):
        _check_id(f"groups[{i}]", group.id, seen)
        check_label(f"groups[{i}].title", group.title)
        choice(f"groups[{i}].colour", group.colour, COLOURS)
        check_place(f"groups[{i}]", group.at)
        for end in group.published:
            known = node_id(end) in group.members and end in parameters
            require(known, f"groups[{i}].published", end, "parameters of its nodes, as node.parameter")
    check_members(groups, members)


def check_label(place: str, text: str) -> None:
    """Raise `BadValue` for a label of more than one line."""
    allowed = f"one line of at most {LONGEST_LABEL} characters"
    require(isinstance(text, str), place, text, allowed)
    require(len(text) <= LONGEST_LABEL and text.isprintable(), place, text, allowed)


def check_place(place: str, at: tuple[float, float]) -> None:
    """Raise `BadValue` for what is no position on the canvas."""
    is_place = is_pair(at) and all(abs(coordinate) <= FURTHEST for coordinate in at)
    require(is_place, f"{place}.at", at, f"two numbers, each -{FURTHEST:g} to {FURTHEST:g}")


def is_pair(at: object) -> bool:
    """Return whether this is two numbers.

    >>> is_pair((0.0, -64)), is_pair(64), is_pair("12")
    (True, False, False)
    """
    return isinstance(at, Sequence) and len(at) == 2 and all(isinstance(coordinate, Real) for coordinate in at)


def _check_id(place: str, id: str, seen: set[str]) -> None:
    require_identifier(f"{place}.id", id)
    require(id not in seen, f"{place}.id", id, "an id that no other node, note or group has")
    seen.add(id)


class SplitGroup(BadValue):
    """A group would hold a part of another one; `ids` are those of both."""

    ids: tuple[str, str] = ("", "")


def check_members(groups: Iterable[Group], ids: Collection[str]) -> None:
    """Raise `BadValue` if a group has an unknown member, `SplitGroup` if it splits another group."""
    inner: dict[str, str] = {}
    for i, group in enumerate(groups):
        require(bool(group.members), f"groups[{i}].members", "[]", "one node or note, or more")
        around = inner.get(group.members[0], "")
        seen: set[str] = set()
        for member in group.members:
            require(member in ids, f"groups[{i}].members", member, "nodes and notes of this patch")
            require(member not in seen, f"groups[{i}].members", member, "each member once")
            seen.add(member)
            if inner.get(member, "") != around:
                cut = inner.get(member, "") or around
                error = SplitGroup(f"groups[{i}] would hold a part of the group {cut!r}; take all of it, or nothing")
                error.ids = group.id, cut
                raise error
        inner.update(dict.fromkeys(group.members, group.id))
