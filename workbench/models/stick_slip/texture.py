"""Stick-slip in real time: slips drawn from the tabulated joint distribution of duration and distance.

While the drive is above 0 the block sticks and slips in turn: onset, slip duration, stick time d/v_b (0 if d < 0), next
onset. Draws are numbered by the frame of the onset. The units of a table are 1/w0 and v_b/w0, so that w0 and v_b may
change in between.

The output is the block's acceleration. It is 0 during sticks; a slip of duration T is one cycle of a sine, which moves
the block back by its distance d and leaves it at the belt velocity: its velocity falls below v_b by
`(d + v_b T)/T (1 - cos 2 pi s/T)`. Each frame has its mean, so that slips begin and end between frames.

Real time: `design`, `run` for one tile; the table comes from `quantile_table.slip_table`. There is no tail.
"""

import math

import numpy as np

from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.signals.events import append
from underfoot.models.stick_slip.quantile_table import draw, parts

STATE = Layout("stick_slip", "is_carried", "next_onset", "onset", "length", "depth")
"""Zeros are no contact. Onset of the next slip; onset, length (frames) and depth of the last one."""

COEFFICIENTS = Layout("stick_slip_coefficients", "frames", "seconds", "rate")
"""Frames and seconds per unit of time of the table, and the frame rate."""


@kernel
def design(w0: float, rate_hz: float, coefficients: Memory) -> None:
    """Set w0, in rad/s. May be called at any time; a slip under way is not changed."""
    coefficients.frames = rate_hz / w0
    coefficients.seconds = 1.0 / w0
    coefficients.rate = rate_hz


@kernel
def run(
    drive: Floats,
    table: Floats,
    key: np.uint64,
    frame: int,
    coefficients: Memory,
    state: Memory,
    acceleration: Floats,
    events: Memory,
) -> None:
    """Run one tile, `drive.size` frames from session frame `frame` on; slips are appended to `events`.

    `drive` is a gate and a factor: the block moves while it is above 0, and all outputs are proportional to it.
    `acceleration` [frames] is that of the block, in units of v_b per second; it may be the same array as `drive`. The
    strength of a slip is its distance over the mean distance, its duration in s; onsets are at least one frame apart.
    `key` is the row's `stream_key(seed, node, tile)`. A contact begins with a complete stick.
    """
    c, s = coefficients, state
    is_carried, next_onset = s.is_carried, s.next_onset
    onset, length, depth = s.onset, s.length, s.depth
    mean_distance = parts(table).mean_distance
    share = 1.0 / mean_distance if mean_distance > 0.0 else 0.0
    lag = _lag(frame - onset, length, depth)
    for i in range(drive.size):
        now = frame + i
        if not drive[i] > 0.0:
            is_carried = next_onset = onset = length = depth = lag = 0.0
            acceleration[i] = 0.0
            continue
        if is_carried == 0.0:
            is_carried = 1.0
            _, distance = draw(table, key, now)
            next_onset = now + max(distance, 0.0) * c.frames
        after = _lag(now + 1 - onset, length, depth)
        change = lag - after
        lag = after
        if next_onset < now + 1.0:
            onset = max(next_onset, float(now))
            duration, distance = draw(table, key, now)
            length = max(duration * c.frames, 1e-9)
            depth = 1.0 + distance / max(duration, 1e-9)
            append(events, onset, share * abs(distance) * drive[i], duration * c.seconds)
            next_onset = onset + max(1.0, (duration + max(distance, 0.0)) * c.frames)
            change += lag
            lag = _lag(now + 1 - onset, length, depth)
            change -= lag
        acceleration[i] = change * c.rate * drive[i]
    s.is_carried, s.next_onset = is_carried, next_onset
    s.onset, s.length, s.depth = onset, length, depth


@kernel
def _lag(since: float, length: float, depth: float) -> float:
    """Return by how much a slip's velocity is below v_b, `since` frames after its onset."""
    if since <= 0.0 or since >= length:
        return 0.0
    return depth * (1.0 - math.cos(2.0 * math.pi * since / length))
