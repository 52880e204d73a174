"""One trial: the stimuli of its intervals, and its known right answer."""

from collections.abc import Mapping

import msgspec

Answers = Mapping[str, int | float | str | bool]
"""Answers by the name of the question."""
NOTHING = ""
"""The stimulus of an interval in which nothing is presented."""


def is_right(correct: int | str, answers: Answers) -> bool:
    """Return whether the first answer is right; case and surrounding spaces are ignored.

    >>> is_right("snow", {"label": " Snow"}), is_right(3, {"number": 2})
    (True, False)
    """
    given = next(iter(answers.values()), "")
    return str(given).strip().casefold() == str(correct).strip().casefold()


class Presentation(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stimulus of the protocol by name, at `gain_db` re its level; "" for no stimulus."""

    stimulus: str
    gain_db: float = 0.0


class Trial(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Trial `number` (from 1) of its stage, in `block` (from 1).

    `correct` is the right answer, or "" if there is none. `facts` are variables for the analysis: the staircase,
    whether it is a catch trial, the position of a target.
    """

    number: int
    block: int
    intervals: tuple[Presentation, ...] = ()
    correct: int | str = ""
    facts: Mapping[str, int | float | str | bool] = {}
