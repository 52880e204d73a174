"""Short bursts on single tiles, by which a person identifies them."""

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import block_kernel

PULSE_HZ, PULSE_S, PULSE_M_S2 = 60.0, 0.25, 8.0
"""Frequency, length and peak of the burst, whose envelope is a squared sine."""


class TilePulse:
    """Bursts on any of `rows` tiles."""

    def __init__(self, rows: int, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._start_frames, self._end_frame = np.full(rows, -1, np.int64), 0
        _add_pulses(np.zeros((0, 1)), np.zeros(0, np.uint8), self._start_frames, 0, 0, rate_hz)  # loads the kernel

    def start(self, row: int, frame: int) -> None:
        """Start a burst on a tile at `frame`."""
        self._start_frames[row] = frame
        self._end_frame = frame + round(PULSE_S * self._rate_hz) + 1

    def apply(self, acceleration: NDArray[np.float64], zero_rows: NDArray[np.uint8], frame: int, n: int) -> None:
        """Add the bursts to `n` frames of float64 [row, frame], in m/s^2; clear the zero marks of their rows."""
        if frame < self._end_frame:
            _add_pulses(acceleration, zero_rows, self._start_frames, frame, n, self._rate_hz)


@block_kernel
def _add_pulses(
    acceleration: NDArray[np.float64],
    zero_rows: NDArray[np.uint8],
    start_frames: NDArray[np.int64],
    frame: int,
    n: int,
    rate_hz: float,
) -> None:
    for row in range(acceleration.shape[0]):
        if start_frames[row] < 0:
            continue
        zero_rows[row] = 0
        for i in range(n):
            now_s = (frame + i - start_frames[row]) / rate_hz
            if 0.0 <= now_s < PULSE_S:
                window = np.sin(np.pi * now_s / PULSE_S) ** 2
                acceleration[row, i] += PULSE_M_S2 * window * np.sin(2.0 * np.pi * PULSE_HZ * now_s)
        if frame + n - start_frames[row] > PULSE_S * rate_hz:
            start_frames[row] = -1
