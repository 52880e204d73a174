"""Loads on a simulated floor: corner forces of walkers and hands, as ideal sensors would measure them.

A foot presses with heel and ball, in shares that give the centre of pressure of its roll. Each is a few points, and the
force of a point is split bilinearly over the corners of the tile below it, so that forces and centroids are exact. A
sole spans the gap between two tiles: a point above the gap presses on both edges, as a load on a beam on its supports.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.kernels import Floats, kernel
from underfoot.models import gait

HEEL, BALL, REACH = 0.12, 0.80, 0.06
"""Centres of heel and ball, and half their length, as fractions of the foot's length."""
_TOUCH_M = 1e-6
"""Tiles with a smaller gap touch."""
_POINTS = 4
"""Points in each of heel and ball."""
_PHASES = 2048
"""Steps of phase in the table of a footfall's curves."""
SPAN_M = 0.03
"""Widest gap between tiles that a sole spans: half of a heel. Points above a wider gap press on the ground."""
HAND_SHARE = 0.12
"""Share of its remaining change that a hand's force makes in one sample: a time constant of 8 ms at 1 kHz."""


FOOTFALL = np.dtype(
    [
        ("start_s", np.float64),
        ("duration_s", np.float64),
        ("heel_x_m", np.float64),
        ("heel_y_m", np.float64),
        ("cos_heading", np.float64),
        ("sin_heading", np.float64),
        ("length_m", np.float64),
        ("breadth_m", np.float64),
        ("extremes_n", np.float64, (3,)),
        ("person", np.int64),
        ("number", np.int64),
        ("left", np.bool_),
    ],
    align=True,
)
"""Footfall as kernels read it. `extremes_n` are first peak, valley and second peak; `number` counts the footfalls of a
`person` from 0."""

FOOTING = np.dtype([("shift_m", np.float64), ("gap_m", np.float64, (2, 2))], align=True)
"""Properties of a tile under a foot: the shift by shear (see `walk`), and the gap at each side, [axis, towards -, +] in
the tile's frame; 0 at a side without a tile within `SPAN_M`."""

HAND = np.dtype(
    [("x_m", np.float64), ("y_m", np.float64), ("target_n", np.float64), ("force_n", np.float64)], align=True
)
"""Hand on a tile: position in the tile's frame, requested force, and present force."""


def footfall_table(walks: Sequence[Sequence[gait.Footfall]]) -> NDArray[np.void]:
    """Return the footfalls of several people in order of time: shape (footfalls,) of `FOOTFALL`."""
    steps = [step for walk in walks for step in walk]
    table = np.zeros(len(steps), FOOTFALL)
    for name in ("start_s", "duration_s", "heel_x_m", "heel_y_m", "length_m", "breadth_m"):
        table[name] = [getattr(step, name) for step in steps]
    table["cos_heading"] = [math.cos(step.heading_rad) for step in steps]
    table["sin_heading"] = [math.sin(step.heading_rad) for step in steps]
    for k, name in enumerate(("peak1_n", "valley_n", "peak2_n")):
        table["extremes_n"][:, k] = [getattr(step, name) for step in steps]
    table["person"] = [person for person, walk in enumerate(walks) for _ in walk]
    table["number"] = [number for walk in walks for number in range(len(walk))]
    table["left"] = [step.side == "left" for step in steps]
    return table[np.argsort(table["start_s"], kind="stable")]


def footing_table(floor: Floor) -> NDArray[np.void]:
    """Return the properties of tiles under feet: shape (tiles,) of `FOOTING`.

    >>> from underfoot.floor.layout import default_floor
    >>> footing_table(default_floor(1, 3))["gap_m"][1].round(3)
    array([[0.005, 0.005],
           [0.   , 0.   ]])
    """
    table = np.zeros(len(floor.tiles), FOOTING)
    corners_m = np.array([tile.corners_m() for tile in floor.tiles])
    for row, tile in enumerate(floor.tiles):
        half = np.array(tile.size_m) / 2.0
        corners = tile.to_tile(np.delete(corners_m, row, axis=0))
        low, high = corners.min(axis=1), corners.max(axis=1)
        beyond_m = np.stack([-half - high, low - half], axis=-1)  # [other, axis, side]
        across = (low < half - _TOUCH_M) & (high > _TOUCH_M - half)
        faces = across[:, ::-1, None] & (beyond_m > _TOUCH_M) & (beyond_m <= SPAN_M)
        nearest = np.where(faces, beyond_m, np.inf).min(axis=0, initial=np.inf)
        table["gap_m"][row] = np.where(np.isfinite(nearest), nearest, 0.0)
    return table


def gait_curves(walkers: Sequence[gait.Walker]) -> NDArray[np.float64]:
    """Return curves over the phase of a footfall, from 0 to 1: shape (3 + walkers, 2049).

    The first three are the force per unit of first peak, valley and second peak: a footfall's force is linear in these.
    The others are the rolls of the walkers' feet.
    """
    phase = np.linspace(0.0, 1.0, _PHASES + 1)
    rolls = [gait.roll(phase, walker.roll_start, walker.roll_reach) for walker in walkers]
    return np.array([*(gait.vertical_force(phase, *one) for one in np.eye(3)), *rolls])


class FeetDown(Struct, frozen=True):
    """True feet of the simulator: one row per time and loaded foot, shape (n,) each.

    `footfall` is the row in the table of footfalls, `person` counts from 0; centre of pressure in the floor's frame.
    """

    time_s: NDArray[np.float64]
    person: NDArray[np.int64]
    footfall: NDArray[np.int64]
    left: NDArray[np.bool_]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    force_n: NDArray[np.float64]


def feet_down(footfalls: NDArray[np.void], curves: Floats, time_s: Floats, least_n: float = 0.0) -> FeetDown:
    """Return the feet with more than `least_n` newtons at each of `time_s` (n,), ascending."""
    found: list[tuple[NDArray[Any], ...]] = []
    phases = np.linspace(0.0, 1.0, _PHASES + 1)
    for row, step in enumerate(footfalls):
        end_s = step["start_s"] + step["duration_s"]
        at = np.arange(np.searchsorted(time_s, step["start_s"]), np.searchsorted(time_s, end_s))
        phase = (time_s[at] - step["start_s"]) / step["duration_s"]
        extremes = np.array([np.interp(phase, phases, curves[j]) for j in range(3)])
        force = step["extremes_n"] @ extremes
        along = step["length_m"] * np.interp(phase, phases, curves[3 + step["person"]])
        kept = force > least_n
        x, y = step["heel_x_m"] + along * step["cos_heading"], step["heel_y_m"] + along * step["sin_heading"]
        found.append((at[kept], np.full(kept.sum(), row), x[kept], y[kept], force[kept]))
    samples, rows, x, y, force = (np.concatenate(column) for column in zip(*found, strict=True))
    order = np.argsort(samples, kind="stable")
    steps = footfalls[rows[order]]
    return FeetDown(
        time_s[samples[order]], steps["person"], rows[order], steps["left"], x[order], y[order], force[order]
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
    footing: NDArray[np.void],
) -> None:
    """Add the footfalls, repeated for ever, to the first `count` of `forces_n` (n, tiles, 4) at session frames
    `stamps`.

    `plates` and `footing` (tiles,) are those of the floor, `curves` those of `gait_curves` for the people in the table.
    A foot brakes and then pushes off. This shear shifts the centroid that vertical sensors measure by the tile's
    `shift_m`: forwards when the foot comes down, backwards when it leaves.
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
                _add_footfall(forces_n[i], plates, footfall, curves, footing, phase)


@kernel
def press(forces_n: Floats, count: int, plates: NDArray[np.void], hands: NDArray[np.void]) -> None:
    """Add the forces of hands (tiles,), of `HAND`, to the first `count` of `forces_n` (n, tiles, 4)."""
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
    forces_n: Floats, plates: NDArray[np.void], step: np.record, curves: Floats, footing: NDArray[np.void], phase: float
) -> None:
    at = phase * _PHASES
    i = min(int(at), _PHASES - 1)
    share = at - i
    force_n = 0.0
    for j in range(3):
        force_n += step.extremes_n[j] * (curves[j, i] + share * (curves[j, i + 1] - curves[j, i]))
    rolls = curves[3 + step.person]
    roll = rolls[i] + share * (rolls[i + 1] - rolls[i])
    heel, ball = min(HEEL, roll), max(BALL, roll)
    on_ball = (roll - heel) / (ball - heel)
    braking = math.cos(math.pi * phase)
    shift = braking * step.cos_heading, braking * step.sin_heading
    for centre, load_n in ((heel, force_n * (1.0 - on_ball)), (ball, force_n * on_ball)):
        for j in range(_POINTS):
            along = (centre + REACH * (2.0 * j / (_POINTS - 1) - 1.0)) * step.length_m
            # The middle points press on one side, the outer ones on the other: the centre stays on the line.
            across = (0.5 if j % 3 == 0 else -0.5) * step.breadth_m
            x = step.heel_x_m + along * step.cos_heading - across * step.sin_heading
            y = step.heel_y_m + along * step.sin_heading + across * step.cos_heading
            _add_point_force(forces_n, plates, footing, (x, y), load_n / _POINTS, shift)


@kernel
def _add_point_force(
    forces_n: Floats,
    plates: NDArray[np.void],
    footing: NDArray[np.void],
    place: tuple[float, float],
    force_n: float,
    shift: tuple[float, float],
) -> None:
    """Add a point force: to the tile below it, or to the edges of a gap (`_held`); elsewhere it goes to the ground."""
    for k in range(len(plates)):
        along, across = _on_tile(plates[k], place)
        if abs(along) <= plates[k].half_m[0] and abs(across) <= plates[k].half_m[1]:
            _add_shifted(forces_n[k], plates[k], footing[k].shift_m, (along, across), force_n, shift)
            return
    held = 0.0
    for k in range(len(plates)):
        along, across = _on_tile(plates[k], place)
        held += _held(plates[k], footing[k], along, across)
    if held > 0.0:
        for k in range(len(plates)):
            along, across = _on_tile(plates[k], place)
            share = _held(plates[k], footing[k], along, across) / held
            if share > 0.0:
                half = plates[k].half_m
                edge = min(max(along, -half[0]), half[0]), min(max(across, -half[1]), half[1])
                _add_shifted(forces_n[k], plates[k], footing[k].shift_m, edge, share * force_n, shift)


@kernel
def _on_tile(plate: np.record, place: tuple[float, float]) -> tuple[float, float]:
    """Convert a place on the floor to a tile's frame."""
    dx, dy = place[0] - plate.centre_m[0], place[1] - plate.centre_m[1]
    return plate.axes[0, 0] * dx + plate.axes[0, 1] * dy, plate.axes[1, 0] * dx + plate.axes[1, 1] * dy


@kernel
def _held(plate: np.record, footing: np.record, along: float, across: float) -> float:
    """Return the share of a load beside a tile that its edge bears: 1 at the edge, 0 at the tile across the gap."""
    share = 1.0
    for axis, at in ((0, along), (1, across)):
        beyond = abs(at) - plate.half_m[axis]
        if beyond > 0.0:
            share *= max(1.0 - beyond / max(footing.gap_m[axis, 1 if at > 0.0 else 0], _TOUCH_M), 0.0)
    return share


@kernel
def _add_shifted(
    forces_n: Floats,
    plate: np.record,
    shift_m: float,
    place: tuple[float, float],
    force_n: float,
    shift: tuple[float, float],
) -> None:
    """Add a foot's force at a place in the tile's frame, shifted by shear."""
    x = place[0] + shift_m * (plate.axes[0, 0] * shift[0] + plate.axes[0, 1] * shift[1])
    y = place[1] + shift_m * (plate.axes[1, 0] * shift[0] + plate.axes[1, 1] * shift[1])
    _add_to_corners(forces_n, plate, x, y, force_n)


@kernel
def _add_to_corners(forces_n: Floats, plate: np.record, x: float, y: float, force_n: float) -> None:
    """Add a force at (x, y) in the tile's frame, split bilinearly over sensors at the corners of a rectangle."""
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
