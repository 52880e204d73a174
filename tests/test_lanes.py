"""Several numbers at a time against NumPy, between numbers that must stay as they are."""

import numpy as np

from underfoot.kernels import kernel
from underfoot.lanes import (
    all_eight,
    all_four,
    all_one,
    anywhere,
    chosen,
    eight,
    everywhere,
    four,
    full_like,
    magnitudes,
    put,
    put_across,
    roots,
    take_like,
    total,
)
from underfoot.memory import LANES


@kernel
def _combine(a, b, out, at, factor):
    x, y = four(a, at), four(b, at)
    put(out, at, x * y - x + all_four(factor) * y)
    return total(x)


def test_four_numbers_at_a_time():
    a, b = np.random.default_rng(1).standard_normal((2, 3 * LANES))
    for at in range(2 * LANES):
        out = np.full_like(a, 7.0)
        found = _combine(a, b, out, at, 0.5)
        four_places = slice(at, at + LANES)
        np.testing.assert_array_equal(out[four_places], (a * b - a + 0.5 * b)[four_places])
        assert found == (a[at] + a[at + 2]) + (a[at + 1] + a[at + 3])
        out[four_places] = 7.0
        assert (out == 7.0).all()


@kernel
def _compare(a, b, out, at):
    x, y = eight(a, at), eight(b, at)
    larger = chosen(x > y, x, y)
    put(out, at, roots(magnitudes(larger)) / all_eight(3.0))
    return anywhere(x == y), everywhere(larger > x - all_eight(1.0)), everywhere(x < y)


def test_numbers_are_compared_and_chosen_one_by_one():
    a, b = np.random.default_rng(2).standard_normal((2, 24))
    for dtype in (np.float64, np.float32):
        out = np.full(24, 7.0, dtype)
        assert _compare(a, b, out, 5) == (False, True, False)
        places = slice(5, 13)
        np.testing.assert_array_equal(out[places], (np.sqrt(np.abs(np.maximum(a, b))) / 3.0)[places].astype(dtype))
        out[places] = 7.0
        assert (out == 7.0).all()
    b[6] = a[6]
    assert _compare(a, b, out, 5)[0]
    assert _compare(a, a + 1.0, out, 5)[2]


@kernel
def _transpose(a, out, at):
    first = eight(a, 0), eight(a, 8), eight(a, 16), eight(a, 24)
    put_across(out, at, (*first, eight(a, 32), eight(a, 40), eight(a, 48), eight(a, 56)))


def test_rows_are_written_column_after_column():
    a, out = np.random.default_rng(3).standard_normal((8, 8)), np.full(70, 7.0)
    _transpose(a, out, 3)
    np.testing.assert_array_equal(out[3:67].reshape(8, 8), a.T)
    assert (out[[0, 1, 2, 67, 68, 69]] == 7.0).all()


@kernel
def _scaled(a, out, at, by_four):
    if by_four:
        put(out, at, _scaled_lanes(a, at, all_four(0.0)))
    else:
        put(out, at, _scaled_lanes(a, at, all_eight(0.0)))


@kernel
def _scaled_lanes(a, at, like):
    return full_like(like, 3.0) * take_like(like, a, at)


def test_what_is_written_for_any_number_of_lanes_takes_as_many_as_it_is_shown():
    a = np.random.default_rng(4).standard_normal(24)
    for by_four, places in ((True, slice(5, 9)), (False, slice(5, 13))):
        out = np.full(24, 7.0)
        _scaled(a, out, 5, by_four)
        np.testing.assert_array_equal(out[places], 3.0 * a[places])
        out[places] = 7.0
        assert (out == 7.0).all()


@kernel
def _alone(number, other):
    a, b = all_one(number), all_one(other)
    larger = chosen(b > a, b, a)
    return total(roots(magnitudes(larger)) / full_like(a, 3.0)), anywhere(a > b), everywhere(a < b)


def test_a_vector_of_one_is_a_number():
    assert _alone(-2.0, 7.0) == (np.sqrt(7.0) / 3.0, False, True)
    assert _alone(5.0, -7.0) == (np.sqrt(5.0) / 3.0, True, False)
