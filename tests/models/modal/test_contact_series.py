"""The step by series against what defines it: exact work, exact motion, and the iteration for any step."""

import numpy as np
import pytest

from underfoot.kernels import kernel
from underfoot.models.modal import contact_step
from underfoot.models.modal.contact_series import expand, solve_by_series

X = 1e-4


def stiffness(exponent):
    """Such that the force at X is 10 N, whatever the exponent."""
    return 10.0 / X**exponent


@kernel
def _by_series(contact, x, elastic, free_d, free_w, guess):
    return solve_by_series(contact, x, 1.0 / x, elastic, free_d, free_w, guess)


def contact_of(exponent, damping):
    """A contact of 20 g on a light object, in steps of 1/48 ms."""
    contact = contact_step.CONTACT.zeros()
    step_s = 1 / 48_000
    contact.stiffness, contact.exponent, contact.nu = stiffness(exponent), exponent, damping / step_s
    free = step_s**2 / 0.02 + step_s**2 / 0.1
    contact.a, contact.b, contact.c = free / 2, free / 12, free / 120
    expand(contact.series, exponent)
    return contact


def potential(x, exponent):
    return stiffness(exponent) * x ** (exponent + 1) / (exponent + 1)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.7, 4.0])
@pytest.mark.parametrize("moves", [-0.09, -1e-3, -1e-9, 0.0, 1e-6, 0.02, 0.09])
@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_step_by_series(exponent, moves, damping):
    contact, elastic = contact_of(exponent, damping), 10.0
    free_d, free_w = X * moves + contact.a * elastic, 1e-3 * X * moves
    expected = contact_step.solve(contact, X, elastic, free_d, free_w, elastic, 0.0)
    guess = expected[2] + 3e-6 * X
    f0, f1, d, work, whole = _by_series(contact, X, elastic, free_d, free_w, guess)
    assert whole
    w = free_w - contact.b * f0 - contact.c * f1
    assert abs(d - (free_d - contact.a * f0 + contact.b * f1)) < 1e-15 * X
    gained = potential(X + d, exponent) - potential(X, exponent)
    if damping == 0.0:
        assert f0 * d + f1 * w == pytest.approx(gained, abs=3e-15 * potential(X, exponent))
    else:
        assert f0 * d + f1 * w >= gained - 3e-15 * potential(X, exponent)
    np.testing.assert_allclose((f0, d), (expected[0], expected[2]), rtol=1e-4, atol=1e-7 * X)
    np.testing.assert_allclose(work / (X + d), stiffness(exponent) * (X + d) ** exponent, rtol=1e-14)


def test_what_is_left_to_the_iteration():
    contact, elastic = contact_of(1.5, 0.3), 10.0
    near = contact.a * elastic
    assert _by_series(contact, X, elastic, near, 0.0, 0.0)[-1]
    assert not _by_series(contact, X, elastic, near, 0.0, 1e-3 * X)[-1]  # a guess far off
    assert not _by_series(contact, X, elastic, near + 0.2 * X, 0.0, 0.2 * X)[-1]  # a long step
    assert not _by_series(contact, X, elastic, -X, 0.0, -1.1 * X)[-1]  # out of contact
