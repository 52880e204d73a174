"""Series solution of a sub-step of `contact_step` whose penetration changes by at most a tenth.

With u = D / x the force is k x^a (1 + u)^a, and its mean and slopes are series in u. There are no powers, roots or
cancelling quotients, and one second-order Newton step from the guess gives the solution of the iteration in
`contact_step`, in a third of the time. Where it does not apply, `contact_step` takes over.
"""

from underfoot.kernels import Floats, kernel, modal_inlined
from underfoot.layouts import Layout, Memory

_TERMS = 12
_LARGEST = 0.1
"""Largest |u|: the first omitted term is then below rounding."""
_NEAR = 1e-5
"""Largest error of the guess of D, relative to x; the error after the Newton step is its cube."""

SERIES = Layout("force_series", mean=_TERMS, slope=6, secant=4)
"""Coefficients of powers of u for the mean force, its derivative, and (F(y) - F(x)) / D, in units of k x^a and x."""


@kernel
def expand(series: Memory, exponent: float) -> None:
    """Write the series coefficients for an exponent.

    >>> series = SERIES.zeros()
    >>> expand(series, 1.5)
    >>> series.mean[:3].tolist(), series.secant[:2].tolist()
    ([1.0, 0.75, 0.125], [1.5, 0.375])
    """
    binomial = 1.0
    for k in range(_TERMS):
        series.mean[k] = binomial / (k + 1.0)
        binomial *= (exponent - k) / (k + 1.0)
        if k < series.slope.size:
            series.slope[k] = binomial * (k + 1.0) / (k + 2.0)
        if k < series.secant.size:
            series.secant[k] = binomial


@modal_inlined
def solve_by_series(
    contact: Memory, x: float, per_x: float, elastic: float, free_d: float, free_w: float, d: float
) -> tuple[float, float, float, float, bool]:
    """Return the solution of `contact_step.solve` from a penetration x > 0 and a guess `d`, and whether it is valid.

    `per_x` is 1 / x. Instead of the elastic force at the end of the step, k y^a y is returned.
    """
    a, b, c, nu, series = contact.a, contact.b, contact.c, contact.nu, contact.series
    u = d * per_x
    u2 = u * u
    u4 = u2 * u2
    rate = elastic * per_x
    secant = rate * ((series.secant[0] + series.secant[1] * u) + (series.secant[2] + series.secant[3] * u) * u2)
    k = secant - b * secant * secant
    e = elastic * _sum_of_twelve(series.mean, u, u2, u4)
    p = series.slope
    de = rate * (((p[0] + p[1] * u) + (p[2] + p[3] * u) * u2) + (p[4] + p[5] * u) * u4)
    dde = rate * per_x * (p[1] + 2.0 * p[2] * u + 3.0 * p[3] * u2)
    tilt = 12.0 * nu * elastic * (1.0 + p[0] * u + series.mean[2] * u2)
    # Value, first and second derivative with respect to D at the guess. The equation for D is multiplied by `scale`.
    # Terms that depend on the sums come last, because the next step waits for them.
    g = 1.0 + nu * d
    q, dq, ddq = e * g, de * g + e * nu, dde * g + 2.0 * de * nu
    r, dr, ddr = k * (d * g), k * (g + nu * d), 2.0 * k * nu
    scale = 1.0 - b * k + c * tilt
    lever = a * k + b * tilt
    of_q, of_r = scale * a + lever * b, lever * c - scale * b
    excess = ((scale * (d - free_d) - lever * free_w) + of_r * r) + of_q * q
    rise = (scale + of_r * dr) + of_q * dq
    bend = of_r * ddr + of_q * ddq
    per_scale, per_rise = 1.0 / scale, 1.0 / rise
    w = per_scale * ((free_w - c * r) - b * q)
    dw, ddw = -per_scale * (c * dr + b * dq), -per_scale * (c * ddr + b * ddq)
    step = -excess * per_rise
    step -= 0.5 * bend * per_rise * (step * step)
    f0 = (q - k * w) + step * ((dq - k * dw) + 0.5 * (ddq - k * ddw) * step)
    f1 = (r + tilt * w) + step * ((dr + tilt * dw) + 0.5 * (ddr + tilt * ddw) * step)
    moved = d + step
    far = 6.0 * abs(w + dw * step)
    whole = abs(u) <= _LARGEST and abs(step) <= _NEAR * x and b > 0.0 and scale >= 0.1 and rise > 0.05 * scale
    # Then damping only dissipates, and nothing is clipped: see `contact_step`.
    whole = whole and f0 >= 0.0 and 6.0 * e >= k * far and nu * (moved - far) >= -1.0
    work = (e + step * (de + 0.5 * dde * step)) * moved
    return f0, f1, moved, elastic * x + (contact.exponent + 1.0) * work, whole


@modal_inlined
def _sum_of_twelve(p: Floats, u: float, u2: float, u4: float) -> float:
    low = ((p[0] + p[1] * u) + (p[2] + p[3] * u) * u2) + ((p[4] + p[5] * u) + (p[6] + p[7] * u) * u2) * u4
    return low + ((p[8] + p[9] * u) + (p[10] + p[11] * u) * u2) * (u4 * u4)
