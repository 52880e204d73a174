"""A vibration as a few oscillations with amplitude and frequency over time, which most formats store.

Analysed from samples, the amplitude is that of a sine of the same power in a window of 5 ms: |analytic signal|^2,
smoothed. The frequency is the centroid of the power spectrum there: Im(conj(a) da/dt) / |a|^2 / 2 pi, both smoothed
over 20 ms. For one sine both are exact away from the ends; for several partials the frequency is the power-weighted
mean, and the amplitude contains their beats as far as 5 ms resolve them.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats
from underfoot.models.signals.breakpoints import thinned

AMPLITUDE_S, FREQUENCY_S = 5e-3, 20e-3
"""Lengths of the Hann windows over which amplitude and frequency are estimated."""
HOP_S = 1e-3
"""Interval in seconds between points, before points on straight lines are removed."""
MOST_POINTS = 50_000
"""Most points of a curve that is written or read: 50 s of a curve that bends at every hop, minutes of gravel."""
COMPARED_DB = 30.0
"""Envelopes are compared where the original is within this many dB of its largest."""

TIME, AMPLITUDE, FREQUENCY = 0, 1, 2
"""Columns of a voice's points."""


@dataclass(frozen=True)
class Voice:
    """One oscillation: `points` [point, 3] of seconds, amplitude and hertz, ascending, linearly interpolated.

    `wave` is "sine", "square", "triangle", "saw" or "noise"; `duty` is the share of a period for which a square is
    high.
    """

    points: Floats
    wave: str = "sine"
    duty: float = 0.5

    def samples(self, frames: int, rate_hz: float) -> Floats:
        """Return the oscillation from phase 0 on: shape (frames,); of square, triangle and saw, the first partial."""
        time_s = np.arange(frames) / rate_hz
        return self.amplitude(time_s) * np.sin(2.0 * np.pi * np.cumsum(self.frequency(time_s)) / rate_hz)

    def amplitude(self, time_s: Floats) -> Floats:
        """Return the amplitude at these times, 0 beyond the ends."""
        return np.interp(time_s, self.points[:, TIME], self.points[:, AMPLITUDE], 0.0, 0.0)

    def frequency(self, time_s: Floats) -> Floats:
        """Return the frequency at these times."""
        return np.interp(time_s, self.points[:, TIME], self.points[:, FREQUENCY])


def analysed(samples: Floats, rate_hz: float) -> Floats:
    """Analyse a vibration [frame]: amplitude and frequency as points [point, 3] every `HOP_S`.

    Where its amplitude is below 1 % of the largest, the frequency is that of the nearest louder part.

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


def lengthened(samples: Floats, rate_hz: float) -> Floats:
    """Return a vibration with silence behind it, at least as long as the longer window: a click has no envelope else.

    >>> lengthened(np.ones(3), 1000.0).size
    20
    """
    return np.pad(samples, (0, max(0, round(FREQUENCY_S * rate_hz) - samples.size)))


def banded(samples: Floats, rate_hz: float, edges_hz: tuple[float, ...]) -> list[Floats]:
    """Split a vibration into bands between these edges; their sum is the vibration from the first edge to the last."""
    spectrum = np.fft.rfft(samples)
    at_hz = np.fft.rfftfreq(samples.size, 1.0 / rate_hz)
    return [
        np.fft.irfft(np.where((at_hz >= low) & (at_hz < high), spectrum, 0.0), samples.size)
        for low, high in pairwise(edges_hz)
    ]


def simplify_points(points: Floats, amplitude: float, frequency: float, most: int = MOST_POINTS) -> Floats:
    """Remove points that deviate from the line between others by at most these amounts."""
    return thinned(points, np.array([amplitude, frequency]), most)


def envelope_error_db(original: Floats, written: Floats, rate_hz: float) -> float:
    """Return the RMS difference of two envelopes in dB, where the original is within 30 dB of its largest.

    Both are estimated over 5 ms. About 1 dB is a just noticeable difference.
    """
    ours, theirs = (
        np.sqrt(smoothed(np.abs(_analytic(samples)) ** 2, round(AMPLITUDE_S * rate_hz)))
        for samples in (original, written)
    )
    loud = ours > ours.max(initial=0.0) * 10.0 ** (-COMPARED_DB / 20.0)
    floor = ours.max(initial=0.0) * 10.0 ** (-(COMPARED_DB + 10.0) / 20.0)
    difference = 20.0 * np.log10(np.maximum(theirs[loud], floor) / ours[loud])
    return float(np.sqrt(np.mean(np.square(difference)))) if loud.any() else 0.0


def smoothed(values: Floats, frames: int) -> Floats:
    """Return the mean over a Hann window of this many frames; zeros beyond the ends."""
    from scipy.signal import fftconvolve

    window = np.hanning(max(frames, 1) + 2)[1:-1]
    whole = fftconvolve(values, window / window.sum(), "same")
    return np.maximum(whole, 0.0) if values.min(initial=0.0) >= 0.0 else whole


def _analytic(samples: Floats) -> NDArray[np.complex128]:
    """Return the analytic signal: without negative frequencies."""
    from scipy.signal import hilbert

    return hilbert(samples)
