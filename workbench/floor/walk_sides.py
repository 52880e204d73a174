"""Which foot made a step: votes of where it lies beside the last one, across the direction of walking."""

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

PROGRESS_M, ROLL_M, LEAST_OFFSET_M, FEET_AGREE_RAD = 0.15, 0.05, 0.01, math.radians(35.0)
"""Sides are determined from steps of at least this length, feet that roll at least this far in directions that agree
within `FEET_AGREE_RAD`, and lateral offsets of at least this."""

TOE_OUT_VOTE_M, LEAST_UNEVEN_TURN_RAD, MOST_UNEVEN_TURN_RAD = 0.01, math.radians(10.0), math.radians(45.0)
"""In a turn by more than `FEET_AGREE_RAD` at each step, feet that point outwards make every other turn larger, by
`LEAST_UNEVEN_TURN_RAD` to `MOST_UNEVEN_TURN_RAD`. This is a vote of `TOE_OUT_VOTE_M`; one straight step outweighs
it."""

SIDE_VOTE_DECAY = 0.85
"""Weight of older votes for the side, at each step."""


class Sides(Struct, eq=False):
    """Votes for the sides of steps of one person, of whose numbers even ones are of one foot and odd ones of the other.

    `votes_m` is the sum of the lateral offsets by which even footfalls lie to the left of odd ones. `guess_m` is that
    of steps before them, after which the numbers may be one off; it counts where there is no vote.

    >>> sides = Sides()
    >>> sides.vote(2, 0.1)
    >>> [sides.of(number) for number in (1, 2)]
    ['right', 'left']
    """

    votes_m: float = 0.0
    guess_m: float = 0.0

    def guessed(self) -> "Sides":
        """Return those of steps of which it is only guessed how many were made since the last one."""
        return Sides(guess_m=self.votes_m or self.guess_m)

    def vote(self, number: int, aside_m: float) -> None:
        """Add that a footfall lies to the left of the one before."""
        self.votes_m = SIDE_VOTE_DECAY * self.votes_m + (aside_m if number % 2 == 0 else -aside_m)

    def of(self, number: int) -> str:
        """Return the side of a footfall: left, right or unknown."""
        votes_m = (self.votes_m or self.guess_m) * (1 if number % 2 == 0 else -1)
        return "left" if votes_m > 0.0 else "right" if votes_m < 0.0 else "unknown"


def walking_direction(
    rolls_m: Sequence[NDArray[np.float64]], stride_m: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Return the direction of walking between two feet that rolled so, from the stride between the footfalls around the
    first one where they did not; zeros if it is not clear.

    >>> walking_direction([np.array([0.1, 0.02]), np.array([0.1, -0.02])], None)
    array([1., 0.])
    """
    if min(float(np.hypot(*roll_m)) for roll_m in rolls_m) >= ROLL_M:
        if abs(_angle_between(rolls_m[0], rolls_m[1])) > FEET_AGREE_RAD:
            return np.zeros(2)
        # Feet that point outwards do so on both sides, which cancels.
        along = rolls_m[0] + rolls_m[1]
    elif stride_m is not None:
        along = stride_m
    else:
        return np.zeros(2)
    return along / (float(np.hypot(*along)) or 1.0)


def toe_out_vote_m(rolls_m: Sequence[NDArray[np.float64]]) -> float:
    """Return the vote of a steady turn over three feet that rolled so for the last one's side, left positive, in
    metres; or 0."""
    if min(float(np.hypot(*roll_m)) for roll_m in rolls_m) < ROLL_M:
        return 0.0
    first, second = _angle_between(rolls_m[0], rolls_m[1]), _angle_between(rolls_m[1], rolls_m[2])
    steady = first * second > 0.0 and min(abs(first), abs(second)) > FEET_AGREE_RAD
    return (
        math.copysign(TOE_OUT_VOTE_M, second - first)
        if steady and LEAST_UNEVEN_TURN_RAD <= abs(second - first) <= MOST_UNEVEN_TURN_RAD
        else 0.0
    )


def _angle_between(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """Return the angle from one direction to another, -pi to pi, positive to the left."""
    return math.atan2(float(one[0] * other[1] - one[1] * other[0]), float(one @ other))
