"""Orders that are counterbalanced over participants: Williams's Latin squares (Aust. J. Sci. Res. A 2, 1949).

Over all rows each condition is equally often in each place, and equally often right after each other one. A square of
an odd number of conditions needs its mirror image, too: twice as many rows.
"""

import re

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
    numbers = re.findall(r"\d+", participant)
    if not numbers:
        raise BadValue(f"participant is {participant!r}; allowed: an id with a number, as P01: orders follow from it")
    return 1 + (int(numbers[-1]) - 1) % rows_of(size)
