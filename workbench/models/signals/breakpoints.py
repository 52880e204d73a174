"""Breakpoint envelope: piecewise linear level and frequency over time, played once at each start."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory

STATE = Layout("breakpoints", "has_begun", "is_playing", "onset", "strength", "segment", "level", "glide")
"""State of playback: onset (session frames) and strength, index of the last point passed, the last level output, and
the level from which a restart glides (0: from silence, at once)."""

GLIDE_S = 5e-3
"""Time in which a restart reaches its own level, to avoid clicks."""

LEAST_TOLERANCE = 1e-9
"""Least deviation by which a row is told from a line between others."""

TIME, LEVEL, FREQUENCY = 0, 1, 2
"""Columns of a table of points."""


@kernel
def begin(onset: float, strength: float, state: Memory) -> None:
    """Start playback at the first point; `onset` is in session frames, fractions included."""
    state.has_begun = state.is_playing = 1.0
    state.onset, state.strength = onset, strength
    state.segment, state.glide = 0.0, state.level


@kernel
def run(
    points: Floats, frame: int, rate: float, starts: Memory, state: Memory, level: Floats, frequency: Floats
) -> None:
    """Fill `level` and `frequency` from the table `points` [point, 3] (seconds, level, hertz).

    Both are exactly 0 where nothing plays: before a start, and after the last point. Of points at the same time the
    last applies from there on. `starts` are events; the level is multiplied by the strength of the one that started it.

    >>> from underfoot.models.signals.events import event_list
    >>> state, level, frequency = STATE.zeros(), np.empty(5), np.empty(5)
    >>> points = np.array([[0.0, 0.0, 50.0], [0.002, 1.0, 50.0], [0.004, 0.0, 70.0]])
    >>> run(points, 0, 1000.0, event_list((0.0, 2.0)), state, level, frequency)
    >>> level, frequency
    (array([0., 1., 2., 1., 0.]), array([50., 50., 50., 60., 70.]))
    """
    last, following = points.shape[0] - 1, 0
    glide_frames = max(GLIDE_S * rate, 1.0)
    for i in range(level.size):
        now = frame + i
        while following < len(starts) and math.floor(starts.time[following]) <= now:
            begin(starts.time[following], starts.strength[following], state)
            following += 1
        level[i] = frequency[i] = 0.0
        if state.is_playing == 0.0:
            continue
        age = (now - state.onset) / rate
        at = int(state.segment)
        while at < last and points[at + 1, TIME] <= age:
            at += 1
        state.segment = float(at)
        if last < 0 or (at == last and age > points[last, TIME]):
            state.is_playing = state.level = 0.0
            continue
        share = 0.0
        if at < last and age > points[at, TIME]:
            share = (age - points[at, TIME]) / (points[at + 1, TIME] - points[at, TIME])
        after = min(at + 1, last)
        ahead = points[at, LEVEL] + share * (points[after, LEVEL] - points[at, LEVEL])
        if age < points[0, TIME]:
            ahead = 0.0
        off = 0.0
        if state.glide != 0.0:
            first = points[0, LEVEL] if points[0, TIME] == 0.0 and age >= 0.0 else 0.0
            off = (state.glide - state.strength * first) * min(max(1.0 - (now - state.onset) / glide_frames, 0.0), 1.0)
        own = state.strength * ahead
        most = max(abs(own), abs(state.glide))  # not the sum, which grows where starts come fast
        level[i] = state.level = min(max(own + off, -most), most)
        frequency[i] = points[at, FREQUENCY] + share * (points[after, FREQUENCY] - points[at, FREQUENCY])


def thinned(points: NDArray[np.float64], tolerances: NDArray[np.float64], most: int) -> NDArray[np.float64]:
    """Thin out rows of `points` [point, column] (the first column is time) that linear interpolation replaces.

    No omitted row is further from the line than `tolerances` [column - 1] (Douglas and Peucker 1973, vertical
    distances). If more than `most` rows remain, the tolerances are doubled until they do not.

    >>> thinned(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.1], [3.0, 0.0]]), np.array([0.2]), 10).tolist()
    [[0.0, 0.0], [2.0, 2.1], [3.0, 0.0]]
    """
    worth = _worth(points, np.maximum(tolerances, LEAST_TOLERANCE))
    allowed = 1.0
    while np.count_nonzero(worth > allowed) > max(most, 2):
        allowed *= 2.0
    return points[worth > allowed]


def _worth(points: NDArray[np.float64], tolerances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the number of tolerances below which each row is kept; 0 for those that none of them keeps.

    A stretch is cut at the same row whatever is allowed, so each is cut once.
    """
    worth = np.zeros(len(points))
    worth[[0, -1]] = np.inf
    waiting = [(0, len(points) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        inner, way = points[first + 1 : last], points[last] - points[first]
        share = (inner[:, :1] - points[first, 0]) / (way[0] if way[0] > 0.0 else 1.0)
        line = points[first, 1:] + share * way[1:]
        off = (np.abs(inner[:, 1:] - line) / tolerances).max(axis=1)
        at = first + 1 + int(off.argmax())
        worth[at] = min(off.max(), worth[first], worth[last])
        if off.max() > 1.0:
            waiting += [(first, at), (at, last)]
    return worth
