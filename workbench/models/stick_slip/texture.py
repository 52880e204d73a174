"""Stick-slip as a texture: slips drawn from the tabulated joint law of duration and distance, one look-up an event.

While the drive is above 0 the block is carried by the belt, slips, is carried again: onset, slip duration, stick time
d/v_b (0 where d < 0), next onset. Draws are numbered by the frame of the onset. The units of a table are 1/w0 and
v_b/w0, so that w0 and v_b may move while it plays.

What is heard is the block's acceleration. While it is carried there is none; a slip of duration T is one cycle of a
sine, which takes the block back by its distance d and leaves it at the belt velocity: its velocity falls below v_b by
`(d + v_b T)/T (1 - cos 2 pi s/T)`. Each frame has the mean over it, so that slips begin and end between frames.

Real time: `tune`, `run` for one tile, `rest`, `state_size`, `tuning_size`; the table is `quantile_table.slip_table`'s.
"""

import math

from underfoot.kernels import kernel
from underfoot.models.stick_slip.quantile_table import MEAN, draw

# The state; all zero is no contact. NEXT: the onset of the next slip; the last one's onset, length and depth follow.
_RUNNING, _NEXT, _ONSET, _LENGTH, _DEPTH = range(5)

# The tuning: frames and seconds in the table's unit of time, and the frame rate.
_FRAMES, _SECONDS, _RATE = range(3)


def state_size() -> int:
    """Float64 values of one row's state.

    >>> state_size()
    5
    """
    return 5


def tuning_size() -> int:
    """Float64 values of one row's tuning.

    >>> tuning_size()
    3
    """
    return 3


@kernel
def tune(t, rate_hz, w0):
    """Fill the tuning `t` [3]: the frame rate, and w0 in rad/s. May be called at any time; a slip that runs goes on."""
    t[_FRAMES] = rate_hz / w0
    t[_SECONDS] = 1.0 / w0
    t[_RATE] = rate_hz


@kernel
def run(s, t, table, key, frame, drive, acceleration, events):
    """One tile, `drive.size` frames from session frame `frame` on; slips to `events`, their number returned.

    `drive` is a gate and a factor: the block is carried while it is above 0, and all that comes out goes with it.
    `acceleration` [frames] is that of the block, in units of v_b a second; it may be the same array as `drive`. An
    event is (onset in frames, strength, duration in s), its strength the distance over the mean one; `events` needs
    room for three floats a frame, and onsets are at least one frame apart. `key` is the row's `stream_key(seed, node,
    tile)`. A contact begins with a whole stick.
    """
    count = 0
    running, next_onset = s[_RUNNING], s[_NEXT]
    onset, length, depth = s[_ONSET], s[_LENGTH], s[_DEPTH]
    share = 1.0 / table[MEAN] if table[MEAN] > 0.0 else 0.0
    missing = _missing(frame - onset, length, depth)
    for i in range(drive.size):
        now = frame + i
        if not drive[i] > 0.0:
            running = next_onset = onset = length = depth = missing = 0.0
            acceleration[i] = 0.0
            continue
        if running == 0.0:
            running = 1.0
            _, distance = draw(table, key, now)
            next_onset = now + max(distance, 0.0) * t[_FRAMES]
        after = _missing(now + 1 - onset, length, depth)
        change = missing - after
        missing = after
        if next_onset < now + 1.0:
            onset = max(next_onset, float(now))
            duration, distance = draw(table, key, now)
            length = max(duration * t[_FRAMES], 1e-9)
            depth = 1.0 + distance / max(duration, 1e-9)
            events[3 * count] = onset
            events[3 * count + 1] = share * abs(distance) * drive[i]
            events[3 * count + 2] = duration * t[_SECONDS]
            count += 1
            next_onset = onset + max(1.0, (duration + max(distance, 0.0)) * t[_FRAMES])
            change += missing
            missing = _missing(now + 1 - onset, length, depth)
            change -= missing
        acceleration[i] = change * t[_RATE] * drive[i]
    s[_RUNNING], s[_NEXT] = running, next_onset
    s[_ONSET], s[_LENGTH], s[_DEPTH] = onset, length, depth
    return count


@kernel
def rest(s, t):
    """A bound of what is still to come if the drive stays 0: nothing."""
    return 0.0


@kernel
def _missing(since, length, depth):
    # What a slip's velocity lacks of v_b, `since` frames after its onset.
    if since <= 0.0 or since >= length:
        return 0.0
    return depth * (1.0 - math.cos(2.0 * math.pi * since / length))
