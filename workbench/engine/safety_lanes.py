"""The safety stage for four or eight rows at a time, which hides the latency of dependencies between frames."""

import numpy as np
from numpy.typing import NDArray

from underfoot.engine.safety_rows import LARGEST, along, is_still, limit_row, limited, limits_of
from underfoot.kernels import Floats, inlined, kernel
from underfoot.lanes import (
    all_eight,
    all_four,
    eight,
    everywhere,
    full_like,
    magnitudes,
    put,
    put_across,
    take_like,
)
from underfoot.layouts import Layout, Memory

CHUNK = 64
"""Frames processed at once."""
ROWS, HALF = 8, 4
"""Rows processed at once, and the number that takes half the time on processors with vectors of four."""

_LANES = Layout(
    "safety_lanes",
    scale=ROWS,
    most=ROWS,
    square=ROWS,
    dc_in=ROWS,
    dc_out=ROWS,
    burst_square=ROWS,
    mean_square=ROWS,
    peak_gain=ROWS,
    peak=ROWS,
)
"""Limits and state of `ROWS` rows, as in `safety_rows.ROW`, side by side."""

WORK = Layout(
    "safety_work",
    lanes=_LANES,
    level=CHUNK,
    opening=CHUNK,
    given=CHUNK * ROWS,
    before=CHUNK * ROWS,
    made=CHUNK * ROWS,
)
"""Workspace of a chunk: its gains and, per frame, the input of the rows, the present values of their channels, and the
results. `before` is 0 except for rows that add.
"""


@kernel
def limit_group(
    acceleration: NDArray[np.float64],
    out: NDArray[np.float32],
    rows: NDArray[np.void],
    members: NDArray[np.int64],
    count: int,
    stage: np.record,
    work: Memory,
    stretch: tuple[int, int, int],
) -> None:
    """Add the frames of up to eight rows to their channels, which must differ.

    `members`: the rows, `count` of them, and room for as many. `stretch`: the session frame of the first frame, its
    row in `out`, and the number of frames.
    """
    frame, at, n = stretch
    for begin in range(0, n, CHUNK):
        frames, here = min(CHUNK, n - begin), frame + begin
        sounding = _find_sounding(acceleration, rows, members, count, (here, begin, frames))
        if sounding == 0:
            continue
        _fill(stage.level, here, work.level[:frames])
        _fill(stage.opening, here, work.opening[:frames])
        done = 0
        if _are_steady(rows, members, sounding, here):
            _gather(out, rows, members, sounding, work, (at + begin, frames))
            _transpose(acceleration, members, begin, work.given[: frames * ROWS])
            if sounding <= HALF:
                done = _run(work, stage, frames, all_four(0.0))
            else:
                done = _run(work, stage, frames, all_eight(0.0))
            _scatter(out, rows, members, sounding, work, (at + begin, done))
        if done < frames:
            for place in range(sounding):
                asked = acceleration[members[1, place], begin + done : begin + frames]
                level, opening = work.level[done:frames], work.opening[done:frames]
                limit_row(asked, out[at + begin + done :], rows[members[1, place]], stage, level, opening, here + done)


@inlined
def _find_sounding(
    acceleration: NDArray[np.float64],
    rows: NDArray[np.void],
    members: NDArray[np.int64],
    count: int,
    stretch: tuple[int, int, int],
) -> int:
    """Append the members that are not silent throughout a stretch behind them; return their number."""
    frame, begin, frames = stretch
    sounding = 0
    for place in range(count):
        k = members[0, place]
        if is_still(rows[k]) and not acceleration[k, begin : begin + frames].any():
            if rows[k].silent_frame < 0:
                rows[k].silent_frame = frame
            continue
        members[1, sounding] = k
        sounding += 1
    for place in range(sounding, ROWS):  # unused places repeat the last row
        members[1, place] = members[1, max(sounding - 1, 0)]
    return sounding


@inlined
def _fill(ramp: np.record, frame: int, gains: Floats) -> None:
    """Write the values of a ramp from a session frame on."""
    if frame >= ramp.frame + ramp.frames:
        gains[:] = along(ramp, frame)
        return
    for i in range(len(gains)):
        gains[i] = along(ramp, frame + i)


@inlined
def _are_steady(rows: NDArray[np.void], members: NDArray[np.int64], count: int, frame: int) -> bool:
    """Return whether no row is silent and all scales are constant."""
    steady = True
    for place in range(count):
        row = rows[members[1, place]]
        steady &= row.silent_frame < 0 and frame >= row.scale.frame + row.scale.frames
    return steady


@inlined
def _gather(
    out: NDArray[np.float32],
    rows: NDArray[np.void],
    members: NDArray[np.int64],
    count: int,
    work: Memory,
    stretch: tuple[int, int],
) -> None:
    """Gather limits, state and channel values of the rows side by side."""
    at, frames = stretch
    lanes = work.lanes
    for place in range(ROWS):
        row = rows[members[1, place]]
        lanes.scale[place], lanes.most[place], lanes.square[place] = row.scale.target, row.peak_limit, row.rms_limit**2
        lanes.dc_in[place], lanes.dc_out[place] = row.dc_in, row.dc_out
        lanes.burst_square[place], lanes.mean_square[place] = row.burst_square, row.mean_square
        lanes.peak_gain[place], lanes.peak[place] = row.peak_gain, row.peak
        if row.adds and place < count:
            for i in range(frames):
                work.before[i * ROWS + place] = out[at + i, row.channel]


@inlined
def _transpose(acceleration: NDArray[np.float64], members: NDArray[np.int64], begin: int, to: Floats) -> None:
    """Transpose the rows' input from frame `begin` on."""
    length, square = acceleration.shape[1], ROWS * ROWS
    a, b, c, d = members[1, 0] * length, members[1, 1] * length, members[1, 2] * length, members[1, 3] * length
    e, f, g, h = members[1, 4] * length, members[1, 5] * length, members[1, 6] * length, members[1, 7] * length
    whole = len(to) // square * square
    for at in range(0, whole, square):
        i = begin + at // ROWS
        left = eight(acceleration, a + i), eight(acceleration, b + i), eight(acceleration, c + i)
        middle = eight(acceleration, d + i), eight(acceleration, e + i), eight(acceleration, f + i)
        put_across(to, at, (*left, *middle, eight(acceleration, g + i), eight(acceleration, h + i)))
    for at in range(whole, len(to), ROWS):
        for place in range(ROWS):
            to[at + place] = acceleration[members[1, place], begin + at // ROWS]


@inlined
def _scatter(
    out: NDArray[np.float32],
    rows: NDArray[np.void],
    members: NDArray[np.int64],
    count: int,
    work: Memory,
    stretch: tuple[int, int],
) -> None:
    """Write the results to the rows' channels, and store their state."""
    at, frames = stretch
    lanes, first = work.lanes, rows[members[1, 0]].channel
    are_neighbours = count == ROWS
    for place in range(count):
        row = rows[members[1, place]]
        row.dc_in, row.dc_out = lanes.dc_in[place], lanes.dc_out[place]
        row.burst_square, row.mean_square = lanes.burst_square[place], lanes.mean_square[place]
        row.peak_gain, row.peak = lanes.peak_gain[place], lanes.peak[place]
        are_neighbours &= row.channel == first + place
        if row.adds:
            work.before[place::ROWS] = 0.0
    if are_neighbours:
        for i in range(frames):
            put(out, (at + i) * out.shape[1] + first, eight(work.made, i * ROWS))
        return
    for place in range(count):
        channel = rows[members[1, place]].channel
        for i in range(frames):
            out[at + i, channel] = work.made[i * ROWS + place]


@kernel
def _run(work: Memory, stage: np.record, n: int, zero: Floats) -> int:
    """Do as `limit_row`, up to the first frame at which a row is silent, not finite or too large; return it, or n.

    As many of the rows side by side are processed as there are numbers in `zero`.
    """
    lanes, largest = work.lanes, full_like(zero, LARGEST)
    scale = take_like(zero, lanes.scale, 0)
    limits = limits_of(stage, take_like(zero, lanes.most, 0), take_like(zero, lanes.square, 0))
    dc = take_like(zero, lanes.dc_in, 0), take_like(zero, lanes.dc_out, 0)
    squares = take_like(zero, lanes.burst_square, 0), take_like(zero, lanes.mean_square, 0)
    gain, peak = take_like(zero, lanes.peak_gain, 0), take_like(zero, lanes.peak, 0)
    done = n
    for i in range(n):
        now = take_like(zero, work.given, i * ROWS) * scale
        is_within = magnitudes(now) < largest
        now = now * full_like(zero, work.level[i])
        sounds = magnitudes(now) + magnitudes(dc[0]) + magnitudes(dc[1]) > zero
        if not everywhere(is_within & sounds):
            done = i
            break
        before = take_like(zero, work.before, i * ROWS)
        y, dc, squares, gain, peak = limited(now, before, work.opening[i], limits, dc, squares, gain, peak)
        put(work.made, i * ROWS, y)
    put(lanes.dc_in, 0, dc[0])
    put(lanes.dc_out, 0, dc[1])
    put(lanes.burst_square, 0, squares[0])
    put(lanes.mean_square, 0, squares[1])
    put(lanes.peak_gain, 0, gain)
    put(lanes.peak, 0, peak)
    return done
