"""One row of the safety stage: its state, and the processing of its samples.

`safety_lanes` does the same for eight rows at a time, bit for bit.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, inlined, part

NEGLIGIBLE, LARGEST = 1e-12, 100.0
"""States below the first are set to 0; input is clamped to the second."""

GAIN_RAMP = np.dtype(
    [("start", np.float64), ("target", np.float64), ("frame", np.float64), ("frames", np.float64)], align=True
)
"""A gain that ramps linearly from `start` to `target` in `frames` frames from session frame `frame` on."""

ROW = np.dtype(
    [
        ("channel", np.int64),
        ("adds", np.bool_),
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
"""A tile's channel, and whether it adds to an earlier row on that channel; its limits, relative to full scale, and its
`scale`, full scale per m/s^2; then its state: the DC block's last input and output, the mean squares over
`BURST_SECONDS` and `RMS_SECONDS`, the peak limiter's gain, a peak meter that halves in a tenth of a second, and the
frame since which it has been silent (-1 while it sounds). During silence only the two means and the gain change,
exponentially; they are updated when it sounds again.
"""

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
        ("sounded_until", np.int64),
        ("peak", np.float64),
    ],
    align=True,
)
"""Shared by all rows: the DC block's pole; the weights of a frame in the two means and in a limited gain; level,
opening, the number of values that were not finite, the number of tiles not silent throughout the last stretch,
the end of the last stretch with such a tile, and the largest peak of a tile.
"""


@inlined
def along(ramp: np.record, frame: float) -> float:
    """Return the value of a ramp at a session frame."""
    share = min(max((frame - ramp.frame) / ramp.frames, 0.0), 1.0)
    return ramp.start + (ramp.target - ramp.start) * share


@inlined
def is_still(row: np.record) -> bool:
    """Return whether a row's state has decayed to zero."""
    return row.dc_in == row.dc_out == 0.0


@part
def limit_row(
    acceleration: Floats,
    out: NDArray[np.float32],
    row: np.record,
    stage: np.record,
    level: Floats,
    opening: Floats,
    frame: int,
) -> None:
    """Add a row's frames, from session frame `frame` on, to its channel; `level` and `opening` are gains per frame."""
    # Keep the loop's values in variables: in a record they would go through memory in every frame.
    channel, most, square = row.channel, row.peak_limit, row.rms_limit**2
    burst_share, rms_share, release_share = stage.burst_share, stage.rms_share, stage.release_share
    pole, spare = stage.dc_pole, stage.burst_share / stage.rms_share - 1.0
    scale, scaled_from = row.scale.target, row.scale.frame + row.scale.frames
    dc_in, dc_out, burst_square, mean_square = row.dc_in, row.dc_out, row.burst_square, row.mean_square
    peak_gain, silent_frame, largest = row.peak_gain, row.silent_frame, row.peak
    for i in range(acceleration.size):
        here = frame + i
        now = acceleration[i] * (scale if here >= scaled_from else along(row.scale, float(here)))
        if not math.isfinite(now):
            stage.faults += 1
            now = 0.0
        now = min(max(now, -LARGEST), LARGEST) * level[i]
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
        dc_out = y if abs(y) > NEGLIGIBLE else 0.0
        burst_square = _toward(burst_square, y * y, burst_share)
        # A burst may use the remainder of the mean square, so that the mean itself stays within its limit.
        allowed = square + max(square - mean_square, 0.0) * spare
        if burst_square > allowed:
            y *= math.sqrt(allowed / burst_square)
        gain = peak_gain + release_share * (1.0 - peak_gain)
        if gain > 1.0 - NEGLIGIBLE:
            gain = 1.0
        if abs(y) * gain > most:
            gain = most / abs(y)
        peak_gain = gain
        y *= gain * opening[i]
        mean_square = _toward(mean_square, y * y, rms_share)
        y = min(max(y + out[i, channel], -most), most)
        largest = max(largest, abs(y))
        out[i, channel] = y
    row.dc_in, row.dc_out, row.burst_square, row.mean_square = dc_in, dc_out, burst_square, mean_square
    row.peak_gain, row.silent_frame, row.peak = peak_gain, silent_frame, largest


@inlined
def _toward(mean: float, value: float, share: float) -> float:
    mean += share * (value - mean)
    return mean if mean > NEGLIGIBLE else 0.0


@inlined
def _decayed(mean: float, share: float, frames: int) -> float:
    """Return a running mean after `frames` frames of silence."""
    left = mean * math.exp(frames * math.log1p(-share)) if mean != 0.0 else 0.0
    return left if left > NEGLIGIBLE else 0.0
