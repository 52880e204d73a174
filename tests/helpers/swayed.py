"""A recording of somebody who stands, and whose centre of pressure goes where it was made to go."""

import numpy as np
from made_recordings import ABOUT

from underfoot.floor.layout import default_floor
from underfoot.records.recording_writer import Writer

WEIGHT_N, RADII_M, ROUND_S = 700.0, (0.006, 0.004), 5.0
FLOOR = default_floor(1, 2)


def swayed(path):
    """Write it: from 1 to 15 s somebody's weight goes along an ellipse once in `ROUND_S`, with a foot on each of two
    tiles, each sensor with 0.3 N of noise."""
    time_s = np.arange(0.0, 17.0, 5e-3)
    on = np.interp(time_s, [1.0, 1.2, 15.0, 15.2], [0.0, 1.0, 1.0, 0.0])
    angle = 2.0 * np.pi * time_s / ROUND_S
    way_m = np.column_stack([RADII_M[0] * np.cos(angle), RADII_M[1] * np.sin(angle)])
    force_n = np.random.default_rng(1).normal(0.0, 0.3, (len(time_s), 2, 4))
    for row, tile in enumerate(FLOOR.tiles):
        reach_m = np.array(tile.sensors_m)
        shares = 0.25 * (1.0 + way_m[:, None, :] / reach_m).prod(axis=2)
        force_n[:, row] += 0.5 * WEIGHT_N * on[:, None] * shares
    stamps = np.round(48_000 * time_s)
    writer = Writer(path, ABOUT | {"floor": FLOOR.dumps().decode(), "force_rate": "200.0"})
    writer.put("force", 0, np.column_stack([stamps, stamps, force_n.reshape(len(time_s), 8)]))
    writer.close()
    return path
