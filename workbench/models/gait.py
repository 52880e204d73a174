"""Walking: ground reaction force, roll of the foot, footfalls, and the split of forces over a tile's corners.

The vertical force of a footfall has the double hump of walking: a first peak (weight acceptance), a valley (swing of
the other leg), a second peak (push-off). At constant mean height of the walker, the impulse of a footfall is weight
times step time; this determines the contact time.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from functools import lru_cache
from typing import Annotated

import msgspec
import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import require_within
from underfoot.errors import require
from underfoot.models.signals.random import normals, stream_key

PEAK1_PHASE, VALLEY_PHASE, PEAK2_PHASE = 0.22, 0.50, 0.77
"""Phases of the extremes, as usual in walking at a comfortable speed."""


def vertical_force(phase: ArrayLike, peak1: float, valley: float, peak2: float) -> NDArray[np.float64]:
    """Return the vertical force at each `phase` (0 landing, 1 toe-off), in the unit of its extremes; 0 outside.

    Quarter sines before the first and after the second peak, raised cosines between: no overshoot, no corner inside.

    >>> vertical_force([0.0, 0.22, 0.5, 0.77, 1.0], 1.1, 0.7, 1.05)
    array([0.  , 1.1 , 0.7 , 1.05, 0.  ])
    """
    p = np.asarray(phase, dtype=np.float64)
    rise = peak1 * np.sin(0.5 * np.pi * np.clip(p, 0.0, PEAK1_PHASE) / PEAK1_PHASE)
    fall = peak2 * np.sin(0.5 * np.pi * np.clip(1.0 - p, 0.0, 1.0 - PEAK2_PHASE) / (1.0 - PEAK2_PHASE))
    first = _raised_cosine((p - PEAK1_PHASE) / (VALLEY_PHASE - PEAK1_PHASE))
    second = _raised_cosine((p - VALLEY_PHASE) / (PEAK2_PHASE - VALLEY_PHASE))
    return np.where(p < VALLEY_PHASE, rise + (valley - peak1) * first, fall + (valley - peak2) * (1.0 - second))


@lru_cache
def mean_force(peak1: float, valley: float, peak2: float) -> float:
    """Return the mean of `vertical_force` over the contact, in closed form.

    >>> round(mean_force(1.1, 0.7, 1.1), 3)
    0.81
    """
    ends = 2.0 / math.pi * (PEAK1_PHASE * peak1 + (1.0 - PEAK2_PHASE) * peak2)
    first = 0.5 * (peak1 + valley) * (VALLEY_PHASE - PEAK1_PHASE)
    return ends + first + 0.5 * (valley + peak2) * (PEAK2_PHASE - VALLEY_PHASE)


def roll(phase: ArrayLike, start: float = 0.05, reach: float = 0.9) -> NDArray[np.float64]:
    """Return the centre of pressure as a fraction of foot length from the heel: from `start`, over `reach`.

    It leaves the heel and reaches the toes fast, crosses the middle slowly, and never goes back.

    >>> roll([0.0, 0.5, 1.0])
    array([0.05, 0.5 , 0.95])
    """
    p = np.clip(np.asarray(phase, dtype=np.float64), 0.0, 1.0)
    return start + reach * (p + 0.3 * np.sin(2.0 * np.pi * p) / (2.0 * np.pi))


class Walker(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Walker: weight, cadence (steps per minute, both feet), feet, and variation of the footfalls.

    Peaks and valley are in body weights. The centre of pressure rolls from `roll_start` over `roll_reach`, fractions of
    the foot's length (a flat-footed step has a short reach). `foot_breadth_m` is the breadth of heel and ball; at 0 the
    foot is a line. `variation` is the relative standard deviation of forces and step time, and that of positions in
    units of 0.3 m. Raises `BadValue` outside the ranges.

    >>> round(Walker().contact_s, 3)
    0.673
    """

    weight_n: Annotated[float, (50.0, 3000.0)] = 700.0
    cadence_per_min: Annotated[float, (20.0, 200.0)] = 110.0
    foot_length_m: Annotated[float, (0.1, 0.4)] = 0.26
    step_length_m: Annotated[float, (0.0, 1.5)] = 0.66
    step_width_m: Annotated[float, (0.0, 0.5)] = 0.10
    toe_out_deg: Annotated[float, (-45.0, 45.0)] = 6.0
    peak1: Annotated[float, (0.9, 2.0)] = 1.10
    valley: Annotated[float, (0.2, 1.0)] = 0.72
    peak2: Annotated[float, (0.9, 2.0)] = 1.08
    roll_start: Annotated[float, (0.0, 0.9)] = 0.05
    roll_reach: Annotated[float, (0.0, 1.0)] = 0.9
    variation: Annotated[float, (0.0, 0.2)] = 0.02
    foot_breadth_m: Annotated[float, (0.0, 0.2)] = 0.0

    def __post_init__(self) -> None:
        require_within(self)
        most = 1.0 - self.roll_start
        require(self.roll_reach <= most, "roll_reach", self.roll_reach, f"at most {most:g}, to the toes")

    @property
    def step_s(self) -> float:
        """Seconds between landings of the two feet."""
        return 60.0 / self.cadence_per_min

    @property
    def contact_s(self) -> float:
        """Contact time of a foot, s, such that the impulse of a footfall is weight times `step_s`."""
        return self.step_s / mean_force(self.peak1, self.valley, self.peak2)


class Footfall(Struct, frozen=True):
    """One footfall: time, position of the heel in the floor's frame, direction, side and forces."""

    side: str
    start_s: float
    duration_s: float
    heel_x_m: float
    heel_y_m: float
    heading_rad: float
    length_m: float
    peak1_n: float
    valley_n: float
    peak2_n: float
    roll_start: float = 0.05
    roll_reach: float = 0.9
    breadth_m: float = 0.0

    def force_n(self, time_s: ArrayLike) -> NDArray[np.float64]:
        """Return the vertical force at each of `time_s`; 0 outside the contact."""
        return vertical_force(self._phase(time_s), self.peak1_n, self.valley_n, self.peak2_n)

    def centre_m(self, time_s: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the centre of pressure (x, y) at each of `time_s`; held at heel and toe outside the contact."""
        along = self.length_m * roll(self._phase(time_s), self.roll_start, self.roll_reach)
        return self.heel_x_m + along * math.cos(self.heading_rad), self.heel_y_m + along * math.sin(self.heading_rad)

    def _phase(self, time_s: ArrayLike) -> NDArray[np.float64]:
        return (np.asarray(time_s, dtype=np.float64) - self.start_s) / self.duration_s


def footfalls(
    walker: Walker, path: Sequence[tuple[float, float]], seconds: float, seed: int = 1, start_s: float = 0.2
) -> list[Footfall]:
    """Return the footfalls that begin in [start_s, seconds), left and right in turn, in order of time.

    The walker follows `path`, points (x, y) in metres, and turns round at its end. A closed path is walked in a loop;
    at a single point the walker steps on the spot. The centres of left and right feet are `step_width_m` apart. The
    same seed gives the same walk, and a longer walk begins with the shorter one. Raises `BadValue` for an empty path,
    points that are not finite, and for seconds or start_s that are not finite.

    >>> steps = footfalls(Walker(variation=0.0), [(0.0, 0.0), (2.0, 0.0)], 1.0)
    >>> [(step.side, round(step.start_s, 3), round(step.heel_y_m, 3)) for step in steps]
    [('left', 0.2, 0.036), ('right', 0.745, -0.036)]
    """
    points = np.asarray(path, dtype=np.float64)
    require(points.ndim == 2 and points.shape[-1] == 2 and len(points) > 0, "path", path, "points (x, y)")
    require(bool(np.isfinite(points).all()), "path", path, "finite points")
    require(math.isfinite(seconds), "seconds", seconds, "a finite time")
    require(math.isfinite(start_s), "start_s", start_s, "a finite time")
    key = stream_key(seed, "walker")
    count = max(0, math.ceil((seconds - start_s) / walker.step_s) + 2)
    way = _Path(points)
    steps = [
        footfall_at(walker, way.at(step * walker.step_length_m), step, vary, start_s + step * walker.step_s)
        for step, vary in enumerate(variations(walker, key, 0, count))
    ]
    return [step for step in sorted(steps, key=lambda step: step.start_s) if start_s <= step.start_s < seconds]


def variations(walker: Walker, key: np.uint64, step: int, count: int) -> list[list[float]]:
    """Return how `count` footfalls of a walker vary, from number `step` on: seven draws of `key` for each.

    >>> walker, key = Walker(variation=0.05), np.uint64(7)
    >>> variations(walker, key, 1, 2) == variations(walker, key, 0, 3)[1:]  # each footfall has its own draws
    True
    """
    draws = np.empty((count, 8))
    normals(key, 8 * step, draws.reshape(-1))
    found: list[list[float]] = (walker.variation * draws[:, :7]).tolist()
    return found


def footfall_at(
    walker: Walker, place: tuple[float, float, float], step: int, vary: Sequence[float], due_s: float
) -> Footfall:
    """Return footfall number `step` (even: left) of a walker, due at `due_s`, varied by one of `variations`.

    `place` is the position of the body, x and y in metres, and its heading in radians; the foot lands half a step width
    to its side.

    >>> walker = Walker(toe_out_deg=0.0)
    >>> right = footfall_at(walker, (1.0, 0.0, 0.0), 1, [0.0] * 7, 0.5)
    >>> right.side, right.start_s, round(right.heel_y_m + 0.5 * walker.step_width_m, 12)
    ('right', 0.5, 0.0)
    """
    x, y, heading = place
    turn = 1.0 if step % 2 == 0 else -1.0
    aside = 0.5 * turn * walker.step_width_m
    x += -aside * math.sin(heading) + 0.3 * vary[0]
    y += aside * math.cos(heading) + 0.3 * vary[1]
    heading += turn * math.radians(walker.toe_out_deg)
    # The first foot lands on time, so that a walk begins where requested.
    late = walker.step_s * vary[2] if step > 0 else 0.0
    return Footfall(
        side="left" if turn > 0 else "right",
        start_s=due_s + late,
        duration_s=walker.contact_s * (1.0 + vary[3]),
        heel_x_m=x - 0.5 * walker.foot_length_m * math.cos(heading),
        heel_y_m=y - 0.5 * walker.foot_length_m * math.sin(heading),
        heading_rad=heading,
        length_m=walker.foot_length_m,
        peak1_n=walker.weight_n * walker.peak1 * (1.0 + vary[4]),
        valley_n=walker.weight_n * walker.valley * (1.0 + vary[5]),
        peak2_n=walker.weight_n * walker.peak2 * (1.0 + vary[6]),
        roll_start=walker.roll_start,
        roll_reach=walker.roll_reach,
        breadth_m=walker.foot_breadth_m,
    )


def corner_forces(force_n: ArrayLike, x_m: ArrayLike, y_m: ArrayLike, sensors_m: ArrayLike) -> NDArray[np.float64]:
    """Split a force at (x, y) bilinearly over four sensors at the corners of a rectangle: shape (..., 4).

    `sensors_m` is (4, 2), in metres, in any order; `force_n`, `x_m` and `y_m` broadcast. The four forces add up to the
    force and their centroid is (x, y), also outside the rectangle, where some are negative. Raises `BadValue` if the
    sensors are not the corners of a rectangle.

    >>> corner_forces(100.0, 0.1, 0.0, [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
    array([50.,  0.,  0., 50.])
    """
    sensors = np.asarray(sensors_m, dtype=np.float64)
    require(sensors.shape == (4, 2), "sensors_m", sensors_m, "four points (x, y)")
    centre, sides = _rectangle(tuple(map(tuple, sensors.tolist())))
    place = np.stack(np.broadcast_arrays(np.asarray(x_m, float), np.asarray(y_m, float)), axis=-1) - centre
    weights = np.full(4, 0.25)
    for half, reach, signs in sides:
        weights = weights * (1.0 + (place @ half)[..., None] / reach * signs)
    return np.asarray(force_n, dtype=np.float64)[..., None] * weights


@lru_cache(maxsize=256)
def _rectangle(
    sensors_m: tuple[tuple[float, float], ...],
) -> tuple[NDArray[np.float64], list[tuple[NDArray[np.float64], float, NDArray[np.float64]]]]:
    """Return the centre of a rectangle of sensors, and of each direction half a side, its square, and each sensor's end
    of it, -1 or 1. Samples come one by one, and always from the same sensors.
    """
    sensors = np.array(sensors_m)
    centre = sensors.mean(axis=0)
    across = sensors - sensors[0]
    near, middle, _ = sorted(across[1:], key=lambda edge: float(edge @ edge))
    size = float(np.abs(across).max())
    corners = np.array([[0.0, 0.0], near, middle, near + middle])
    apart = np.abs(across[:, None] - corners[None, :]).max(axis=2).min(axis=0)
    is_rectangle = apart.max() <= 1e-6 * size and abs(near @ middle) <= 1e-6 * size**2 and near @ near > 1e-12 * size**2
    require(bool(is_rectangle), "sensors_m", sensors.tolist(), "the corners of a rectangle")
    halves = (near / 2.0, middle / 2.0)
    return centre, [(half, float(half @ half), np.sign((sensors - centre) @ half)) for half in halves]


def _raised_cosine(u: NDArray[np.float64]) -> NDArray[np.float64]:
    return 0.5 * (1.0 - np.cos(np.pi * np.clip(u, 0.0, 1.0)))


class _Path:
    """Polyline that is walked there and back, or in a loop if it is closed."""

    def __init__(self, points: NDArray[np.float64]) -> None:
        edges = np.diff(points, axis=0)
        lengths = np.hypot(edges[:, 0], edges[:, 1])
        self._points, self._edges, self._lengths = points.tolist(), edges.tolist(), lengths.tolist()
        self._ends: list[float] = np.cumsum(lengths).tolist()
        self._total = float(lengths.sum())
        self._is_closed = len(points) > 2 and bool((points[0] == points[-1]).all())
        self._last = max((k for k, length in enumerate(self._lengths) if length > 0.0), default=0)

    def at(self, distance: float) -> tuple[float, float, float]:
        """Return position and heading after `distance`."""
        if self._total == 0.0:
            x, y = self._points[0]
            return x, y, 0.0
        place = distance % (self._total if self._is_closed else 2.0 * self._total)
        back = place > self._total
        if back:
            place = 2.0 * self._total - place
        edge = min(bisect_right(self._ends, place), self._last)
        share = (place - (self._ends[edge] - self._lengths[edge])) / self._lengths[edge]
        (x, y), (dx, dy) = self._points[edge], self._edges[edge]
        heading = math.atan2(dy, dx) + (math.pi if back else 0.0)
        return x + share * dx, y + share * dy, heading
