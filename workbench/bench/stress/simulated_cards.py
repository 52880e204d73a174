"""An engine and a further sound card in simulated time, independent of the machine's load."""

import ctypes
from collections import deque

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import RATE_HZ
from underfoot.devices.outputs import CardChannels, Output
from underfoot.engine.further_card import FurtherCard

BLOCK, AT_ONCE = 128, 4
LATEST_S = 0.004
"""Both request `AT_ONCE` blocks at a time, with delays up to this."""
HUM_HZ, STEADY = 200.0, 0.5


class SimulatedCards:
    """An engine, and a card of `channels` whose clock is `ppm` fast.

    The card's first channel is a tone of `HUM_HZ`, the others are constant. `events` are the times at which the engine
    (False) or the card (True) requests a block. `offsets_s` holds the card's clock offset at each of its blocks, in
    seconds.
    """

    def __init__(self, ppm: float, seconds: float, channels: int = 2) -> None:
        draws = np.random.default_rng(1)
        self.now_s = 0.0
        self.card = FurtherCard(CardChannels(Output("card"), 1, channels), RATE_HZ, BLOCK, lambda: self.now_s)
        self.card.begin(0.02)
        engine, own = (_times(rate_hz, seconds, draws) for rate_hz in (RATE_HZ, RATE_HZ * (1.0 + 1e-6 * ppm)))
        whose = np.append(np.zeros(len(engine), bool), np.ones(len(own), bool))
        times = np.append(engine, own)
        order = np.argsort(times, kind="stable")
        self.events: deque[tuple[float, bool]] = deque(zip(times[order].tolist(), whose[order].tolist(), strict=True))
        self.offsets_s: list[float] = []
        self._written = 0

    def run(self, until_s: float = np.inf) -> NDArray[np.float32]:
        """Simulate until `until_s`, or to the end; return the card's output since the last call, [frame, channel]."""
        channels = self.card.card.count
        out = np.full((BLOCK, channels + 1), STEADY, np.float32)
        played = []
        while self.events and self.events[0][0] < until_s:
            self.now_s, is_card = self.events.popleft()
            if is_card:
                block = (ctypes.c_float * (BLOCK * channels)).from_address(self.card.fill())
                self.offsets_s.append(self.card.offset_frames / RATE_HZ)
                played.append(np.ctypeslib.as_array(block).reshape(BLOCK, channels).copy())
            else:
                frames = np.arange(self._written, self._written + BLOCK)
                out[:, 1] = np.sin(2.0 * np.pi * HUM_HZ * frames / RATE_HZ)
                self.card.write(out, BLOCK)
                self._written += BLOCK
        return np.concatenate(played)


def _times(rate_hz: float, seconds: float, draws: np.random.Generator) -> NDArray[np.float64]:
    blocks = np.arange(int(seconds * rate_hz / BLOCK))
    due_s = (blocks // AT_ONCE) * AT_ONCE * BLOCK / rate_hz
    return np.maximum.accumulate(due_s + draws.uniform(0.0, LATEST_S, len(blocks)))
