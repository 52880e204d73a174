"""What a page asks a participant: parameters under names, and those that a protocol writes down."""

from dataclasses import dataclass, field
from typing import Annotated, Literal

import msgspec

from underfoot.errors import require
from underfoot.parameters import IDENTIFIER, Choice, Count, Number, Parameter, Text

FIRST, SECOND = "first", "second"
YES, NO = "yes", "no"

Bound = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]


@dataclass(frozen=True)
class Scale(Number):
    """A slider whose ends have words of their own.

    >>> Scale(50.0, 0.0, 100.0, ends=("soft", "hard")).allowed
    '0 (soft) to 100 (hard)'
    """

    ends: tuple[str, str] = field(default=("", ""), kw_only=True)

    @property
    def allowed(self) -> str:
        low, high = self.ends
        return f"{self.low:g} ({low}) to {self.high:g} ({high})"


def ask(name: str, parameter: Parameter) -> Parameter:
    """A parameter that a page asks for under `name`; its label comes of the name where it has none.

    >>> ask("rating", Number(50.0, 0.0, 100.0)).label
    'Rating'
    """
    parameter.__set_name__(Parameter, name)
    return parameter


def yes_or_no(name: str, doc: str) -> Parameter:
    """A question to be answered with yes or no."""
    return ask(name, Choice(NO, options=(YES, NO), doc=doc))


def first_or_second(doc: str) -> Parameter:
    """A question for one of two intervals, under "interval"."""
    return ask("interval", Choice(FIRST, options=(FIRST, SECOND), doc=doc))


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A question of a protocol: of a questionnaire, or of the participant beforehand.

    `kind` says what answers it: "number" and "count" from `low` to `high`, "choice" one of `options`, "text" words.
    Names of people are never asked for.
    """

    name: str
    text: str
    kind: Literal["number", "count", "choice", "text"] = "text"
    low: Bound = 0.0
    high: Bound = 100.0
    options: tuple[str, ...] = ()
    unit: str = ""

    def check(self, place: str) -> None:
        """Raise `BadValue` for a question that cannot be asked."""
        require(bool(IDENTIFIER.fullmatch(self.name)), f"{place}.name", self.name, "letters, digits, - and _")
        require(self.low < self.high or self.kind in ("choice", "text"), f"{place}.high", self.high, "above low")
        if self.kind == "choice":
            distinct = len(set(self.options)) == len(self.options) >= 2
            require(distinct, f"{place}.options", list(self.options), "two or more different ones")

    @property
    def parameter(self) -> Parameter:
        """The parameter that checks its answer."""
        match self.kind:
            case "number":
                found: Parameter = Number(self.low, self.low, self.high, doc=self.text, unit=self.unit)
            case "count":
                found = Count(int(self.low), int(self.low), int(self.high), doc=self.text, unit=self.unit)
            case "choice":
                found = Choice(self.options[0], options=self.options, doc=self.text)
            case _:
                found = Text("", doc=self.text)
        return ask(self.name, found)
