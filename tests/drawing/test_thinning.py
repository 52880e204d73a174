"""Thinned curves look like those that they were made of."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from underfoot.drawing.thinning import thinned


@given(st.integers(0, 1000), st.sampled_from([20, 80]))
def test_a_thinned_curve_keeps_least_and_largest_of_every_step(seed, length):
    """Short steps are compared side by side, long ones one after the other."""
    y = np.random.default_rng(seed).normal(size=(400, 2))
    x, thin = thinned(np.arange(400.0), y, float(length))
    assert len(x) == 2 * 400 // length
    assert (np.diff(x) > 0).all()
    for step in range(400 // length):
        piece, kept = y[length * step :][:length], thin[2 * step : 2 * step + 2]
        np.testing.assert_array_equal(np.sort(kept, axis=0), [piece.min(axis=0), piece.max(axis=0)])


@pytest.mark.parametrize("step", [1.0, 20.0])
def test_a_curve_is_broken_at_a_gap(step):
    times = np.concatenate([np.arange(100.0), np.arange(300.0, 400.0)])
    x, y = thinned(times, np.ones((200, 1)), step)
    assert np.isnan(x).sum() == np.isnan(y).sum() == 1
    assert x[int(np.flatnonzero(np.isnan(x))[0]) + 1] >= 300.0
