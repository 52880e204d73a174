"""The safety stage between a program and the shakers: nothing reaches a shaker in any other way.

Each channel: level, DC block, limit of the running mean square, peak limit, ramps for start, stop and panic, and
silence where a value is not finite. It runs sample by sample, so the result does not depend on the block.
"""

import math
from typing import Annotated, NamedTuple

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.array_tables import F1, addresses, arrays_at
from underfoot.clock import FADE, RAMP
from underfoot.engine.safety_lanes import ROWS, WORK, limit_group
from underfoot.engine.safety_rows import NEGLIGIBLE, ROW, STAGE, along, is_still
from underfoot.floor.profile import NOMINAL_ACCELERATION
from underfoot.kernels import block_kernel

DC_HZ = 5.0
"""Corner frequency of the DC block: far below the 40 Hz from which the sole feels, far above drift."""
RMS_SECONDS, BURST_SECONDS = 0.5, 0.05
"""Averaging times of the mean square: the first is of the order of a voice coil's heating; over the second, a signal's
power is estimated. Shorter bursts pass unchanged.
"""
RELEASE_SECONDS = 0.1
"""Release time of a limited channel."""
METER_SECONDS = 0.1
"""Time in which a peak meter halves."""

PANIC = 48
"""Frames of the ramp at a panic."""


class Limits(Struct, frozen=True):
    """Limits of one channel, relative to full scale, and the acceleration of full scale in m/s^2."""

    acceleration_per_unit: float = NOMINAL_ACCELERATION
    peak: float = 0.95
    rms: float = 0.35


SOUND = Limits(acceleration_per_unit=1.0)
"""Limits of the Sound channel, whose input is relative to full scale."""


class SafetyMemory(NamedTuple):
    """All arrays that the kernel reads and writes besides its arguments, as `array_tables` passes them."""

    out: Annotated[np.ndarray, np.dtype(np.float32), 2]
    rows: Annotated[np.ndarray, ROW, 1]
    stage: Annotated[np.ndarray, STAGE, 1]
    members: Annotated[np.ndarray, np.dtype(np.int64), 2]
    work: F1


class Safety:
    """The safety stage with `limits` per row; writes float32 [frame, channel] into `out`.

    `channels[row]` is the channel of a row, or -1 for a tile without one; `sound_channel` is that of Sound, which no
    row may use, or -1.
    """

    def __init__(
        self, limits: list[Limits], channels: list[int], rate_hz: float, block: int, width: int, sound_channel: int = -1
    ) -> None:
        self.out = np.zeros((block, width), np.float32)
        self.channels, self.sound_channel = np.array(channels, np.int64), sound_channel
        self._rows = _rows([*limits, SOUND], [*channels, sound_channel])
        self.peaks = self._rows["peak"][:-1]
        """Peak of each row in the last tenth of a second, relative to full scale."""
        self.silent_since = self._rows["silent_frame"][:-1]
        """Frame since which each row has been silent; -1 while it is not."""
        self._stage = np.zeros(1, STAGE)
        self._stage["dc_pole"] = math.exp(-2.0 * math.pi * DC_HZ / rate_hz)
        for name, seconds in (("burst", BURST_SECONDS), ("rms", RMS_SECONDS), ("release", RELEASE_SECONDS)):
            self._stage[f"{name}_share"] = 1.0 - math.exp(-1.0 / (seconds * rate_hz))
        self._stage["peak_fall"] = 0.5 ** (1.0 / (METER_SECONDS * rate_hz))
        self._stage["level"], self._stage["opening"] = (1.0, 1.0, 0.0, 1.0), (0.0, 0.0, -1.0, 1.0)
        self._peak, self._sounded_until = self._stage["peak"], self._stage["sounded_until"]
        self._level, self._opening = self._stage["level"], self._stage["opening"]
        self._memory = SafetyMemory(
            self.out, self._rows, self._stage, np.zeros((2, ROWS), np.int64), WORK.zeros().values
        )
        self._where = addresses(self._memory)
        self._limit = _limit.specialised(self._where, np.zeros((1, 1)), np.zeros(1, np.uint8), 0, 0, 0)

    def rescale(self, row: int, acceleration_per_unit: float, frame: int) -> None:
        """Fade the acceleration of a row's full scale to this value (m/s^2) from `frame` on."""
        _turn(self._rows["scale"][row : row + 1], 1.0 / acceleration_per_unit, frame, FADE)

    def level(self, gain: float, frame: int) -> None:
        """Ramp to `gain`, 0 to 1, from `frame` on; to silence if it is not a number.

        While the outputs are closed it is set at once: otherwise, outputs opened in the same frame would begin at the
        old level.
        """
        gain = min(max(gain, 0.0), 1.0) if math.isfinite(gain) else 0.0
        if not self.closed(frame):
            _turn(self._level, gain, frame, RAMP)
            return
        before = _at(self._level, frame)
        for state in (self._rows["dc_in"], self._rows["dc_out"]):  # of the DC block, which is linear
            state *= gain / before if before > 0.0 else 0.0
        self._level[0] = (gain, gain, frame, RAMP)

    def open(self, frame: int) -> None:
        """Fade the outputs in from `frame` on."""
        _turn(self._opening, 1.0, frame, FADE)

    def close(self, frame: int) -> None:
        """Fade the outputs out from `frame` on. A fade out that has begun continues unchanged."""
        if self._opening["target"][0] != 0.0:
            _turn(self._opening, 0.0, frame, FADE)

    def panic(self, frame: int) -> None:
        """Close the outputs in a ramp of `PANIC` frames from `frame` on."""
        _turn(self._opening, 0.0, frame, PANIC)

    def closed(self, frame: int) -> bool:
        """Return whether the outputs are closed from `frame` on."""
        _, target, begun, length = self._opening[0].item()
        return bool(target == 0.0 and frame >= begun + length)

    @property
    def sounding(self) -> int:
        """Number of rows that were not silent throughout the last output."""
        return int(self._stage["sounding"][0])

    @property
    def sounded_until(self) -> int:
        """Session frame from which on all rows have been silent: the end of the last output in which one was not."""
        return int(self._sounded_until.item())

    @property
    def peak(self) -> float:
        """The largest of `peaks`."""
        return float(self._peak.item())

    @property
    def faults(self) -> int:
        """Number of values silenced because they were not finite."""
        return int(self._stage["faults"][0])

    def apply(
        self, acceleration: NDArray[np.float64], zero_rows: NDArray[np.uint8], frame: int, at: int, n: int
    ) -> None:
        """Process `n` frames of acceleration, float64 [row, frame] in m/s^2, into `out` from its row `at` on.

        A row after those of the tiles is Sound, relative to full scale. `zero_rows` marks rows that are zero
        throughout. Rows with the same channel are added. Allocates nothing.
        """
        self._limit(self._where, acceleration, zero_rows, frame, at, n)

    def commanded(
        self, acceleration: NDArray[np.float64], zero_rows: NDArray[np.uint8], out: NDArray[np.float32], frame: int,
        at: int, n: int,
    ) -> None:  # fmt: skip
        """Write the commanded acceleration of the tiles, m/s^2, [frame, row], into `out`: with level and opening only.

        It is taken before equaliser and limits: what an ideal tile would measure. Allocates nothing.
        """
        _command(acceleration, zero_rows, out, self._rows, self._stage, frame, at, n)


def _rows(limits: list[Limits], channels: list[int]) -> NDArray[np.void]:
    """Return rows with these limits, at rest."""
    rows = np.zeros(len(limits), ROW)
    rows["channel"], rows["peak_gain"], rows["silent_frame"] = channels, 1.0, -1
    rows["adds"] = [channel in channels[:k] for k, channel in enumerate(channels)]
    for row, limit in zip(rows, limits, strict=True):
        row["peak_limit"], row["rms_limit"] = limit.peak, limit.rms
        row["scale"] = (1.0 / limit.acceleration_per_unit, 1.0 / limit.acceleration_per_unit, 0.0, 1.0)
    return rows


def _turn(ramp: NDArray[np.void], target: float, frame: int, frames: int) -> None:
    """Ramp the single ramp in an array from its value at `frame` to `target`."""
    ramp[0] = (_at(ramp, frame), target, frame, frames)


def _at(ramp: NDArray[np.void], frame: int) -> float:
    """Return the value of the single ramp in an array."""
    start, goal, begun, length = ramp[0].item()
    return float(start + (goal - start) * min(max((frame - begun) / length, 0.0), 1.0))


def limited(signal: NDArray[np.float64], rate_hz: float) -> NDArray[np.float64]:
    """Return a measuring signal (frames,), relative to full scale, as this stage outputs it: float64 (frames,).

    >>> bool(np.abs(limited(np.full(4800, 5.0), 48000.0)).max() <= Limits().peak)
    True
    """
    limits = Limits()
    stage = Safety([limits], [0], rate_hz, len(signal), 1)
    stage.open(-FADE)
    rows = np.ascontiguousarray(signal, dtype=np.float64)[None, :] * limits.acceleration_per_unit
    stage.apply(rows, np.zeros(1, np.uint8), 0, 0, len(signal))
    return stage.out[:, 0].astype(np.float64)


_work_at = WORK.at
_memory_at = arrays_at(SafetyMemory)


@block_kernel
def _limit(
    where: NDArray[np.int64],
    acceleration: NDArray[np.float64],
    zero_rows: NDArray[np.uint8],
    frame: int,
    at: int,
    n: int,
) -> None:
    """Implement `Safety.apply`: groups of neighbouring rows, those that are not silent."""
    m = _memory_at(where)
    out, rows, stages, members, work = m.out, m.rows, m.stage, m.members, _work_at(m.work, ())
    for i in range(at, min(at + n, stages[0].written)):
        for j in range(out.shape[1]):
            out[i, j] = 0.0
    if stages[0].written <= at + n:
        stages[0].written = min(stages[0].written, at)
    fall = stages[0].peak_fall ** n
    sounding, count = 0, 0
    for k in range(len(acceleration)):
        row = rows[k]
        row.peak = row.peak * fall if row.peak > NEGLIGIBLE else 0.0  # else it ends at the least float64
        if row.channel < 0:
            continue
        if zero_rows[k] != 0 and is_still(row):
            if row.silent_frame < 0:
                row.silent_frame = frame
            continue
        sounding += k < len(rows) - 1
        if count == ROWS or (count > 0 and row.adds):
            limit_group(acceleration, out, rows, members, count, stages[0], work, (frame, at, n))
            count = 0
        members[0, count] = k
        count += 1
    if count > 0:
        limit_group(acceleration, out, rows, members, count, stages[0], work, (frame, at, n))
        stages[0].written = max(stages[0].written, at + n)
    stages[0].sounding, stages[0].peak = sounding, 0.0
    if sounding > 0:
        stages[0].sounded_until = frame + n
    for k in range(len(rows) - 1):
        stages[0].peak = max(stages[0].peak, rows[k].peak)


@block_kernel
def _command(
    acceleration: NDArray[np.float64],
    zero_rows: NDArray[np.uint8],
    out: NDArray[np.float32],
    rows: NDArray[np.void],
    stages: NDArray[np.void],
    frame: int,
    at: int,
    n: int,
) -> None:
    stage = stages[0]
    for i in range(n):
        here = float(frame + i)
        gain = along(stage.level, here) * along(stage.opening, here)
        for k in range(acceleration.shape[0]):
            plays = zero_rows[k] == 0 and rows[k].channel >= 0 and math.isfinite(acceleration[k, i])
            out[at + i, k] = acceleration[k, i] * gain if plays else 0.0
