"""Between a program and the shakers: nothing reaches a shaker but through here.

Each channel: level, DC block, limit of the running mean square, limit of the peak, ramps of start, stop and panic; and
silence where a value is not finite. Sample by sample, so that the result does not depend on the block.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import FADE, RAMP
from underfoot.kernels import inlined, kernel

DC_HZ = 5.0
"""Corner of the DC block: far below the 40 Hz from which the sole feels, far above drift."""
RMS_SECONDS, BURST_SECONDS = 0.5, 0.05
"""Time over which the mean square is taken, of the order of a voice coil's heating that one can still hear coming; and
time in which a signal's power is known. A shorter burst is left as it is."""
RELEASE_SECONDS = 0.1
"""Time in which a limited channel comes back."""

PANIC = 48
"""Frames in which a panic ramps down."""

_NEGLIGIBLE, _LARGEST = 1e-12, 100.0  # a state below the one is 0; input beyond the other is held to it

GAIN_RAMP = np.dtype(
    [("start", np.float64), ("target", np.float64), ("frame", np.float64), ("frames", np.float64)], align=True
)
"""A gain that goes straight from `start` to `target` in `frames` frames from session frame `frame` on."""

ROW = np.dtype(
    [
        ("channel", np.int64),
        ("peak_limit", np.float64),
        ("rms_limit", np.float64),
        ("scale", GAIN_RAMP),
        ("dc_in", np.float64),
        ("dc_out", np.float64),
        ("burst_square", np.float64),
        ("mean_square", np.float64),
        ("peak_gain", np.float64),
        ("peak", np.float64),
        ("silent_frame", np.int64),
    ],
    align=True,
)
"""A tile's limits, of full scale, and its `scale`, full scale per m/s^2; then its state: the DC block's last input and
output, the mean squares over `BURST_SECONDS` and `RMS_SECONDS`, the peak limiter's gain, a peak meter that falls by
half in a tenth of a second, and the frame since which it has been silent: -1 while it sounds. In silence only the two
means and the gain move, each along an exponential, and they are looked at when it sounds again."""

STAGE = np.dtype(
    [
        ("dc_pole", np.float64),
        ("burst_share", np.float64),
        ("rms_share", np.float64),
        ("release_share", np.float64),
        ("level", GAIN_RAMP),
        ("opening", GAIN_RAMP),
        ("faults", np.int64),
        ("sounding", np.int64),
    ],
    align=True,
)
"""What all rows share: the DC block's pole; what a frame adds to the two means and to a limited gain; level, opening,
how many values were not finite, and how many rows of the last stretch were not silent throughout."""


@dataclass(frozen=True)
class Limits:
    """What one channel may get, of full scale, and how many m/s^2 full scale is."""

    acceleration_per_unit: float = 20.0
    peak: float = 0.95
    rms: float = 0.35


SOUND = Limits(acceleration_per_unit=1.0)
"""Those of the channel for ears, which is given in parts of its full scale."""


class Safety:
    """The last stage for `limits`, one for each row; writes float32 [frame, channel] into `out`.

    `channels[row]` is the channel of a row, or -1 for a tile that has none; `sound_channel` is that of what is heard,
    which no row may have, or -1.
    """

    def __init__(
        self, limits: list[Limits], channels: list[int], rate_hz: float, block: int, width: int, sound_channel: int = -1
    ) -> None:
        self.out = np.zeros((block, width), np.float32)
        self.channels, self.sound_channel = np.array(channels, np.int64), sound_channel
        self._rows, self._sound = _rows(limits, channels), _rows([SOUND], [sound_channel])
        self.peaks = self._rows["peak"]
        """The largest sample of each row in the last tenth of a second, of full scale."""
        self.silent_since = self._rows["silent_frame"]
        """The frame since which each row is silent, -1 while it is not."""
        self._stage = np.zeros(1, STAGE)
        self._stage["dc_pole"] = math.exp(-2.0 * math.pi * DC_HZ / rate_hz)
        for name, seconds in (("burst", BURST_SECONDS), ("rms", RMS_SECONDS), ("release", RELEASE_SECONDS)):
            self._stage[f"{name}_share"] = 1.0 - math.exp(-1.0 / (seconds * rate_hz))
        self._stage["level"], self._stage["opening"] = (1.0, 1.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)
        self._level, self._opening = self._stage["level"], self._stage["opening"]

    def rescale(self, row: int, acceleration_per_unit: float, frame: int) -> None:
        """Let full scale of a row be so many m/s^2, in a ramp of 10 ms from `frame` on."""
        _turn(self._rows["scale"][row : row + 1], 1.0 / acceleration_per_unit, frame, FADE)

    def level(self, gain: float, frame: int) -> None:
        """Go to `gain`, 0 to 1, in a ramp from `frame` on; to silence if it is not a number."""
        _turn(self._level, min(max(gain, 0.0), 1.0) if math.isfinite(gain) else 0.0, frame, RAMP)

    def open(self, on: bool, frame: int) -> None:
        """Let sound out, or close, in a ramp of 10 ms from `frame` on. What is closing goes on as it was."""
        if on or self._opening["target"][0] != 0.0:
            _turn(self._opening, float(on), frame, FADE)

    def panic(self, frame: int) -> None:
        """Close in a ramp of 1 ms from `frame` on."""
        _turn(self._opening, 0.0, frame, PANIC)

    def closed(self, frame: int) -> bool:
        """Whether nothing is let out from `frame` on."""
        _, target, begun, length = self._opening[0].item()
        return bool(target == 0.0 and frame >= begun + length)

    @property
    def sounding(self) -> int:
        """How many rows were not silent throughout what was put out last."""
        return int(self._stage["sounding"][0])

    @property
    def faults(self) -> int:
        """How many values that were not finite have been silenced."""
        return int(self._stage["faults"][0])

    def apply(
        self, acceleration: NDArray[np.float64], zero_rows: NDArray[np.uint8], frame: int, at: int, n: int
    ) -> None:
        """Turn `n` frames of acceleration, float64 [row, frame] in m/s^2, into `out` from its row `at` on.

        `zero_rows` marks rows that are zero throughout. Rows on one channel add. Allocates nothing.
        """
        _limit(acceleration, zero_rows, self.out, self._rows, self._stage, frame, at, n)

    def apply_sound(self, sound: NDArray[np.float64], no_sound: NDArray[np.uint8], frame: int, at: int, n: int) -> None:
        """Turn `n` frames of sound, float64 [1, frame] of full scale, into its channel of `out`; after `apply`.

        `no_sound` (1,) says that it is zero throughout. Without a channel there is nothing to do. Allocates nothing.
        """
        if self.sound_channel >= 0:
            _limit_sound(sound, no_sound, self.out, self._sound, self._stage, frame, at, n)

    def commanded(
        self, acceleration: NDArray[np.float64], zero_rows: NDArray[np.uint8], out: NDArray[np.float32], frame: int,
        at: int, n: int,
    ) -> None:  # fmt: skip
        """What is asked of the tiles, m/s^2: as given to `apply`, but for level and opening; [frame, row] into `out`.

        Before an equaliser and without limits: what a tile that does what it is told measures. Allocates nothing.
        """
        _command(acceleration, zero_rows, out, self._rows, self._stage, frame, at, n)


def _rows(limits: list[Limits], channels: list[int]) -> NDArray[np.void]:
    """Rows with these limits, at rest."""
    rows = np.zeros(len(limits), ROW)
    rows["channel"], rows["peak_gain"], rows["silent_frame"] = channels, 1.0, -1
    for row, limit in zip(rows, limits, strict=True):
        row["peak_limit"], row["rms_limit"] = limit.peak, limit.rms
        row["scale"] = (1.0 / limit.acceleration_per_unit, 1.0 / limit.acceleration_per_unit, 0.0, 1.0)
    return rows


def _turn(ramp: NDArray[np.void], target: float, frame: int, frames: int) -> None:
    """Let the one ramp in an array go to `target` from where it is at `frame`."""
    start, goal, begun, length = ramp[0].item()
    now = start + (goal - start) * min(max((frame - begun) / length, 0.0), 1.0)
    ramp[0] = (now, target, frame, frames)


def limited(signal: NDArray[np.float64], rate_hz: float) -> NDArray[np.float64]:
    """A measuring signal (frames,), of full scale, as this stage lets it out: float64 (frames,).

    >>> bool(np.abs(limited(np.full(4800, 5.0), 48000.0)).max() <= Limits().peak)
    True
    """
    limits = Limits()
    stage = Safety([limits], [0], rate_hz, len(signal), 1)
    stage.open(True, -FADE)
    rows = np.ascontiguousarray(signal, dtype=np.float64)[None, :] * limits.acceleration_per_unit
    stage.apply(rows, np.zeros(1, np.uint8), 0, 0, len(signal))
    return stage.out[:, 0].astype(np.float64)


@kernel
def _along(ramp: np.record, frame: float) -> float:
    """Where a ramp is at a session frame."""
    share = min(max((frame - ramp.frame) / ramp.frames, 0.0), 1.0)
    return ramp.start + (ramp.target - ramp.start) * share


@kernel
def _limit(
    acceleration: NDArray[np.float64],
    zero_rows: NDArray[np.uint8],
    out: NDArray[np.float32],
    rows: NDArray[np.void],
    stages: NDArray[np.void],
    frame: int,
    at: int,
    n: int,
) -> None:
    for i in range(at, at + n):
        for j in range(out.shape[1]):
            out[i, j] = 0.0
    fall = 0.5 ** (n / 4800.0)
    sounding = 0
    for k in range(acceleration.shape[0]):
        row = rows[k]
        row.peak *= fall
        if row.channel < 0:
            continue
        if zero_rows[k] != 0 and row.dc_in == row.dc_out == 0.0:
            if row.silent_frame < 0:
                row.silent_frame = frame
            continue
        row.peak = max(row.peak, _limit_row(acceleration[k], out, row, stages[0], frame, at, n))
        sounding += 1
    stages[0].sounding = sounding


@kernel
def _limit_sound(
    sound: NDArray[np.float64],
    no_sound: NDArray[np.uint8],
    out: NDArray[np.float32],
    rows: NDArray[np.void],
    stages: NDArray[np.void],
    frame: int,
    at: int,
    n: int,
) -> None:
    row = rows[0]
    if no_sound[0] == 0 or row.dc_in != 0.0 or row.dc_out != 0.0:
        _limit_row(sound[0], out, row, stages[0], frame, at, n)
    elif row.silent_frame < 0:
        row.silent_frame = frame


@kernel
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
        gain = _along(stage.level, here) * _along(stage.opening, here)
        for k in range(acceleration.shape[0]):
            plays = zero_rows[k] == 0 and rows[k].channel >= 0 and math.isfinite(acceleration[k, i])
            out[at + i, k] = acceleration[k, i] * gain if plays else 0.0


@kernel
def _limit_row(
    acceleration: NDArray[np.float64],
    out: NDArray[np.float32],
    row: np.record,
    stage: np.record,
    frame: int,
    at: int,
    n: int,
) -> float:
    """Add one row's frames to its channel; returns the largest sample there."""
    # What the loop reads and writes is held in variables: in a record it would go through memory in every frame.
    channel, most, square = row.channel, row.peak_limit, row.rms_limit**2
    burst_share, rms_share, release_share = stage.burst_share, stage.rms_share, stage.release_share
    pole, spare = stage.dc_pole, stage.burst_share / stage.rms_share - 1.0
    scale, scaled_from = row.scale.target, row.scale.frame + row.scale.frames
    level, level_from = _along(stage.level, math.inf), stage.level.frame + stage.level.frames
    opening, open_from = _along(stage.opening, math.inf), stage.opening.frame + stage.opening.frames
    dc_in, dc_out, burst_square, mean_square = row.dc_in, row.dc_out, row.burst_square, row.mean_square
    peak_gain, silent_frame, largest = row.peak_gain, row.silent_frame, 0.0
    for i in range(n):
        here = frame + i
        now = acceleration[i] * (scale if here >= scaled_from else _along(row.scale, float(here)))
        if not math.isfinite(now):
            stage.faults += 1
            now = 0.0
        now = min(max(now, -_LARGEST), _LARGEST) * (level if here >= level_from else _along(stage.level, float(here)))
        if now == dc_in == dc_out == 0.0:
            if silent_frame < 0:
                silent_frame = here
            continue
        if silent_frame >= 0:
            silent = here - silent_frame
            burst_square = _decayed(burst_square, burst_share, silent)
            mean_square = _decayed(mean_square, rms_share, silent)
            peak_gain = 1.0 - _decayed(1.0 - peak_gain, release_share, silent)
            silent_frame = -1
        y = now - dc_in + pole * dc_out
        dc_in = now
        dc_out = y if abs(y) > _NEGLIGIBLE else 0.0
        burst_square = _toward(burst_square, y * y, burst_share)
        # What has not been used of the mean square may be spent in a burst, so that the mean itself keeps to it.
        allowed = square + max(square - mean_square, 0.0) * spare
        if burst_square > allowed:
            y *= math.sqrt(allowed / burst_square)
        gain = peak_gain + release_share * (1.0 - peak_gain)
        if gain > 1.0 - _NEGLIGIBLE:
            gain = 1.0
        if abs(y) * gain > most:
            gain = most / abs(y)
        peak_gain = gain
        y *= gain * (opening if here >= open_from else _along(stage.opening, float(here)))
        mean_square = _toward(mean_square, y * y, rms_share)
        y = min(max(y + out[at + i, channel], -most), most)
        largest = max(largest, abs(y))
        out[at + i, channel] = y
    row.dc_in, row.dc_out, row.burst_square, row.mean_square = dc_in, dc_out, burst_square, mean_square
    row.peak_gain, row.silent_frame = peak_gain, silent_frame
    return largest


@inlined
def _toward(mean: float, value: float, share: float) -> float:
    mean += share * (value - mean)
    return mean if mean > _NEGLIGIBLE else 0.0


@inlined
def _decayed(mean: float, share: float, frames: int) -> float:
    """What so many frames of silence leave of a mean."""
    left = mean * math.exp(frames * math.log1p(-share)) if mean != 0.0 else 0.0
    return left if left > _NEGLIGIBLE else 0.0
