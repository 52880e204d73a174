"""A linear system as a sum of its poles, in real time and exactly.

A transfer function `d + sum r_k / (s - p_k)` (each complex pole stands for itself and its conjugate) is run sample by
sample. What goes in is taken as straight between samples, and for that the output is exact at every sample, at any
rate: no pole is warped or moved, as the bilinear transform would.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import Floats, modal_kernel
from underfoot.lanes import all_four, four, put, total
from underfoot.layouts import Layout, Memory
from underfoot.memory import LANES

STATE = Layout("poles_state", "before", re="poles", im="poles")
"""The last sample that came in, and each pole's state."""
COEFFICIENTS = Layout(
    "poles_coefficients",
    *("direct", "peak_gain"),
    step_re="poles",
    step_im="poles",
    now_re="poles",
    now_im="poles",
    before_re="poles",
    before_im="poles",
    gain_re="poles",
    gain_im="poles",
)
"""The direct part, and a bound of what comes out for inputs within -1 to 1; each pole's factor from one sample to the
next, what the sample and the one before it add to its state, and what its state adds to the output."""
_NEGLIGIBLE = 1e-100
_SERIES = 0.3
"""Below this |p h|, exp(p h) is too near 1 for differences; a series of 12 terms is exact to 1e-16 up to here."""


@dataclass(frozen=True)
class Poles:
    """`poles` (n,) in 1/s, their `residues` (n,), and the `direct` part.

    A pole with an imaginary part above 0 has its conjugate, and its residue's, besides; none below 0 is given.
    `BadValue` for one that is, and for a pole that does not decay.

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
        """The transfer function at frequencies of any shape."""
        s = 2j * math.pi * np.asarray(frequencies_hz, dtype=np.float64)[..., None]
        paired = self.poles.imag > 0.0
        whole = self.residues / (s - self.poles) + np.where(paired, self.residues.conj() / (s - self.poles.conj()), 0.0)
        return np.asarray(self.direct + whole.sum(axis=-1))

    def at_rate(self, rate_hz: float) -> tuple[Memory, Memory]:
        """A state at rest (`STATE`) and the coefficients (`COEFFICIENTS`) for `run` at `rate_hz`."""
        step = self.poles / rate_hz
        now, before = _ramp_weights(step)
        count = len(self.poles)
        places = -(-count // LANES) * LANES  # what is beyond the poles stays 0
        coefficients = COEFFICIENTS.zeros(poles=places)
        coefficients.direct = self.direct
        rows = {
            "step": np.exp(step),
            "now": now / rate_hz,
            "before": before / rate_hz,
            "gain": self.residues * np.where(self.poles.imag > 0.0, 2.0, 1.0),
        }
        gained = np.abs(rows["gain"]) * (np.abs(rows["now"]) + np.abs(rows["before"])) / (1.0 - np.abs(rows["step"]))
        coefficients.peak_gain = abs(self.direct) + float(gained.sum())
        for name, row in rows.items():
            getattr(coefficients, f"{name}_re")[:count], getattr(coefficients, f"{name}_im")[:count] = (
                row.real,
                row.imag,
            )
        return STATE.zeros(poles=places), coefficients


@modal_kernel
def run(state: Memory, coefficients: Memory, given: Floats, out: Floats) -> None:
    """Run the system over the samples of `given` into `out`; the two may be the same array.

    `state` and `coefficients` are of `Poles.at_rate`. How samples are cut into calls does not matter, to the bit.
    Allocates nothing.
    """
    c = coefficients
    step_re, step_im, now_re, now_im = c.step_re, c.step_im, c.now_re, c.now_im
    before_re, before_im, gain_re, gain_im = c.before_re, c.before_im, c.gain_re, c.gain_im
    direct, re, im, before = c.direct, state.re, state.im, state.before
    for i in range(len(given)):
        now = given[i]
        ahead, behind, heard = all_four(now), all_four(before), all_four(0.0)
        for k in range(0, len(re), LANES):
            x0, y0 = four(re, k), four(im, k)
            x = four(step_re, k) * x0 - four(step_im, k) * y0 + (four(before_re, k) * behind + four(now_re, k) * ahead)
            y = four(step_re, k) * y0 + four(step_im, k) * x0 + (four(before_im, k) * behind + four(now_im, k) * ahead)
            put(re, k, x)
            put(im, k, y)
            heard = heard + (four(gain_re, k) * x - four(gain_im, k) * y)
        before = now
        out[i] = direct * now + total(heard)
    state.before = before


@modal_kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """A bound of what the system still puts out when nothing but zeros comes in, and the last sample was one."""
    bound = 0.0
    for k in range(len(state.re)):
        gain = abs(coefficients.gain_re[k]) + abs(coefficients.gain_im[k])
        bound += gain * (abs(state.re[k]) + abs(state.im[k]))
    return bound


@modal_kernel
def flush(state: Memory) -> None:
    """Set poles to 0 that have all but decayed: numbers below 1e-308 would take a hundred times as long."""
    for k in range(len(state.re)):
        if abs(state.re[k]) + abs(state.im[k]) < _NEGLIGIBLE:
            state.re[k] = state.im[k] = 0.0


def of_biquads(zeros: ArrayLike, poles: ArrayLike, gain: float) -> Poles:
    """The system `gain prod (s - z) / prod (s - p)`: its poles simple, conjugates given, no more zeros than poles.

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


def of_states(
    a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64], direct: float, least: float = 1e-12
) -> Poles:
    """The system x' = a x + b u, y = c x + direct u, without the poles that are not driven or not heard.

    A pole is left out whose part of the output stays below `least` of the largest's.
    """
    return of_outputs(a, b, [(c, direct)], least)[0]


def of_outputs(
    a: NDArray[np.float64], b: NDArray[np.float64], outputs: Iterable[tuple[NDArray[np.float64], float]],
    least: float = 1e-12,
) -> list[Poles]:  # fmt: skip
    """The systems of several `outputs` (c, direct) of the same states, as `of_states` has them of one."""
    poles, vectors = np.linalg.eig(a)
    driven = np.linalg.solve(vectors, b.astype(complex))
    found = []
    for c, direct in outputs:
        residues = (c @ vectors) * driven
        size = np.abs(residues) / np.abs(poles.real)
        kept = (poles.imag >= 0.0) & (size > least * size.max(initial=0.0))
        found.append(Poles(poles[kept], residues[kept], direct))
    return found


def _ramp_weights(step: NDArray[np.complex128]) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """What a sample, and the one before it, add to a pole's state, in units of the period: p h is `step`."""
    small = np.abs(step) < _SERIES
    safe = np.where(small, 1.0, step)
    whole = np.where(small, _series(step, 1), (np.exp(safe) - 1.0) / safe)
    ahead = np.where(small, _series(step, 2), (np.exp(safe) - 1.0 - safe) / safe**2)
    return ahead, whole - ahead


def _series(step: NDArray[np.complex128], first: int) -> NDArray[np.complex128]:
    """sum over k of step^k / (k + first)!."""
    total = np.zeros_like(step)
    for k in range(12, -1, -1):
        total = total * step + 1.0 / math.factorial(k + first)
    return total
