"""What accelerometers measure while the engine plays: the card's inputs, as m/s^2 of each tile, at session frames."""

import numpy as np

from underfoot.devices.accelerometers import Accelerometer
from underfoot.engine.rings import Ring
from underfoot.floor.layout import Floor


class AccelerometerReader:
    """Writes what came in with a block to a ring of float32 [frame, tile], m/s^2; 0 for tiles without accelerometer.

    `heard` is float32 [frame, input], of full scale: whoever plays puts a block's input there. What comes in is what
    was played `delay_frames` ago, and is written at the frames of then.
    """

    def __init__(self, accelerometers: tuple[Accelerometer, ...], floor: Floor, block: int) -> None:
        inputs = 1 + max(one.channel for one in accelerometers)
        self.heard = np.zeros((block, inputs), np.float32)
        self.delay_frames = 0
        self._rows = np.zeros((block, len(floor.tiles)), np.float32)
        self._columns = [
            (self.heard[:, one.channel], np.float32(one.m_s2_per_unit), self._rows[:, floor.index(one.tile)])
            for one in accelerometers
        ]

    def write(self, ring: Ring, frame: int, n: int) -> None:
        """Write the block that begins at session frame `frame`, whole blocks only. Allocates no arrays."""
        begin = frame - self.delay_frames
        if begin > ring.written:
            ring.skip(begin)
        for heard, scale, row in self._columns:
            np.multiply(heard, scale, out=row)
        known = max(ring.written - begin, 0)  # at the start: what came in before anything was played
        if known < n:
            ring.write(self._rows[known:], n - known)
