"""The adult step of previews: its force on a tile, and its addition to a floor's samples."""

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.floor.layout import Tile
from underfoot.kernels import block_kernel
from underfoot.models import gait

STEP_S = 0.05
"""Time at which the foot comes down, after the start of a preview or of a patch played from its start."""
FORCE_HZ = 1000.0
"""Sample rate of the step's force."""
_LONGEST_S = 2.0
"""Time within which an adult's step is over."""


def adult_step(tile: Tile, time_s: NDArray[np.float64], start_s: float) -> tuple[NDArray[np.float64], ...]:
    """Return the force of a step over the middle of a tile at these times, N: of foot (n,) and corners (n, 4).

    >>> from underfoot.floor.layout import default_floor
    >>> tile = default_floor().tiles[0]
    >>> force_n, corners_n = adult_step(tile, np.arange(1000) / FORCE_HZ, STEP_S)
    >>> bool(np.allclose(corners_n.sum(axis=1), force_n)), round(float(force_n.max()), -2)
    (True, 800.0)
    """
    walker = gait.Walker(variation=0.0)
    step = gait.footfalls(walker, [(0.0, 0.0)], start_s + 0.01, start_s=start_s)[0]
    along_m = walker.foot_length_m * (gait.roll((time_s - step.start_s) / step.duration_s) - 0.5)
    force_n = step.force_n(time_s)
    return force_n, gait.corner_forces(force_n, along_m, np.zeros_like(along_m), tile.sensors_m)


def step_forces(tile: Tile) -> NDArray[np.float64]:
    """Return the corner forces of `adult_step` from touchdown on, at 1 kHz, N (n, 4); the last is 0."""
    force_n, corners_n = adult_step(tile, np.arange(round(_LONGEST_S * FORCE_HZ)) / FORCE_HZ, 0.0)
    return np.ascontiguousarray(corners_n[: int(np.flatnonzero(force_n)[-1]) + 2])


class _Step(Struct):
    row: int
    start: float
    end: float
    corners_n: NDArray[np.float64]


class StepAdder:
    """Adds steps to the samples of a source, each from its frame on. A new one on a tile ends the previous one."""

    def __init__(self, rate_hz: float) -> None:
        self._period = rate_hz / FORCE_HZ
        self._steps: list[_Step] = []
        _add(np.zeros((0, 1, 4)), np.zeros(0), 0, 0, 0.0, 0.0, self._period, np.zeros((1, 4)))

    def begin(self, row: int, frame: int, corners_n: NDArray[np.float64]) -> None:
        """Begin a step of `step_forces` at a frame."""
        for step in self._steps:
            if step.row == row:
                step.end = min(step.end, float(frame))
        self._steps.append(_Step(row, float(frame), frame + len(corners_n) * self._period, corners_n))

    def add(self, stamps: NDArray[np.float64], forces: NDArray[np.float64], count: int) -> None:
        """Add the steps to the first `count` samples: `stamps` in frames, `forces` in N [sample, tile, corner]."""
        for step in self._steps:
            _add(forces, stamps, count, step.row, step.start, step.end, self._period, step.corners_n)
        while self._steps and stamps[0] >= self._steps[0].end:
            del self._steps[0]


@block_kernel
def _add(
    forces: NDArray[np.float64],
    stamps: NDArray[np.float64],
    count: int,
    row: int,
    start: float,
    end: float,
    period: float,
    corners_n: NDArray[np.float64],
) -> None:
    for i in range(count):
        if start <= stamps[i] < end:
            at = (stamps[i] - start) / period
            first = int(at)
            if first + 1 < len(corners_n):
                for corner in range(4):
                    low, high = corners_n[first, corner], corners_n[first + 1, corner]
                    forces[i, row, corner] += low + (high - low) * (at - first)
