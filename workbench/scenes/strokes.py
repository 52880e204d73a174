"""A stroke font for pictures without a screen: capitals, digits and a few signs."""

from functools import cache

import numpy as np
from numpy.typing import NDArray

WIDE, HIGH, ADVANCE = 4, 6, 5.5
"""Width and height of a letter, and the distance to the next one, in units of the table."""

_TABLE = """
A 00-26-40 12-32|B 00-06-36-45-44-33-03 33-42-41-30-00|C 46-16-05-01-10-40|D 00-06-26-44-42-20-00|E 46-06-00-40 03-33
F 46-06-00 03-33|G 46-16-05-01-10-40-43-23|H 00-06 40-46 03-43|I 20-26|J 46-41-30-10-01|K 00-06 46-03-40|L 06-00-40
M 00-06-23-46-40|N 00-06-40-46|O 10-01-05-16-36-45-41-30-10|P 00-06-36-45-44-33-03|Q 10-01-05-16-36-45-41-30-10 22-40
R 00-06-36-45-44-33-03 23-40|S 01-10-30-41-42-33-13-04-05-16-36-45|T 06-46 26-20|U 06-01-10-30-41-46|V 06-20-46
W 06-10-23-30-46|X 00-46 06-40|Y 06-23-46 23-20|Z 06-46-00-40|0 10-01-05-16-36-45-41-30-10|1 15-26-20
2 05-16-36-45-44-00-40|3 05-16-36-45-44-33-13 33-42-41-30-10-01|4 30-36-02-42|5 46-06-03-33-42-41-30-00
6 45-36-16-05-01-10-30-41-42-33-03
7 06-46-10|8 13-04-05-16-36-45-44-33-13-02-01-10-30-41-42-33|9 01-10-30-41-45-36-16-05-04-13-43
. 20-21|, 21-10|: 21-22 24-25|- 13-33|+ 13-33 22-24|/ 00-46|% 00-46 05-06 40-41|' 25-26|( 26-14-12-20|) 26-34-32-20
= 12-32 14-34|? 05-16-36-45-33-22 20-21|! 26-22 20-21
"""


@cache
def _strokes() -> dict[str, tuple[NDArray[np.float64], ...]]:
    """Return the strokes of each letter, each a list of points."""
    found = {}
    for entry in _TABLE.replace("\n", "|").split("|"):
        if entry.strip():
            letter, _, strokes = entry.strip().partition(" ")
            found[letter] = tuple(
                np.array([[int(point[0]), int(point[1])] for point in stroke.split("-")], dtype=np.float64)
                for stroke in strokes.split()
            )
    return found


def written(text: str, x: float, y: float, height: float) -> NDArray[np.float64]:
    """Return the lines of a text centred on (x, y), y upwards, with capitals of `height`: shape (n, 2, 2).

    Unknown letters are gaps.

    >>> written("I", 0.0, 0.0, 6.0).tolist()
    [[[0.0, -3.0], [0.0, 3.0]]]
    """
    unit = height / HIGH
    width = ADVANCE * len(text) - (ADVANCE - WIDE)
    lines = []
    for place, letter in enumerate(text.upper()):
        for stroke in _strokes().get(letter, ()):
            points = stroke + np.array([place * ADVANCE - width / 2.0, -HIGH / 2.0])
            lines.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate([np.zeros((0, 2, 2)), *lines]) * unit + (x, y)
