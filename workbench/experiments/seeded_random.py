"""Random draws of a study: identical for the same seed, participant and stage, on every installation."""

import random
from collections.abc import Iterable, Sequence
from typing import TypeVar

Item = TypeVar("Item")


class SeededRandom:
    """Random draws, seeded with the protocol's seed and words such as participant and stage.

    All draws use `random.Random.random` only. Python guarantees its sequence for a given seed, so the order of a
    started study stays the same after an update.

    >>> given = ((1, "P01", "main"), (1, "P01", "main"), (2, "P01", "main"), (1, "P02", "main"), (1, "P01", "more"))
    >>> len({tuple(SeededRandom(*one).shuffled("abcdefgh")) for one in given})
    4
    """

    def __init__(self, seed: int, *words: str) -> None:
        self._random = random.Random("\0".join((str(seed), *words)))

    def shuffled(self, items: Iterable[Item]) -> list[Item]:
        """Return the items in random order."""
        drawn = ((self._random.random(), k, item) for k, item in enumerate(items))  # sorting compares no two items
        return [item for _, _, item in sorted(drawn)]

    def uniform(self, low: float, high: float) -> float:
        """Return a uniformly distributed number from `low` to `high`."""
        return low + (high - low) * self._random.random()

    def happens(self, share: float) -> bool:
        """Return True with probability `share`."""
        return self._random.random() < share

    def one_of(self, items: Sequence[Item]) -> Item:
        """Return a random item."""
        return items[int(self._random.random() * len(items))]
