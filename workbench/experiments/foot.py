"""Answers by foot: declaration of the fields of the floor, and of when a step counts as an answer."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

import msgspec

from underfoot.errors import BadValue, require
from underfoot.experiments.questions import Adjusted, FreeNumber
from underfoot.parameters import IDENTIFIER, Choice, Count, Number, Parameter

MOST_FIELDS = 12
"""Largest number of fields of a slider, which otherwise has one per tile."""


class FootAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Answers by foot. Each answer has a field on the floor.

    A field is a tile, in the order of `tiles` (all tiles if empty), or the left or right half of a single tile. Only
    contacts that begin after the question count. Rule "dwell": one foot loads one field with at least `force_n` for
    `dwell_s`. Rule "release": a foot leaves a field after at least `dwell_s` on it.
    """

    by: Annotated[
        Literal["tiles", "halves"],
        msgspec.Meta(title="Fields", description="A tile for each answer, or the halves of one tile for two."),
    ] = "tiles"
    tiles: Annotated[
        tuple[str, ...],
        msgspec.Meta(description="Ids of tiles, one for each answer in its order; none: all tiles of the floor."),
    ] = ()
    rule: Annotated[
        Literal["dwell", "release"],
        msgspec.Meta(title="Given", description="By staying on the field, or by leaving it again."),
    ] = "dwell"
    dwell_s: Annotated[
        float, msgspec.Meta(ge=0.1, le=10.0, title="Stays for", description="How long a foot must be on the field.")
    ] = 0.6
    force_n: Annotated[
        float, msgspec.Meta(ge=5.0, le=1000.0, title="Presses with", description="Less force is no answer.")
    ] = 100.0

    def check(self, place: str, questions: Sequence[Parameter]) -> None:
        """Raise `BadValue` if the questions cannot be answered by foot, or not with these tiles."""
        good = len(set(self.tiles)) == len(self.tiles) and all(IDENTIFIER.fullmatch(tile) for tile in self.tiles)
        require(good, f"{place}.tiles", list(self.tiles), "ids of tiles, each once")
        least = least_fields(questions)
        if least == 0:
            raise BadValue(
                f"{place}: what is asked cannot be answered by foot; allowed: one question with choices, numbers or a "
                "slider"
            )
        if self.by == "halves":
            require(least == 2, f"{place}.by", self.by, f"tiles; there are {least} answers, and a tile has two halves")
        elif self.tiles:
            count = len(self.tiles)
            require(count >= least, f"{place}.tiles", list(self.tiles), f"at least {least}, one for each answer")


def least_fields(questions: Sequence[Parameter]) -> int:
    """Return the number of fields that the questions need; 0 if a foot cannot answer them.

    >>> from underfoot.experiments.questions import yes_or_no
    >>> least_fields([yes_or_no("felt", "Did you?")])
    2
    """
    if len(questions) != 1:
        return 0
    match questions[0]:
        case Choice(options=options):
            return len(options)
        case Count(low=low, high=high):
            return high - low + 1
        case Number() if not isinstance(questions[0], FreeNumber | Adjusted):
            return 2
    return 0


def values_of(question: Parameter, fields: int) -> list[Any]:
    """Return the answers of `fields` fields, in order; a slider's values are evenly spaced.

    >>> values_of(Number(50.0, 0.0, 100.0), 5)
    [0.0, 25.0, 50.0, 75.0, 100.0]
    """
    match question:
        case Choice(options=options):
            return list(options)
        case Count(low=low, high=high):
            return list(range(low, high + 1))
        case Number(low=low, high=high):
            count = min(fields, MOST_FIELDS)
            return [low + (high - low) * k / (count - 1) for k in range(count)]
    return []


def fields_in_words(foot: FootAnswer, questions: Sequence[Parameter]) -> str:
    """Return a description of each answer's field; "" for questions that a foot cannot answer.

    >>> from underfoot.experiments.questions import yes_or_no
    >>> fields_in_words(FootAnswer(tiles=("t2", "t1")), [yes_or_no("felt", "Did you?")])
    'yes: t2  ·  no: t1'
    """
    if not least_fields(questions):
        return ""
    fields = ("left half", "right half") if foot.by == "halves" else foot.tiles
    if not fields and isinstance(questions[0], Number):
        return "The values of the slider are spread over all tiles of the floor, evenly."
    values = values_of(questions[0], max(len(fields), 2))
    fields = fields or tuple(f"tile {k + 1} of the floor" for k in range(len(values)))
    words = (f"{value:g}" if isinstance(value, float) else str(value) for value in values)
    return "  ·  ".join(f"{value}: {field}" for value, field in zip(words, fields, strict=False))
