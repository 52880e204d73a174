"""Parameters of nodes, declared once.

The declaration of a parameter is used by the inspector's control and tooltip, the check of files, the node reference,
the command line's help and the random stress test.
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeGuard

from underfoot.arguments import choice, is_text
from underfoot.errors import BadValue, refusal, require
from underfoot.phrases import Phrase

IDENTIFIER = re.compile(r"[A-Za-z0-9_-]+")
"""Pattern of an id (of a node, tile or port)."""


@dataclass(frozen=True)
class Parameter:
    """Common part of parameters. `name` is the attribute it is declared as; files and wires use that name.

    `default` is the value where a file has none. `added` is the value of a node added by hand, where it should begin
    otherwise: files may leave the default out, so that it cannot change.
    """

    default: Any
    added: Any = field(default=None, kw_only=True)
    doc: str = field(default="", kw_only=True)
    label: str = field(default="", kw_only=True)
    name: str = field(default="", init=False, compare=False)
    kind: ClassVar[str] = "any"

    def __set_name__(self, owner: type, name: str) -> None:
        object.__setattr__(self, "name", name)
        if not self.label:
            object.__setattr__(self, "label", name.replace("_", " ").capitalize())

    @property
    def is_ramped(self) -> bool:
        """Whether it ramps to a new value; otherwise a change rebuilds the program and fades it in."""
        return False

    @property
    def initial(self) -> Any:  # noqa: ANN401 - of the parameter's kind
        """Value that a node added by hand has, and that a control goes back to."""
        return self.default if self.added is None else self.added

    @property
    def allowed(self) -> str:
        """Description of the allowed values."""
        raise AssertionError(f"{type(self).__name__} says nothing of what it allows")

    def check(self, value: object) -> Any:  # noqa: ANN401 - of the parameter's kind
        """Return the value as the program uses it, or raise `BadValue`."""
        raise AssertionError(f"{type(self).__name__} checks nothing")

    def check_declaration(self) -> None:
        """Raise `BadValue` if the declaration contradicts itself."""
        try:
            self.check(self.default)
        except BadValue as error:
            raise BadValue(f"default of {error}") from None

    def refuse(self, value: object) -> BadValue:
        return refusal(self.name, value, self.allowed)


@dataclass(frozen=True)
class Number(Parameter):
    """Real number from `low` to `high`, in `unit`. Changes are ramped; `wire` says whether a wire may drive it.

    With `fades` it cannot be ramped: a change rebuilds the program and fades it in.

    `wire` is "" (no), "span" (read once per span) or "audio" (one value per frame). `scale` is the spacing of its
    control: "linear", "log", or in decibels from silence on: "gain", a factor that is also shown in decibels, with a
    detent at 0 dB; "amplitude", shown in its unit, also for other numbers of many sizes that may be 0. Files and wires
    have the number itself. A gain that may be negative is set by its size, and inverted by a button.

    `unit_of` names the port whose wires give the unit of a number that has none of its own: an LFO that drives a
    frequency goes from low to high in Hz.

    >>> Number(1.0, 0.0, 2.0, unit="m").check(3)
    Traceback (most recent call last):
    underfoot.errors.BadValue:  is 3; allowed: 0 to 2 m
    """

    low: float = 0.0
    high: float = 1.0
    unit: str = field(default="", kw_only=True)
    scale: str = field(default="linear", kw_only=True)
    wire: str = field(default="", kw_only=True)
    fades: bool = field(default=False, kw_only=True)
    unit_of: str = field(default="", kw_only=True)
    kind: ClassVar[str] = "number"

    @property
    def is_ramped(self) -> bool:
        return not self.fades

    @property
    def allowed(self) -> str:
        return Phrase("{low} to {high} {unit}", low=float(self.low), high=float(self.high), unit=self.unit)

    def check_declaration(self) -> None:
        super().check_declaration()
        require(self.wire in _WIRES, f"wire of {self.name}", self.wire, ", ".join(map(repr, _WIRES)))
        choice(f"scale of {self.name}", self.scale, _SCALES)
        require(self.scale != "log" or self.low > 0.0, f"low of {self.name}", self.low, "above 0 with log")

    def check(self, value: object) -> float:
        if not _is_within(value, self.low, self.high):
            raise self.refuse(value)
        return float(value)

    @property
    def is_in_db(self) -> bool:
        """Whether a control spaces it in decibels, from silence on."""
        return self.scale in ("gain", "amplitude")

    def position(self, value: float) -> float:
        """Return the position of `value` on the control, 0 to 1; for a gain, that of its size."""
        if self.scale == "log":
            return math.log(value / self.low) / math.log(self.high / self.low)
        if self.is_in_db:
            return max(_db(abs(value)) - LEAST_DB, 0.0) / (_db(self.high) - LEAST_DB)
        return (value - self.low) / (self.high - self.low)

    def value(self, position: float) -> float:
        """Return the value at a control's `position`, 0 to 1; the inverse of `position`, except for a gain's sign."""
        if self.scale == "log":
            return min(max(self.low * (self.high / self.low) ** position, self.low), self.high)
        if self.is_in_db:
            db = LEAST_DB + position * (_db(self.high) - LEAST_DB)
            if position <= 0.0:
                return 0.0
            return float(min(10.0 ** (db / 20.0), self.high))
        return self.low + (self.high - self.low) * position


_WIRES, _SCALES = ("", "span", "audio"), ("linear", "log", "gain", "amplitude")
LEAST_DB = -60.0
"""Lowest level of a control in decibels above silence."""


def _db(factor: float) -> float:
    return 20.0 * math.log10(factor) if factor > 0.0 else -math.inf


@dataclass(frozen=True)
class Count(Parameter):
    """Whole number from `low` to `high`. A change rebuilds the program and fades it in."""

    low: int = 0
    high: int = 1
    unit: str = field(default="", kw_only=True)
    kind: ClassVar[str] = "count"

    @property
    def allowed(self) -> str:
        return Phrase("whole numbers {low} to {high} {unit}", low=self.low, high=self.high, unit=self.unit)

    def check(self, value: object) -> int:
        if not _is_within(value, self.low, self.high) or value != value // 1:
            raise self.refuse(value)
        return int(value)


@dataclass(frozen=True)
class Choice(Parameter):
    """One of several options. A change rebuilds the program and fades it in."""

    options: tuple[str, ...] = ()
    kind: ClassVar[str] = "choice"

    @property
    def allowed(self) -> str:
        return Phrase("{options}", options=self.options)

    def check(self, value: object) -> str:
        if value not in self.options:
            raise self.refuse(value)
        return str(value)


@dataclass(frozen=True)
class Numbers(Parameter):
    """List of `least` to `most` numbers, each from `low` to `high`."""

    low: float = 0.0
    high: float = 1.0
    least: int = field(default=1, kw_only=True)
    most: int = field(default=200, kw_only=True)
    unit: str = field(default="", kw_only=True)
    kind: ClassVar[str] = "numbers"

    @property
    def allowed(self) -> str:
        return f"a list of {self.least} to {self.most} numbers, each {self.low:g} to {self.high:g} {self.unit}".rstrip()

    def check(self, value: object) -> tuple[float, ...]:
        if not (_is_list(value, self.least, self.most) and all(_is_within(one, self.low, self.high) for one in value)):
            raise self.refuse(value)
        return tuple(float(item) for item in value)


@dataclass(frozen=True)
class Rows(Parameter):
    """List of up to `most` rows of numbers; `columns` gives each column's name, lowest and highest value."""

    columns: tuple[tuple[str, float, float], ...] = ()
    most: int = field(default=200, kw_only=True)
    kind: ClassVar[str] = "rows"

    @property
    def allowed(self) -> str:
        columns = ", ".join(f"{name} {low:g} to {high:g}" for name, low, high in self.columns)
        return f"up to {self.most} rows of [{columns}]"

    def check(self, value: object) -> tuple[tuple[float, ...], ...]:
        if not (_is_list(value, 0, self.most) and all(map(self._is_row, value))):
            raise self.refuse(value)
        return tuple(tuple(float(item) for item in row) for row in value)

    def _is_row(self, row: object) -> bool:
        if not _is_list(row, len(self.columns), len(self.columns)):
            return False
        return all(_is_within(one, low, high) for one, (_, low, high) in zip(row, self.columns, strict=True))


def _is_within(value: object, low: float, high: float) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool) and low <= value <= high


def _is_list(value: object, least: int, most: int) -> TypeGuard[Sequence[Any]]:
    return isinstance(value, Sequence) and not isinstance(value, str) and least <= len(value) <= most


@dataclass(frozen=True)
class Text(Parameter):
    """Line of text, such as the path of a sound file."""

    most: int = field(default=1000, kw_only=True)
    kind: ClassVar[str] = "text"

    @property
    def allowed(self) -> str:
        return f"text of at most {self.most} characters in UTF-8"

    def check(self, value: object) -> str:
        if not isinstance(value, str) or not is_text(value) or len(value) > self.most or "\0" in value:
            raise self.refuse(value)
        return value


@dataclass(frozen=True)
class FilePath(Text):
    """Path of a file, relative to the patch unless it is absolute. `suffixes` are those of the files that it is for, in
    lower case with the dot, as ".wav": one that is dropped on the canvas becomes a node.
    """

    suffixes: tuple[str, ...] = field(default=(), kw_only=True)
    kind: ClassVar[str] = "file"


@dataclass(frozen=True)
class Tiles(Parameter):
    """Tiles that a node applies to: "all", or tile ids joined by "+"."""

    default: str = "all"
    kind: ClassVar[str] = "tiles"

    @property
    def allowed(self) -> str:
        return 'all, or tile ids joined by "+"'

    def check(self, value: object) -> str:
        if not isinstance(value, str) or not all(IDENTIFIER.fullmatch(tile) for tile in value.split("+")):
            raise self.refuse(value)
        return value

    @staticmethod
    def has(value: str, tile: str) -> bool:
        """Return whether `value` includes `tile`.

        >>> Tiles.has("t1+t2", "t2"), Tiles.has("all", "t9"), Tiles.has("t1", "t2")
        (True, True, False)
        """
        return value == "all" or tile in value.split("+")


def declared_in(owner: type) -> dict[str, Parameter]:
    """Return the parameters that a class declares itself, without those of its bases, by name and in their order.

    >>> class Walk:
    ...     speed = Number(1.2, 0.1, 3.0, unit="m/s")
    ...     people = Count(1, 1, 9)
    >>> list(declared_in(Walk))
    ['speed', 'people']
    """
    return {name: value for name, value in vars(owner).items() if isinstance(value, Parameter)}


def require_identifier(place: str, id: str) -> None:
    """Raise `BadValue` for an id that is no `IDENTIFIER`.

    >>> require_identifier("nodes[0].id", "a tone")
    Traceback (most recent call last):
    underfoot.errors.BadValue: nodes[0].id is 'a tone'; allowed: letters, digits, - and _
    """
    is_one = isinstance(id, str) and IDENTIFIER.fullmatch(id) is not None
    require(is_one, place, id, "letters, digits, - and _")


def ask(name: str, parameter: Parameter) -> Parameter:
    """Return the parameter, to be asked for as `name`; without a label of its own, its label is the name.

    >>> ask("load_n", Number(100.0, 1.0, 2000.0, unit="N")).label
    'Load n'
    """
    parameter.__set_name__(Parameter, name)
    return parameter
