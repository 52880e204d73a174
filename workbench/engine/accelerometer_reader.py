"""Accelerometer readings during playback: m/s^2 per tile, aligned with the session frames of the command."""

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.accelerometers import LINK, Accelerometer
from underfoot.devices.device_floor import DeviceFloor
from underfoot.devices.force_source import ForceSource
from underfoot.devices.link_acceleration import LAG_S, LinkAcceleration
from underfoot.devices.sound import Stream, inputs_to_open
from underfoot.engine.alignment import NEAR_S, delay_of, split
from underfoot.engine.rings import Ring
from underfoot.engine.session_memory import SessionMemory
from underfoot.floor.layout import Floor

CHUNK_S = 0.3
"""Length of the stretch whose delay is estimated at once. Results lag by up to two stretches."""
MOST_DELAY_S = 2.0
"""Longest delay from output to input that is searched; the rings do not hold much more."""
TOO_LATE_S = 1.5
"""Delay beyond which the stream is reopened: only a card that lost many blocks and buffers its input is so late."""
_HISTORY_S = 3.0 * CHUNK_S + 1.0
"""Length of the input that is kept: the stretches that wait for `align`, and a second to spare."""


class CardReader:
    """Stores the input of each block; `align` writes it to a ring as float32 [frame, tile] in m/s^2.

    `recorded` is float32 [frame, input] in full scale: the player writes a block's input there. The input lags the
    output by `delay_frames`, and is written at the frames that it was played at. Tiles without an accelerometer have 0.
    The card or a sound server may lose frames: `align` then finds where, continues at the new delay, and counts
    `jumps`.
    """

    needs_stream = True
    """Whether it measures only while a sound card plays."""

    def __init__(
        self,
        accelerometers: tuple[Accelerometer, ...],
        floor: Floor,
        rings: SessionMemory,
        rate_hz: float,
        block: int,
        inputs: int,
    ) -> None:
        """Record that many `inputs`; the accelerometers may need fewer."""
        self.recorded = np.zeros((block, inputs), np.float32)
        self.delay_frames = 0
        self.jumps = 0
        self._chunk = round(CHUNK_S * rate_hz)
        self._most, self._near = round(MOST_DELAY_S * rate_hz), round(NEAR_S * rate_hz)
        self._too_late = round(TOO_LATE_S * rate_hz)
        self._rows = np.zeros((block * -(-round(_HISTORY_S * rate_hz) // block), len(floor.tiles)), np.float32)
        self._tiles = [floor.index(accelerometer.tile) for accelerometer in accelerometers]
        self._scales = [
            (self.recorded[:, accelerometer.channel], np.float32(accelerometer.m_s2_per_unit))
            for accelerometer in accelerometers
        ]
        self._origin = -1  # session frame of the first row
        self._begin = self._end = 0  # the session frames in `_rows`: from begin, up to end
        self._next = 0  # the first frame that is not written yet
        self.is_found = False
        """Whether a signal was found at `delay_frames`."""
        self._is_new = True  # whether the delay was found in a stretch that may contain another one
        self._ring, self._played = rings.measured, rings.vibration

    @property
    def is_too_late(self) -> bool:
        """Whether the input is about to lag too far behind to be aligned."""
        return self.delay_frames > self._too_late

    def write(self, frame: int, n: int) -> None:
        """Store the block that begins at session frame `frame`; whole blocks only. Allocates no arrays."""
        if self._origin < 0:
            self._origin = frame
        if frame != self._end:
            self._begin = frame
        at = (frame - self._origin) % len(self._rows)
        for tile, (recorded, scale) in zip(self._tiles, self._scales, strict=True):
            np.multiply(recorded, scale, out=self._rows[at : at + n, tile])
        self._end = frame + n

    def align(self) -> None:
        """Write all complete chunks. Not for the audio callback: it takes milliseconds."""
        begin, end = self._begin, self._end
        self._next = max(self._next, begin, end - len(self._rows) + self._chunk)
        while end - self._next >= 2 * self._chunk:
            self._align_chunk()

    def _align_chunk(self) -> None:
        """Write at most one chunk; the chunk after it shows whether the delay has changed."""
        first, middle, last = self._next, self._next + self._chunk, self._next + 2 * self._chunk
        delay, tile = self._found(middle, last)
        if delay is not None and delay != self.delay_frames:
            recorded = self._kept(first, last)[:, tile]
            before, behind = (_rows_of(self._played, first - d, last - d)[:, tile] for d in (self.delay_frames, delay))
            extra = max(delay - self.delay_frames, 0)  # silence, or repeated frames
            at = first + split(before, behind, recorded, extra)
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
        """Return the delay of the loudest tile's input, or None if it is undetermined, and that tile."""
        recorded = self._kept(begin, end)
        tile = max(self._tiles, key=lambda tile: float(np.dot(recorded[:, tile], recorded[:, tile])))
        played = np.ascontiguousarray(_rows_of(self._played, begin - self._most, end)[:, tile])
        recorded_there = np.ascontiguousarray(recorded[:, tile])
        return delay_of(played, recorded_there, self.delay_frames, self._near, is_new=self._is_new), tile

    def _kept(self, begin: int, end: int) -> NDArray[np.float32]:
        return self._rows[(np.arange(begin, end) - self._origin) % len(self._rows)]

    def _publish(self, begin: int, end: int) -> None:
        _write_new(self._ring, self._kept(begin, end), begin - self.delay_frames, end - begin)

    @staticmethod
    def delay_s(stream: Stream) -> float:
        """Return the latency in seconds from output to input, as reported by the stream."""
        return stream.round_trip_s


def _rows_of(ring: Ring, begin: int, end: int) -> NDArray[np.float32]:
    """Return past rows of a ring; 0 before its first and after its last row."""
    frames = np.arange(begin, end)
    rows = ring.rows[frames % len(ring.rows)]
    rows[(frames < 0) | (frames >= ring.written)] = 0.0
    return rows


class LinkReader:
    """Writes the acceleration received over the link to a ring, as `CardReader` does for a card, `LAG_S` later."""

    needs_stream = False
    recorded = None

    def __init__(self, acceleration: LinkAcceleration, floor: Floor, ring: Ring, rate_hz: float, block: int) -> None:
        self.delay_frames = 0
        self._ring = ring
        self._acceleration, self._lag_frames = acceleration, round(LAG_S * rate_hz)
        self._rows = np.zeros((block, len(floor.tiles)), np.float32)

    def write(self, frame: int, n: int) -> None:
        """Write the block that began `LAG_S` before session frame `frame`, if it is complete. Allocates no arrays."""
        end_frame = frame - self._lag_frames
        self._acceleration.fill(self._rows, end_frame, n)
        _write_new(self._ring, self._rows, end_frame - self.delay_frames, n)

    @staticmethod
    def delay_s(stream: Stream) -> float:
        """Return the latency in seconds from the output to the tile, as reported by the stream."""
        return stream.latency_s


AccelerometerReader = CardReader | LinkReader


def reader_of(
    accelerometers: tuple[Accelerometer, ...],
    source: ForceSource,
    rings: SessionMemory,
    rate_hz: float,
    block: int,
    card: str = "",
) -> AccelerometerReader | None:
    """Return the reader of these accelerometers, which may be on inputs of a `card`; None if there are none or the
    source is not a device.
    """
    if any(accelerometer.channel != LINK for accelerometer in accelerometers):
        inputs = inputs_to_open(card, max(accelerometer.channel for accelerometer in accelerometers))
        return CardReader(accelerometers, source.floor, rings, rate_hz, block, inputs)
    if accelerometers and isinstance(source, DeviceFloor):
        return LinkReader(source.accelerations_of(accelerometers), source.floor, rings.measured, rate_hz, block)
    return None


def _write_new(ring: Ring, rows: NDArray[np.float32], begin: int, n: int) -> None:
    """Write the first `n` rows, from frame `begin` on, except those already in the ring; skip frames missing before."""
    ring.skip(begin)
    known = max(ring.written - begin, 0)  # at the start: input from before anything was played
    if known < n:
        ring.write(rows[known:], n - known)
