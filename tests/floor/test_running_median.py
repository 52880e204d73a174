"""The running median: a window of which the middle is kept, whatever goes and comes; medians against sorting."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from underfoot.floor.running_median import MIDDLE, begin, exchange, insert, median, median_deviation, running_median
from underfoot.kernels import kernel

VALUES = st.floats(-5.0, 5.0) | st.integers(-3, 3).map(float)
WINDOW = 300


@kernel
def _exchange(middle, ascending, old, new):
    exchange(middle, ascending, old, new)


@kernel
def _running_median(middle, ascending, ring, newest, n):
    return running_median(middle, ascending, ring, newest, n)


@pytest.mark.parametrize("made", ["noise", "few values", "drift", "still", "jumps"])
def test_a_running_median_is_that_of_the_window_sorted(made):
    draw = np.random.default_rng(1)
    noise = draw.normal(size=2000)
    values = {
        "noise": noise,
        "few values": np.round(noise),
        "drift": np.cumsum(noise),
        "still": np.zeros(2000),
        "jumps": noise + 50.0 * (np.arange(2000) // 170 % 3),
    }[made]
    middle, ascending, ring = np.zeros(1, MIDDLE)[0], np.zeros(WINDOW), np.zeros(WINDOW + 7)
    begin(middle)
    for i, value in enumerate(values):
        goes = ring[(i - WINDOW) % len(ring)]
        ring[i % len(ring)] = value
        if i < WINDOW:
            insert(middle, ascending, value)
        else:
            _exchange(middle, ascending, goes, value)
        window = values[max(i + 1 - WINDOW, 0) : i + 1]
        assert _running_median(middle, ascending, ring, i % len(ring), len(window)) == np.median(window)


@given(st.lists(VALUES, min_size=1, max_size=40), st.integers(0, 5))
def test_the_deviation_is_the_middle_one_of_all(values, room):
    padded = np.append(values, np.full(room, np.nan))
    n = len(values)
    assert median(padded.copy(), n) == np.median(values)
    assert median_deviation(padded, n) == np.sort(np.abs(np.array(values) - np.median(values)))[(n + 1) // 2 - 1]
