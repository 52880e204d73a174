"""Exact motion of a driven mass-spring-damper over one frame, with coefficients that may change between frames.

The equation is `x'' + gamma x' + kappa x = g u` with time in frames: kappa = K h^2 / M and gamma = B h / M for
stiffness K, damping B, mass M and a frame of h seconds. The drive u is linear between frames. The coefficients follow
from the impulse response f (f(0) = 0, f'(0) = 1) and its first and second integrals. These are power series, evaluated
at a step that is halved until it converges in a few terms, and doubled back by the addition theorem. One path serves
light, critical and heavy damping and a missing spring, without transcendental functions, to rounding error.
"""

import math

import numpy as np

from underfoot.kernels import kernel

_LARGEST_KAPPA = 0.0625
_LARGEST_GAMMA = 0.25
"""Above these values the step is halved; at or below them the series needs at most 15 terms."""

_RECIPROCAL_FACTORIALS = 1.0 / np.cumprod(np.maximum(np.arange(24.0), 1.0))


@kernel
def frame_response(kappa: float, gamma: float) -> tuple[float, float, float, float]:
    """Return the impulse response f one frame after the impulse, its slope f', and its first and second integrals.

    `kappa` and `gamma` are dimensionless, finite and at least 0. Without spring and damping f = t:

    >>> frame_response(0.0, 0.0) == (1.0, 1.0, 1 / 2, 1 / 6)
    True
    """
    halvings = 0
    while kappa > _LARGEST_KAPPA or gamma > _LARGEST_GAMMA:
        kappa *= 0.25
        gamma *= 0.5
        halvings += 1
    first = 0.5
    second = _RECIPROCAL_FACTORIALS[3]
    before, term = 1.0, -gamma
    for n in range(4, _RECIPROCAL_FACTORIALS.size):
        weight = _RECIPROCAL_FACTORIALS[n]
        second += term * weight
        first += term * weight * n
        before, term = term, -gamma * term - kappa * before
        if max(abs(before), abs(term)) * weight < 1e-18:
            break
    response = 1.0 - gamma * first - kappa * second
    slope = 1.0 - gamma * response - kappa * first
    for _ in range(halvings):
        doubled = second + first + response * (first + gamma * second) + slope * second
        first = 0.25 * (first + response * (response + gamma * first) + slope * first)
        kept = slope + gamma * response
        slope, response = slope * slope - kappa * response * response, 0.5 * response * (kept + slope)
        second = 0.125 * doubled
        kappa *= 4.0
        gamma *= 2.0
    return response, slope, first, second


@kernel
def frame_step(
    kappa: float, gamma: float, gain: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the coefficients c0 to c7 of the motion over one frame, in which the drive goes from u0 to u1.

    `x1 = c0 x + c1 w + c2 u0 + c3 u1` and `w1 = c4 x + c5 w + c6 u0 + c7 u1`, where w is the velocity per frame.

    >>> c = frame_step(0.0, 0.0, 1.0)  # a free mass: half of the acceleration, a third of it late
    >>> [round(value, 4) for value in c]
    [1.0, 1.0, 0.3333, 0.1667, -0.0, 1.0, 0.5, 0.5]
    """
    response, slope, first, second = frame_response(kappa, gamma)
    return (
        1.0 - kappa * first,
        response,
        gain * (first - second),
        gain * second,
        -kappa * response,
        slope,
        gain * (response - first),
        gain * first,
    )


@kernel
def resolved(frame_s: float, stiffness: float, damping: float, creep: float, mass: float) -> tuple[float, float]:
    """Return the mass and damping that frames of `frame_s` s can resolve, for a total damping `damping` + `creep`.

    The mass is raised until the time constants M / B and sqrt(M / K) are at least a thousandth of a frame. If the
    system would still ring above half the frame rate, `damping` is raised to half of critical damping. Both may be 0.
    Where frames resolve the motion, both are returned unchanged. Any consistent units.

    >>> resolved(1e-3, 1.0, 0.0065, 0.0, 1e-3)
    (0.001, 0.0065)
    >>> mass, damping = resolved(1e-3, 1.0, 0.0, 0.0, 0.0)
    >>> 0.0 < mass < 1e-9, 0.0 < damping < 1e-5
    (True, True)
    """
    mass = max(mass, 1e-3 * frame_s * (damping + creep), 1e-6 * frame_s * frame_s * stiffness)
    if stiffness * frame_s * frame_s > math.pi**2 * mass:
        damping = max(damping, math.sqrt(stiffness * mass))
    return mass, damping


@kernel
def crossing(start: float, end: float, level: float) -> float:
    """Return where a displacement from `start` to `end` crosses `level`, as a share of the frame, below 1.

    >>> crossing(0.0, 2.0, 0.5)
    0.25
    """
    return min(max((level - start) / (end - start), 0.0), 0.999)
