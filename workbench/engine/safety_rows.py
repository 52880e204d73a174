"""The rule of the safety stage, for as many rows as there are numbers in a vector, and its use on one row.

`safety_lanes` uses it on four or eight rows at a time, with the same bits.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, inlined, kernel
from underfoot.lanes import all_one, anywhere, chosen, full_like, magnitudes, roots, total

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
        ("peak_fall", np.float64),
        ("level", GAIN_RAMP),
        ("opening", GAIN_RAMP),
        ("faults", np.int64),
        ("sounding", np.int64),
        ("sounded_until", np.int64),
        ("peak", np.float64),
        ("written", np.int64),
    ],
    align=True,
)
"""Shared by all rows: the DC block's pole; the weights of a frame in the two means and in a limited gain; by what
peak meters fall in a frame; level, opening, the number of values that were not finite, the number of tiles not silent
throughout the last stretch, the end of the last stretch with such a tile, and the largest peak of a tile. All frames of
the output are zero from number `written` on.
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


@kernel
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
    channel, silent_frame = row.channel, row.silent_frame
    scale, scaled_from = row.scale.target, row.scale.frame + row.scale.frames
    limits = limits_of(stage, all_one(row.peak_limit), all_one(row.rms_limit**2))
    dc, squares = (all_one(row.dc_in), all_one(row.dc_out)), (all_one(row.burst_square), all_one(row.mean_square))
    gain, peak = all_one(row.peak_gain), all_one(row.peak)
    for i in range(acceleration.size):
        here = frame + i
        now = acceleration[i] * (scale if here >= scaled_from else along(row.scale, float(here)))
        if not math.isfinite(now):
            stage.faults += 1
            now = 0.0
        now = min(max(now, -LARGEST), LARGEST) * level[i]
        if now == total(dc[0]) == total(dc[1]) == 0.0:
            if silent_frame < 0:
                silent_frame = here
            continue
        if silent_frame >= 0:
            silent = here - silent_frame
            burst_square = _decayed(total(squares[0]), stage.burst_share, silent)
            mean_square = _decayed(total(squares[1]), stage.rms_share, silent)
            squares = all_one(burst_square), all_one(mean_square)
            gain = all_one(1.0 - _decayed(1.0 - total(gain), stage.release_share, silent))
            silent_frame = -1
        before = all_one(out[i, channel])
        y, dc, squares, gain, peak = limited(all_one(now), before, opening[i], limits, dc, squares, gain, peak)
        out[i, channel] = total(y)
    row.dc_in, row.dc_out = total(dc[0]), total(dc[1])
    row.burst_square, row.mean_square = total(squares[0]), total(squares[1])
    row.peak_gain, row.silent_frame, row.peak = total(gain), silent_frame, total(peak)


@inlined
def limits_of(stage: np.record, most: Floats, square: Floats) -> tuple[Floats, ...]:
    """Return the limits of rows as `limited` takes them: of peak and mean square, shares of a frame, spare, DC pole."""
    burst, rms, release = stage.burst_share, stage.rms_share, stage.release_share
    shares = full_like(most, burst), full_like(most, rms), full_like(most, release)
    return most, square, *shares, full_like(most, burst / rms - 1.0), full_like(most, stage.dc_pole)


@inlined
def limited(
    now: Floats,
    before: Floats,
    opening: float,
    limits: tuple[Floats, ...],
    dc: tuple[Floats, Floats],
    squares: tuple[Floats, Floats],
    gain: Floats,
    peak: Floats,
) -> tuple[Floats, tuple[Floats, Floats], tuple[Floats, Floats], Floats, Floats]:
    """Return a frame behind DC block and limits, added to what was there `before`, and the rows' state after it.

    The state as in `ROW`: the DC block's last input and output, both mean squares, the peak limiter's gain, the peak.
    """
    most, square, burst_share, rms_share, release_share, spare, pole = limits
    zero, one = full_like(now, 0.0), full_like(now, 1.0)
    y = now - dc[0] + pole * dc[1]
    dc = now, chosen(magnitudes(y) > full_like(now, NEGLIGIBLE), y, zero)
    burst_square = _toward(squares[0], y * y, burst_share)
    # A burst may use the remainder of the mean square, so that the mean itself stays within its limit.
    allowed = square + larger(square - squares[1], zero) * spare
    is_over = burst_square > allowed
    if anywhere(is_over):
        y = chosen(is_over, y * roots(allowed / burst_square), y)
    gain = gain + release_share * (one - gain)
    gain = chosen(gain > full_like(now, 1.0 - NEGLIGIBLE), one, gain)
    is_above = magnitudes(y) * gain > most
    if anywhere(is_above):
        gain = chosen(is_above, most / magnitudes(y), gain)
    y = y * (gain * full_like(now, opening))
    squares = burst_square, _toward(squares[1], y * y, rms_share)
    y = held(y + before, most)
    return y, dc, squares, gain, larger(peak, magnitudes(y))


@inlined
def held(value: Floats, most: Floats) -> Floats:
    """Clamp a value to -most to most."""
    value = larger(value, full_like(most, -1.0) * most)
    return chosen(most < value, most, value)


@inlined
def larger(a: Floats, b: Floats) -> Floats:
    """Return the larger of two values with the semantics of `max`, including the sign of zero."""
    return chosen(b > a, b, a)


@inlined
def _toward(mean: Floats, value: Floats, share: Floats) -> Floats:
    mean = mean + share * (value - mean)
    return chosen(mean > full_like(mean, NEGLIGIBLE), mean, full_like(mean, 0.0))


@inlined
def _decayed(mean: float, share: float, frames: int) -> float:
    """Return a running mean after `frames` frames of silence."""
    left = mean * math.exp(frames * math.log1p(-share)) if mean != 0.0 else 0.0
    return left if left > NEGLIGIBLE else 0.0
