"""White noise, band-limited noise and the gravel texture of thesis 6.3.5, all read by position.

Nothing random is carried from frame to frame: what sounds at a frame follows from the stream's key and the frame's
number, so the length of a block, a row that slept or another row cannot change it. All three have unit RMS.
"""

import math

import numpy as np

from underfoot.kernels import kernel
from underfoot.models.filtering import second_order
from underfoot.models.signals.random import exponential, uniform

BAND_STATE = 2 * second_order.SECTION_STATE
"""Floats of dynamic state band-limited noise needs."""
BAND_TUNING = 2 * second_order.SECTION_TUNING + 1
"""Floats of tuning band-limited noise needs: the high-pass, the low-pass, the gain."""
TEXTURE_STATE = second_order.SECTION_STATE
"""Floats of dynamic state the texture needs."""
TEXTURE_TUNING = second_order.SECTION_TUNING + 3
"""Floats of tuning the texture needs: the band-pass, mean interval and burst in frames, the gain."""

LOW_HZ, HIGH_HZ = 50.0, 700.0
"""The thesis's noise band (6.3.5)."""
MEAN_INTERVAL_S, BURST_S, CENTRE_HZ, WIDTH_HZ = 0.020, 0.001, 300.0, 15.0
"""The thesis's texture (6.3.5, intervals as in the errata)."""

CELL = 32
"""Frames in which the impulses of a Poisson process are drawn together; also the most impulses in that time."""
_SHARED = second_order.SECTION_TUNING
_LONGEST_BURST = 1 << 16
_BURSTS = np.uint64(0xD1B54A32D192ED03)
_ROOT_12 = math.sqrt(12.0)


@kernel
def white(key, frame, y, n):
    """Fill `n` frames of `y` with white noise of unit variance, number `frame` (int64) of stream `key` (uint64) first.

    Samples are uniform within +-sqrt(3): nothing for a limiter to catch, and an eighth of the cost of normal ones.
    Band-limited, the two cannot be told apart.

    >>> y = np.empty(1000)
    >>> white(np.uint64(1), 0, y, 1000)
    >>> bool(abs(y.std() - 1.0) < 0.05)
    True
    """
    for i in range(n):
        y[i] = _white_sample(key, frame + i)


@kernel
def tune_band(t, low_hz, high_hz, rate):
    """Fill `t` (BAND_TUNING) for noise from `low_hz` to `high_hz`: second-order Butterworth at each end, unit RMS.

    The edges are kept at least 2 % apart.
    """
    high_hz = min(max(high_hz, 1.02 * second_order.LOWEST * rate), second_order.HIGHEST * rate)
    low_hz = min(low_hz, high_hz / 1.02)
    second_order.tune_high_pass(t[:_SHARED], low_hz, second_order.BUTTERWORTH, rate)
    second_order.tune_low_pass(t[_SHARED:], high_hz, second_order.BUTTERWORTH, rate)
    low, high = t[6], t[_SHARED + 6]
    # With W = tan(w/2): |H|^2 = W^4/(W^4 + low^4) high^4/(W^4 + high^4), a difference of two low-passes.
    ratio = (low / high) ** 4
    t[2 * _SHARED] = math.sqrt((1.0 - ratio) / (_low_passed_power(high) - _low_passed_power(low)))


@kernel
def run_band(s, t, key, frame, y, n):
    """Fill `n` frames of `y` with band-limited noise of unit RMS; `s` (BAND_STATE), `t` from `tune_band`."""
    gain = t[2 * _SHARED]
    for i in range(n):
        y[i] = gain * _white_sample(key, frame + i)
    second_order.run(s[:2], t[:_SHARED], y, y, n)
    second_order.run(s[2:], t[_SHARED:], y, y, n)


@kernel
def rest_band(s, t):
    """An upper bound of |output| from here on if the noise before the filters stops.

    For the high-pass (k < 2) `V = x1^2 + k x1 x2 + x2^2` shrinks each frame by exactly
    `r^2 = (1 - k g + g^2) / (1 + k g + g^2)`. As |x|^2 <= V / (1 - k/2), all it will still put out sums to at most
    `|gains| |x| / (1 - r)`, and a unit of input lengthens the low-pass's state by at most 2 g.
    """
    g, k = t[6], t[7]
    v = s[0] * s[0] + k * s[0] * s[1] + s[1] * s[1]
    shrink = math.sqrt((1.0 - k * g + g * g) / (1.0 + k * g + g * g))
    sum_to_come = math.hypot(t[4], t[5]) * math.sqrt(max(v, 0.0) / (1.0 - 0.5 * k)) / (1.0 - shrink)
    low_pass = t[_SHARED:]
    return second_order.rest(s[2:], low_pass) + 2.0 * low_pass[6] * sum_to_come


@kernel
def impulses(key, mean_interval_s, rate, frame, n, events):
    """Write the impulses of a Poisson process whose frames lie in [frame, frame + n) to `events`; give their count.

    Events are (time in frames, strength 1, duration 0); those that share a frame become one, their strengths added, at
    their mean time. `events` holds 3 floats an event and must have room for n of them.

    >>> events = np.empty(3 * 48000)
    >>> 30 < impulses(np.uint64(1), 0.02, 48000.0, 0, 48000, events) < 70
    True
    """
    mean = _mean_frames(mean_interval_s, rate)
    count = 0
    for cell in range(frame // CELL, (frame + n + CELL - 1) // CELL):
        after = 0.0
        for event in range(cell * CELL, (cell + 1) * CELL):
            after += mean * exponential(key, event)
            if after >= CELL:
                break
            time = cell * CELL + after
            onset = math.floor(time)
            if onset < frame or onset >= frame + n:
                continue
            last = 3 * (count - 1)
            if count > 0 and math.floor(events[last]) == onset:
                events[last + 1] += 1.0
                events[last] += (time - events[last]) / events[last + 1]
                continue
            events[3 * count], events[3 * count + 1], events[3 * count + 2] = time, 1.0, 0.0
            count += 1
    return count


@kernel
def tune_texture(t, mean_interval_s, burst_s, centre_hz, width_hz, rate):
    """Fill `t` (TEXTURE_TUNING): mean interval and length of the bursts, centre and -3 dB width of the band-pass.

    The gain gives unit RMS over time: bursts sound a share burst / mean of it, and the band-pass lets through
    `b / (1 + b)` of a white noise's power, b = tan(pi width / rate). It acts before the filter, where no step is felt.
    """
    second_order.tune_band_pass(t[:_SHARED], centre_hz, width_hz, rate)
    mean = _mean_frames(mean_interval_s, rate)
    burst = min(max(math.floor(burst_s * rate + 0.5), 1.0), float(_LONGEST_BURST))
    b = t[6] * t[7] / (1.0 + t[6] * t[6])
    t[_SHARED] = mean
    t[_SHARED + 1] = burst
    t[_SHARED + 2] = math.sqrt(mean / burst * (1.0 + b) / b)


@kernel
def bursts(t, key, frame, y, n):
    """Fill `n` frames of `y` with the texture's bursts before their filter: each impulse begins one, overlaps add.

    An impulse's burst has draws of its own. If the mean interval in `t` moves, impulses in its future are those of
    `impulses` with the new mean; a burst that is sounding may end early.
    """
    mean, burst, gain = t[_SHARED], np.int64(t[_SHARED + 1]), t[_SHARED + 2]
    end = frame + n
    burst_key = np.uint64(key) ^ _BURSTS
    for i in range(n):
        y[i] = 0.0
    for cell in range((frame - burst + 1) // CELL, (end + CELL - 1) // CELL):
        after = 0.0
        for event in range(cell * CELL, (cell + 1) * CELL):
            after += mean * exponential(key, event)
            if after >= CELL:
                break
            onset = np.int64(math.floor(cell * CELL + after))
            for at in range(max(onset, frame), min(onset + burst, end)):
                y[at - frame] += gain * _white_sample(burst_key, event * _LONGEST_BURST + at - onset)


@kernel
def run_texture(s, t, key, frame, y, n):
    """Fill `n` frames of `y` with the texture, unit RMS; `s` (TEXTURE_STATE), `t` from `tune_texture`.

    >>> s, t, y = np.zeros(TEXTURE_STATE), np.zeros(TEXTURE_TUNING), np.empty(48000)
    >>> tune_texture(t, MEAN_INTERVAL_S, BURST_S, CENTRE_HZ, WIDTH_HZ, 48000.0)
    >>> run_texture(s, t, np.uint64(1), 0, y, 48000)
    >>> bool(0.5 < y.std() < 2.0)
    True
    """
    bursts(t, key, frame, y, n)
    second_order.run(s, t[:_SHARED], y, y, n)


@kernel
def rest_texture(s, t):
    """An upper bound of |output| from here on if no burst sounds any more."""
    return second_order.rest(s, t[:_SHARED])


@kernel
def _white_sample(key, counter):
    return _ROOT_12 * (uniform(key, counter) - 0.5)


@kernel
def _mean_frames(mean_interval_s, rate):
    return max(mean_interval_s * rate, 2.0)


@kernel
def _low_passed_power(g):
    """The power a second-order Butterworth low-pass leaves of unit white noise, (2/pi) int g^4/(W^4+g^4) dW/(1+W^2)."""
    return (g**4 + math.sqrt(0.5) * (g - g**3)) / (1.0 + g**4)
