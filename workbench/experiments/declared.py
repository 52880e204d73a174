"""Fields of a protocol's documents as parameters, derived from their types, for forms."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar

import msgspec
from msgspec import inspect

from underfoot.parameters import Choice, Count, Number, Parameter, Text, ask
from underfoot.quantities import split_unit

_LONGEST = 20_000


@dataclass(frozen=True)
class BooleanField(Parameter):
    """Yes or no."""

    kind: ClassVar[str] = "flag"

    @property
    def allowed(self) -> str:
        return "true or false"

    def check(self, value: object) -> bool:
        if not isinstance(value, bool):
            raise self.refuse(value)
        return value


@dataclass(frozen=True)
class TextLine(Parameter):
    """Several distinct short texts, in a meaningful order."""

    default: tuple[str, ...] = ()
    kind: ClassVar[str] = "words"

    @property
    def allowed(self) -> str:
        return "texts, each once"

    def check(self, value: object) -> tuple[str, ...]:
        if not isinstance(value, Sequence) or isinstance(value, str) or not all(isinstance(v, str) for v in value):
            raise self.refuse(value)
        if len(set(value)) != len(value):
            raise self.refuse(value)
        return tuple(value)


@dataclass(frozen=True)
class NamedChoice(Parameter):
    """One of several values; `values` maps the labels that a form shows to them."""

    values: Mapping[str, str] = field(default_factory=dict, kw_only=True)
    kind: ClassVar[str] = "named"

    @property
    def allowed(self) -> str:
        return ", ".join(self.values)

    def check(self, value: object) -> str:
        if value not in self.values.values():
            raise self.refuse(value)
        return str(value)


def fields_of(document: type[msgspec.Struct], names: Sequence[str]) -> dict[str, Parameter]:
    """Return the fields of these names as parameters, in this order; fields that contain documents are omitted.

    >>> from underfoot.experiments.protocol import Sounds
    >>> sounds = fields_of(Sounds, ("noise", "noise_db"))
    >>> sounds["noise"].allowed, sounds["noise_db"].allowed, sounds["noise_db"].label
    ('none, pink, white', '-120 to 0 dB', 'Noise level')
    """
    known = _known_fields(document)
    found = {}
    for name in names:
        field = known[name]
        made = _parameter(name, field.type, "" if field.default is msgspec.NODEFAULT else field.default)
        if made is not None:
            found[name] = ask(name, made)
    return found


@cache  # a form asks at each key
def _known_fields(document: type[msgspec.Struct]) -> dict[str, inspect.Field]:
    info = inspect.type_info(document)
    assert isinstance(info, inspect.StructType)
    return {field.name: field for field in info.fields}


def caption(name: str) -> tuple[str, str]:
    """Return the caption of a field name in a form, and the unit with which the name ends.

    >>> caption("trial_pause_s"), caption("blocks")
    (('Trial pause', 's'), ('Blocks', ''))
    """
    stem, unit = split_unit(name)
    return stem.replace("_", " ").capitalize(), unit


def shown_name(name: str, parameter: Parameter | None) -> str:
    """Return a field's name in a form: its declared label, or a caption made of its name.

    >>> from underfoot.experiments.protocol import Stage
    >>> shown_name("start", fields_of(Stage, ["start"])["start"]), shown_name("trial_pause_s", None)
    ('Begun by', 'Trial pause')
    """
    if parameter is not None and parameter.label.lower() != name.replace("_", " "):
        return parameter.label
    return caption(name)[0]


def _parameter(name: str, kind: inspect.Type, default: Any) -> Parameter | None:  # noqa: ANN401 - of that type
    label, unit = caption(name)
    doc = ""
    if isinstance(kind, inspect.Metadata):
        told = kind.extra_json_schema or {}
        doc, label, kind = told.get("description", ""), told.get("title", label), kind.type
    match kind:
        case inspect.BoolType():
            return BooleanField(default, doc=doc, label=label)
        case inspect.LiteralType(values=values):
            return Choice(default or values[0], options=tuple(map(str, values)), doc=doc, label=label)
        case inspect.FloatType(ge=low, le=high) if low is not None and high is not None:
            return Number(default or 0.0, low, high, doc=doc, label=label, unit=unit)
        case inspect.IntType(ge=low, le=high) if low is not None and high is not None:
            return Count(default or 0, low, high, doc=doc, label=label, unit=unit)
        case inspect.VarTupleType(item_type=inspect.StrType()):
            return TextLine(tuple(default or ()), doc=doc, label=label)
        case inspect.StrType():
            return Text(default, doc=doc, label=label, most=_LONGEST)
    return None
