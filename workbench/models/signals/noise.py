"""White noise, band-limited noise and the gravel texture of thesis 6.3.5, computed by position.

No random state is carried from frame to frame: the value follows from the stream's key and the frame number, so that
block length, sleep and other rows cannot change it. All three have unit RMS.
"""

import math

import numpy as np

from underfoot.clock import SPAN
from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.filtering import second_order
from underfoot.models.signals.events import emit
from underfoot.models.signals.random import exponential, uniform

BAND_STATE = Layout("band_noise", high_pass=second_order.STATE, low_pass=second_order.STATE)
BAND_COEFFICIENTS = Layout(
    "band_noise_coefficients", "gain", high_pass=second_order.COEFFICIENTS, low_pass=second_order.COEFFICIENTS
)
TEXTURE_STATE = Layout("texture", "gain", filter=second_order.MOVING_STATE)
"""The gain of the last span, 0 before the first, and the band-pass."""
TEXTURE_COEFFICIENTS = Layout("texture_coefficients", "interval", "burst", "gain", band_pass=second_order.COEFFICIENTS)
"""Mean interval and length of a burst in frames, and the gain before the band-pass."""

LOW_HZ, HIGH_HZ = 50.0, 700.0
"""Noise band of the thesis (6.3.5)."""
MEAN_INTERVAL_S, BURST_S, CENTRE_HZ, WIDTH_HZ = 0.020, 0.001, 300.0, 15.0
"""Texture of the thesis (6.3.5; intervals as in docs/models.md#noise-and-texture)."""

CELL = 32
"""Frames for which the impulses of a Poisson process are drawn together; also their largest number in that time."""
_LONGEST_BURST = 1 << 16
_BURSTS = np.uint64(0xD1B54A32D192ED03)
_ROOT_12 = math.sqrt(12.0)


@kernel
def white(key: np.uint64, frame: int, out: Floats) -> None:
    """Fill `out` with white noise of unit variance, from sample `frame` (int64) of stream `key` (uint64) on.

    Samples are uniform within +-sqrt(3): a small peak value, at an eighth of the cost of normal samples. After band
    limiting the two are indistinguishable.

    >>> noise = np.empty(1000)
    >>> white(np.uint64(1), 0, noise)
    >>> bool(abs(noise.std() - 1.0) < 0.05)
    True
    """
    for i in range(out.size):
        out[i] = _white_sample(key, frame + i)


@kernel
def design_band(low_hz: float, high_hz: float, rate: float, coefficients: Memory) -> None:
    """Design noise from `low_hz` to `high_hz`: second-order Butterworth at each end, unit RMS.

    The edges are kept at least 2 % apart.
    """
    high_hz = min(max(high_hz, 1.02 * second_order.LOWEST * rate), second_order.HIGHEST * rate)
    low_hz = min(low_hz, high_hz / 1.02)
    high_pass, low_pass = coefficients.high_pass, coefficients.low_pass
    second_order.design_high_pass(low_hz, second_order.BUTTERWORTH, rate, high_pass)
    second_order.design_low_pass(high_hz, second_order.BUTTERWORTH, rate, low_pass)
    # With W = tan(w/2): |H|^2 = W^4/(W^4 + low^4) high^4/(W^4 + high^4), a difference of two low-passes.
    ratio = (high_pass.g / low_pass.g) ** 4
    power = _low_passed_power(low_pass.g) - _low_passed_power(high_pass.g)
    coefficients.gain = math.sqrt((1.0 - ratio) / power)


@kernel
def run_band(key: np.uint64, frame: int, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Fill `out` with band-limited noise of unit RMS."""
    gain = coefficients.gain
    for i in range(out.size):
        out[i] = gain * _white_sample(key, frame + i)
    second_order.run_two(out, coefficients.high_pass, coefficients.low_pass, (state.high_pass, state.low_pass), out)


@kernel
def impulses(key: np.uint64, mean_interval_s: float, rate: float, frame: int, end: int, events: Memory) -> None:
    """Append the impulses of a Poisson process with frames in [frame, end) to `events`, at strength 1.

    Impulses in the same frame are merged: strengths added, mean time.

    >>> from underfoot.models.signals.events import event_list
    >>> events = event_list(room=200)
    >>> impulses(np.uint64(1), 0.02, 48000.0, 0, 48000, events)
    >>> 30 < len(events) < 70
    True
    """
    mean = _mean_frames(mean_interval_s, rate)
    for cell in range(frame // CELL, (end + CELL - 1) // CELL):
        after = 0.0
        for draw in range(cell * CELL, (cell + 1) * CELL):
            after += mean * exponential(key, draw)
            if after >= CELL:
                break
            time = cell * CELL + after
            if frame <= math.floor(time) < end:
                emit(events, time, 1.0)


@kernel
def design_texture(
    mean_interval_s: float, burst_s: float, centre_hz: float, width_hz: float, rate: float, coefficients: Memory
) -> None:
    """Design the texture: bursts of this mean interval and length, through a band-pass of this centre and width.

    The gain gives unit RMS over time: bursts are present for a share burst / mean of it, and the band-pass passes
    `b / (1 + b)` of the power of white noise, b = tan(pi width / rate). It acts before the filter, which smooths steps.
    """
    band_pass = coefficients.band_pass
    second_order.design_band_pass(centre_hz, width_hz, rate, band_pass)
    mean = _mean_frames(mean_interval_s, rate)
    burst = min(max(math.floor(burst_s * rate + 0.5), 1.0), float(_LONGEST_BURST))
    b = band_pass.g * band_pass.k / (1.0 + band_pass.g * band_pass.g)
    coefficients.interval = mean
    coefficients.burst = burst
    coefficients.gain = math.sqrt(mean / burst * (1.0 + b) / b)


@kernel
def run_texture(key: np.uint64, frame: int, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Fill `out` with the texture, from session frame `frame` on.

    A gain that rises, as for a band-pass that becomes narrow, waits for the span in which the band-pass moves: through
    one that is still wide it would be too loud.
    """
    bursts(key, frame, coefficients, out)
    if state.gain == 0.0:
        state.gain = coefficients.gain
    i = 0
    while i < out.size and state.gain != coefficients.gain:
        out[i] *= min(state.gain / coefficients.gain, 1.0)
        i += 1
        if (frame + i) % SPAN == 0:
            state.gain = coefficients.gain
    second_order.run_moving(out, coefficients.band_pass, frame, state.filter, out)


@kernel
def bursts(key: np.uint64, frame: int, coefficients: Memory, out: Floats) -> None:
    """Fill `out` with the texture's bursts before the filter: each impulse starts one, overlaps add.

    Each burst has its own draws. If the mean interval changes, later impulses are those of `impulses` with the new
    mean; a burst under way may end early.
    """
    mean, burst, gain = coefficients.interval, int(coefficients.burst), coefficients.gain
    end = frame + out.size
    burst_key = np.uint64(key) ^ _BURSTS
    for i in range(out.size):
        out[i] = 0.0
    for cell in range((frame - burst + 1) // CELL, (end + CELL - 1) // CELL):
        after = 0.0
        for event in range(cell * CELL, (cell + 1) * CELL):
            after += mean * exponential(key, event)
            if after >= CELL:
                break
            onset = int(math.floor(cell * CELL + after))
            for at in range(max(onset, frame), min(onset + burst, end)):
                out[at - frame] += gain * _white_sample(burst_key, event * _LONGEST_BURST + at - onset)


@kernel
def _white_sample(key: np.uint64, counter: int) -> float:
    return _ROOT_12 * (uniform(key, counter) - 0.5)


@kernel
def _mean_frames(mean_interval_s: float, rate: float) -> float:
    return max(mean_interval_s * rate, 2.0)


@kernel
def _low_passed_power(g: float) -> float:
    """Return the power of low-passed unit white noise (Butterworth), (2/pi) int g^4/(W^4+g^4) dW/(1+W^2)."""
    return (g**4 + math.sqrt(0.5) * (g - g**3)) / (1.0 + g**4)
