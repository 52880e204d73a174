"""A further sound card: it plays some of the engine's channels on a clock of its own.

The first card's clock is the session's. A further card asks for frames a little faster or slower; what the engine made
is read at that pace, by a resampler whose ratio keeps it a constant delay behind the engine.
"""

import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import SPAN
from underfoot.devices.block_clock import BlockClock
from underfoot.devices.outputs import CardChannels
from underfoot.engine.safety import PANIC
from underfoot.models.filtering.resampling import BEFORE, BEHIND, resampled

_FRAMES = 1 << 15
_PULL_HZ = 0.05
"""Bandwidth with which a deviation from the delay is taken back: slow enough that its changes of pitch stay below what
is felt, fast enough that 200 ppm amount to less than a millisecond."""
_MOST_RATIO = 0.005
_SETTLED_S = 0.5
"""How long both clocks are watched before the first frame is played."""
_FAR_S = 0.01
"""A deviation beyond this is not taken back but jumped over, in a ramp to silence and back."""
_MORE_S, _MOST_S = 0.005, 0.2
"""An underrun lengthens the delay by the first, up to the second."""


class FurtherCard:
    """Frames from the engine, for the callback of another card.

    `write` is called by the engine after each block, `fill` by the card's stream. `delay_frames` is by how much the
    card is behind the engine, `offset_frames` how far it is from that now, `underruns` how often there was nothing to
    play.
    """

    def __init__(
        self, card: CardChannels, rate_hz: float, block: int, now_s: Callable[[], float] = time.perf_counter
    ) -> None:
        self.card = card
        self.delay_frames, self.offset_frames, self.underruns = 0.0, 0.0, 0
        self.rate_hz, self._now_s = rate_hz, now_s
        self._ring = np.zeros((_FRAMES, card.count), np.float32)
        self._out = np.zeros((block, card.count), np.float32)
        self._address = self._out.ctypes.data
        self._gain, self._weights = np.array((0.0, 1.0, 1.0 / PANIC)), np.zeros(6)
        self._written, self._played, self._position = 0, 0, 0.0
        self._engine, self._own = BlockClock(rate_hz), BlockClock(rate_hz)
        self._is_seated = self._is_silenced = False
        resampled(self._ring, 8.0, 1.0, self._gain.copy(), self._out, self._weights)  # loaded here, not in the callback

    @property
    def drift_ppm(self) -> float:
        """How much faster the card's clock goes than the engine's, as it seems, in parts of a million."""
        return 1e6 * (self._own.rate_hz / self._engine.rate_hz - 1.0)

    def begin(self, latency_s: float) -> None:
        """A stream begins, which says that it asks `latency_s` ahead."""
        self.delay_frames = 2.0 * len(self._out) + SPAN + latency_s * self.rate_hz
        self._own, self._played = BlockClock(self.rate_hz), 0
        self._is_seated = False
        self._gain[0] = 0.0

    def silence(self, on: bool) -> None:
        """Ramp down in a millisecond what is still to come, or let it out again."""
        self._is_silenced = on

    def write(self, out: NDArray[np.float32], n: int) -> None:
        """Take the first `n` frames of `out`, float32 [frame, channel of the floor]."""
        first, at = self.card.first, self._written % _FRAMES
        until_end = min(n, _FRAMES - at)
        self._ring[at : at + until_end] = out[:until_end, first : first + self.card.count]
        self._ring[: n - until_end] = out[until_end:n, first : first + self.card.count]
        self._written += n
        self._engine.update(self._now_s(), self._written)

    def fill(self) -> int:
        """The stream's callback: the address of the card's next block."""
        now_s, n = self._now_s(), len(self._out)
        self._own.update(now_s, self._played)
        self._played += n
        if not self._is_seated:
            self._seat(now_s)
        ratio = self._ratio(now_s) if self._is_seated else 1.0
        is_far = abs(self.offset_frames) > _FAR_S * self.rate_hz
        self._gain[1] = 0.0 if is_far or self._is_silenced else 1.0
        if not self._is_seated or self._position + ratio * n + BEHIND + 1 > self._written:
            self._fall_silent()
            return self._address
        resampled(self._ring, self._position, ratio, self._gain, self._out, self._weights)
        self._position += ratio * n
        if is_far and self._gain[0] == 0.0:
            self._is_seated = False
        return self._address

    def _seat(self, now_s: float) -> None:
        """Begin to read, `delay_frames` behind the engine, once there is as much."""
        position = self._engine.frame_at(now_s) - self.delay_frames
        oldest = self._written - _FRAMES + BEFORE + 1
        settled = min(self._engine.age_s, self._own.age_s) >= _SETTLED_S
        self._is_seated = settled and position >= max(oldest, BEFORE)
        if self._is_seated:
            self._position = position + self._played - len(self._out) - self._own.frame_at(now_s)
            self.offset_frames = 0.0

    def _ratio(self, now_s: float) -> float:
        """Frames of the engine a frame of the card: what both clocks say, and what takes the deviation back."""
        ratio = self._engine.rate_hz / self._own.rate_hz
        ahead = self._played - len(self._out) - self._own.frame_at(now_s)
        self.offset_frames = self._engine.frame_at(now_s) - self.delay_frames - (self._position - ratio * ahead)
        pull = 2.0 * np.pi * _PULL_HZ * self.offset_frames / self.rate_hz
        return min(max(ratio + pull, 1.0 - _MOST_RATIO), 1.0 + _MOST_RATIO)

    def _fall_silent(self) -> None:
        """Nothing is there to play: silence for a block, and then a longer delay."""
        self._out[:] = 0.0
        self._gain[0] = 0.0
        if self._is_seated:
            self.underruns += 1
            self.delay_frames = min(self.delay_frames + _MORE_S * self.rate_hz, _MOST_S * self.rate_hz)
            self._is_seated = False
