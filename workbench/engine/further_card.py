"""A further sound card, which plays some of the engine's channels on its own clock.

The first card's clock is the session's. A further card requests frames at a slightly different rate; a resampler reads
the engine's output at that rate, and adjusts its ratio to keep a constant delay behind the engine.
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
"""Frames of the engine that are kept: 0.7 s at 48 kHz."""
_PULL_HZ = 0.05
"""Bandwidth of the delay control: low enough to keep its pitch changes below the sensation threshold, high enough that
a drift of 200 ppm shifts the delay by less than 1 ms.
"""
_MOST_RATIO = 0.005
"""Largest deviation of the resampling ratio from 1."""
_SETTLED_S = 0.5
"""Seconds for which both clocks are observed before the first frame is played."""
_FAR_S = 0.01
"""Deviation in seconds beyond which the delay is not controlled but reset, with a ramp to silence and back."""
_MORE_S, _MOST_S = 0.005, 0.2
"""Each underrun lengthens the delay by `_MORE_S`, up to `_MOST_S`."""


class FurtherCard:
    """The engine's frames for the callback of another card.

    The engine calls `write` after each block, the card's stream calls `fill`. `delay_frames` is the nominal delay
    behind the engine, `offset_frames` the present deviation from it, `underruns` the number of times there was nothing
    to play.
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
        self._is_reading = self._is_silenced = False
        resampled(self._ring, 8.0, 1.0, self._gain.copy(), self._out, self._weights)  # loads the kernel

    @property
    def drift_ppm(self) -> float:
        """Estimated drift of the card's clock against the engine's, in ppm; positive if the card is faster."""
        return 1e6 * (self._own.rate_hz / self._engine.rate_hz - 1.0)

    @property
    def asked(self) -> int:
        """Number of frames that the present stream has asked for."""
        return self._played

    def begin(self, latency_s: float) -> None:
        """Prepare for a new stream of this latency."""
        self.delay_frames = 2.0 * len(self._out) + SPAN + latency_s * self.rate_hz
        self._own, self._played = BlockClock(self.rate_hz), 0
        self._is_reading = False
        self._gain[0] = 0.0

    def silence(self, *, on: bool) -> None:
        """Ramp the output down in `PANIC` frames, or open it again."""
        self._is_silenced = on

    def write(self, out: NDArray[np.float32], n: int) -> None:
        """Store the first `n` frames of `out`, float32 [frame, channel of the floor]."""
        first, at = self.card.first, self._written % _FRAMES
        until_end = min(n, _FRAMES - at)
        self._ring[at : at + until_end] = out[:until_end, first : first + self.card.count]
        self._ring[: n - until_end] = out[until_end:n, first : first + self.card.count]
        self._written += n
        self._engine.update(self._now_s(), self._written)

    def fill(self) -> int:
        """Compute the card's next block, and return its address; the stream's callback."""
        now_s, n = self._now_s(), len(self._out)
        self._own.update(now_s, self._played)
        self._played += n
        if not self._is_reading:
            self._begin_reading(now_s)
        ratio = self._ratio(now_s) if self._is_reading else 1.0
        is_far = abs(self.offset_frames) > _FAR_S * self.rate_hz
        self._gain[1] = 0.0 if is_far or self._is_silenced else 1.0
        if not self._is_reading or self._position + ratio * n + BEHIND + 1 > self._written:
            self._handle_underrun()
            return self._address
        resampled(self._ring, self._position, ratio, self._gain, self._out, self._weights)
        self._position += ratio * n
        if is_far and self._gain[0] == 0.0:
            self._is_reading = False
        return self._address

    def _begin_reading(self, now_s: float) -> None:
        """Start reading `delay_frames` behind the engine, once enough frames are stored."""
        position = self._engine.frame_at(now_s) - self.delay_frames
        oldest = self._written - _FRAMES + BEFORE + 1
        settled = min(self._engine.age_s, self._own.age_s) >= _SETTLED_S
        self._is_reading = settled and position >= max(oldest, BEFORE)
        if self._is_reading:
            self._position = position + self._played - len(self._out) - self._own.frame_at(now_s)
            self.offset_frames = 0.0

    def _ratio(self, now_s: float) -> float:
        """Return engine frames per card frame: the ratio of the clock rates, with a correction of the delay's
        deviation.
        """
        ratio = self._engine.rate_hz / self._own.rate_hz
        ahead = self._played - len(self._out) - self._own.frame_at(now_s)
        self.offset_frames = self._engine.frame_at(now_s) - self.delay_frames - (self._position - ratio * ahead)
        pull = 2.0 * np.pi * _PULL_HZ * self.offset_frames / self.rate_hz
        return min(max(ratio + pull, 1.0 - _MOST_RATIO), 1.0 + _MOST_RATIO)

    def _handle_underrun(self) -> None:
        """Handle an underrun: silence for this block, and, unless it is silenced, a longer delay from then on."""
        self._out[:] = 0.0
        self._gain[0] = 0.0
        if self._is_reading and not self._is_silenced:
            self.underruns += 1
            self.delay_frames = min(self.delay_frames + _MORE_S * self.rate_hz, _MOST_S * self.rate_hz)
        self._is_reading = False
