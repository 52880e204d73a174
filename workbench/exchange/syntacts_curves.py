"""Curves between the keys of a Syntacts envelope: the easing functions of Penner (2001)."""

from collections.abc import Callable

import numpy as np

from underfoot.errors import BadValue
from underfoot.kernels import Floats

Easing = Callable[[Floats], Floats]


def shaped(name: str, share: Floats) -> Floats:
    """Return the share of the change in value at a share of the time, 0 to 1, on a curve such as "Quadratic::Out".

    >>> shaped("Quadratic::Out", np.array([0.0, 0.5, 1.0])).tolist()
    [0.0, 0.75, 1.0]
    """
    if name in _WHOLE:
        return _WHOLE[name](share)
    family, _, way = name.partition("::")
    if family not in _OUT or way not in ("In", "Out", "InOut"):
        raise BadValue(f"an envelope has a curve {name[:40]!r}; allowed: those of Syntacts 1.3")
    ease = _back(2.5949095) if name == "Back::InOut" else _OUT[family]
    if way == "Out":
        return ease(share)
    if way == "In":
        return 1.0 - ease(1.0 - share)
    first = 0.5 * (1.0 - ease(1.0 - np.minimum(2.0 * share, 1.0)))
    return np.where(share < 0.5, first, 0.5 + 0.5 * ease(np.maximum(2.0 * share - 1.0, 0.0)))


def _smooth(power: int, *terms: float) -> Easing:
    return lambda t: t**power * np.polyval(terms, t)


def _power(exponent: int) -> Easing:
    return lambda t: 1.0 - (1.0 - t) ** exponent


def _exponential(t: Floats) -> Floats:
    return np.where(t >= 1.0, 1.0, 1.0 - 2.0 ** (-10.0 * t))


def _elastic(t: Floats) -> Floats:
    return np.where((t <= 0.0) | (t >= 1.0), t, 2.0 ** (-10.0 * t) * np.sin((t - 0.1) * 2.0 * np.pi / 0.4) + 1.0)


def _back(overshoot: float) -> Easing:
    return lambda t: 1.0 + (t - 1.0) ** 2 * ((overshoot + 1.0) * (t - 1.0) + overshoot)


def _bounce(t: Floats) -> Floats:
    pieces = ((1.0, 0.0, 0.0), (2.0, 1.5, 0.75), (2.5, 2.25, 0.9375), (np.inf, 2.625, 0.984375))
    found = np.zeros_like(t)
    before = -np.inf
    for end, middle, base in pieces:
        inside = (2.75 * t >= before) & (2.75 * t < end)
        found = np.where(inside, 7.5625 * (t - middle / 2.75) ** 2 + base, found)
        before = end
    return found


_WHOLE: dict[str, Easing] = {
    "Instant": np.ones_like,
    "Delayed": lambda t: np.where(t < 1.0, 0.0, 1.0),
    "Linear": lambda t: t,
    "Smoothstep": _smooth(2, -2.0, 3.0),
    "Smootherstep": _smooth(3, 6.0, -15.0, 10.0),
    "Smootheststep": _smooth(4, -20.0, 70.0, -84.0, 35.0),
}
_OUT: dict[str, Easing] = {
    "Quadratic": _power(2),
    "Cubic": _power(3),
    "Quartic": _power(4),
    "Quintic": _power(5),
    "Sinusoidal": lambda t: np.sin(0.5 * np.pi * t),
    "Exponential": _exponential,
    "Circular": lambda t: np.sqrt(np.maximum(1.0 - (t - 1.0) ** 2, 0.0)),
    "Elastic": _elastic,
    "Back": _back(1.70158),
    "Bounce": _bounce,
}
"""The "out" variant of each family; the others are its mirror images."""
