"""Slipping block: a damped oscillator in white noise, whose transition density is Gaussian.

`dx = v dt`, `dv = (-w0^2 x - zeta v) dt + sqrt(2 D) dW` (8.23). From (x, v) the state after a time t is normal with
mean `A(t) (x, v)` and covariance `S(t)`.
"""

import math
from typing import NamedTuple

import numpy as np

from underfoot.arguments import number
from underfoot.errors import require
from underfoot.kernels import kernel

_GAUSS_NODES, _GAUSS_WEIGHTS = np.polynomial.legendre.leggauss(10)


class BlockOnBelt(NamedTuple):
    """Block on a spring, in white noise, carried by a belt; and the state in which its slip begins.

    Any consistent units; those given here are SI. `require_slip` has the ranges.

    >>> block = BlockOnBelt(w0=1.0, zeta=0.1, noise=0.4, belt_velocity=1.0, x0=0.0, v0=-1.0)
    """

    w0: float
    """Natural angular frequency, rad/s."""
    zeta: float
    """Damping rate, 1/s (damping over mass; twice the damping ratio times w0)."""
    noise: float
    """Noise intensity D, m^2/s^3: white noise adds 2 D t to the variance of the velocity."""
    belt_velocity: float
    """v_b, m/s. The slip ends when the block's velocity first reaches it."""
    x0: float
    """Position at slip onset, m."""
    v0: float
    """Velocity at slip onset, m/s."""


class Transition(NamedTuple):
    """Propagator A and covariance S of position x and velocity v over one time."""

    a_xx: float
    a_xv: float
    a_vx: float
    a_vv: float
    s_xx: float
    s_xv: float
    s_vv: float


@kernel
def transition(w0: float, zeta: float, noise: float, t: float) -> Transition:
    """Return the propagator and the covariance after `t` > 0 s.

    Matrix exponential and covariance of 8.23 (8.24 to 8.26, corrected), for any damping. Where the closed form would
    cancel (small t, small or large zeta) the covariance is integrated over a part of t, as a sum of positive terms, and
    the part is doubled until it is t.

    >>> abs(transition(1.0, 0.1, 0.4, 1e-3).s_vv / (2 * 0.4 * 1e-3) - 1) < 1e-3
    True
    """
    fastest = max(w0, zeta)
    if fastest * t > 0.5 and zeta > 1e-3 * fastest and w0 * w0 * t > 1e-3 * zeta:
        xx, xv, vx, vv = _propagator(w0, zeta, t)
        level = noise / zeta
        s_xx = level * ((1.0 - xx * xx) / (w0 * w0) - xv * xv)
        s_xv = -level * (xx * vx / (w0 * w0) + xv * vv)
        s_vv = level * (1.0 - vx * vx / (w0 * w0) - vv * vv)
        return Transition(xx, xv, vx, vv, s_xx, s_xv, s_vv)
    doublings = 0
    part = t
    while fastest * part > 1.0:
        part *= 0.5
        doublings += 1
    s_xx = s_xv = s_vv = 0.0
    for i in range(_GAUSS_NODES.size):
        xx, xv, vx, vv = _propagator(w0, zeta, 0.5 * part * (1.0 + _GAUSS_NODES[i]))
        weight = noise * part * _GAUSS_WEIGHTS[i]
        s_xx += weight * xv * xv
        s_xv += weight * xv * vv
        s_vv += weight * vv * vv
    xx, xv, vx, vv = _propagator(w0, zeta, part)
    for _ in range(doublings):
        s_xx, s_xv, s_vv = (
            s_xx + xx * xx * s_xx + 2.0 * xx * xv * s_xv + xv * xv * s_vv,
            s_xv + xx * vx * s_xx + (xx * vv + xv * vx) * s_xv + xv * vv * s_vv,
            s_vv + vx * vx * s_xx + 2.0 * vx * vv * s_xv + vv * vv * s_vv,
        )
        xx, xv, vx, vv = xx * xx + xv * vx, xx * xv + xv * vv, vx * xx + vv * vx, vx * xv + vv * vv
    return Transition(xx, xv, vx, vv, s_xx, s_xv, s_vv)


def require_slip(block: BlockOnBelt, t_end: float, error: float) -> tuple[BlockOnBelt, float, float]:
    """Return the arguments as float64; `BadValue` names the first value that is out of range.

    `t_end` is the observation time, s; `error` the largest CDF difference. Ranges are wide, and relative to the units
    1/w0 and v_b/w0; beyond them float64 or the computing time would not suffice.

    >>> require_slip(BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, 1.0), 20.0, 1e-4)
    Traceback (most recent call last):
    underfoot.errors.BadValue: v0 is 1.0; allowed: below belt_velocity, and not below -1e9 times it
    """
    require(isinstance(block, BlockOnBelt), "block", block, "a BlockOnBelt")
    rate = number("w0", block.w0, 1e-30, 1e30, "1e-30 to 1e30 rad/s")
    belt = number("belt_velocity", block.belt_velocity, 1e-30, 1e30, "1e-30 to 1e30 m/s")
    level = rate * belt * belt
    below_belt = "below belt_velocity, and not below -1e9 times it"
    checked = BlockOnBelt(
        rate,
        number("zeta", block.zeta, 0.0, 1e9 * rate, "0 to 1e9 w0"),
        number("noise", block.noise, 1e-15 * level, 1e15 * level, "1e-15 to 1e15 w0 v_b^2"),
        belt,
        number("x0", block.x0, -1e12 * belt / rate, 1e12 * belt / rate, "at most 1e12 v_b / w0 in size"),
        number("v0", block.v0, -1e9 * belt, math.nextafter(belt, 0.0), below_belt),
    )
    t_end = number("t_end", t_end, 1e-12 / rate, 1e12 / rate, "1e-12 to 1e12 / w0")
    return checked, t_end, number("error", error, 1e-6, 0.1, "1e-6 to 0.1")


@kernel
def _propagator(w0: float, zeta: float, t: float) -> tuple[float, float, float, float]:
    """Return A_xx, A_xv, A_vx and A_vv after t: by a series near critical damping, else by (hyperbolic) sines."""
    half = 0.5 * zeta
    square = (w0 * w0 - half * half) * t * t
    if abs(square) < 1e-6:
        decay = math.exp(-half * t)
        sine = decay * t * (1.0 - square / 6.0 * (1.0 - square / 20.0))
        cosine = decay * (1.0 - square / 2.0 * (1.0 - square / 12.0))
    elif square > 0.0:
        decay = math.exp(-half * t)
        angle = math.sqrt(square)
        sine = decay * t * math.sin(angle) / angle
        cosine = decay * math.cos(angle)
    else:
        angle = math.sqrt(-square)
        slow = 0.5 * math.exp(-w0 * w0 * t * t / (half * t + angle))
        fast = 0.5 * math.exp(-half * t - angle)
        sine = t * (slow - fast) / angle
        cosine = slow + fast
    return cosine + half * sine, sine, -w0 * w0 * sine, cosine - half * sine
