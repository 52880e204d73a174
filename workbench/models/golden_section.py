"""Golden-section search: where a function of one number is least, without its derivative."""

from collections.abc import Callable

import numpy as np

from underfoot.kernels import Floats

_SHARE = 0.5 * (5.0**0.5 - 1.0)  # of the interval that a step leaves: one of its two places is one of the next step's


def least_at(error: Callable[[float], float], tried: Floats, steps: int) -> float:
    """Return where `error` is least: it is searched for in so many steps between the neighbours of the best of `tried`.

    These values must ascend, so densely that there is one minimum between two neighbours of any.

    >>> round(least_at(lambda x: (x - 0.3) ** 2, np.linspace(0.0, 1.0, 6), 40), 6)
    0.3
    """
    best = int(np.argmin([error(float(one)) for one in tried]))
    low, high = float(tried[max(best - 1, 0)]), float(tried[min(best + 1, tried.size - 1)])
    one, two = high - _SHARE * (high - low), low + _SHARE * (high - low)
    errors = error(one), error(two)
    for _ in range(steps - 1):
        if errors[0] < errors[1]:
            high, two, one = two, one, two - _SHARE * (two - low)
            errors = error(one), errors[0]
        else:
            low, one, two = one, two, one + _SHARE * (high - one)
            errors = errors[1], error(two)
    low, high = (low, two) if errors[0] < errors[1] else (one, high)
    return 0.5 * (low + high)
