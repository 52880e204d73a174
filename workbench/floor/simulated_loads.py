"""The loads on a simulated floor: the corner forces of walkers and hands, as ideal sensors would read them.

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
"""Points by which each part of the sole presses."""
_PHASES = 2048
"""Steps of phase in the table of a footfall's curves."""
HAND_SHARE = 0.12
"""Share of the way that a pressing hand goes in one sample: a time constant of 8 ms at 1 kHz."""

Floats = NDArray[np.float64]

FOOTFALL = np.dtype(
    [
        ("start_s", np.float64),
        ("duration_s", np.float64),
        ("heel_x_m", np.float64),
        ("heel_y_m", np.float64),
        ("cos_heading", np.float64),
        ("sin_heading", np.float64),
        ("length_m", np.float64),
        ("extremes_n", np.float64, (3,)),
    ],
    align=True,
)
"""A footfall as kernels read it; its extremes are the first peak, the valley and the second peak."""

HAND = np.dtype(
    [("x_m", np.float64), ("y_m", np.float64), ("target_n", np.float64), ("force_n", np.float64)], align=True
)
"""A hand on a tile: its place in the tile's frame, the force it goes to, and its force now."""


def footfall_table(
    floor: Floor,
    seconds: float,
    seed: int,
    walker: gait.Walker | None = None,
    path_m: Sequence[tuple[float, float]] = (),
) -> NDArray[np.void]:
    """A walk on the floor: shape (footfalls,) of `FOOTFALL`, the first at 0.2 s.

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
    table = np.zeros(len(steps), FOOTFALL)
    for row, step in zip(table, steps, strict=True):
        for name in ("start_s", "duration_s", "heel_x_m", "heel_y_m", "length_m"):
            row[name] = getattr(step, name)
        row["cos_heading"], row["sin_heading"] = math.cos(step.heading_rad), math.sin(step.heading_rad)
        row["extremes_n"] = step.peak1_n, step.valley_n, step.peak2_n
    return table


def gait_curves(walker: gait.Walker | None = None) -> NDArray[np.float64]:
    """A footfall's force per unit of first peak, valley and second peak, and its roll, over the phase: shape (4, 2049).

    The force is linear in its three extremes, so that these curves hold every footfall's.
    """
    walker = walker or gait.Walker()
    phase = np.linspace(0.0, 1.0, _PHASES + 1)
    ones = np.eye(3)
    return np.array(
        [*(gait.vertical_force(phase, *one) for one in ones), gait.roll(phase, walker.roll_start, walker.roll_reach)]
    )


@kernel
def walk(
    forces_n: Floats,
    stamps: Floats,
    count: int,
    rate: float,
    plates: NDArray[np.void],
    footfalls: NDArray[np.void],
    curves: Floats,
    foot_shift_m: Floats,
) -> None:
    """Add to the first `count` of `forces_n` (n, tiles, 4) the footfalls at session frames `stamps`, over and over.

    `plates` (tiles,) are those of the floor, `curves` those of `gait_curves`. A foot brakes, then pushes off: the
    place where vertical sensors see it is `foot_shift_m` (tiles,) ahead of where it is as it comes down, and as much
    behind as it leaves.
    """
    length_s = footfalls[-1].start_s + footfalls[-1].duration_s
    longest_s = 0.0
    for k in range(len(footfalls)):
        longest_s = max(longest_s, footfalls[k].duration_s)
    for i in range(count):
        now_s = (stamps[i] / rate) % length_s
        first = np.searchsorted(footfalls["start_s"], now_s - longest_s)
        for k in range(first, len(footfalls)):
            footfall = footfalls[k]
            if footfall.start_s > now_s:
                break
            phase = (now_s - footfall.start_s) / footfall.duration_s
            if phase < 1.0:
                _add_footfall(forces_n[i], plates, footfall, curves, foot_shift_m, phase)


@kernel
def press(forces_n: Floats, count: int, plates: NDArray[np.void], hands: NDArray[np.void]) -> None:
    """Add the hands (tiles,) of `HAND` to the first `count` of `forces_n` (n, tiles, 4)."""
    for i in range(count):
        for k in range(len(plates)):
            hand = hands[k]
            hand.force_n += HAND_SHARE * (hand.target_n - hand.force_n)
            if hand.force_n < 1e-3 and hand.target_n == 0.0:
                hand.force_n = 0.0
            if hand.force_n > 0.0:
                _add_to_corners(forces_n[i, k], plates[k], hand.x_m, hand.y_m, hand.force_n)


@kernel
def _add_footfall(
    forces_n: Floats, plates: NDArray[np.void], step: np.record, curves: Floats, foot_shift_m: Floats, phase: float
) -> None:
    at = phase * _PHASES
    i = min(int(at), _PHASES - 1)
    share = at - i
    force_n = 0.0
    for j in range(3):
        force_n += step.extremes_n[j] * (curves[j, i] + share * (curves[j, i + 1] - curves[j, i]))
    roll = curves[3, i] + share * (curves[3, i + 1] - curves[3, i])
    heel, ball = min(HEEL, roll), max(BALL, roll)
    on_ball = (roll - heel) / (ball - heel)
    braking = math.cos(math.pi * phase)
    shift_x, shift_y = braking * step.cos_heading, braking * step.sin_heading
    for part, load_n in ((heel, force_n * (1.0 - on_ball)), (ball, force_n * on_ball)):
        for j in range(_POINTS):
            along = (part + REACH * (2.0 * j / (_POINTS - 1) - 1.0)) * step.length_m
            x, y = step.heel_x_m + along * step.cos_heading, step.heel_y_m + along * step.sin_heading
            _add_point_force(forces_n, plates, x, y, load_n / _POINTS, foot_shift_m, shift_x, shift_y)


@kernel
def _add_point_force(
    forces_n: Floats,
    plates: NDArray[np.void],
    x: float,
    y: float,
    force_n: float,
    foot_shift_m: Floats,
    shift_x: float,
    shift_y: float,
) -> None:
    """A point force on the floor goes to the tile that it is on; beside the tiles it goes into the ground."""
    for k in range(len(plates)):
        plate = plates[k]
        dx, dy = x - plate.centre_m[0], y - plate.centre_m[1]
        along = plate.axes[0, 0] * dx + plate.axes[0, 1] * dy
        across = plate.axes[1, 0] * dx + plate.axes[1, 1] * dy
        if abs(along) <= plate.half_m[0] and abs(across) <= plate.half_m[1]:
            shift_m = foot_shift_m[k]
            along += shift_m * (plate.axes[0, 0] * shift_x + plate.axes[0, 1] * shift_y)
            across += shift_m * (plate.axes[1, 0] * shift_x + plate.axes[1, 1] * shift_y)
            _add_to_corners(forces_n[k], plate, along, across, force_n)
            return


@kernel
def _add_to_corners(forces_n: Floats, plate: np.record, x: float, y: float, force_n: float) -> None:
    """A force at (x, y) of a tile's frame, split bilinearly over sensors at the corners of an upright rectangle."""
    centre_x = centre_y = half_x = half_y = 0.0
    for j in range(4):
        centre_x += 0.25 * plate.sensors_m[j, 0]
        centre_y += 0.25 * plate.sensors_m[j, 1]
    for j in range(4):
        half_x = max(half_x, abs(plate.sensors_m[j, 0] - centre_x))
        half_y = max(half_y, abs(plate.sensors_m[j, 1] - centre_y))
    for j in range(4):
        right = 1.0 if plate.sensors_m[j, 0] > centre_x else -1.0
        up = 1.0 if plate.sensors_m[j, 1] > centre_y else -1.0
        forces_n[j] += 0.25 * force_n * (1.0 + right * (x - centre_x) / half_x) * (1.0 + up * (y - centre_y) / half_y)
