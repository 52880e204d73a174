"""Axes: ticks at round values, ranges that hold the data, and values where they belong."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from underfoot.drawing.axes import Axis, fixed_axis, round_axis, tick_texts, tick_values

HUGE = 1e6


@pytest.mark.parametrize(("low", "high"), [(0.3, 41.0), (-3e-5, 2e-4), (0.0, 65535.0), (1e5, 1e5 + 1.0)])
def test_even_ticks_enclose_the_range_at_round_values(low, high):
    values = np.array(tick_values(low, high, 6.0, log=False))
    step = values[1] - values[0]
    assert values[0] <= low + 1e-6 * step
    assert values[-1] >= high - 1e-6 * step
    assert 3 <= len(values) <= 14
    np.testing.assert_allclose(np.diff(values), step)


@pytest.mark.parametrize(("low", "high"), [(20.0, 2000.0), (1e-3, 1e4), (50.0, 80.0), (100.0, 200.0), (130.0, 145.0)])
def test_ticks_of_a_log_axis_enclose_the_range(low, high):
    values = tick_values(low, high, 6.0, log=True)
    assert 0.0 < values[0] <= low * (1 + 1e-6)
    assert values[-1] >= high * (1 - 1e-6)
    assert 2 <= len(values) <= 12


@given(st.floats(-HUGE, HUGE), st.floats(1e-6, HUGE), st.floats(30.0, 2000.0))
def test_ticks_are_apart_within_the_axis_and_told_apart(low, length, pixels):
    axis = round_axis((low, low + length), 0.0, pixels, 26.0, log=False)
    assert axis.low <= low
    assert axis.high >= low + length
    places = axis.place([value for value, _ in axis.ticks])
    texts = [text for _, text in axis.ticks]
    assert ((places > -1.0) & (places < pixels + 1.0)).all()
    assert len(set(texts)) == len(texts)
    assert len(texts) <= 14
    if len(texts) > 3:
        assert np.diff(places).min() > 20.0


def test_a_narrow_log_axis_has_ticks_too():
    axis = round_axis((140.0, 145.0), 0.0, 400.0, 50.0, log=True)
    assert len(axis.ticks) >= 3


def test_a_given_range_is_shown_exactly():
    axis = fixed_axis((-1.3, 7.7), 100.0, 0.0, 26.0, log=False)
    assert (axis.low, axis.high) == (-1.3, 7.7)
    assert all(axis.low <= value <= axis.high for value, _ in axis.ticks)
    np.testing.assert_allclose(axis.place([-1.3, 7.7]), [100.0, 0.0])


@pytest.mark.parametrize("log", [False, True])
def test_a_pixel_has_the_value_that_is_drawn_there(log):
    axis = Axis(2.0, 900.0, log, 56.0, 640.0)
    for value in (2.0, 31.0, 900.0):
        assert axis.value(float(axis.place(value))) == pytest.approx(value)


def test_what_a_log_axis_cannot_show_has_no_place():
    assert np.isnan(Axis(1.0, 10.0, True, 0.0, 100.0).place([0.0, -3.0, np.nan])).all()


@given(st.lists(st.integers(-99, 99), min_size=2, max_size=6, unique=True), st.integers(-6, 6))
def test_texts_of_ticks_differ(steps, exponent):
    values = sorted(4000 * 10.0**exponent + step * 10.0**exponent for step in steps)
    assert all(a != b for a, b in pairwise(tick_texts(values)))
