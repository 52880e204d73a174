"""Is X A or B? A blind comparison of two patches (ABX): who is X, what was answered, and the table of it."""

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
    """So many trials, in each of which X is drawn anew from seed and participant. Titles and `facts` go into the table.

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
        """The trial that is under way, from 1."""
        return len(self._answers) + 1

    @property
    def is_over(self) -> bool:
        """Whether all trials are answered."""
        return len(self._answers) == self.trials

    @property
    def x(self) -> str:
        """What X is in the trial that is under way: "A" or "B"."""
        return self._drawn[len(self._answers)]

    @property
    def right(self) -> int:
        """How many answers are right."""
        return sum(answer["answered"] == answer["correct"] for answer in self._answers)

    def answer(self, slot: str, response_s: float, plays: int) -> None:
        """X is said to be this slot, so long after the trial began, and after so many presentations."""
        require(slot in SLOTS, "answer", slot, "A or B")
        self._answers.append({"correct": self.x, "answered": slot, "response_s": round(response_s, 3), "plays": plays})

    def rows(self) -> list[dict[str, Any]]:
        """A row for each trial that was answered, as `underfoot analyse` reads them."""
        same = {"participant": self.participant, "stage": "A and B", "method": METHOD, "practice": False}
        about = {"a": self.a, "b": self.b, "seed": self.seed, **self.facts}
        return [
            {**same, "trial": k, "block": 1, "attempt": 1, "spoiled": "", **answer, **about}
            for k, answer in enumerate(self._answers, 1)
        ]


def chance_p(right: int, of: int) -> float:
    """How probable it is to be right so often or more by guessing: the exact binomial test, of one side.

    >>> round(chance_p(12, 16), 4)
    0.0384
    """
    return sum(math.comb(of, k) for k in range(right, of + 1)) / 2**of
