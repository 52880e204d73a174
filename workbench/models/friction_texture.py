"""Stick-slip as a texture: slips drawn from the tabulated joint law of duration and distance, one look-up an event.

The law depends on four numbers only, the units of time and length being 1/w0 and v_b/w0; a table holds one law, and w0
and v_b may move while it plays. While the drive is above 0 the block is carried by the belt, slips, is carried again:
onset, slip duration, stick time d/v_b (0 where d < 0), next onset. Draws are numbered by the frame of the onset.

Offline: `slip_table`. Real time: `tune`, `run` for one tile, `rest`, `state_size`, `tuning_size`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from workbench.errors import BadValue
from workbench.kernels import kernel
from workbench.models.friction_laws import SlipLaw
from workbench.models.random import uniform

DURATIONS, DISTANCES = 129, 33
"""Nodes of a table: durations at chances p, and for each of them distances; p = sin^2(pi y / 2) at even steps of y."""

TABLE_SIZE = 1 + DURATIONS + DURATIONS * DISTANCES
"""Floats of a table: the mean size of a distance, the durations, and a row of distances for each."""

_LONGEST = 800.0
_REMAINING = 1e-3


def slip_table(zeta: float, noise: float, x0: float, v0: float, error: float = 1e-3) -> NDArray[np.float64]:
    """Tabulate the joint law of a slip's duration and distance for `tune`; TABLE_SIZE floats.

    All in units of 1/w0 and v_b/w0: `zeta` is the damping over w0, `noise` D/(w0 v_b^2), `x0` and `v0` (< 1) the start.
    Slips are followed until 0.1 % still last, or for 800/w0; the law is that of those that ended. `BadValue` for values
    out of range, or where nothing ends. Takes 0.1 to 1 s: not for the engine.

    >>> table = slip_table(0.4, 0.5, 2.0, 0.0)
    >>> table.size == TABLE_SIZE and bool(np.all(np.diff(table[1 : 1 + DURATIONS]) >= 0.0))
    True
    """
    t_end = 25.0
    while (law := SlipLaw.solve(1.0, zeta, noise, 1.0, x0, v0, t_end, error)).remaining > _REMAINING:
        if t_end >= _LONGEST:
            break
        t_end = min(4.0 * t_end, _LONGEST)
    ended = 1.0 - law.remaining
    if ended < 1e-3:
        raise BadValue(f"noise is {noise!r}; allowed for these values: larger (only {ended:.1e} of the slips end)")
    table = np.empty(TABLE_SIZE)
    durations = table[1 : 1 + DURATIONS]
    chances = np.clip(_chances(DURATIONS), 1e-6, 1.0 - 1e-6)
    rising = np.flatnonzero(np.diff(law.duration.cdf, prepend=-1.0) > 0.0)
    durations[:] = np.interp(chances * ended, law.duration.cdf[rising], law.duration.t[rising])
    distances = table[1 + DURATIONS :].reshape(DURATIONS, DISTANCES)
    for row, t in zip(distances, durations, strict=True):
        row[:] = x0 - _place_quantiles(law, float(t))[::-1]
    middles = 0.25 * (distances[1:, 1:] + distances[:-1, 1:] + distances[1:, :-1] + distances[:-1, :-1])
    weights = np.outer(np.diff(_chances(DURATIONS)), np.diff(_chances(DISTANCES)))
    table[0] = float((weights * np.abs(middles)).sum())
    return table


def _chances(nodes: int) -> NDArray[np.float64]:
    return np.sin(0.5 * math.pi * np.linspace(0.0, 1.0, nodes)) ** 2


def _place_quantiles(law: SlipLaw, t: float) -> NDArray[np.float64]:
    """Where slips of duration `t` end: rising places at the table's chances."""
    middles, masses, width = law.places(t)
    at = np.linspace(middles[0] - 5.0 * width, middles[-1] + 5.0 * width, 16 * (middles.size + 8))
    density = np.exp(-0.5 * ((at[:, None] - middles) / width) ** 2) @ masses
    risen = np.concatenate([[0.0], np.cumsum(np.maximum(0.5 * (density[1:] + density[:-1]), 0.0))])
    risen += np.linspace(0.0, 1e-12 * risen[-1], risen.size)
    chances = np.clip(_chances(DISTANCES), 1e-5, 1.0 - 1e-5)
    return np.interp(chances * risen[-1], risen, at)


# The state; all zero is no contact. NEXT: the onset of the next slip in session frames.
_RUNNING, _NEXT = range(2)

# The tuning: frames and seconds in the table's unit of time, an event's strength in its unit of distance, the table.
_FRAMES, _SECONDS, _STRENGTH, _TABLE = range(4)


def state_size() -> int:
    """Float64 values of one row's state.

    >>> state_size()
    2
    """
    return 2


def tuning_size() -> int:
    """Float64 values of one row's tuning.

    >>> tuning_size() == 3 + TABLE_SIZE
    True
    """
    return _TABLE + TABLE_SIZE


@kernel
def tune(t, table, rate_hz, w0, strength):
    """Fill the tuning `t`: a `slip_table`, the frame rate, w0 in rad/s, and the strength of a mean slip at drive 1.

    May be called at any time; what has been drawn stays. (v_b is only the unit of distance, in which strengths are.)
    """
    t[_FRAMES] = rate_hz / w0
    t[_SECONDS] = 1.0 / w0
    t[_STRENGTH] = strength / table[0]
    for i in range(TABLE_SIZE):
        t[_TABLE + i] = table[i]


@kernel
def run(s, t, key, frame, drive, events):
    """One tile, `drive.size` frames from session frame `frame` on: slips to `events`, their number returned.

    `drive` is a force or a gate: the block is carried while it is above 0, and an event's strength goes with it. An
    event is (onset in frames, strength, duration in s); `events` needs room for three floats a frame. Onsets are at
    least one frame apart. `key` is the row's `stream_key(seed, node, tile)`. A contact begins with a whole stick.
    """
    count = 0
    running, onset = s[_RUNNING], s[_NEXT]
    for i in range(drive.size):
        if not drive[i] > 0.0:
            running = 0.0
            onset = 0.0
            continue
        now = frame + i
        if running == 0.0:
            running = 1.0
            _, distance = draw(t, key, now)
            onset = now + max(distance, 0.0) * t[_FRAMES]
        if onset < now + 1.0:
            onset = max(onset, float(now))
            duration, distance = draw(t, key, now)
            events[3 * count] = onset
            events[3 * count + 1] = t[_STRENGTH] * abs(distance) * drive[i]
            events[3 * count + 2] = duration * t[_SECONDS]
            count += 1
            onset += max(1.0, (duration + max(distance, 0.0)) * t[_FRAMES])
    s[_RUNNING] = running
    s[_NEXT] = onset
    return count


@kernel
def rest(s, t):
    """A bound of what is still to come if the drive stays 0: nothing."""
    return 0.0


@kernel
def draw(t, key, counter):
    """Draw number `counter` of the stream `key` from the table in the tuning `t`: duration and distance, its units."""
    y = _place(uniform(key, 2 * counter)) * (DURATIONS - 1)
    z = _place(uniform(key, 2 * counter + 1)) * (DISTANCES - 1)
    i = min(int(y), DURATIONS - 2)
    j = min(int(z), DISTANCES - 2)
    y -= i
    z -= j
    first = _TABLE + 1 + i
    duration = (1.0 - y) * t[first] + y * t[first + 1]
    here = _TABLE + 1 + DURATIONS + i * DISTANCES + j
    near = (1.0 - z) * t[here] + z * t[here + 1]
    far = (1.0 - z) * t[here + DISTANCES] + z * t[here + DISTANCES + 1]
    return duration, (1.0 - y) * near + y * far


@kernel
def _place(chance):
    return 2.0 / math.pi * math.asin(math.sqrt(chance))
