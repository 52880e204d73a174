"""Orders that are counterbalanced over participants: Williams's Latin squares (Aust. J. Sci. Res. A 2, 1949).

Over all rows each condition is equally often in each place, and equally often right after each other one. A square of
an odd number of conditions needs its mirror image, too: twice as many rows.

Where stages and the stimuli within them are both counterbalanced, every row of stages meets every row of stimuli: both
squares are crossed. That takes as many participants as there are pairs of rows. It is the least, and each square is
balanced by itself after the least common multiple of its rows.

Where stimuli of two stages are counterbalanced, the second goes on with the next row, as blocks of one stage do: nobody
gets one order twice before they have had all.
"""

import re
from math import gcd, lcm
from typing import NamedTuple

from underfoot.errors import BadValue


def rows_of(size: int) -> int:
    """Return the number of rows for so many conditions.

    >>> [rows_of(size) for size in (1, 2, 3, 4)]
    [1, 2, 6, 4]
    """
    return 2 * size if size % 2 and size > 1 else size


def row_of(size: int, number: int) -> list[int]:
    """Return a row, as indices of conditions; numbers count from 1, and begin again behind the last row.

    >>> [row_of(4, number) for number in (1, 2, 3, 4)]
    [[0, 1, 3, 2], [1, 2, 0, 3], [2, 3, 1, 0], [3, 0, 2, 1]]
    """
    at = (number - 1) % rows_of(size)
    first = [(k + 1) // 2 if k % 2 else -(k // 2) for k in range(size)]
    row = [(place + at) % size for place in first]
    return row if at < size else row[::-1]


def number_of_row(participant: str, size: int) -> int:
    """Return the number of a participant's row, from 1: by the last number in the id.

    >>> number_of_row("P01", 4), number_of_row("P06", 4)
    (1, 2)
    """
    return 1 + _number(participant) % rows_of(size)


class Turn(NamedTuple):
    """A participant, in a study of which so many `stages` change places, too; 0 if none do.

    `rows_before` have had their turn in stages before, of as many stimuli. `begun` is the row that the stage was begun
    with, if that is known: an earlier version may have given another one. 0 if it follows from the participant.
    """

    participant: str = "1"
    stages: int = 0
    rows_before: int = 0
    begun: int = 0

    def row(self, size: int) -> int:
        """Return the number of the participant's row of so many stimuli, from 1.

        >>> [(number_of_row(f"P{k}", 2), Turn(f"P{k}", stages=2).row(2)) for k in (1, 2, 3, 4)]
        [(1, 1), (2, 2), (1, 2), (2, 1)]
        >>> Turn("P01", rows_before=3).row(4)
        4
        """
        row = self.begun or self._own_row(size) + self.rows_before
        return 1 + (row - 1) % rows_of(size)

    def _own_row(self, size: int) -> int:
        """Return the row in the first stage of so many stimuli."""
        if not self.stages:
            return number_of_row(self.participant, size)
        number, rows, orders = _number(self.participant), rows_of(size), rows_of(self.stages)
        alike = gcd(rows, orders)
        again = number // lcm(rows, orders) % alike
        # Each time an order of stages would meet the same rows again, the rows are shifted, first by even numbers. So
        # of an odd number of stimuli it meets a whole square before the mirrored one.
        at = (number + 2 * again % alike + 2 * again // alike) % rows
        return 1 + (at // 2 + size * (at % 2) if size % 2 else at)


ANYONE = Turn()
"""The turn where orders are not asked for."""


def _number(participant: str) -> int:
    """Return the last number in an id, from 0."""
    numbers = re.findall(r"\d+", participant)
    if not numbers:
        raise BadValue(f"participant is {participant!r}; allowed: an id with a number, as P01: orders follow from it")
    return int(numbers[-1]) - 1
