"""Options and arguments of a command, declared as the fields of a dataclass, for the command line and its help."""

from collections.abc import Mapping
from dataclasses import Field, dataclass, field, fields, replace
from types import NoneType
from typing import Any, TypeVar, get_args, get_origin

from underfoot.errors import require

Value = TypeVar("Value")
_DECLARED, _BY_NAME = "declared", "--"


@dataclass(frozen=True)
class Option:
    """Option: the field's `name`, its `flag` on the command line, the `type` of its value, its default and help.

    `flag` is "" for an argument, which stands without one. The value of one that `is_several` is a tuple; one that
    `is_optional` can be None. `presets` is the kind of presets that may be named instead of a file, "" for none;
    `is_written`, of a file and no folder. `more` is what only the command line knows.
    """

    doc: str
    default: object
    flag: str
    presets: str
    more: Mapping[str, object]
    is_written: bool = False
    name: str = ""
    type: type = str
    is_several: bool = False
    is_optional: bool = False


def option(
    doc: str,
    default: Value = None,  # type: ignore[assignment]
    flag: str = "",
    presets: str = "",
    *,
    is_written: bool = False,
    **more: object,
) -> Value:
    """Declare a field of a frozen dataclass as an option of a command; `level_db` becomes `--level-db` by default.

    The field's type is str, int, float, Path, or one of them or None, or a tuple of as many as are given; bool is a
    switch. Of a file, `presets` is the function of `preset_files` for the presets that may be named, too, and
    `is_written` that it is a file to write. `more` goes to `click.Option`.
    """
    declared = Option(doc, default, flag or _BY_NAME, presets, more, is_written)
    found: Value = field(default=default, metadata={_DECLARED: declared})
    return found


def argument(presets: str = "", **more: object) -> Any:  # noqa: ANN401 - of the field's type
    """Declare a field as an argument, which stands without a flag; `more` goes to `click.Argument`."""
    return field(metadata={_DECLARED: Option("", None, "", presets, more)})


def shared(declared: Value) -> Value:
    """Declare a field as an option that several commands have: one that was declared outside of a class."""
    assert isinstance(declared, Field)
    found: Value = field(default=declared.default, metadata=declared.metadata)  # type: ignore[assignment]
    return found


def options_of(owner: type) -> tuple[Option, ...]:
    """Return the options and arguments that a dataclass declares, in order, and last those that it inherits.

    >>> @dataclass(frozen=True)
    ... class Playing:
    ...     level: float | None = option("How loud to play.", None)
    >>> @dataclass(frozen=True)
    ... class Showing(Playing):
    ...     width: int = option("How many pixels.", 480)
    >>> [(option.name, option.flag, option.type) for option in options_of(Showing)]
    [('width', '--width', <class 'int'>), ('level', '--level', <class 'float'>)]
    """
    classes = [of.__annotations__ for of in owner.__mro__[:-1]]
    found = sorted(fields(owner), key=lambda one: next(k for k, names in enumerate(classes) if one.name in names))
    return tuple(map(_option_of, found))


def _option_of(one: "Field[Any]") -> Option:
    parts = get_args(one.type) or (one.type,)
    kinds = [kind for kind in parts if kind not in (NoneType, ...)]
    require(len(kinds) == 1 and isinstance(kinds[0], type), one.name, one.type, "one type, or that type or None")
    declared: Option = one.metadata[_DECLARED]
    flag = f"--{one.name.replace('_', '-')}" if declared.flag == _BY_NAME else declared.flag
    is_several, is_optional = get_origin(one.type) is tuple, NoneType in parts
    return replace(declared, name=one.name, flag=flag, type=kinds[0], is_several=is_several, is_optional=is_optional)
