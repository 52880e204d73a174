"""What an edit of a draft changed: its name for an undo list, and its place in the document."""

import json
from collections.abc import Mapping, Sequence
from typing import Any

from msgspec import Struct

from underfoot.experiments.mistake_places import place_in_form

_LISTS = {"stimuli": "stimulus", "stages": "stage", "participant": "question"}
"""Lists of a protocol, and what one item is called."""
_TYPED_WHOLE = ("factors",)
"""Values that are typed as one text, although they are documents."""


class DraftEdit(Struct, frozen=True):
    """The difference between two states of a draft.

    `part` is the key of the protocol that differs, `index` the place in its list, else -1. Consecutive edits with the
    same `merge` are one undo step, as letters that are typed into one field; "" for an edit of its own.
    """

    name: str
    part: str
    index: int = -1
    merge: str = ""


def edit_between(before: Mapping[str, Any], after: Mapping[str, Any]) -> DraftEdit:
    """Return what was changed in a draft's document; the first change, if there are several.

    >>> stages = [{"id": "main", "kind": "pause", "seconds": 1.0}]
    >>> edit_between({"stages": []}, {"stages": stages})
    DraftEdit(name='Add stage main', part='stages', index=0, merge='')
    >>> edit_between({"stages": stages}, {"stages": [{**stages[0], "seconds": 15.0}]})
    DraftEdit(name='Change stage main, Lasts', part='stages', index=0, merge='stages.0.seconds')
    >>> edit_between({"title": "Ic"}, {"title": "Ice"})
    DraftEdit(name='Change Title', part='title', index=-1, merge='title')
    """
    for part, what in _LISTS.items():
        old, new = _items(before.get(part)), _items(after.get(part))
        if _differ(old, new):
            return _edit_of_list(part, what, old, new, after)
    part = next((name for name in {**before, **after} if _differ(before.get(name), after.get(name))), "")
    steps = _first_difference(before, after)
    return DraftEdit(f"Change {_place(steps, after)}", part, merge=_merge(steps, before, after))


def _differ(one: object, other: object) -> bool:
    """Return whether two values are written differently: 0 and 0.0 are equal, and so are documents in another order."""
    return json.dumps(one) != json.dumps(other)


def _items(value: object) -> list[tuple[str, dict[str, Any]]]:
    """Return the items of a part with their names."""
    if isinstance(value, Mapping):
        return [(str(name), item) for name, item in value.items()]
    if isinstance(value, Sequence):
        return [(str(item.get("id") or item.get("name") or at + 1), item) for at, item in enumerate(value)]
    return []


def _edit_of_list(
    part: str, what: str, old: list[tuple[str, Any]], new: list[tuple[str, Any]], after: Mapping[str, Any]
) -> DraftEdit:
    was, now = [name for name, _ in old], [name for name, _ in new]
    added, removed = [name for name in now if name not in was], [name for name in was if name not in now]
    if len(added) == 1 and not removed:
        return DraftEdit(f"Add {what} {added[0]}", part, now.index(added[0]))
    if len(removed) == 1 and not added:
        return DraftEdit(f"Remove {what} {removed[0]}", part, was.index(removed[0]))
    index = next((k for k, (one, other) in enumerate(zip(was, now, strict=False)) if one != other), -1)
    if len(added) == len(removed) == 1 and was.index(removed[0]) == now.index(added[0]):
        return DraftEdit(f"Rename {what} {removed[0]}", part, index, f"{part}.{index}.name")
    if added or removed:
        return DraftEdit(f"Replace the {part if part != 'participant' else 'questions'}", part, 0)
    if index >= 0:
        return DraftEdit(f"Move {what} {now[index]}", part, index)
    index = next(k for k, (one, other) in enumerate(zip(old, new, strict=True)) if _differ(one[1], other[1]))
    one, other = old[index][1], new[index][1]
    steps = _first_difference(one, other)
    place = _place((part, now[index] if part == "stimuli" else index, *steps), after)
    return DraftEdit(f"Change {place}", part, index, _merge(steps, one, other, f"{part}.{index}."))


def _first_difference(before: object, after: object) -> tuple[str | int, ...]:
    """Return the keys to the innermost value that contains all of the first difference."""
    if isinstance(before, Mapping) and isinstance(after, Mapping):
        for key in {**before, **after}:
            if _differ(before.get(key), after.get(key)):
                return (key, *(() if key in _TYPED_WHOLE else _first_difference(before.get(key), after.get(key))))
    old, new = _objects(before), _objects(after)
    if old is not None and new is not None and len(old) == len(new):
        for at, (one, other) in enumerate(zip(old, new, strict=True)):
            if _differ(one, other):
                return at, *_first_difference(one, other)
    return ()


def _objects(value: object) -> list[Mapping[str, Any]] | None:
    """Return a list of objects; None for any other value."""
    return value if isinstance(value, list) and all(isinstance(one, Mapping) for one in value) else None


def _merge(steps: tuple[str | int, ...], before: object, after: object, head: str = "") -> str:
    """Return the place of a value that is typed letter by letter; "" for a choice, or items that come and go."""
    ends: list[Any] = [before, after]
    for step in steps:
        ends = [value.get(step) if isinstance(value, Mapping) else value[step] for value in ends]
    is_choice = any(isinstance(value, bool) for value in ends)
    is_item = any(isinstance(value, Mapping) for value in ends) and steps[-1:] != _TYPED_WHOLE
    are_items = all(_objects(value) is not None for value in ends) and any(ends)
    return "" if is_choice or is_item or are_items else head + ".".join(map(str, steps))


def _place(steps: Sequence[str | int], after: Mapping[str, Any]) -> str:
    return place_in_form(steps, after) or "the study"
