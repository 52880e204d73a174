"""A modal bank driven at audio rate (equation 3.4): second-order recursions, 16 frames a pass, one row of real time.

The inner loop runs over modes and keeps 16 sums in registers. Passes lie at multiples of 16 session frames. A call
that ends inside one computes it from its beginning, with the excitation so far, and the next call does so again: each
frame comes out of the same arithmetic, hence with the same bits, however the frames are split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous.
"""

import math

from workbench.kernels import kernel, modal_kernel

PASS = 16
_QUIET = 4  # passes without excitation after which modes under the floor are set to 0
_EXCITATION = 8  # before it, in s: which pair of rows is current, whether anything sounds, quiet passes
_S_ROWS = _EXCITATION + PASS
_T_ROWS = 8  # before it: modes, floor squared, sum of amplitudes
_GAIN, _NEAR, _FAR, _NEAR_REST, _FAR_REST, _SINE_NEAR, _SINE_FAR = range(7)
"""Rows of `t`: gain; coefficients of the last two values and what rounding took from them; weights of the quadrature."""


@kernel
def state_size(modes):
    """The floats of `s`.

    >>> state_size(10)
    88
    """
    return _S_ROWS + 4 * _padded(modes)


@kernel
def tuning_size(modes):
    """The floats of `t`.

    >>> tuning_size(10)
    120
    """
    return _T_ROWS + 7 * _padded(modes)


@kernel
def tune(t, frequencies_hz, decays_per_s, amplitudes, rate_hz, floor):
    """Set `t` for modes a exp(-b t) sin(2 pi f t). What rings already goes on with the new values.

    A mode at or above half the rate is left out: it would alias. Without excitation, a mode whose amplitude has
    fallen below `floor` (output units) is set to exactly 0.
    """
    modes = frequencies_hz.size
    row = _padded(modes)
    t[:] = 0.0
    t[0] = modes
    t[1] = floor * floor
    for m in range(modes):
        angle = 2.0 * math.pi * (frequencies_hz[m] / rate_hz)
        if 0.0 < angle < math.pi and amplitudes[m] != 0.0:
            decay = decays_per_s[m] / rate_hz
            size = math.exp(-decay)
            o = _T_ROWS + m
            t[2] += abs(amplitudes[m])
            t[o + _GAIN * row] = amplitudes[m] * size * math.sin(angle)
            # 2 r cos = 2 - (1 - r^2) - |1 - p|^2 and r^2 = 1 - (1 - r^2), from small numbers that are known well: what
            # rounding takes from the coefficients would put a low mode out of phase within seconds.
            loss = -math.expm1(-2.0 * decay)
            away = math.expm1(-decay) ** 2 + 4.0 * size * math.sin(0.5 * angle) ** 2
            near, far = 2.0 - (loss + away), loss - 1.0
            t[o + _NEAR * row], t[o + _FAR * row] = near, far
            t[o + _NEAR_REST * row] = PASS * ((2.0 - near) - (loss + away))
            t[o + _FAR_REST * row] = PASS * (loss - (1.0 + far))
            t[o + _SINE_NEAR * row] = amplitudes[m] * size * math.cos(angle)
            t[o + _SINE_FAR * row] = amplitudes[m] * size * size


@kernel
def ring(s, t, excitation, out, frame, n):
    """Ring for `n` frames from session frame `frame` into `out`, driven by `excitation`.

    One frame of excitation of value 1 rings, from that frame on, as sum a exp(-b t) sin(2 pi f t).
    """
    done = 0
    while done < n:
        start = (frame + done) % PASS
        length = min(PASS - start, n - done)
        for k in range(length):
            value = excitation[done + k]
            s[_EXCITATION + start + k] = value
            if value != 0.0:
                s[1] = 1.0
                s[2] = 0.0
        if s[1] == 0.0:
            for k in range(length):
                out[done + k] = 0.0
        elif length == PASS:
            _run_pass(s, t, out[done : done + PASS])
        else:
            for k in range(start + length, PASS):
                s[_EXCITATION + k] = 0.0
            _run_partial(s, t, out[done : done + length], start)
        done += length
        if start + length == PASS and s[1] != 0.0:
            s[0] = 1.0 - s[0]
            s[2] += 1.0
            if s[2] > _QUIET:
                _drop(s, t)
                s[2] = 1.0
'''
