"""Energy-stable sub-step of a hammer on a modal object (equations 3.3 and 3.4).

The force is k x^a (1 + mu x') while x > 0 and never negative; x is the penetration of the hammer into the surface.
(The thesis prints the other sign, which creates energy; see docs/models.md#impacts.) A mode is a phasor z with
z' = (-b + i w) z + g F; it contributes Im z to the surface's displacement.

Over a step of h seconds the force is F0 + F1 (tau - 1/2), tau from 0 to 1. Under this force hammer and modes move
exactly, and take the work F0 D + F1 W, where D is the change of x and W the integral of (tau - 1/2) x'. With

    F0 = E - K W,   F1 = K D,   E = (Phi(x + D) - Phi(x)) / D,   Phi = k x^(a+1) / (a+1)

this is the change of the contact's energy Phi, for any K. K = 0 is the discrete-gradient scheme, of order 2;
K near Phi'' gives order 4, because K W is the contribution of the path's curvature to the mean force.
The damping, the same projection of mu Phi' x', is dissipative: mu/h (E D^2 + K D^2 W + 12 E' W^2) >= 0 wherever
E >= K |W|; elsewhere, and where the force is clipped at 0, the step is of order 2.
"""

import cmath
import math

from underfoot.kernels import kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.modal.contact_series import SERIES

CONTACT = Layout(
    "contact",
    *("stiffness", "exponent", "nu", "a", "b", "c"),
    *("d_push", "d_tilt", "w_push", "w_tilt"),
    series=SERIES,
)
"""Parameters of a step: k and its exponent, mu / h, and the compliances in D = D_free - a F0 + b F1 and
W = W_free - b F0 - c F1; what F0 (push) and F1 (tilt) subtract from D_free and W_free of the next step; and the force
as a series."""

STEP = Layout(
    "contact_coefficients",
    **{f"{name}_{part}": ("row",) for name in ("change", "moment", "push", "tilt") for part in ("re", "im")},
)
"""Per mode: the change of z over a step, the contribution of z to W, and those of F0 and F1 to z."""

_WHOLE, _CLIPPED, _REFUSED = range(3)
_TERMS = 16  # of the series in z up to 1/2; the next is below rounding
_MEAN_TERMS = tuple(1.0 / math.factorial(n + 1) for n in range(_TERMS))
_MOMENT_TERMS = tuple(1.0 / (math.factorial(n) * 2.0 * (n + 2) * (n + 3)) for n in range(_TERMS))


@kernel
def prepare(
    contact: Memory, step: Memory, m: int, decay_per_s: float, angular: float, mobility: float, h: float
) -> None:
    """Write the coefficients of mode `m` for steps of `h` seconds, and add its compliance to that of the contact."""
    z = complex(-decay_per_s * h, angular * h)
    mean, moment = _means(z)
    change = z * mean
    curve = z * z * moment
    push = mobility * h * mean
    tilt = -mobility * h * z * moment
    step.change_re[m], step.change_im[m] = change.real, change.imag
    step.moment_re[m], step.moment_im[m] = curve.real, curve.imag
    step.push_re[m], step.push_im[m] = push.real, push.imag
    step.tilt_re[m], step.tilt_im[m] = tilt.real, tilt.imag
    contact.a += push.imag
    contact.b -= tilt.imag
    contact.c += mobility * h * (moment * (1.0 - 0.5 * z)).imag
    contact.d_push += (change * push).imag
    contact.d_tilt += (change * tilt).imag
    contact.w_push += (curve * push).imag
    contact.w_tilt += (curve * tilt).imag


@kernel
def solve(
    contact: Memory, x: float, elastic: float, free_d: float, free_w: float, mean: float, slope: float
) -> tuple[float, float, float, float]:
    """Solve one step from the penetration `x`: return F0, F1, D and the elastic force k x^exponent at its end.

    `elastic` is that force at its start; `free_d` and `free_w` are D and W without force; `mean` and `slope` are
    guesses of F0 and F1. `contact` has the fields of `CONTACT`.
    """
    exponent, a, b = contact.exponent, contact.a, contact.b
    if x <= 0.0 and x + free_d <= 0.0:
        return 0.0, 0.0, free_d, 0.0
    d = free_d - a * mean + b * slope
    end = contact.stiffness * power(x + d, exponent)
    curvature = 0.0
    if abs(d) > 1e-9 * abs(x):
        curvature = (end - elastic) / d
    elif x > 0.0:
        curvature = exponent * elastic / x
    if b > 0.0:
        curvature /= 1.0 + b * curvature
        f0, f1, moved, force, kind = _newton(contact, x, elastic, free_d, free_w, d, end, curvature)
        if kind == _WHOLE:
            return f0, f1, moved, force
        if kind == _CLIPPED:
            moved = free_d - a * f0
            force = contact.stiffness * power(x + moved, exponent)
            returned = mean_force(x, x + moved, elastic, force, exponent)
            if moved <= 0.0 and f0 <= returned:  # no more than the contact returns
                return f0, 0.0, moved, force
    if x <= 0.0:  # from above, the iteration converges monotonically
        d = min(free_d, ((exponent + 1.0) * free_d**2 / (a * contact.stiffness)) ** (1.0 / (exponent + 1.0)) - x)
        end = contact.stiffness * power(x + d, exponent)
    return _newton(contact, x, elastic, free_d, free_w, d, end, 0.0)[:4]


@kernel
def power(x: float, exponent: float) -> float:
    """Return x^exponent for x > 0, else 0; fast for Hertz's 3/2."""
    if x <= 0.0:
        return 0.0
    if exponent == 1.5:
        return x * math.sqrt(x)
    return x**exponent


@kernel
def _newton(
    contact: Memory, x: float, elastic: float, free_d: float, free_w: float, d: float, end: float, curvature: float
) -> tuple[float, float, float, float, int]:
    """Solve for D from a guess `d`, with `end` the elastic force there; the last value returned is the outcome.

    Without `curvature` this is the scheme of order 2, clipped at 0, which always succeeds. With it, `_CLIPPED` comes
    with the mean of a force that reaches or leaves 0 within the step, and `_REFUSED` without a solution.
    """
    exponent, nu, a, b, c = contact.exponent, contact.nu, contact.a, contact.b, contact.c
    tilt = 12.0 * nu * mean_force(x, x + d, elastic, end, exponent) if curvature > 0.0 else 0.0
    scale = 1.0 - b * curvature + c * tilt
    if scale < 0.1:
        return 0.0, 0.0, 0.0, 0.0, _REFUSED
    for _ in range(100):
        y = x + d
        e = mean_force(x, y, elastic, end, exponent)
        if abs(d) > 1e-3 * max(abs(x), abs(y)):
            de = (end - e) / d
        else:
            de = exponent * e / max(x + y, 1e-300)
        g = 1.0 + nu * d
        q, dq = e * g, de * g + e * nu
        if g < 0.0 and curvature == 0.0:
            q = dq = 0.0
        r, dr = curvature * d * g, curvature * (g + nu * d)
        w, dw = (free_w - b * q - c * r) / scale, -(b * dq + c * dr) / scale
        excess = d - free_d + a * (q - curvature * w) - b * (r + tilt * w)
        rise = 1.0 + a * (dq - curvature * dw) - b * (dr + tilt * dw)
        if not rise > 0.05:
            return 0.0, 0.0, 0.0, 0.0, _REFUSED
        step = -excess / rise
        d += step
        if abs(step) <= 1e-8 * abs(x + d) + 1e-14 * abs(x):
            # The next correction would be the square of this one: first order suffices.
            w += dw * step
            f0 = (q + dq * step) - curvature * w
            if y > 0.0:
                end += exponent * end / y * step
            if curvature > 0.0:
                first, last = 1.0 + nu * (d - 6.0 * w), 1.0 + nu * (d + 6.0 * w)
                if (first < 0.0 or last < 0.0) and x > 0.0:
                    if first > 0.0:
                        return 0.5 * elastic * first * first / (first - last), 0.0, 0.0, 0.0, _CLIPPED
                    if last > 0.0:
                        return 0.5 * end * last * last / (last - first), 0.0, 0.0, 0.0, _CLIPPED
                    return 0.0, 0.0, 0.0, 0.0, _CLIPPED
                if f0 < 0.0 or e < curvature * abs(w):
                    return 0.0, 0.0, 0.0, 0.0, _REFUSED
            return max(f0, 0.0), r + dr * step + tilt * w, d, end if x + d > 0.0 else 0.0, _WHOLE
        end = contact.stiffness * power(x + d, exponent)
    if curvature > 0.0:
        return 0.0, 0.0, 0.0, 0.0, _REFUSED
    return max((free_d - d) / a, 0.0), 0.0, d, end, _WHOLE


@kernel
def mean_force(x: float, y: float, start: float, end: float, exponent: float) -> float:
    """Return the mean of the elastic force from x to y, whose end values are `start` and `end`."""
    d = y - x
    if x > 0.0 and y > 0.0 and abs(d) <= 1e-3 * x:
        return 0.5 * (start + end) - d / 12.0 * exponent * (end / y - start / x)
    if d == 0.0:
        return start
    return (end * max(y, 0.0) - start * max(x, 0.0)) / ((exponent + 1.0) * d)


@kernel
def _means(z: complex) -> tuple[complex, complex]:
    """The integrals over tau from 0 to 1 of exp(z tau), and of (tau - 1/2) exp(z tau) / z."""
    if abs(z) > 0.5:
        mean = (cmath.exp(z) - 1.0) / z
        return mean, (0.5 * mean + (1.0 - mean) / z) / z
    mean, moment = complex(0.0), complex(0.0)
    for n in range(_TERMS - 1, -1, -1):
        mean = mean * z + _MEAN_TERMS[n]
        moment = moment * z + _MOMENT_TERMS[n]
    return mean, moment
