"""Four numbers at a time against NumPy, between numbers that must stay as they are."""

import numpy as np

from underfoot.kernels import kernel
from underfoot.lanes import all_four, four, put, total
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
