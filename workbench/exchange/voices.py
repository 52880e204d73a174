"""A vibration as a few oscillations, each with an amplitude and a frequency over time: what most formats hold.

Analysed from samples, the amplitude is that of a sine with the same power, through a window of 5 ms: |analytic
signal|^2, smoothed. The frequency is the middle of the power spectrum there: Im(conj(a) da/dt) / |a|^2 / 2 pi, both
smoothed alike over 20 ms. For one sine both are exact away from the ends; of several partials the frequency is the mean
by power, and their beats are in the amplitude as far as 5 ms show them.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underfoot.models.signals.breakpoints import thinned

Array = NDArray[np.float64]

AMPLITUDE_S, FREQUENCY_S = 5e-3, 20e-3
"""Lengths of the windows (Hann) through which amplitude and frequency are seen."""
HOP_S = 1e-3
"""Amplitude and frequency are told so often, before points on straight lines are left out."""
COMPARED_DB = 30.0
"""Envelopes are compared where the original is within so many dB of its largest."""

TIME, AMPLITUDE, FREQUENCY = 0, 1, 2
"""The columns of a voice's points."""


@dataclass(frozen=True)
class Voice:
    """One oscillation: `points` [point, 3] of seconds, amplitude and hertz, ascending, straight lines between.

    `wave` is "sine", "square", "triangle", "saw" or "noise"; `duty` is the share of a period that a square is high.
    """

    points: Array
    wave: str = "sine"
    duty: float = 0.5

    def samples(self, frames: int, rate_hz: float) -> Array:
        """The oscillation, from phase 0: shape (frames,). Square, triangle and saw count by their first partial."""
        time_s = np.arange(frames) / rate_hz
        return self.amplitude(time_s) * np.sin(2.0 * np.pi * np.cumsum(self.frequency(time_s)) / rate_hz)

    def amplitude(self, time_s: Array) -> Array:
        """The amplitude at these times, 0 beyond the ends."""
        return np.interp(time_s, self.points[:, TIME], self.points[:, AMPLITUDE], 0.0, 0.0)

    def frequency(self, time_s: Array) -> Array:
        """The frequency at these times."""
        return np.interp(time_s, self.points[:, TIME], self.points[:, FREQUENCY])


def analysed(samples: Array, rate_hz: float) -> Array:
    """Amplitude and frequency of a vibration [frame], as points [point, 3] every `HOP_S`.

    Where it is softer than 1 % of its largest amplitude, the frequency is that of the sound beside it.

    >>> sine = np.sin(2.0 * np.pi * 120.0 * np.arange(24_000) / 48_000.0)
    >>> analysed(2.0 * sine, 48_000.0)[250].round(2).tolist()
    [0.25, 2.0, 120.0]
    """
    analytic = _analytic(samples)
    power = np.abs(analytic) ** 2
    turning = np.zeros_like(power)
    turning[1:-1] = np.imag(np.conj(analytic[1:-1]) * (analytic[2:] - analytic[:-2])) * rate_hz / (4.0 * np.pi)
    frames = np.minimum(np.round(np.arange(0.0, samples.size / rate_hz, HOP_S) * rate_hz).astype(int), samples.size - 1)
    amplitude = np.sqrt(smoothed(power, round(AMPLITUDE_S * rate_hz))[frames])
    window = round(FREQUENCY_S * rate_hz)
    weight = smoothed(power, window)[frames]
    frequency = np.abs(smoothed(turning, window)[frames]) / np.maximum(weight, 1e-300)
    loud = np.flatnonzero(amplitude > 0.01 * amplitude.max(initial=0.0))
    if loud.size:
        frequency = np.interp(np.arange(frames.size), loud, frequency[loud])
    return np.column_stack([frames / rate_hz, amplitude, frequency])


def banded(samples: Array, rate_hz: float, edges_hz: tuple[float, ...]) -> list[Array]:
    """The vibration in bands between these edges, which together are all of it between the first and the last."""
    spectrum = np.fft.rfft(samples)
    at_hz = np.fft.rfftfreq(samples.size, 1.0 / rate_hz)
    return [
        np.fft.irfft(np.where((at_hz >= low) & (at_hz < high), spectrum, 0.0), samples.size)
        for low, high in pairwise(edges_hz)
    ]


def lean(points: Array, amplitude: float, frequency: float, most: int = 4000) -> Array:
    """Points that are off the straight line between others by no more than these are left out."""
    return thinned(points, np.array([amplitude, frequency]), most)


def envelope_error_db(original: Array, written: Array, rate_hz: float) -> float:
    """By how many dB two envelopes differ (root mean square), where the original is within 30 dB of its largest.

    Both are seen through a window of 5 ms. 1 dB is about the least that a person tells.
    """
    ours, theirs = (
        np.sqrt(smoothed(np.abs(_analytic(samples)) ** 2, round(AMPLITUDE_S * rate_hz)))
        for samples in (original, written)
    )
    loud = ours > ours.max(initial=0.0) * 10.0 ** (-COMPARED_DB / 20.0)
    floor = ours.max(initial=0.0) * 10.0 ** (-(COMPARED_DB + 10.0) / 20.0)
    difference = 20.0 * np.log10(np.maximum(theirs[loud], floor) / ours[loud])
    return float(np.sqrt(np.mean(np.square(difference)))) if loud.any() else 0.0


def smoothed(values: Array, frames: int) -> Array:
    """The mean through a Hann window of so many frames; beyond the ends there is nothing."""
    window = np.hanning(max(frames, 1) + 2)[1:-1]
    size = values.size + window.size - 1
    length = 1 << (size - 1).bit_length()
    product = np.fft.irfft(np.fft.rfft(values, length) * np.fft.rfft(window / window.sum(), length), length)
    first = (window.size - 1) // 2
    whole = product[first : first + values.size]
    return np.maximum(whole, 0.0) if values.min(initial=0.0) >= 0.0 else whole


def _analytic(samples: Array) -> NDArray[np.complex128]:
    """The analytic signal: what has no negative frequencies."""
    spectrum = np.fft.fft(samples)
    half = samples.size // 2
    spectrum[1 : half + samples.size % 2] *= 2.0
    spectrum[half + 1 :] = 0.0
    return np.fft.ifft(spectrum)
