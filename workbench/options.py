"""Options of a command, declared as the fields of a dataclass, for the command line and its help."""

from dataclasses import dataclass, field, fields
from typing import TypeVar, get_args

from underfoot.errors import require

Value = TypeVar("Value")
_DOC, _FLAG, _PRESETS, _WRITTEN = "doc", "flag", "presets", "written"


@dataclass(frozen=True)
class Option:
    """Option: the field's `name`, its `flag` on the command line, the `type` of its value, its default and help.

    `presets` is the kind of presets that may be named instead of a file, "" for none; `is_written`, of a file and no
    folder.
    """

    name: str
    flag: str
    type: type
    default: object
    doc: str
    presets: str = ""
    is_written: bool = False


def option(doc: str, default: Value, flag: str = "", presets: str = "", *, is_written: bool = False) -> Value:
    """Declare a field of a frozen dataclass as an option of a command; `level_db` becomes `--level-db` by default.

    The field's type is str, int, float, Path, or one of them or None; bool is a switch. Of a Path, `presets` is the
    function of `preset_files` for the presets that may be named, too, and `is_written` that it is a file to write.
    """
    found: Value = field(default=default, metadata={_DOC: doc, _FLAG: flag, _PRESETS: presets, _WRITTEN: is_written})
    return found


def options_of(owner: type) -> tuple[Option, ...]:
    """Return the options that a dataclass declares, in order.

    >>> @dataclass(frozen=True)
    ... class Playing:
    ...     level: float | None = option("How loud to play.", None)
    >>> [(option.name, option.flag, option.type) for option in options_of(Playing)]
    [('level', '--level', <class 'float'>)]
    """
    found = []
    for one in fields(owner):
        kinds = [kind for kind in get_args(one.type) or (one.type,) if kind is not type(None)]
        require(len(kinds) == 1 and isinstance(kinds[0], type), one.name, one.type, "one type, or that type or None")
        flag = one.metadata[_FLAG] or f"--{one.name.replace('_', '-')}"
        doc, presets, is_written = (one.metadata[key] for key in (_DOC, _PRESETS, _WRITTEN))
        found.append(Option(one.name, flag, kinds[0], one.default, doc, presets, is_written))
    return tuple(found)
