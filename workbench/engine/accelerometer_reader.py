"""What accelerometers measure while the engine plays, as m/s^2 of each tile, at the session frames of the command."""

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.accelerometers import LINK, Accelerometer
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.force_source import ForceSource
from underfoot.devices.link_acceleration import LAG_S, LinkAcceleration
from underfoot.devices.sound import Stream
from underfoot.engine.alignment import NEAR_S, delay_of, split
from underfoot.engine.rings import Ring
from underfoot.engine.session_memory import SessionMemory
from underfoot.floor.layout import Floor

CHUNK_S = 0.3
"""Of so much it is found at once how far it is behind what was played. It is told so late, and once more."""
MOST_DELAY_S = 2.0
"""How late what is played may come back: soon after, the rings have forgotten what it was."""
TOO_LATE_S = 1.5
"""So late it comes back only where a card has lost many blocks and holds what came in: its stream is opened anew."""
_HISTORY_S = 3.0 * CHUNK_S + 1.0


class CardReader:
    """Keeps what came in with each block; `align` writes it, float32 [frame, tile] in m/s^2, to a ring.

    `heard` is float32 [frame, input], of full scale: whoever plays puts a block's input there. What comes in is what
    was played `delay_frames` ago, and is written at the frames of then; tiles without accelerometer have 0. The card or
    a sound server may lose frames on the way: `align` finds where, goes on at the new distance, and counts `jumps`.
    """

    needs_stream = True
    """Whether it measures only while a sound card plays."""

    def __init__(
        self, accelerometers: tuple[Accelerometer, ...], floor: Floor, rings: SessionMemory, rate_hz: float, block: int
    ) -> None:
        inputs = 1 + max(one.channel for one in accelerometers)
        self.heard = np.zeros((block, inputs), np.float32)
        self.delay_frames = 0
        self.jumps = 0
        self._chunk = round(CHUNK_S * rate_hz)
        self._most, self._near = round(MOST_DELAY_S * rate_hz), round(NEAR_S * rate_hz)
        self._too_late = round(TOO_LATE_S * rate_hz)
        self._rows = np.zeros((block * -(-round(_HISTORY_S * rate_hz) // block), len(floor.tiles)), np.float32)
        self._tiles = [floor.index(one.tile) for one in accelerometers]
        self._scales = [(self.heard[:, one.channel], np.float32(one.m_s2_per_unit)) for one in accelerometers]
        self._origin = -1  # the session frame of the first row
        self._begin = self._end = 0  # session frames between which rows are there
        self._next = 0  # the first that is not written
        self.is_found = False
        """Whether anything was heard at `delay_frames`."""
        self._is_new = True  # whether it was found in a stretch that may have had another one, too
        self._ring, self._played = rings.measured, rings.vibration

    @property
    def is_too_late(self) -> bool:
        """Whether what comes in will soon be too late to be known again."""
        return self.delay_frames > self._too_late

    def write(self, frame: int, n: int) -> None:
        """Keep the block that begins at session frame `frame`, whole blocks only. Allocates no arrays."""
        if self._origin < 0:
            self._origin = frame
        if frame != self._end:
            self._begin = frame
        at = (frame - self._origin) % len(self._rows)
        for tile, (heard, scale) in zip(self._tiles, self._scales, strict=True):
            np.multiply(heard, scale, out=self._rows[at : at + n, tile])
        self._end = frame + n

    def align(self) -> None:
        """Write what is complete. Not from the callback: it takes milliseconds."""
        begin, end = self._begin, self._end
        self._next = max(self._next, begin, end - len(self._rows) + self._chunk)
        while end - self._next >= 2 * self._chunk:
            self._align_chunk()

    def _align_chunk(self) -> None:
        """Write up to the chunk that comes next, which says whether all before it is at the present distance."""
        first, middle, last = self._next, self._next + self._chunk, self._next + 2 * self._chunk
        delay, tile = self._found(middle, last)
        if delay is not None and delay != self.delay_frames:
            heard = self._kept(first, last)[:, tile]
            before, behind = (_rows_of(self._played, first - d, last - d)[:, tile] for d in (self.delay_frames, delay))
            extra = max(delay - self.delay_frames, 0)  # silence, or frames that came twice
            at = first + split(before, behind, heard, extra)
            self._publish(first, at)
            is_jump = abs(delay - self.delay_frames) > self._near
            self.jumps += is_jump and self.is_found
            self._is_new = is_jump
            self.delay_frames = delay
            self.is_found = True
            first, middle = at + extra, max(at + extra, middle)
        elif delay is not None:
            self.is_found, self._is_new = True, False
        self._publish(first, middle)
        self._next = middle

    def _found(self, begin: int, end: int) -> tuple[int | None, int]:
        """The delay of the loudest tile's input, None where that cannot be told; and that tile."""
        heard = self._kept(begin, end)
        tile = max(self._tiles, key=lambda tile: float(np.dot(heard[:, tile], heard[:, tile])))
        played = np.ascontiguousarray(_rows_of(self._played, begin - self._most, end)[:, tile])
        heard_there = np.ascontiguousarray(heard[:, tile])
        return delay_of(played, heard_there, self.delay_frames, self._near, self._is_new), tile

    def _kept(self, begin: int, end: int) -> NDArray[np.float32]:
        return np.take(self._rows, np.arange(begin, end) - self._origin, axis=0, mode="wrap")

    def _publish(self, begin: int, end: int) -> None:
        _write_new(self._ring, self._kept(begin, end), begin - self.delay_frames, end - begin)

    @staticmethod
    def delay_s(stream: Stream) -> float:
        """How long what is played is on its way to an input, as the stream says."""
        return stream.round_trip_s


def _rows_of(ring: Ring, begin: int, end: int) -> NDArray[np.float32]:
    """Rows of a ring that were written a while ago; 0 before the first, and behind the last."""
    frames = np.arange(begin, end)
    rows = np.take(ring.rows, frames, axis=0, mode="wrap")
    rows[(frames < 0) | (frames >= ring.written)] = 0.0
    return rows


class LinkReader:
    """Writes what came over the link to a ring, as `CardReader` does what came in with a block; `LAG_S` later."""

    needs_stream = False
    heard = None

    def __init__(self, acceleration: LinkAcceleration, floor: Floor, ring: Ring, rate_hz: float, block: int) -> None:
        self.delay_frames = 0
        self._ring = ring
        self._acceleration, self._lag_frames = acceleration, round(LAG_S * rate_hz)
        self._rows = np.zeros((block, len(floor.tiles)), np.float32)

    def write(self, frame: int, n: int) -> None:
        """Write, once that is over, the block that began `LAG_S` before session frame `frame`. Allocates no arrays."""
        taken = frame - self._lag_frames
        self._acceleration.fill(self._rows, taken, n)
        _write_new(self._ring, self._rows, taken - self.delay_frames, n)

    @staticmethod
    def delay_s(stream: Stream) -> float:
        """How long what is played is on its way to a tile, as the stream says."""
        return stream.latency_s


AccelerometerReader = CardReader | LinkReader


def reader_of(
    accelerometers: tuple[Accelerometer, ...], source: ForceSource, rings: SessionMemory, rate_hz: float, block: int
) -> AccelerometerReader | None:
    """What reads these accelerometers; None where there are none, or none can be heard: over the link of no device."""
    if any(one.channel != LINK for one in accelerometers):
        return CardReader(accelerometers, source.floor, rings, rate_hz, block)
    if accelerometers and isinstance(source, DeviceFloor):
        return LinkReader(source.hear(accelerometers), source.floor, rings.measured, rate_hz, block)
    return None


def _write_new(ring: Ring, rows: NDArray[np.float32], begin: int, n: int) -> None:
    """Write `n` rows, the first of which is of frame `begin`, without those that the ring has; before them a gap."""
    ring.skip(begin)
    known = max(ring.written - begin, 0)  # at the start: what came in before anything was played
    if known < n:
        ring.write(rows[known:], n - known)
