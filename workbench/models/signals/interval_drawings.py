"""Distribution of a Poisson process as a picture: intervals drawn by a node, with their theoretical density."""

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import RATE_HZ
from underfoot.drawing import Drawing, Series
from underfoot.models.signals import noise
from underfoot.models.signals.events import event_list
from underfoot.models.signals.random import stream_key

_EVENTS, _LONGEST_S, _BINS = 4000, 2000.0, 30
_SHOWN = 5.0
"""End of the picture, in mean intervals: one interval in 150 is longer."""


def drawn_intervals_s(mean_interval_s: float) -> NDArray[np.float64]:
    """Return intervals between the impulses of a Poisson process, s: some thousand, or those of 2000 s.

    >>> round(float(drawn_intervals_s(0.02).mean()), 3)
    0.02
    """
    seconds = min(_EVENTS * mean_interval_s, _LONGEST_S)
    events = event_list(room=2 * _EVENTS)
    noise.impulses(stream_key(0, "laws"), mean_interval_s, float(RATE_HZ), 0, round(seconds * RATE_HZ), events)
    return np.diff(events.time[: len(events)]) / RATE_HZ


def interval_drawings(mean_interval_s: float) -> tuple[Drawing, ...]:
    """Return a drawing of the intervals: a histogram of the node's own draws, and the exponential density.

    >>> drawing, = interval_drawings(0.02)
    >>> expected = drawing.series[1]
    >>> float(expected.x[0]), float(expected.y[0])  # exp(-t / 20 ms) / 20 ms
    (0.0, 0.05)
    """
    intervals = drawn_intervals_s(mean_interval_s)
    edges = np.linspace(0.0, _SHOWN * mean_interval_s, _BINS + 1)
    share = np.histogram(intervals, edges)[0] / max(intervals.size, 1) / np.diff(edges)
    outline_s, height = np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(share, 2), [0.0]])
    at_s = np.linspace(0.0, edges[-1], 200)
    density = np.exp(-at_s / mean_interval_s) / mean_interval_s
    return (
        Drawing(
            "From event to event",
            "interval, ms",
            "density, 1/ms",
            (
                Series(f"{intervals.size} draws", 1e3 * outline_s, 1e-3 * height),
                Series("exponential distribution", 1e3 * at_s, 1e-3 * density, "dashed", "force"),
            ),
        ),
    )
