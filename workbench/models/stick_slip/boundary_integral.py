"""The slip's end as an integral equation on the belt line v = v_b, one dimension less than the Fokker-Planck equation.

Were nobody stopped at the belt velocity, the state would follow its free Gaussian law G. Whoever reaches the line at
(x', s) would walk on from there, so what is still slipping at t has the density

    P(x, v, t) = G(x, v, t | start) - int ds dx' F(x', s) G(x, v, t - s | x', v_b).

F is the law of the slip's end (8.6: F = -D dP/dv on the line, P = 0 there). Twice the slope on the line plus
a = w0^2 x + zeta v_b times the value on it gives an equation of the second kind,

    F = R(start) + int F R,   R = -(2 D d/dv + a) G for the start, (2 D d/dv + a) G for the line,

whose kernel goes to 0 as sqrt(t - s). (Fortet's and Buonocore's equation for one dimension, here for two.)

F is held as *packets*: normal densities of one width on an even lattice in x. A packet stays a normal density under
the free motion, so that R is known in closed form however short the lag. In time, a *panel* holds 8 Gauss-Legendre
instants; its lattice may travel at the belt's speed.
"""

import math

import numpy as np

from underfoot.kernels import kernel
from underfoot.models.stick_slip.oscillator import transition

INSTANTS = 8
NODES, WEIGHTS = np.polynomial.legendre.leggauss(INSTANTS)
_BARYCENTRIC = np.array([1.0 / np.prod(node - np.delete(NODES, i)) for i, node in enumerate(NODES)])

PANEL_FIELDS = 8
"""Columns of a panel table: start s, length s, and of the lattice: first m, spacing m, packet width m, speed m/s (first
moves from the panel's start on), number of packets, place of the panel's first mass (instant after instant)."""

_FAR = 3.0
"""A panel is read at its own instants from lags that reach over a factor of at most this, else it is cut up."""
_CUTS = 64
_RENEW = 16


@kernel
def add_start(motion, x0, v0, times, first, spacing, speed, since, out):
    """Add R of the start (x0, v0) to `out[instant, place]` at `times` on a lattice that left `first` at `since`."""
    w0, zeta, noise, belt = motion
    for i in range(times.size):
        a_xx, a_xv, a_vx, a_vv, s_xx, s_xv, s_vv = transition(w0, zeta, noise, times[i])
        inverse = 1.0 / (s_xx * s_vv - s_xv * s_xv)
        dv = belt - a_vx * x0 - a_vv * v0
        for k in range(out.shape[1]):
            x = first + speed * (times[i] - since) + k * spacing
            dx = x - a_xx * x0 - a_xv * v0
            height = math.exp(-0.5 * inverse * (s_vv * dx * dx - 2.0 * s_xv * dx * dv + s_xx * dv * dv))
            pull = w0 * w0 * x + zeta * belt - 2.0 * noise * inverse * (s_xx * dv - s_xv * dx)
            out[i, k] -= height * math.sqrt(inverse) / (2.0 * math.pi) * pull


@kernel
def add_panels(motion, table, panels, masses, finest, times, first, spacing, speed, since, out):
    """Add R of the first `panels` panels, all before `times`, to `out[instant, place]`.

    `finest` s: the lag below which R is a power series in the square root of the lag.
    """
    places = out.shape[1]
    share = np.empty(INSTANTS)
    lags = np.empty(INSTANTS * _CUTS)
    weights = np.empty(INSTANTS * _CUTS)
    widest = 1
    for j in range(panels):
        widest = max(widest, int(table[j, 6]))
    emitted = np.empty(widest)
    response = np.empty((widest, places))
    value = np.empty(places)
    ratio = np.empty(places)
    for i in range(times.size):
        edge = first + speed * (times[i] - since)
        for j in range(panels):
            start, length, left, gap, width, pace, count, place = table[j]
            packets = int(count)
            begin = int(place)
            cuts = _lags(times[i] - start - length, times[i] - start, finest, lags, weights)
            for m in range(cuts):
                moment = times[i] - lags[m] - start
                shares(2.0 * moment / length - 1.0, share)
                emitted[:packets] = 0.0
                for n in range(INSTANTS):
                    if share[n] != 0.0:
                        for q in range(packets):
                            emitted[q] += share[n] * masses[begin + n * packets + q]
                _respond(
                    motion, lags[m], left + pace * moment, gap, width, packets, edge, spacing, response, value, ratio
                )
                for q in range(packets):
                    mass = weights[m] * emitted[q]
                    for k in range(places):
                        out[i, k] += mass * response[q, k]


@kernel
def own_matrix(motion, length, finest, first, spacing, width, speed, out):
    """R of a panel on itself: `out[source instant, packet, target instant, place]` for masses at the instants."""
    places = out.shape[1]
    share = np.empty(INSTANTS)
    lags = np.empty(INSTANTS * _CUTS)
    weights = np.empty(INSTANTS * _CUTS)
    response = np.empty((places, places))
    value = np.empty(places)
    ratio = np.empty(places)
    out[:] = 0.0
    for i in range(INSTANTS):
        time = 0.5 * length * (1.0 + NODES[i])
        edge = first + speed * time
        cuts = _lags(0.0, time, finest, lags, weights)
        for m in range(cuts):
            moment = time - lags[m]
            shares(2.0 * moment / length - 1.0, share)
            _respond(
                motion, lags[m], first + speed * moment, spacing, width, places, edge, spacing, response, value, ratio
            )
            for n in range(INSTANTS):
                factor = weights[m] * share[n]
                for q in range(places):
                    for k in range(places):
                        out[n, q, i, k] += factor * response[q, k]


@kernel
def add_above(motion, table, panels, masses, finest, times, out):
    """Take from `out` the share of all that ended before `times` that would, walking on, be above the belt velocity.

    With the start's own share in `out` what is left is the residual of the solved equation, as a probability.
    """
    w0, zeta, noise, belt = motion
    share = np.empty(INSTANTS)
    lags = np.empty(INSTANTS * _CUTS)
    weights = np.empty(INSTANTS * _CUTS)
    for i in range(times.size):
        for j in range(panels):
            start, length, left, gap, width, pace, count, place = table[j]
            if start >= times[i]:
                break
            packets = int(count)
            begin = int(place)
            cuts = _lags(max(0.0, times[i] - start - length), times[i] - start, finest, lags, weights)
            for m in range(cuts):
                moment = times[i] - lags[m] - start
                shares(2.0 * moment / length - 1.0, share)
                _, _, a_vx, a_vv, _, _, s_vv = transition(w0, zeta, noise, lags[m])
                spread = math.sqrt(2.0 * (s_vv + a_vx * a_vx * width * width))
                for q in range(packets):
                    mass = 0.0
                    for n in range(INSTANTS):
                        mass += share[n] * masses[begin + n * packets + q]
                    dv = belt - a_vx * (left + pace * moment + q * gap) - a_vv * belt
                    out[i] -= weights[m] * mass * 0.5 * math.erfc(dv / spread)


@kernel
def shares(z, share):
    """The Lagrange polynomials of a panel's instants at `z` in [-1, 1] (its ends), into `share` [INSTANTS]."""
    total = 0.0
    for n in range(INSTANTS):
        distance = z - NODES[n]
        if abs(distance) < 1e-13:
            share[:] = 0.0
            share[n] = 1.0
            return
        share[n] = _BARYCENTRIC[n] / distance
        total += share[n]
    for n in range(INSTANTS):
        share[n] /= total


@kernel
def _respond(motion, lag, left, gap, width, packets, edge, spacing, out, value, ratio):
    # R of unit packets at left + q gap, a lag earlier, at the places edge + k spacing. Over q the exponent is a square
    # with one and the same curvature, so that its exponential is carried on by two products; it is renewed now and then
    # because a value that began in underflow would stay 0.
    w0, zeta, noise, belt = motion
    a_xx, a_xv, a_vx, a_vv, s_xx, s_xv, s_vv = transition(w0, zeta, noise, lag)
    s_xx += a_xx * a_xx * width * width
    s_xv += a_xx * a_vx * width * width
    s_vv += a_vx * a_vx * width * width
    inverse = 1.0 / (s_xx * s_vv - s_xv * s_xv)
    c_xx = s_vv * inverse
    c_xv = -s_xv * inverse
    c_vv = s_xx * inverse
    norm = math.sqrt(inverse) / (2.0 * math.pi)
    step_x = -a_xx * gap
    step_v = -a_vx * gap
    bend = -(c_xx * step_x * step_x + 2.0 * c_xv * step_x * step_v + c_vv * step_v * step_v)
    bent = math.exp(bend)
    slope = (w0 * w0 - 2.0 * noise * c_xv) * spacing
    for q in range(packets):
        dx0 = edge - a_xx * (left + q * gap) - a_xv * belt
        dv = belt - a_vx * (left + q * gap) - a_vv * belt
        if q % _RENEW == 0:
            for k in range(out.shape[1]):
                dx = dx0 + k * spacing
                exponent = -0.5 * (c_xx * dx * dx + 2.0 * c_xv * dx * dv + c_vv * dv * dv)
                if exponent < -600.0:
                    value[k] = 0.0
                    ratio[k] = 0.0
                else:
                    rise = -(c_xx * dx * step_x + c_xv * (dx * step_v + dv * step_x) + c_vv * dv * step_v)
                    value[k] = norm * math.exp(exponent)
                    ratio[k] = math.exp(rise + 0.5 * bend)
        pull = w0 * w0 * edge + zeta * belt - 2.0 * noise * (c_vv * dv + c_xv * dx0)
        for k in range(out.shape[1]):
            out[q, k] = value[k] * (pull + slope * k)
            value[k] *= ratio[k]
            ratio[k] *= bent


@kernel
def _lags(near, far, finest, lags, weights):
    # Gauss-Legendre rules in lag from near to far, each at most a factor long; in sqrt(lag) where it starts at 0.
    if far <= _FAR * near:
        _rule(near, far, 0, lags, weights)
        return INSTANTS
    count = 0
    if near <= 0.0:
        near = min(far, finest)
        root = math.sqrt(near)
        _rule(0.0, root, 0, lags, weights)
        for n in range(INSTANTS):
            weights[n] *= 2.0 * lags[n]
            lags[n] *= lags[n]
        count = INSTANTS
    while near < far * (1.0 - 1e-12) and count < lags.size:
        end = max(_FAR * near, min(finest, 4.0 * _FAR * near))
        if 1.3 * end > far or count + INSTANTS == lags.size:
            end = far
        _rule(near, end, count, lags, weights)
        count += INSTANTS
        near = end
    return count


@kernel
def _rule(low, high, at, points, weights):
    for n in range(INSTANTS):
        # From the far end on: a whole panel's lags then fall on its own instants in their order.
        points[at + n] = high - 0.5 * (high - low) * (1.0 + NODES[n])
        weights[at + n] = 0.5 * (high - low) * WEIGHTS[n]
