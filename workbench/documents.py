"""JSON documents with `format` and `version`, and errors that name the file, the place in it and the value."""

import codecs
import hashlib
import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from msgspec.structs import fields, force_setattr

from underfoot.arguments import is_text, plain
from underfoot.errors import BadFile, BadValue, cut_short, require, shown
from underfoot.files import LARGEST, head_of

_WORDS = {"int": "a whole number", "float": "a number", "str": "text", "array": "a list", "object": "an object"}

DEEPEST = 64
_FORMAT, _BEGINNING = re.compile(rb'"format"\s*:\s*"(underfoot-[a-z]+)"'), 1000
"""How a document says what it is, and the bytes among which it does."""
_LONGEST = 120
"""Characters of a message that repeats what is in the file."""

Document = TypeVar("Document", bound=msgspec.Struct)


def read_document(text: bytes | str, source: str, format: str, version: int, kind: type[Document]) -> Document:
    """Parse the document of type `kind` in `text`; its fields stand beside `format` and `version`.

    `BadFile` names `source`, the place in it, the value and what is allowed.
    """
    raw = parse(text, source, format, version)
    fields = {key: value for key, value in raw.items() if key not in ("format", "version")}
    with refusals(source, raw):
        return msgspec.convert(fields, kind)


def as_declared(document: msgspec.Struct) -> None:
    """Give the fields of a document that a script makes the types that they have after reading it from a file.

    `BadValue` where that cannot be: it would be written to a file that cannot be read.

    >>> class Title(msgspec.Struct, frozen=True):
    ...     words: tuple[str, ...]
    ...     __post_init__ = as_declared
    >>> Title(["gravel"])
    Title(words=('gravel',))
    >>> Title(["gravel", 2])
    Traceback (most recent call last):
    underfoot.errors.BadValue: words[1] is 2; allowed: text
    """
    given = {name: plain(getattr(document, name)) for name in document.__struct_fields__}
    try:
        found = msgspec.convert(given, _form(type(document)))
    except msgspec.ValidationError as error:
        raise BadValue(placed(error, given, shown).removeprefix("$.")) from None
    for name, value in given.items():
        texts = [one for one in (value if isinstance(value, list | tuple) else (value,)) if isinstance(one, str)]
        require(all(map(is_text, texts)), name, value, "text in UTF-8")
        force_setattr(document, name, getattr(found, name))


@cache
def _form(kind: type[msgspec.Struct]) -> type[msgspec.Struct]:
    """Return a struct with the same fields, which checks their types and nothing else."""
    return msgspec.defstruct(kind.__name__, [(field.name, field.type) for field in fields(kind)])


@contextmanager
def refusals(source: str, raw: object) -> Iterator[None]:
    """Turn validation errors of the document `raw` into a `BadFile` that names `source` and the place.

    >>> with refusals("a.json", {"n": "many"}):
    ...     msgspec.convert({"n": "many"}, dict[str, int])
    Traceback (most recent call last):
        ...
    underfoot.errors.BadFile: a.json: $[...] is {"n": "many"}; allowed: a whole number
    """
    try:
        yield
    except msgspec.ValidationError as error:
        raise BadFile(f"{source}: {placed(error, raw)}") from None
    except BadValue as error:
        raise BadFile(f"{source}: $.{error}") from None


def parse(text: bytes | str, source: str, format: str, version: int) -> dict[str, Any]:
    """Return the JSON object in `text` after checking its format and version.

    `BadFile` also for unusual JSON: see `plain_json`.
    """
    require(isinstance(text, bytes | str), source, text, "text, as of a file")
    raw = plain_json(text, source)
    if not isinstance(raw, dict) or raw.get("format") != format:
        given = raw.get("format") if isinstance(raw, dict) else raw
        raise BadFile(f"{source}: $.format is {_short(given)}; allowed: {format!r}")
    found = raw.get("version")
    if found != version or isinstance(found, bool):
        newer = " (a newer Underfoot may have written it)" if isinstance(found, int) and found > version else ""
        raise BadFile(f"{source}: $.version is {_short(found)}; allowed: {version}{newer}")
    return raw


def document_format(path: Path) -> str:
    """Return the format that the beginning of a file names, as "underfoot-floor"; "" if it names none of ours."""
    named = _FORMAT.search(head_of(path, _BEGINNING) or b"")
    return named[1].decode() if named else ""


def plain_json(text: bytes | str, source: str, deepest: int = DEEPEST) -> object:
    """Parse JSON `text`. `BadFile` for invalid JSON, for more than `LARGEST` bytes or `deepest` levels of lists and
    objects, and for an unpaired surrogate in a text.

    >>> plain_json("[1, 2.5]", "a.json")
    [1, 2.5]
    """
    if len(text) > LARGEST:
        raise BadFile(f"{source} has {len(text)} bytes; allowed: at most {LARGEST}")
    try:
        raw = json.loads(text.removeprefix(codecs.BOM_UTF8) if isinstance(text, bytes) else text)
    except UnicodeDecodeError:
        raise BadFile(f"{source} is not JSON: it is not UTF-8 text") from None
    except RecursionError:
        raise BadFile(f"{source} is nested deeper than {deepest} lists and objects") from None
    except json.JSONDecodeError as error:
        raise BadFile(f"{source} is not JSON: {_lower(error)}") from None
    except ValueError:  # of Python's own limit
        raise BadFile(f"{source} has a whole number of thousands of digits; allowed: what fits in 64 bits") from None
    _require_plain(raw, source, deepest)
    return raw


def _require_plain(raw: object, source: str, deepest: int) -> None:
    """Refuse values that are nested too deep, and text that cannot be encoded."""
    level, depth = [raw], 0
    while level:
        if depth > deepest:
            raise BadFile(f"{source} is nested deeper than {deepest} lists and objects")
        inside: list[Any] = []
        for value in level:
            if isinstance(value, dict):
                inside += value
                inside += value.values()
            elif isinstance(value, list):
                inside += value
            elif isinstance(value, str) and not is_text(value):
                raise BadFile(f"{source} has half of a surrogate pair in {_short(value)}")
        level, depth = inside, depth + 1


def write_document(format: str, version: int, document: msgspec.Struct) -> bytes:
    """Return the document as JSON in a fixed order; fields that are empty or not set are omitted."""
    fields = {"format": format, "version": version, **msgspec.to_builtins(document)}
    return msgspec.json.format(msgspec.json.encode(_lean(fields)), indent=1)


def written_part(part: msgspec.Struct) -> bytes:
    """Return a part of a document as JSON as `write_document` writes it, without spaces."""
    return msgspec.json.encode(_lean(msgspec.to_builtins(part)))


def identity_of(part: msgspec.Struct, made: str) -> str:
    """Return the identity of a calibration of the day `made`: that, and the first 12 hexadecimal digits of the SHA-256
    of its JSON without spaces.

    By these, recordings and sessions of studies name it. A field that is added to a part has to be empty or `UNSET` by
    default, and so is not written: otherwise what was calibrated before would get another digest.
    """
    as_read = msgspec.json.decode(written_part(part), type=type(part))  # a procedure's 0 is 0.0 from then on
    return f"{made} {hashlib.sha256(written_part(as_read)).hexdigest()[:12]}"


def _lean(value: object) -> object:
    if isinstance(value, dict):
        return {key: _lean(item) for key, item in value.items() if item not in (None, "", (), [], {})}
    return [_lean(item) for item in value] if isinstance(value, list | tuple) else value


def placed(error: msgspec.ValidationError, raw: object, as_text: Callable[[object], str] | None = None) -> str:
    """Return the library's message with its place in front and, if it names only a type, the actual value as text: by
    default as in JSON."""
    message, _, place = str(error).partition(" - at `")
    place = place.rstrip("`") or "$"
    value: Any = raw
    try:
        for key, index in re.findall(r"\.([A-Za-z0-9_-]+)|\[(\d+)\]", place):
            value = value[key] if key else value[int(index)]
    except (KeyError, IndexError, TypeError):
        value = raw
    if message.startswith("Expected") and place != "$":
        wanted = message.removeprefix("Expected ").partition(", got")[0].replace("`", "").split()
        return (
            f"{place} is {(as_text or _short)(value)}; allowed: {' '.join(_WORDS.get(word, word) for word in wanted)}"
        )
    if "; allowed: " in message:
        return f"{place}.{message}"
    return f"{place}: {_lower(message if len(message) <= _LONGEST else f'{message[: _LONGEST - 3]}...')}"


def _short(value: object) -> str:
    text = ascii(value) if isinstance(value, str) and not value.isprintable() else ""
    return cut_short(text or (repr(value) if isinstance(value, str) else json.dumps(value)))


def _lower(error: object) -> str:
    """Lower the first letter of a message for use inside a sentence; names such as JSON stay."""
    text = str(error)
    return text if text[1:2].isupper() else text[:1].lower() + text[1:]
