"""What accelerometers measure while the engine plays, as m/s^2 of each tile, at the session frames of the command."""

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.accelerometers import LINK, Accelerometer
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.force_source import ForceSource
from underfoot.devices.link_acceleration import LAG_S, LinkAcceleration
from underfoot.devices.sound import Stream
from underfoot.engine.rings import Ring
from underfoot.floor.layout import Floor


class CardReader:
    """Writes what came in with a block to a ring of float32 [frame, tile], m/s^2; 0 for tiles without accelerometer.

    `heard` is float32 [frame, input], of full scale: whoever plays puts a block's input there. What comes in is what
    was played `delay_frames` ago, and is written at the frames of then.
    """

    needs_stream = True
    """Whether it measures only while a sound card plays."""

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
        _write_new(ring, self._rows, begin, n)

    @staticmethod
    def delay_s(stream: Stream) -> float:
        """How long what is played is on its way to an input, as the stream says."""
        return stream.round_trip_s


class LinkReader:
    """Writes what came over the link to a ring, as `CardReader` does what came in with a block; `LAG_S` later."""

    needs_stream = False
    heard = None

    def __init__(self, acceleration: LinkAcceleration, floor: Floor, rate_hz: float, block: int) -> None:
        self.delay_frames = 0
        self._acceleration, self._lag_frames = acceleration, round(LAG_S * rate_hz)
        self._rows = np.zeros((block, len(floor.tiles)), np.float32)

    def write(self, ring: Ring, frame: int, n: int) -> None:
        """Write, once that is over, the block that began `LAG_S` before session frame `frame`. Allocates no arrays."""
        taken = frame - self._lag_frames
        if taken - self.delay_frames > ring.written:
            ring.skip(taken - self.delay_frames)
        self._acceleration.fill(self._rows, taken, n)
        _write_new(ring, self._rows, taken - self.delay_frames, n)

    @staticmethod
    def delay_s(stream: Stream) -> float:
        """How long what is played is on its way to a tile, as the stream says."""
        return stream.latency_s


AccelerometerReader = CardReader | LinkReader


def reader_of(
    accelerometers: tuple[Accelerometer, ...], source: ForceSource, rate_hz: float, block: int
) -> AccelerometerReader | None:
    """What reads these accelerometers; None where there are none, or none can be heard: over the link of no device."""
    if any(one.channel != LINK for one in accelerometers):
        return CardReader(accelerometers, source.floor, block)
    if accelerometers and isinstance(source, DeviceFloor):
        return LinkReader(source.hear(accelerometers), source.floor, rate_hz, block)
    return None


def _write_new(ring: Ring, rows: NDArray[np.float32], begin: int, n: int) -> None:
    """Write `n` rows, the first of which is of frame `begin`, without those that the ring has."""
    known = max(ring.written - begin, 0)  # at the start: what came in before anything was played
    if known < n:
        ring.write(rows[known:], n - known)
