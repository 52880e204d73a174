"""The slipping block between stick and stick: a damped oscillator in white noise, whose transition law is Gaussian.

`dx = v dt`, `dv = (-w0^2 x - zeta v) dt + sqrt(2 D) dW` (8.23): x in m, v in m/s, w0 in rad/s, the damping zeta is a
rate in 1/s, the noise D in m^2/s^3. From (x, v) the state after t is normal about `A(t) (x, v)` with covariance `S(t)`.
"""

import math

import numpy as np

from underfoot.arguments import number
from underfoot.kernels import kernel

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(10)


@kernel
def transition(w0, zeta, noise, t):
    """Propagator `(A_xx, A_xv, A_vx, A_vv)` and covariance `(S_xx, S_xv, S_vv)` after `t` > 0 s, as seven numbers.

    The matrix exponential and covariance of 8.23 (8.24 to 8.26 as the errata correct them), for any damping. Where the
    closed form would cancel (small t, small or large zeta) the covariance is summed from positive terms and doubled up.

    >>> values = transition(1.0, 0.1, 0.4, 1e-3)
    >>> abs(values[6] / (2 * 0.4 * 1e-3) - 1) < 1e-3
    True
    """
    fastest = max(w0, zeta)
    if fastest * t > 0.5 and zeta > 1e-3 * fastest and w0 * w0 * t > 1e-3 * zeta:
        xx, xv, vx, vv = _propagator(w0, zeta, t)
        level = noise / zeta
        s_xx = level * ((1.0 - xx * xx) / (w0 * w0) - xv * xv)
        s_xv = -level * (xx * vx / (w0 * w0) + xv * vv)
        s_vv = level * (1.0 - vx * vx / (w0 * w0) - vv * vv)
        return xx, xv, vx, vv, s_xx, s_xv, s_vv
    doublings = 0
    part = t
    while fastest * part > 1.0:
        part *= 0.5
        doublings += 1
    s_xx = s_xv = s_vv = 0.0
    for i in range(_NODES.size):
        xx, xv, vx, vv = _propagator(w0, zeta, 0.5 * part * (1.0 + _NODES[i]))
        weight = noise * part * _WEIGHTS[i]
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
    return xx, xv, vx, vv, s_xx, s_xv, s_vv


def require_slip(
    w0: float, zeta: float, noise: float, belt_velocity: float, x0: float, v0: float, t_end: float, error: float
) -> tuple[float, ...]:
    """What every slip needs, in this order, as float64; `BadValue` names the first value that is out of its range.

    Ranges are wide, and go with the units 1/w0 and v_b/w0: beyond them float64 or patience would end.

    >>> require_slip(1.0, 0.1, 0.4, 1.0, 0.0, 1.0, 20.0, 1e-4)
    Traceback (most recent call last):
    underfoot.errors.BadValue: v0 is 1.0; allowed: below belt_velocity, and not below -1e9 times it
    """
    rate = number("w0", w0, 1e-30, 1e30, "1e-30 to 1e30 rad/s")
    belt = number("belt_velocity", belt_velocity, 1e-30, 1e30, "1e-30 to 1e30 m/s")
    level = rate * belt * belt
    return (
        rate,
        number("zeta", zeta, 0.0, 1e9 * rate, "0 to 1e9 w0"),
        number("noise", noise, 1e-15 * level, 1e15 * level, "1e-15 to 1e15 w0 v_b^2"),
        belt,
        number("x0", x0, -1e12 * belt / rate, 1e12 * belt / rate, "at most 1e12 v_b / w0 in size"),
        number("v0", v0, -1e9 * belt, math.nextafter(belt, 0.0), "below belt_velocity, and not below -1e9 times it"),
        number("t_end", t_end, 1e-12 / rate, 1e12 / rate, "1e-12 to 1e12 / w0"),
        number("error", error, 1e-6, 0.1, "1e-6 to 0.1"),
    )


@kernel
def _propagator(w0, zeta, t):
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
