"""Split of a load over the corners of a real plate: random deviations from bilinear, and corners that lift."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.floor.layout import Tile
from underfoot.floor.tile_parameters import Split
from underfoot.kernels import kernel
from underfoot.models.signals.random import normal, stream_key, uniform


def drawn_split(tile: Tile, split: Split, seed: int) -> NDArray[np.float64]:
    """Draw the matrix (4, 4) from bilinear corner forces to those of a real plate.

    Four corner forces are a sum, two moments, and a twist (+ - + -) that changes none of these. The sum is kept, the
    moments are those of a slightly shifted and scaled place, and a twist is added that varies over the plate.
    `BadValue` for sensors that are not the corners of a rectangle along the tile's axes.
    """
    key = stream_key("split", seed, tile.id)
    draws = [normal(key, draw) for draw in range(10)]
    sensors = np.array(tile.sensors_m)
    centred = sensors - sensors.mean(axis=0)
    half = np.abs(centred).max(axis=0)
    upright = (
        half.min() > 0.0 and np.allclose(np.abs(centred), half, rtol=1e-6) and len(np.unique(centred > 0, axis=0)) == 4
    )
    require(bool(upright), "sensors_m", tile.sensors_m, "the corners of a rectangle along the tile's axes")
    signs = np.sign(centred)
    basis = np.stack([np.ones(4), signs[:, 0], signs[:, 1], signs[:, 0] * signs[:, 1]])
    change = np.eye(4)
    for axis in range(2):
        shift, own, other = (split.placement_m / half[axis] * draw for draw in draws[3 * axis : 3 * axis + 3])
        change[1 + axis, 0] += shift
        change[1 + axis, 1 + axis] += own
        change[1 + axis, 2 - axis] += other
    twist = np.array(draws[6:])
    size = math.sqrt(float(twist**2 @ [1.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 9.0]))
    # A corner has a quarter of the twist.
    drawn = 4.0 * split.deviation * 2.0 ** (2.0 * uniform(key, 100) - 1.0)
    change[3] += drawn * twist / size
    return 0.25 * basis.T @ change @ basis


def corner_twist(tile: Tile) -> NDArray[np.float64]:
    """Return the corner forces (4,) that change neither sum nor moments: + - + - around the tile."""
    centred = np.array(tile.sensors_m) - np.mean(tile.sensors_m, axis=0)
    return np.asarray(np.sign(centred[:, 0] * centred[:, 1]))


@kernel
def lift_corners(carried: NDArray[np.float64], twist: NDArray[np.float64]) -> None:
    """Lift the corners that would pull, because rubber mounts can only push.

    `carried` (4,) are the forces at the corners, with the plate's own weight. Statics determine all but their twist,
    which is changed just enough to bring a negative force to 0. A plate that would tip, because it is pressed outside
    its sensors, keeps negative forces, equal at the two corners that would lift.
    """
    least, most = -math.inf, math.inf
    for corner in range(4):
        if twist[corner] > 0.0:
            least = max(least, -carried[corner])
        else:
            most = min(most, carried[corner])
    change = min(max(0.0, least), most) if least <= most else 0.5 * (least + most)
    for corner in range(4):
        carried[corner] += change * twist[corner]


@kernel
def lift_corners_all(carried: NDArray[np.float64], twist: NDArray[np.float64]) -> None:
    """Apply `lift_corners` to each row of (n, 4)."""
    for i in range(len(carried)):
        lift_corners(carried[i], twist)


def hand_shift_m(tile: Tile, split: Split, seed: int) -> NDArray[np.float64]:
    """Draw the shift (2,) of the centroid by a hand's shear, which vertical sensors cannot detect."""
    turn = 2.0 * math.pi * uniform(stream_key("lean", seed, tile.id), 0)
    return tile.sensor_depth_m * split.shear * np.array([math.cos(turn), math.sin(turn)])
