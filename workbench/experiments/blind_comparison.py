"""Blind comparison of two patches (ABX): the identity of X in each trial, the answers, and their table."""

import math
from dataclasses import dataclass, field
from typing import Any

from underfoot.errors import require
from underfoot.experiments.seeded_random import SeededRandom

SLOTS = ("A", "B")
METHOD = "abx"
"""The name of the method in tables of trials."""
MOST_TRIALS = 200


@dataclass
class BlindComparison:
    """A number of ABX trials. X is drawn in each trial, from seed and participant.

    Titles and `facts` are copied to the table.

    >>> test = BlindComparison("P01", 4, seed=1)
    >>> while not test.is_over:
    ...     test.answer("A", response_s=2.0, plays=3)
    >>> test.right, len(test.rows())
    (1, 4)
    """

    participant: str
    trials: int
    seed: int = 0
    a: str = ""
    b: str = ""
    facts: dict[str, Any] = field(default_factory=dict)
    _answers: list[dict[str, Any]] = field(default_factory=list)

    def __post_init__(self) -> None:
        require(1 <= self.trials <= MOST_TRIALS, "trials", self.trials, f"1 to {MOST_TRIALS}")
        require(bool(self.participant.strip()), "participant", self.participant, "an id, such as P01")
        draws = SeededRandom(self.seed, self.participant, METHOD)
        self._drawn = [draws.one_of(SLOTS) for _ in range(self.trials)]

    @property
    def number(self) -> int:
        """The number of the current trial, from 1."""
        return len(self._answers) + 1

    @property
    def is_over(self) -> bool:
        """Whether all trials have been answered."""
        return len(self._answers) == self.trials

    @property
    def x(self) -> str:
        """The slot that X is in the current trial: "A" or "B"."""
        return self._drawn[len(self._answers)]

    @property
    def right(self) -> int:
        """The number of right answers so far."""
        return sum(answer["answered"] == answer["correct"] for answer in self._answers)

    def answer(self, slot: str, response_s: float, plays: int) -> None:
        """Store the answer that X is `slot`.

        `response_s` is the time since the trial began, in seconds; `plays` is the number of presentations.
        """
        require(slot in SLOTS, "answer", slot, "A or B")
        self._answers.append({"correct": self.x, "answered": slot, "response_s": round(response_s, 3), "plays": plays})

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each answered trial, in the format that `underfoot analyse` reads."""
        same = {"participant": self.participant, "stage": "A and B", "method": METHOD, "practice": False}
        about = {"a": self.a, "b": self.b, "seed": self.seed, **self.facts}
        return [
            {**same, "trial": k, "block": 1, "attempt": 1, "spoiled": "", **answer, **about}
            for k, answer in enumerate(self._answers, 1)
        ]


def chance_p(right: int, of: int) -> float:
    """Return the probability of `right` or more right answers out of `of` by guessing (one-sided exact binomial test).

    >>> round(chance_p(12, 16), 4)
    0.0384
    """
    return sum(math.comb(of, k) for k in range(right, of + 1)) / 2**of
