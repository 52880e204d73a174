"""A hammer in contact with a modal object: one sub-step of equation 3.3 with 3.4, energy exact.

The contact force is k x^a + lambda x^a x' = k x^a (1 + mu x') while x > 0 and it is not negative, x the hammer's way into
the surface. (The thesis prints the other sign, which makes energy; see the errata.) Each mode is a phasor z with
z' = (-b + i w) z + g F, and its share of the surface's displacement is Im z.

Over a step of length h the force is taken as F0 + F1 (tau - 1/2), tau from 0 to 1. Under such a force hammer and modes move
exactly, and do the work F0 D + F1 W, with D the change of x and W the integral of (tau - 1/2) x'. With

    F0 = E - K W,    F1 = K D,    E = (Phi(x + D) - Phi(x)) / D,    Phi = k x^(a+1) / (a+1),

that work is the change of Phi, whatever K: no energy is made or lost. K = 0 is the discrete-gradient scheme of order
2; K near Phi'' makes it order 4, since K W is what the path's curvature adds to the mean force. The damping
mu (Phi' x') is averaged the same way and can only take energy.
"""

import cmath
import math

from workbench.kernels import kernel, modal_kernel

# Rows of coefficients, one number a mode, real and imaginary parts: change of z over a step, its share of W, and the
# effect of F0 and of F1 on z.
CHANGE, CURVE, PUSH, TILT = 0, 2, 4, 6
ROWS = 8


@kernel
def prepare(c, row, b, w, gain, modes, mass_kg, h):
    """Fill the coefficients `c` for steps of `h` seconds; return how D and W answer F0 and F1.

    D = D* - A F0 + B F1 and W = W* - B F0 - C F1: returns A, B, C.
    """
    free = h * h / mass_kg
    response_a, response_b, response_c = free / 2.0, free / 12.0, 0.0
    for m in range(modes):
        z = complex(-b[m] * h, w[m] * h)
        rise, lean = _means(z)
        change = z * rise
        curve = z * z * lean
        push = gain[m] * h * rise
        tilt = -gain[m] * h * z * lean
        c[CHANGE * row + m], c[(CHANGE + 1) * row + m] = change.real, change.imag
        c[CURVE * row + m], c[(CURVE + 1) * row + m] = curve.real, curve.imag
        c[PUSH * row + m], c[(PUSH + 1) * row + m] = push.real, push.imag
        c[TILT * row + m], c[(TILT + 1) * row + m] = tilt.real, tilt.imag
        response_a += push.imag
        response_b -= tilt.imag
        response_c += gain[m] * h * (lean * (1.0 - 0.5 * z)).imag
    return response_a, response_b, response_c


@kernel
def power(x, exponent):
    """x^exponent for x > 0, else 0; quick for Hertz's 3/2."""
    if x <= 0.0:
        return 0.0
    if exponent == 1.5:
        return x * math.sqrt(x)
    return x**exponent


@kernel
def _means(z):
    """The integrals over tau from 0 to 1 of exp(z tau), and of (tau - 1/2) exp(z tau) / z."""
    if abs(z) > 0.5:
        rise = (cmath.exp(z) - 1.0) / z
        return rise, (0.5 * rise + (1.0 - rise) / z) / z
    rise, lean, term = complex(1.0), complex(0.0), complex(1.0)
    for n in range(1, 16):
        lean += term / (2.0 * (n + 1) * (n + 2))
        term *= z / n
        rise += term / (n + 1)
    return rise, lean
