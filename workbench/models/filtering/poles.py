"""Linear system as a sum of poles, run exactly in real time.

A transfer function `d + sum r_k / (s - p_k)` (each complex pole stands for itself and its conjugate) is run sample by
sample. The input is taken as linear between samples; for that the output is exact at every sample, at any rate. No pole
is warped or moved, as it would be by the bilinear transform.
"""

import math
from collections.abc import Iterable

import numpy as np
from msgspec import Struct
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import Floats, modal_inlined, modal_kernel
from underfoot.lanes import all_eight, eight, put, total
from underfoot.layouts import Layout, Memory

STATE = Layout("poles_state", re="poles", im="poles")
"""State of each pole: the sum of all inputs, each multiplied by the pole's factor once per period since; its real part,
and its imaginary part divided by that of the factor."""
COEFFICIENTS = Layout(
    "poles_coefficients",
    *("direct", "peak_gain"),
    step_re="poles",
    step_im_square="poles",
    gain_re="poles",
    gain_im="poles",
)
"""Direct contribution of a sample to the output, and a bound of the output for inputs within -1 to 1; each pole's
factor per sample, and the gain from its state before a sample to the output."""
_LANES, _FEW = 8, 24
"""Poles processed at once; and the number of poles whose states stay in registers from sample to sample (as `_LANES`
poles do), without waiting for memory."""
_NEGLIGIBLE = 1e-100
_LEAST_SHARE = 1e-12
_SERIES = 0.3
"""Below this |p h|, exp(p h) - 1 would cancel; a series of 12 terms is exact to 1e-16 up to here."""


class Poles(Struct, frozen=True):
    """System with `poles` (n,) in 1/s, `residues` (n,), and a `direct` part.

    A pole with a positive imaginary part implies its conjugate. `BadValue` for a negative imaginary part, and for a
    pole that does not decay.

    >>> lag = Poles(np.array([-1.0 + 0j]), np.array([1.0 + 0j]))
    >>> lag.transfer([0.0]).real
    array([1.])
    """

    poles: NDArray[np.complex128]
    residues: NDArray[np.complex128]
    direct: float = 0.0

    def __post_init__(self) -> None:
        require(bool((self.poles.real < 0.0).all()), "poles", self.poles, "real parts below 0")
        require(bool((self.poles.imag >= 0.0).all()), "poles", self.poles, "no imaginary part below 0")

    def transfer(self, frequencies_hz: ArrayLike) -> NDArray[np.complex128]:
        """Return the transfer function at frequencies of any shape."""
        s = 2j * math.pi * np.asarray(frequencies_hz, dtype=np.float64)[..., None]
        paired = self.poles.imag > 0.0
        whole = self.residues / (s - self.poles) + np.where(paired, self.residues.conj() / (s - self.poles.conj()), 0.0)
        return np.asarray(self.direct + whole.sum(axis=-1))

    def at_rate(self, rate_hz: float) -> tuple[Memory, Memory]:
        """Return a `STATE` at rest and the `COEFFICIENTS` for `run` at `rate_hz`."""
        step = self.poles / rate_hz
        now, before = _ramp_weights(step)
        count = len(self.poles)
        places = _FEW if _LANES < count <= _FEW else max(-(-count // _LANES), 1) * _LANES  # padding stays 0
        coefficients = COEFFICIENTS.zeros(poles=places)
        # A sample contributes to a pole's state with `now` at once, and with `before` one sample later.
        share = self.residues * np.where(self.poles.imag > 0.0, 2.0, 1.0) / rate_hz
        factor = np.exp(step)
        gain = share * (now * factor + before)
        coefficients.direct = self.direct + float((share * now).real.sum())
        coefficients.peak_gain = abs(coefficients.direct) + float((np.abs(gain) / (1.0 - np.abs(factor))).sum())
        coefficients.step_re[:count], coefficients.step_im_square[:count] = factor.real, factor.imag**2
        coefficients.gain_re[:count], coefficients.gain_im[:count] = gain.real, -gain.imag * factor.imag
        return STATE.zeros(poles=places), coefficients


@modal_kernel
def run(state: Memory, coefficients: Memory, given: Floats, out: Floats) -> None:
    """Run the system over `given` into `out`; the two may be the same array.

    `state` and `coefficients` come from `Poles.at_rate`. Results do not depend, to the bit, on how samples are split
    into calls. Allocates nothing.
    """
    c, direct = coefficients, coefficients.direct
    if len(state.re) == _LANES:
        x, y, u, square, gain_re, gain_im = _eight_of(state, c, 0)
        for i in range(len(given)):
            now = all_eight(given[i])
            out[i] = direct * given[i] + total(gain_re * x + gain_im * y)
            x, y = now + u * x - square * y, x + u * y
        put(state.re, 0, x)
        put(state.im, 0, y)
    elif len(state.re) == _FEW:
        _run_few(state, c, given, out)
    else:
        for i in range(len(given)):
            now, heard = all_eight(given[i]), all_eight(0.0)
            for k in range(0, len(state.re), _LANES):
                x, y, u, square, gain_re, gain_im = _eight_of(state, c, k)
                heard = heard + (gain_re * x + gain_im * y)
                put(state.re, k, now + u * x - square * y)
                put(state.im, k, x + u * y)
            out[i] = direct * given[i] + total(heard)


@modal_inlined
def _run_few(state: Memory, coefficients: Memory, given: Floats, out: Floats) -> None:
    """Run `_FEW` poles, as many as fit in the processor's registers."""
    direct = coefficients.direct
    x0, y0, u0, square0, gain_re0, gain_im0 = _eight_of(state, coefficients, 0)
    x1, y1, u1, square1, gain_re1, gain_im1 = _eight_of(state, coefficients, _LANES)
    x2, y2, u2, square2, gain_re2, gain_im2 = _eight_of(state, coefficients, 2 * _LANES)
    for i in range(len(given)):
        now = all_eight(given[i])
        heard = (gain_re0 * x0 + gain_im0 * y0) + (gain_re1 * x1 + gain_im1 * y1) + (gain_re2 * x2 + gain_im2 * y2)
        out[i] = direct * given[i] + total(heard)
        x0, y0 = now + u0 * x0 - square0 * y0, x0 + u0 * y0
        x1, y1 = now + u1 * x1 - square1 * y1, x1 + u1 * y1
        x2, y2 = now + u2 * x2 - square2 * y2, x2 + u2 * y2
    for k, x, y in ((0, x0, y0), (_LANES, x1, y1), (2 * _LANES, x2, y2)):
        put(state.re, k, x)
        put(state.im, k, y)


@modal_inlined
def _eight_of(state: Memory, coefficients: Memory, k: int) -> tuple[Floats, ...]:
    """Return eight poles from the k-th on: both parts of their states, then their coefficients."""
    c = coefficients
    own = eight(state.re, k), eight(state.im, k)
    return (*own, eight(c.step_re, k), eight(c.step_im_square, k), eight(c.gain_re, k), eight(c.gain_im, k))


@modal_kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """Return a bound of |output| if all further input is zero."""
    bound = 0.0
    for k in range(len(state.re)):
        gain = abs(coefficients.gain_re[k]) + abs(coefficients.gain_im[k])
        bound += gain * (abs(state.re[k]) + abs(state.im[k]))
    return bound


@modal_kernel
def flush(state: Memory) -> None:
    """Set states that have all but decayed to 0: numbers below 1e-308 would take a hundred times as long."""
    for k in range(len(state.re)):
        if abs(state.re[k]) + abs(state.im[k]) < _NEGLIGIBLE:
            state.re[k] = state.im[k] = 0.0


def of_biquads(zeros: ArrayLike, poles: ArrayLike, gain: float) -> Poles:
    """Return the system `gain prod (s - z) / prod (s - p)`: simple poles, conjugates given, no more zeros than poles.

    >>> band = of_biquads([0.0], [-1.0 + 2.0j, -1.0 - 2.0j], 3.0)
    >>> bool(np.allclose(band.transfer([0.5]), 3.0 * 1j * np.pi / ((1j * np.pi + 1.0) ** 2 + 4.0)))
    True
    """
    z, p = np.atleast_1d(np.asarray(zeros, complex)), np.atleast_1d(np.asarray(poles, complex))
    require(len(z) <= len(p), "zeros", len(z), f"no more than poles, {len(p)}")
    apart = p[:, None] - p[None, :] + np.eye(len(p))
    residues = gain * np.prod(p[:, None] - z[None, :], axis=1) / np.prod(apart, axis=1)
    upper = p.imag >= 0.0
    return Poles(p[upper], residues[upper], gain if len(z) == len(p) else 0.0)


def of_outputs(
    a: NDArray[np.float64], b: NDArray[np.float64], outputs: Iterable[tuple[NDArray[np.float64], float]]
) -> list[Poles]:
    """Return the system x' = a x + b u, y = c x + direct u of each of the `outputs` (c, direct).

    Poles that are not controllable or not observable are left out: their part of the output is below `_LEAST_SHARE` of
    the largest.

    >>> a, b = np.array([[0.0, 1.0], [-1e4, -20.0]]), np.array([0.0, 1.0])  # an oscillator at 100 rad/s
    >>> position, velocity = of_outputs(a, b, [(np.array([1.0, 0.0]), 0.0), (np.array([0.0, 1.0]), 0.0)])
    >>> complex(np.round(velocity.residues[0] / position.residues[0], 6)) == complex(np.round(position.poles[0], 6))
    True
    """
    poles, vectors = np.linalg.eig(a)
    driven = np.linalg.solve(vectors, b.astype(complex))
    found = []
    for c, direct in outputs:
        residues = (c @ vectors) * driven
        size = np.abs(residues) / np.abs(poles.real)
        kept = (poles.imag >= 0.0) & (size > _LEAST_SHARE * size.max(initial=0.0))
        found.append(Poles(poles[kept], residues[kept], direct))
    return found


def _ramp_weights(step: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return the weights of a sample and of the one before it in a pole's state, in periods; `step` is p h."""
    small = np.abs(step) < _SERIES
    safe = np.where(small, 1.0, step)
    whole = np.where(small, _series(step, 1), (np.exp(safe) - 1.0) / safe)
    ahead = np.where(small, _series(step, 2), (np.exp(safe) - 1.0 - safe) / safe**2)
    return ahead, whole - ahead


def _series(step: NDArray[np.complex128], first: int) -> NDArray[np.complex128]:
    """Return sum over k of step^k / (k + first)!."""
    total = np.zeros_like(step)
    for k in range(12, -1, -1):
        total = total * step + 1.0 / math.factorial(k + first)
    return total
