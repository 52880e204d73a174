"""The floor that is not there: what four sensors under each tile read of walkers and hands.

A foot presses with heel and ball at once, in shares that put its centre where it rolls; each is a few points, and a
point presses on the tile that it is on, which splits it over its corners bilinearly: forces and centroids are exact.
"""

import math
from collections.abc import Sequence

import msgspec
import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.kernels import kernel
from underfoot.models import gait

HEEL, BALL, REACH = 0.12, 0.80, 0.06
"""Middles of the two parts of the sole that press, and how far they reach, as fractions of the foot's length."""
_POINTS = 4
_PHASES = 2048
HAND_SHARE = 0.12
"""Share of the way that a pressing hand goes in one sample: a time constant of 8 ms at 1 kHz."""

_START, _DURATION, _X, _Y, _COS, _SIN, _LENGTH, _PEAK1, _VALLEY, _PEAK2 = range(10)


def footfall_table(
    floor: Floor,
    seconds: float,
    seed: int,
    walker: gait.Walker | None = None,
    path_m: Sequence[tuple[float, float]] = (),
) -> NDArray[np.float64]:
    """A walk on the floor as the kernels read it, shape (footfalls, 10), the first footfall at 0.2 s.

    Without a path it is a rectangle halfway between the floor's middle and its edges, walked round and round, and steps
    are short where the floor is: on 2 x 2 tiles each foot lands on the next tile.
    """
    walker = walker or gait.Walker()
    if not path_m:
        corners = np.concatenate([tile.corners_m() for tile in floor.tiles])
        low, high = corners.min(axis=0), corners.max(axis=0)
        middle, half = (low + high) / 2.0, (high - low) / 4.0
        turns = [middle + half * turn for turn in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
        path_m = [(float(x), float(y)) for x, y in turns]
        short = min(walker.step_length_m, float(half.sum()))
        walker = msgspec.structs.replace(walker, step_length_m=short)
    steps = gait.footfalls(walker, path_m, seconds, seed)
    return np.array(
        [
            (
                s.start_s,
                s.duration_s,
                s.heel_x_m,
                s.heel_y_m,
                math.cos(s.heading_rad),
                math.sin(s.heading_rad),
                s.length_m,
                s.peak1_n,
                s.valley_n,
                s.peak2_n,
            )
            for s in steps
        ]
    )


def curves(walker: gait.Walker | None = None) -> NDArray[np.float64]:
    """A footfall's force per unit of first peak, valley and second peak, and its roll, over the phase: shape (4, 2049).

    The force is linear in its three extremes, so the models of `gait` need be asked only once.
    """
    walker = walker or gait.Walker()
    phase = np.linspace(0.0, 1.0, _PHASES + 1)
    ones = np.eye(3)
    return np.array(
        [*(gait.vertical_force(phase, *one) for one in ones), gait.roll(phase, walker.roll_start, walker.roll_reach)]
    )


@kernel
def walk(forces, stamps, count, rate, tiles, steps, shapes, leans_m):
    """Add to the first `count` of `forces` (n, tiles, 4) the footfalls at session frames `stamps`, over and over.

    A foot brakes, then pushes off: the place where vertical sensors see it is `leans_m` (tiles,) ahead of where it is
    as it comes down, and as much behind as it leaves.
    """
    length = steps[-1, _START] + steps[-1, _DURATION]
    longest = 0.0
    for step in range(len(steps)):
        longest = max(longest, steps[step, _DURATION])
    for i in range(count):
        now = (stamps[i] / rate) % length
        first = np.searchsorted(steps[:, _START], now - longest)
        for k in range(first, len(steps)):
            if steps[k, _START] > now:
                break
            phase = (now - steps[k, _START]) / steps[k, _DURATION]
            if phase < 1.0:
                _tread(forces[i], tiles, steps[k], shapes, leans_m, phase)


@kernel
def press(forces, count, tiles, hands):
    """Add hands to the first `count` of `forces`: `hands` (tiles, 4) are x, y, force asked for and force now."""
    for i in range(count):
        for k in range(len(tiles)):
            hands[k, 3] += HAND_SHARE * (hands[k, 2] - hands[k, 3])
            if hands[k, 3] < 1e-3 and hands[k, 2] == 0.0:
                hands[k, 3] = 0.0
            if hands[k, 3] > 0.0:
                _split(forces[i, k], tiles[k], hands[k, 0], hands[k, 1], hands[k, 3])


@kernel
def _tread(forces, tiles, step, shapes, leans_m, phase):
    at = phase * _PHASES
    i = min(int(at), _PHASES - 1)
    share = at - i
    force = 0.0
    for j in range(3):
        force += step[_PEAK1 + j] * (shapes[j, i] + share * (shapes[j, i + 1] - shapes[j, i]))
    roll = shapes[3, i] + share * (shapes[3, i + 1] - shapes[3, i])
    heel, ball = min(HEEL, roll), max(BALL, roll)
    on_ball = (roll - heel) / (ball - heel)
    braking = math.cos(math.pi * phase)
    ahead, aside = braking * step[_COS], braking * step[_SIN]
    for part, load in ((heel, force * (1.0 - on_ball)), (ball, force * on_ball)):
        for j in range(_POINTS):
            along = (part + REACH * (2.0 * j / (_POINTS - 1) - 1.0)) * step[_LENGTH]
            x, y = step[_X] + along * step[_COS], step[_Y] + along * step[_SIN]
            _press_floor(forces, tiles, x, y, load / _POINTS, leans_m, ahead, aside)


@kernel
def _press_floor(forces, tiles, x, y, force, leans_m, ahead, aside):
    """A point force on the floor goes to the tile that it is on; beside the tiles it goes into the ground."""
    for k in range(len(tiles)):
        tile = tiles[k]
        dx, dy = x - tile.centre_m[0], y - tile.centre_m[1]
        along = tile.axes[0, 0] * dx + tile.axes[0, 1] * dy
        across = tile.axes[1, 0] * dx + tile.axes[1, 1] * dy
        if abs(along) <= tile.half_m[0] and abs(across) <= tile.half_m[1]:
            lean = leans_m[k]
            along += lean * (tile.axes[0, 0] * ahead + tile.axes[0, 1] * aside)
            across += lean * (tile.axes[1, 0] * ahead + tile.axes[1, 1] * aside)
            _split(forces[k], tile, along, across, force)
            return


@kernel
def _split(forces, tile, x, y, force):
    """A force at (x, y) of a tile's frame, split bilinearly over sensors at the corners of an upright rectangle."""
    centre_x = centre_y = half_x = half_y = 0.0
    for j in range(4):
        centre_x += 0.25 * tile.sensors_m[j, 0]
        centre_y += 0.25 * tile.sensors_m[j, 1]
    for j in range(4):
        half_x = max(half_x, abs(tile.sensors_m[j, 0] - centre_x))
        half_y = max(half_y, abs(tile.sensors_m[j, 1] - centre_y))
    for j in range(4):
        right = 1.0 if tile.sensors_m[j, 0] > centre_x else -1.0
        up = 1.0 if tile.sensors_m[j, 1] > centre_y else -1.0
        forces[j] += 0.25 * force * (1.0 + right * (x - centre_x) / half_x) * (1.0 + up * (y - centre_y) / half_y)
