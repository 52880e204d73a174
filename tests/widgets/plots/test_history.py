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


def test_a_history_of_no_rows_keeps_none_and_a_cleared_one_begins_anew():
    none, some = History(np.float32, 0, 2), History(np.float32, 3, 2)
    for history in (none, some):
        history.append(np.ones((5, 2)))
    assert none.latest().shape == (0, 2)
    some.clear()
    assert some.latest().shape == (0, 2)
    some.append([[7.0, 8.0]])
    assert some.latest().tolist() == [[7.0, 8.0]]
