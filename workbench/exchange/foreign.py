"""Documents of other programs: reading into declared fields, with errors that name the place; and fields not read.

A structure declares exactly the fields that become part of a patch, so that a comparison yields the rest of the file.
"""

import math
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin, get_type_hints

import msgspec

from underfoot.documents import plain_json, refusals
from underfoot.errors import BadFile
from underfoot.files import read_file

Document = TypeVar("Document", bound=msgspec.Struct)

Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
"""A number from 0 to 1."""
Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=3600.0)]
"""A time from the beginning, at most an hour."""


def read_json(path: Path, deepest: int = 64, prefix: str = "") -> object:
    """Read the JSON in a file, after an optional `prefix`; raise `BadFile` also for numbers that are not finite."""
    data = read_file(path)
    head = data[: len(prefix) + 16].lstrip()
    if prefix and head.startswith(prefix.encode()):
        data = data.lstrip()[len(prefix) :]
    raw = plain_json(data, str(path), deepest)
    for place, value in _numbers(raw, "$"):
        if not math.isfinite(value):
            where = place if len(place) <= 80 else f"{place[:40]}...{place[-36:]}"
            raise BadFile(f"{path}: {where} is {value}; allowed: finite numbers")
    return raw


def convert(raw: object, path: Path, kind: type[Document]) -> Document:
    """Convert to a document; `BadFile` names the file, the place in it, the value and what is allowed."""
    with refusals(str(path), raw):
        return msgspec.convert(raw, kind)


def unread(raw: object, kind: object, silent: frozenset[str] = frozenset()) -> tuple[str, ...]:
    """Return the fields of a document that its structure `kind` does not declare: each once, as a path with its count.

    `silent` are names of fields without effect on a vibration, such as versions and ids.

    >>> class Point(msgspec.Struct):
    ...     time: float
    >>> unread([{"time": 0.0, "colour": "red"}, {"time": 1.0, "colour": 3}], list[Point])
    ('colour (2 times)',)
    """
    counts: dict[str, int] = {}
    for place in _unread(raw, kind, ""):
        if place.rpartition(".")[2] not in silent:
            counts[place] = counts.get(place, 0) + 1
    return tuple(place if count == 1 else f"{place} ({count} times)" for place, count in counts.items())


def _unread(raw: object, kind: object, place: str) -> Iterator[str]:
    kinds = _structures(kind)
    if isinstance(raw, dict) and kinds:
        hints = {
            field.encode_name: get_type_hints(kind)[field.name]
            for kind in kinds
            for field in msgspec.structs.fields(kind)
        }
        for key, value in raw.items():
            inside = f"{place}.{key}" if place else key
            if key not in hints:
                if value not in (None, "", [], {}):
                    yield inside
            else:
                yield from _unread(value, hints[key], inside)
    elif isinstance(raw, list):
        items = [item for one in _flat(kind) if get_origin(one) in (list, tuple) for item in get_args(one)[:1]]
        for value in raw:
            for item in items:
                yield from _unread(value, item, place)


def _structures(kind: object) -> list[type]:
    return [one for one in _flat(kind) if isinstance(one, type) and issubclass(one, msgspec.Struct)]


def _flat(kind: object) -> list[Any]:
    """Return the members of a union, or the type itself."""
    if get_origin(kind) is Annotated:
        return _flat(get_args(kind)[0])
    if get_origin(kind) in (Union, types.UnionType):
        return [one for member in get_args(kind) for one in _flat(member)]
    return [kind]


def _numbers(raw: object, place: str) -> Iterator[tuple[str, float]]:
    waiting = [(place, raw)]
    while waiting:
        place, value = waiting.pop()
        if isinstance(value, dict):
            waiting += [(f"{place}.{key}", item) for key, item in value.items()]
        elif isinstance(value, list):
            waiting += [(f"{place}[{at}]", item) for at, item in enumerate(value)]
        elif isinstance(value, float):
            yield place, value
