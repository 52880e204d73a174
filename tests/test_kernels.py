"""How kernels are compiled."""

import numpy as np
import pytest
from numba import njit
from numpy.typing import NDArray

from underfoot.kernels import inlined, kernel


@inlined
def _twice(number: float) -> float:
    return 2 * number


@kernel
def _doubled_counts(out: NDArray[np.float64]) -> None:
    count = 0  # a literal for Numba, until it is counted up
    while count < len(out):
        out[count] = _twice(count) + _twice(1)
        count += 1


def test_a_kernel_that_is_called_with_literals_is_compiled_once(monkeypatch, tmp_path):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path))  # where it was not compiled before
    out = np.zeros(3)
    _doubled_counts(out)
    assert list(out) == [2.0, 4.0, 6.0]
    assert len(_twice.part.signatures) == 1


@kernel
def _root(number: float) -> float:
    if number < 0.0:
        raise ValueError("no root of a negative number")
    return number**0.5


@kernel
def _two_roots(number: float) -> float:
    return 2.0 * _root(number)


def test_a_kernel_that_another_calls_is_a_part_of_it_may_raise_there_and_can_be_called(monkeypatch, tmp_path):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path))
    assert _two_roots(9.0) == 6.0
    with pytest.raises(ValueError, match="no root of a negative number"):
        _two_roots(-9.0)
    assert not [path for path in tmp_path.rglob("*.nbi") if "_root-" in path.name]
    assert _root(9.0) == 3.0
    with pytest.raises(ValueError, match="no root of a negative number"):
        _root(-9.0)
    assert _twice(3.0) == 6.0


@njit
def _tripled(number: float) -> float:
    return 3.0 * number


@kernel
def _next_to_triple(number: float) -> float:
    return _tripled(number) + 1.0


@kernel
def _largest(number: float) -> float:
    return max(_next_to_triple(number), 2.0)


def test_a_function_of_numba_that_a_kernel_calls_can_be_called_from_python_afterwards(monkeypatch, tmp_path):
    """As one that a node's `run` calls and its `sizes`, too: the interpreter crashed."""
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path))
    assert _largest(2.0) == 7.0
    assert _tripled(2.0) == 6.0


@kernel
def _filled(out: NDArray[np.float64], value: float, n: int) -> int:
    for i in range(n):
        out[i] = value
    return n


def test_a_specialised_kernel_is_the_one_that_is_called_with_such_arguments(monkeypatch, tmp_path):
    monkeypatch.setenv("UNDERFOOT_CACHE", str(tmp_path))
    out = np.zeros(3)
    fill = _filled.specialised(out, 0.0, 0)
    assert fill(out, 2, 2) == 2  # a whole number is passed as what the version takes
    assert list(out) == [2.0, 2.0, 0.0]
    assert _filled(out, 1.5, 3) == 3
    assert list(out) == [1.5, 1.5, 1.5]
    assert len(_filled.compiled.signatures) == 1
