"""One trial: what is presented in each of its intervals, and what is known of the answer beforehand."""

from collections.abc import Mapping

import msgspec

Answers = Mapping[str, int | float | str | bool]
"""What was answered, by the name of what was asked."""
NOTHING = ""
"""The stimulus of an interval in which nothing is presented."""


def is_right(correct: int | str, answers: Answers) -> bool:
    """Whether the first of the answers is the right one; case and spaces around words do not matter.

    >>> is_right("snow", {"label": " Snow"}), is_right(3, {"number": 2})
    (True, False)
    """
    given = next(iter(answers.values()), "")
    return str(given).strip().casefold() == str(correct).strip().casefold()


class Presentation(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stimulus of the protocol, by its name, `gain_db` above the level that it has there; "" for nothing."""

    stimulus: str
    gain_db: float = 0.0


class Trial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Number `number` (from 1) of its stage, in `block` (from 1).

    `correct` is the right answer where there is one, else "". `facts` are what the analysis needs to know of it: which
    staircase, whether it was a catch trial, the place of a target.
    """

    number: int
    block: int
    intervals: tuple[Presentation, ...] = ()
    correct: int | str = ""
    facts: Mapping[str, int | float | str | bool] = {}
