"""Validation of arguments of public functions: numbers and arrays of one type, or `BadValue`."""

import math
import re
import sys
from collections.abc import Collection, Mapping
from functools import cache
from numbers import Real
from typing import Annotated, get_origin, get_type_hints

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import refusal, require

TINY, HUGE = math.ulp(0.0), sys.float_info.max
"""Smallest number above 0, and largest finite number."""


def number(name: str, value: object, lowest: float, highest: float, allowed: str) -> float:
    """Return a number from `lowest` to `highest`; zero-dimensional arrays count as numbers.

    >>> number("rate", np.array(48_000), TINY, HUGE, "above 0 Hz")
    48000.0
    >>> number("rate", "fast", TINY, HUGE, "above 0 Hz")
    Traceback (most recent call last):
    underfoot.errors.BadValue: rate is 'fast'; allowed: above 0 Hz
    """
    given = value.item() if isinstance(value, np.ndarray) and value.ndim == 0 else value
    try:
        found = float(given) if isinstance(given, Real) else math.nan
    except OverflowError:
        found = math.nan
    require(lowest <= found <= highest, name, value, allowed)
    return found


def integer(name: str, value: object, lowest: int, highest: int, allowed: str) -> int:
    """Return a whole number from `lowest` to `highest`.

    >>> integer("fibres", 2e3, 1, 10**12, "1 to 1e12")
    2000
    >>> integer("fibres", 2.5, 1, 10**12, "1 to 1e12")
    Traceback (most recent call last):
    underfoot.errors.BadValue: fibres is 2.5; allowed: a whole number, 1 to 1e12
    """
    if isinstance(value, int | np.integer):
        found: float = int(value)
        require(lowest <= found <= highest, name, value, f"a whole number, {allowed}")
    else:
        found = number(name, value, lowest, highest, f"a whole number, {allowed}")
        require(found == int(found), name, value, f"a whole number, {allowed}")
    return int(found)


def is_text(value: object) -> bool:
    """Return whether this is text that a file can have: UTF-8 has no halves of a surrogate pair, which are what Python
    has of the name of a file that is not UTF-8.

    >>> is_text("rain.wav"), is_text(b"caf\\xe9.wav".decode(errors="surrogateescape")), is_text(3)
    (True, False, False)
    """
    return isinstance(value, str) and (value.isascii() or not re.search("[\ud800-\udfff]", value))


def choice(name: str, value: object, choices: Collection[str]) -> None:
    """Raise `BadValue` unless a value is one of these words.

    >>> choice("footwear", ["shoe"], ("barefoot", "shoe"))
    Traceback (most recent call last):
    underfoot.errors.BadValue: footwear is ['shoe']; allowed: barefoot, shoe
    """
    require(isinstance(value, str) and value in choices, name, value, ", ".join(choices))


def numbers(name: str, values: ArrayLike) -> NDArray[np.float64]:
    """Return finite numbers in one dimension as a contiguous array.

    >>> numbers("stress", [1, 2])
    array([1., 2.])
    >>> numbers("stress", [[1], [1, 2]])
    Traceback (most recent call last):
    underfoot.errors.BadValue: stress is [[1], [1, 2]]; allowed: finite numbers in one dimension
    """
    allowed = "finite numbers in one dimension"
    found = array(name, values, allowed)
    require(found.ndim == 1 and bool(np.isfinite(found).all()), name, values, allowed)
    return found


def array(name: str, values: ArrayLike, allowed: str, last: int = 0) -> NDArray[np.float64]:
    """Return numbers, which may be NaN, as a contiguous array of any shape, or with a `last` axis of this length.

    >>> array("points_m", [[1, 2]], "shape (..., 2)", 2)
    array([[1., 2.]])
    >>> array("points_m", "here", "shape (..., 2)", 2)
    Traceback (most recent call last):
    underfoot.errors.BadValue: points_m is 'here'; allowed: shape (..., 2)
    """
    try:
        found = None if values is None or np.iscomplexobj(values) else np.asarray(values, np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        found = None
    if found is None:
        raise refusal(name, values, allowed)
    require(not last or found.shape[-1:] == (last,), f"the shape of {name}", found.shape, allowed)
    return found


def require_alike(**arrays: ArrayLike) -> None:
    """Raise `BadValue` unless all arrays have the shape of the first.

    >>> require_alike(x=[1.0, 2.0], f=[0.1, 0.2, 0.3])
    Traceback (most recent call last):
    underfoot.errors.BadValue: the shape of f is (3,); allowed: (2,), as x
    """
    (first, one), *others = arrays.items()
    for name, other in others:
        given, allowed = np.shape(other), np.shape(one)
        require(given == allowed, f"the shape of {name}", given, f"{allowed}, as {first}")


@cache
def ranges_of(kind: type[Struct]) -> Mapping[str, tuple[float, float]]:
    """Return the lowest and highest value of each number that a struct declares with its range, by name.

    >>> class Mount(Struct):
    ...     damping: Annotated[float, (0.0, 1.0)] = 0.1
    >>> ranges_of(Mount)
    {'damping': (0.0, 1.0)}
    """
    hints = get_type_hints(kind, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items() if get_origin(hint) is Annotated}


def require_within(given: Struct) -> None:
    """Raise `BadValue` unless each number of a struct is within its range, as `ranges_of` finds it.

    >>> class Mount(Struct):
    ...     damping: Annotated[float, (0.0, 1.0)] = 0.1
    >>> require_within(Mount(2.0))
    Traceback (most recent call last):
    underfoot.errors.BadValue: damping is 2.0; allowed: 0 to 1
    """
    for name, (low, high) in ranges_of(type(given)).items():
        value = getattr(given, name)
        require(low <= value <= high, name, value, f"{low:g} to {high:g}")


def plain(value: object) -> object:
    """Return a scalar or an array of NumPy as Python's own number, text or lists, and anything else as it is.

    >>> plain(np.float32(0.5)), plain(np.array([[1.0, 2.0]])), plain([1, 2])
    (0.5, [[1.0, 2.0]], [1, 2])
    """
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else value


def seed_of(value: object) -> int:
    """Return a seed: a whole number from 0 to 2^63.

    >>> seed_of(7)
    7
    """
    return integer("seed", value, 0, 2**63 - 1, "0 to 2^63 - 1")
