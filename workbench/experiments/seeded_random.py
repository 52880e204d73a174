"""Random draws of a study: the same for the same seed, participant and stage, whatever is installed."""

import random
from collections.abc import Iterable, Sequence
from typing import TypeVar

Item = TypeVar("Item")


class SeededRandom:
    """Draws from the protocol's seed and words, such as participant and stage.

    Everything is made of `random.Random.random` alone: Python promises its sequence for a seed, so that a study that
    was begun goes on in the same order after an update.

    >>> SeededRandom(1, "P01", "main").shuffled("abcd") == SeededRandom(1, "P01", "main").shuffled("abcd")
    True
    """

    def __init__(self, seed: int, *words: str) -> None:
        self._random = random.Random("\0".join((str(seed), *words)))

    def shuffled(self, items: Iterable[Item]) -> list[Item]:
        """The items in random order."""
        return [item for _, _, item in sorted((self._random.random(), k, item) for k, item in _numbered(items))]

    def uniform(self, low: float, high: float) -> float:
        """A number from `low` to `high`."""
        return low + (high - low) * self._random.random()

    def happens(self, share: float) -> bool:
        """True in a `share` of all calls."""
        return self._random.random() < share

    def one_of(self, items: Sequence[Item]) -> Item:
        """One of the items."""
        return items[int(self._random.random() * len(items))]


def _numbered(items: Iterable[Item]) -> list[tuple[int, Item]]:
    """Items with their places, so that two equal draws compare no items."""
    return list(enumerate(items))
