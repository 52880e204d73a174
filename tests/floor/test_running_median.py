"""The running median: a window in ascending order, whatever goes and comes; medians against sorting."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from underfoot.floor.running_median import exchange, median, median_deviation

VALUES = st.floats(-5.0, 5.0) | st.integers(-3, 3).map(float)


@given(st.lists(VALUES, min_size=1, max_size=40), st.data())
def test_a_window_stays_what_sorting_makes_of_it(values, data):
    window = np.sort(values)
    goes, comes = data.draw(st.sampled_from(values)), data.draw(VALUES)
    expected = values.copy()
    expected[expected.index(goes)] = comes
    exchange(window, goes, comes)
    np.testing.assert_array_equal(window, np.sort(expected))


@given(st.lists(VALUES, min_size=1, max_size=40), st.integers(0, 5))
def test_the_deviation_is_the_middle_one_of_all(values, room):
    window = np.append(np.sort(values), np.full(room, np.nan))
    n = len(values)
    assert median(window, n) == np.median(values)
    assert median_deviation(window, n) == np.sort(np.abs(np.array(values) - np.median(values)))[(n + 1) // 2 - 1]
