"""Questions to a participant: named parameters, and the questions that a protocol declares."""

import re
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import msgspec

from underfoot.errors import BadValue, require
from underfoot.number_parsing import parse_quantity
from underfoot.parameters import Choice, Count, Number, Parameter, Text, ask, require_identifier
from underfoot.phrases import ENGLISH, Language, Phrase

FIRST, SECOND = "first", "second"
YES, NO = "yes", "no"
WHICH_FELT = "In which one did you feel it?"

_NUMBERED = re.compile(r"(0|[1-9][0-9]?)(?![.,]?\d|\s*[–-])")
"""An option that begins with a number of its own, such as "2 or more", but is no range, as "2-5"."""

Bound = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]


@dataclass(frozen=True)
class Scale(Number):
    """A slider with labels at its ends.

    >>> Scale(50.0, 0.0, 100.0, ends=("soft", "hard")).allowed
    '0 (soft) to 100 (hard)'
    """

    ends: tuple[str, str] = field(default=("", ""), kw_only=True)

    @property
    def allowed(self) -> str:
        least, most = self.ends
        return Phrase("{low} ({least}) to {high} ({most})", low=self.low, least=least, high=self.high, most=most)


@dataclass(frozen=True)
class FreeNumber(Number):
    """A number that is typed, because no slider suggests a range.

    >>> FreeNumber(1.0, 1e-6, 1e6).allowed
    'a number above 0, up to 1000000'
    """

    @property
    def allowed(self) -> str:
        return Phrase("a number above 0, up to {high}", high=round(self.high))


@dataclass(frozen=True)
class Adjusted(Number):
    """A number that is felt while it is moved from its default, in large and in small `steps`.

    `moves` is the number of the patch, "node.parameter", or "" for the level, in dB re the stimulus's. Neither the
    number nor its place in the range is shown: who saw where it stood would set it there again.
    """

    steps: tuple[float, float] = field(default=(2.0, 0.5), kw_only=True)
    moves: str = field(default="", kw_only=True)

    def moved(self, value: float, way: int, *, is_fine: bool) -> float:
        """Return the value one step higher (`way` 1) or lower (-1), as far as the range goes.

        >>> level = Adjusted(0.0, -40.0, 0.0)
        >>> level.moved(-1.0, 1, is_fine=True), level.moved(-1.0, 1, is_fine=False)
        (-0.5, 0.0)
        """
        found = value + way * self.steps[is_fine]
        return min(max(float(f"{found:.12g}"), self.low), self.high)  # steps of 0.1 add up to 0.7999999999999998


def needs_answer(question: Parameter) -> bool:
    """Return whether a page requires an answer to this question. A default is never stored as an answer.

    >>> needs_answer(Number(50.0, 0.0, 100.0)), needs_answer(Text(""))
    (True, False)
    """
    return not isinstance(question, Text)


def unanswered(question: Parameter) -> BadValue:
    """Return the error for a required question without an answer."""
    words = Phrase("Please answer: {question} ({allowed})", question=asked(question), allowed=question.allowed)
    return BadValue(words)


def unmoved(question: Adjusted) -> BadValue:
    """Return the error for a number that is felt and was not moved: its default is no answer."""
    return BadValue(Phrase("Move it to answer: {question}", question=asked(question)))


def asked(question: Parameter) -> str:
    """Return what a participant reads of a question."""
    return question.doc or question.label


def typed_answer(question: Parameter, text: str, language: Language = ENGLISH) -> object:
    """Return the value of a typed answer: a number with or without unit, or a choice by number or first letters.

    Choices are read in the `language` in which they are shown. Raises `BadValue` in the question's words, a `Phrase`
    for the participant.

    >>> weight = ask("mass_kg", Number(70.0, 30.0, 200.0, doc="What do you weigh?", unit="kg"))
    >>> typed_answer(weight, "70,5 kg")
    70.5
    >>> typed_answer(ask("fingers", Choice("2", options=("2", "3", "4"))), "2")  # the second is 3
    '2'
    >>> typed_answer(weight, "light")
    Traceback (most recent call last):
    underfoot.errors.BadValue: What do you weigh? The answer is 'light'; allowed: 30 to 200 kg
    """
    value: Any = text
    try:
        if isinstance(question, Choice):
            value = _chosen(question.options, tuple(map(language.say, question.options)), text)
        elif isinstance(question, Number | Count):
            value = parse_quantity(text, question.unit)
        return question.check(value)
    except BadValue:
        words = "{question} The answer is {given}; allowed: {allowed}"
        raise BadValue(Phrase(words, question=asked(question), given=repr(text), allowed=question.allowed)) from None


def keys_of(options: tuple[str, ...]) -> tuple[str, ...]:
    """Return the number that is typed for each option: the one that it begins with, if all do, or else its place.

    >>> keys_of(("0", "1", "2 or more")), keys_of(("sand", "snow")), keys_of(("0-5", "6-9"))
    (('0', '1', '2'), ('1', '2'), ('1', '2'))
    """
    begun = [found[1] for option in options if (found := _NUMBERED.match(option))]
    if len(set(begun)) == len(options):
        return tuple(begun)
    return tuple(str(place) for place in range(1, len(options) + 1))


def _chosen(options: tuple[str, ...], shown: tuple[str, ...], text: str) -> str:
    for named in (shown, keys_of(shown)):
        if text in named:
            return options[named.index(text)]
    begun = [option for option, words in zip(options, shown, strict=True) if words.startswith(text)]
    return begun[0] if len(begun) == 1 else text


def yes_or_no(name: str, doc: str) -> Parameter:
    """Return a yes-no question."""
    return ask(name, Choice(NO, options=(YES, NO), doc=doc))


def felt_or_stronger(doc: str, *, are_two: bool) -> Parameter:
    """Return a yes-no question of one interval, "felt", or for one of two, "interval"; without words, the usual ones.

    >>> [asked(felt_or_stronger("", are_two=are_two)) for are_two in (False, True)]
    ['Did you feel it?', 'Which was stronger?']
    """
    if not are_two:
        return yes_or_no("felt", doc or "Did you feel it?")
    return ask("interval", Choice(FIRST, options=(FIRST, SECOND), doc=doc or "Which was stronger?"))


class Question(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A question of a protocol, in a questionnaire or about the participant.

    `kind` is the type of the answer: "number" or "count" from `low` to `high`, a "choice" of `options`, or "text".
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
        """Raise `BadValue` for an invalid question; `place` is its place in the protocol."""
        require_identifier(f"{place}.name", self.name)
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
