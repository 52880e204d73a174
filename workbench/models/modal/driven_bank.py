"""Modal bank driven at audio rate (equation 3.4): second-order recursions, 16 frames per pass, one real-time row.

The inner loop runs over modes and keeps 16 sums in registers. Passes lie at multiples of 16 session frames. A call
that ends within a pass computes it from its start with the excitation so far, and the next call computes it again: each
frame results from the same arithmetic, bit for bit, however the frames are split into calls.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, copy, kernel, modal_kernel, widest
from underfoot.layouts import Layout, Memory

PASS = 16

STATE = Layout(
    "driven_bank",
    *("sounds", "driven_lately"),
    excitation=PASS,
    out=PASS,
    near=("row",),
    far=("row",),
    kept_near=("row",),
    kept_far=("row",),
)
"""Whether anything sounds; whether there was excitation lately; a pass under way; each mode's last two values, and a
copy of both."""
COEFFICIENTS = Layout(
    "driven_bank_coefficients",
    *("modes", "floor_squared", "amplitude_sum"),
    gain=("row",),
    near=("row",),
    far=("row",),
    near_rest=("row",),
    far_rest=("row",),
    quadrature_near=("row",),
    quadrature_far=("row",),
)
"""Per mode: the gain; the factors of the last two values, with their rounding errors over a pass; and the factors of
the quadrature, which gives the amplitude."""

_PATIENCE = 64  # frames without excitation before modes under the floor are dropped


def sizes(modes: int) -> dict[str, int]:
    """Return the memory sizes for `modes` modes, padded so that vector loops of eight have no remainder.

    >>> sizes(10)
    {'row': 16}
    """
    return {"row": (modes + 7) // 8 * 8}


@kernel
def design(modes: NDArray[np.float64], rate_hz: float, floor: float, coefficients: Memory) -> None:
    """Design the bank of modes a exp(-b t) sin(2 pi f t); `modes` [3, m] has rows of f (Hz), b (1/s) and a.

    Present ringing goes on with the new values. A mode at or above half the rate is left out, because it would alias.
    Without excitation, a mode whose amplitude has fallen below `floor` (output units) is set to exactly 0.
    """
    c = coefficients
    c.values[:] = 0.0
    c.modes, c.floor_squared = modes.shape[1], floor * floor
    for m in range(modes.shape[1]):
        angle, amplitude = 2.0 * math.pi * (modes[0, m] / rate_hz), modes[2, m]
        if 0.0 < angle < math.pi and amplitude != 0.0:
            decay = modes[1, m] / rate_hz
            size = math.exp(-decay)
            c.amplitude_sum += abs(amplitude)
            c.gain[m] = amplitude * size * math.sin(angle)
            # 2 r cos = 2 - (1 - r^2) - |1 - p|^2 and r^2 = 1 - (1 - r^2), from small numbers without cancellation:
            # rounding errors of the coefficients would put a low mode out of phase within seconds.
            loss = -math.expm1(-2.0 * decay)
            drift = loss + (math.expm1(-decay) ** 2 + 4.0 * size * math.sin(0.5 * angle) ** 2)
            near, far = 2.0 - drift, loss - 1.0
            c.near[m], c.near_rest[m] = near, PASS * ((2.0 - near) - drift)
            c.far[m], c.far_rest[m] = far, PASS * (loss - (1.0 + far))
            c.quadrature_near[m] = amplitude * size * math.cos(angle)
            c.quadrature_far[m] = amplitude * size * size


@kernel
def ring(excitation: Floats, frame: int, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Run from session frame `frame` on into `out`, driven by `excitation`, one value per frame.

    An excitation of 1 in one frame gives, from that frame on, sum a exp(-b t) sin(2 pi f t).
    """
    done, n = 0, out.size
    while done < n:
        at = frame + done
        if at % _PATIENCE == 0:
            _drop(coefficients, state)
        length = min(_PATIENCE - at % _PATIENCE, n - done)
        if at % PASS != 0 or length < PASS:
            length = min(PASS - at % PASS, length)
        else:
            length -= length % PASS
        for k in range(length):
            if excitation[done + k] != 0.0:
                state.sounds = state.driven_lately = 1.0
                break
        if state.sounds == 0.0:
            for k in range(length):
                out[done + k] = 0.0
        elif length >= PASS:
            _run_passes(excitation[done : done + length], coefficients, state, out[done : done + length])
        else:
            _run_part(excitation[done : done + length], at % PASS, coefficients, state, out[done : done + length])
        done += length


@kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """Return an upper bound of |output| from here on, without further excitation."""
    bound = 0.0
    for k in range(PASS):
        bound += abs(state.excitation[k])
    bound *= coefficients.amplitude_sum  # the pass under way
    for m in range(int(coefficients.modes)):
        bound += math.sqrt(_squared_amplitude(coefficients, state, m))
    return bound


@kernel
def _run_part(excitation: Floats, start: int, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Run a pass as far as its excitation is known, from its start; undo it unless it is complete."""
    for k in range(out.size):
        state.excitation[start + k] = excitation[k]
    ends = start + out.size == PASS
    if not ends:
        copy(state.near, state.kept_near)
        copy(state.far, state.kept_far)
    _run_passes(state.excitation, coefficients, state, state.out)
    for k in range(out.size):
        out[k] = state.out[start + k]
    if ends:
        state.excitation[:] = 0.0
    else:
        copy(state.kept_near, state.near)
        copy(state.kept_far, state.far)


@kernel
def _drop(coefficients: Memory, state: Memory) -> None:
    """Set modes under the floor to exactly 0, unless recent excitation may still be building them up."""
    if state.driven_lately == 0.0:
        state.sounds = 0.0
        for m in range(state.row):
            if _squared_amplitude(coefficients, state, m) > coefficients.floor_squared:
                state.sounds = 1.0
            else:
                state.near[m] = state.far[m] = 0.0
    state.driven_lately = 0.0


@kernel
def _squared_amplitude(c: Memory, state: Memory, m: int) -> float:
    near, far = state.near[m], state.far[m]
    sine = c.gain[m] * near
    cosine = c.quadrature_near[m] * near - c.quadrature_far[m] * far
    return sine * sine + cosine * cosine


@modal_kernel
def _run_passes(excitation: Floats, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Run whole passes from `excitation` to `out`."""
    widest()
    nears, fars = state.near, state.far
    gains, as_, bs = coefficients.gain, coefficients.near, coefficients.far
    a_rests, b_rests = coefficients.near_rest, coefficients.far_rest
    for i in range(0, out.size, PASS):
        e = excitation[i : i + PASS]
        e0, e1, e2, e3, e4, e5, e6, e7 = e[0], e[1], e[2], e[3], e[4], e[5], e[6], e[7]
        e8, e9, e10, e11, e12, e13, e14, e15 = e[8], e[9], e[10], e[11], e[12], e[13], e[14], e[15]
        a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = a8 = a9 = a10 = a11 = a12 = a13 = a14 = a15 = 0.0
        for m in range(state.row):
            x, y = nears[m], fars[m]
            g, a, b = gains[m], as_[m], bs[m]
            a0 += g * x
            y = a * x + (b * y + e0)
            a1 += g * y
            x = a * y + (b * x + e1)
            a2 += g * x
            y = a * x + (b * y + e2)
            a3 += g * y
            x = a * y + (b * x + e3)
            a4 += g * x
            y = a * x + (b * y + e4)
            a5 += g * y
            x = a * y + (b * x + e5)
            a6 += g * x
            y = a * x + (b * y + e6)
            a7 += g * y
            x = a * y + (b * x + e7)
            a8 += g * x
            y = a * x + (b * y + e8)
            a9 += g * y
            x = a * y + (b * x + e9)
            a10 += g * x
            y = a * x + (b * y + e10)
            a11 += g * y
            x = a * y + (b * x + e11)
            a12 += g * x
            y = a * x + (b * y + e12)
            a13 += g * y
            x = a * y + (b * x + e13)
            a14 += g * x
            y = a * x + (b * y + e14)
            a15 += g * y
            x = a * y + (b * x + e15)
            nears[m] = x + (a_rests[m] * x + b_rests[m] * y)
            fars[m] = y
        o = out[i : i + PASS]
        o[0], o[1], o[2], o[3], o[4], o[5], o[6], o[7] = a0, a1, a2, a3, a4, a5, a6, a7
        o[8], o[9], o[10], o[11], o[12], o[13], o[14], o[15] = a8, a9, a10, a11, a12, a13, a14, a15
