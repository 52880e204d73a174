"""A modal bank driven at audio rate (equation 3.4): second-order recursions, 16 frames a pass, one row of real time.

The inner loop runs over modes and keeps 16 sums in registers. Passes lie at multiples of 16 session frames. A call
that ends inside one computes it from its beginning, with the excitation so far, and the next call does so again: each
frame comes out of the same arithmetic, hence with the same bits, however the frames are split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous.
"""

import math

from underfoot.kernels import kernel, modal_kernel, widest

PASS = 16
_PATIENCE = 64  # frames without excitation after which modes under the floor are looked for
_IN = 8  # before it, in s: whether anything sounds, whether excitation came of late
_OUT = _IN + PASS
_VALUES = _OUT + PASS  # rows: each mode's last value and the one before, and a copy of both
_TABLE = 8  # before it, in t: modes, floor squared, sum of |amplitudes|; then rows:
_GAIN, _NEAR, _FAR, _NEAR_REST, _FAR_REST, _QUADRATURE_NEAR, _QUADRATURE_FAR = range(7)


@kernel
def state_size(modes):
    """The floats of `s`.

    >>> state_size(10)
    104
    """
    return _VALUES + 4 * _padded(modes)


@kernel
def tuning_size(modes):
    """The floats of `t`.

    >>> tuning_size(10)
    120
    """
    return _TABLE + 7 * _padded(modes)


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
            o = _TABLE + m
            t[2] += abs(amplitudes[m])
            t[o + _GAIN * row] = amplitudes[m] * size * math.sin(angle)
            # 2 r cos = 2 - (1 - r^2) - |1 - p|^2 and r^2 = 1 - (1 - r^2), from small numbers that are known well: what
            # rounding takes from the coefficients would put a low mode out of phase within seconds.
            loss = -math.expm1(-2.0 * decay)
            drift = loss + (math.expm1(-decay) ** 2 + 4.0 * size * math.sin(0.5 * angle) ** 2)
            near, far = 2.0 - drift, loss - 1.0
            t[o + _NEAR * row], t[o + _NEAR_REST * row] = near, PASS * ((2.0 - near) - drift)
            t[o + _FAR * row], t[o + _FAR_REST * row] = far, PASS * (loss - (1.0 + far))
            t[o + _QUADRATURE_NEAR * row] = amplitudes[m] * size * math.cos(angle)
            t[o + _QUADRATURE_FAR * row] = amplitudes[m] * size * size


@kernel
def ring(s, t, excitation, out, frame, n):
    """Ring for `n` frames from session frame `frame` into `out`, driven by `excitation`.

    One frame of excitation of value 1 rings, from that frame on, as sum a exp(-b t) sin(2 pi f t).
    """
    done = 0
    while done < n:
        at = frame + done
        if at % _PATIENCE == 0:
            _drop(s, t)
        length = min(_PATIENCE - at % _PATIENCE, n - done)
        if at % PASS != 0 or length < PASS:
            length = min(PASS - at % PASS, length)
        else:
            length -= length % PASS
        for k in range(length):
            if excitation[done + k] != 0.0:
                s[0] = s[1] = 1.0
                break
        if s[0] == 0.0:
            for k in range(length):
                out[done + k] = 0.0
        elif length >= PASS:
            _run_passes(s, t, excitation, done, out, done, length // PASS)
        else:
            _run_part(s, t, excitation, out, done, at % PASS, length)
        done += length


@kernel
def rest(s, t):
    """An upper bound of |output| from here on, without further excitation."""
    bound = 0.0
    for k in range(PASS):
        bound += abs(s[_IN + k])
    bound *= t[2]  # the pass that has begun
    for m in range(int(t[0])):
        bound += math.sqrt(_squared_amplitude(s, t, m))
    return bound


@kernel
def _padded(modes):
    """The length of a row: vector loops over whole eights have no remainder."""
    return (modes + 7) // 8 * 8


@kernel
def _run_part(s, t, excitation, out, done, start, length):
    """A pass as far as its excitation is known: anew from its beginning, and undone unless this was its end."""
    for k in range(length):
        s[_IN + start + k] = excitation[done + k]
    ends = start + length == PASS
    rows = 2 * _padded(int(t[0]))
    if not ends:
        for m in range(_VALUES, _VALUES + rows):
            s[m + rows] = s[m]
    _run_passes(s, t, s, _IN, s, _OUT, 1)
    for k in range(length):
        out[done + k] = s[_OUT + start + k]
    if ends:
        for k in range(_IN, _OUT):
            s[k] = 0.0
    else:
        for m in range(_VALUES, _VALUES + rows):
            s[m] = s[m + rows]


@kernel
def _drop(s, t):
    """Set modes under the floor to exactly 0, unless excitation of late may still be building them up."""
    if s[1] == 0.0:
        s[0] = 0.0
        row = _padded(int(t[0]))
        for m in range(row):
            if _squared_amplitude(s, t, m) > t[1]:
                s[0] = 1.0
            else:
                s[_VALUES + m] = s[_VALUES + row + m] = 0.0
    s[1] = 0.0


@kernel
def _squared_amplitude(s, t, m):
    row = _padded(int(t[0]))
    near, far = s[_VALUES + m], s[_VALUES + row + m]
    o = _TABLE + m
    sine = t[o + _GAIN * row] * near
    cosine = t[o + _QUADRATURE_NEAR * row] * near - t[o + _QUADRATURE_FAR * row] * far
    return sine * sine + cosine * cosine


@modal_kernel
def _run_passes(s, t, excitation, first_in, out, first_out, count):
    """`count` whole passes, from `excitation[first_in]` to `out[first_out]`."""
    widest()
    row = _padded(int(t[0]))
    nears, fars = s[_VALUES : _VALUES + row], s[_VALUES + row : _VALUES + 2 * row]
    o = _TABLE
    gains, as_, bs = t[o : o + row], t[o + row : o + 2 * row], t[o + 2 * row : o + 3 * row]
    a_rests, b_rests = t[o + 3 * row : o + 4 * row], t[o + 4 * row : o + 5 * row]
    for i in range(count):
        o = first_in + PASS * i
        e0, e1, e2, e3, e4, e5, e6, e7 = (
            excitation[o + 0],
            excitation[o + 1],
            excitation[o + 2],
            excitation[o + 3],
            excitation[o + 4],
            excitation[o + 5],
            excitation[o + 6],
            excitation[o + 7],
        )
        e8, e9, e10, e11, e12, e13, e14, e15 = (
            excitation[o + 8],
            excitation[o + 9],
            excitation[o + 10],
            excitation[o + 11],
            excitation[o + 12],
            excitation[o + 13],
            excitation[o + 14],
            excitation[o + 15],
        )
        a0 = a1 = a2 = a3 = a4 = a5 = a6 = a7 = a8 = a9 = a10 = a11 = a12 = a13 = a14 = a15 = 0.0
        for m in range(row):
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
        o = first_out + PASS * i
        out[o + 0], out[o + 1], out[o + 2], out[o + 3], out[o + 4], out[o + 5], out[o + 6], out[o + 7] = (
            a0,
            a1,
            a2,
            a3,
            a4,
            a5,
            a6,
            a7,
        )
        out[o + 8], out[o + 9], out[o + 10], out[o + 11], out[o + 12], out[o + 13], out[o + 14], out[o + 15] = (
            a8,
            a9,
            a10,
            a11,
            a12,
            a13,
            a14,
            a15,
        )
