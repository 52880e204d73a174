"""The latest rows of a stream."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from underfoot.widgets.plots.history import History


@given(st.lists(st.integers(1, 7), min_size=1, max_size=12))
def test_a_history_keeps_the_latest_rows_whatever_they_come_in(lengths):
    history, everything = History(np.float64, 5), np.zeros(0)
    for length in lengths:
        rows = np.arange(len(everything), len(everything) + length, dtype=float)
        history.append(rows)
        everything = np.concatenate([everything, rows])
        assert history.latest().tolist() == everything[-5:].tolist()
