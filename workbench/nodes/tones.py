"""Tones and their roughness."""

import math

from underfoot.models.signals import waveshaping
from underfoot.parameters import Number, Numbers
from underfoot.patch.node import Input, Output, node, prepared


@node("tone", "Tones", "Waveshaped tone")
class Tone:
    """Oscillator by waveshaping (3.1, 3.2): a sine and its harmonics, without those at or above half the sample rate.

    Amplitude bounds the samples; at exactly 0 the node sleeps, and it wakes at the start of a period.
    """

    also_called = "sine, VCO, osc, oscillator, cycle, FM, buzz, hum, waveshaper, distortion"
    accuracy = "exact: a sum of sines, to 1e-12"
    frequency = Number(50.0, 1.0, 5000.0, unit="Hz", scale="log", wire="audio", doc="fundamental frequency")
    harmonics = Numbers(
        (0.3, 0.4, 0.6, 0.9, 1.0, 0.8, 0.5, 0.3, 0.2, 0.1),
        -10.0,
        10.0,
        most=64,
        doc="amplitude of each harmonic relative to the others, fundamental first",
    )
    amplitude = Number(
        5.0,
        0.0,
        100.0,
        scale="amplitude",
        wire="audio",
        doc="sum of the harmonics' amplitudes, m/s^2: the peak of one, a bound of the peak of several",
    )
    out = Output("m/s^2")
    state = waveshaping.STATE
    muted_by = ("amplitude",)
    tail = math.inf

    @prepared
    def weights(values, rate):
        total = waveshaping.peak_bound(values["harmonics"]) or 1.0
        return [a / total for a in values["harmonics"]]

    def run(frequency, amplitude, weights, rate, state, out):
        waveshaping.run(frequency, weights, rate, state, out)
        for i in range(out.size):
            out[i] *= amplitude[i]


@node("roughness", "Tones")
class Roughness:
    """Amplitude modulation, 1 + depth sin(2 pi f t): beats that feel rough (thesis: 25 Hz)."""

    also_called = "AM, tremolo, buzz"
    accuracy = "exact: to 1e-12"
    signal = Input()
    depth = Number(
        0.5, 0.0, 1.0, wire="audio", doc="modulation depth: 0 is smooth; at 1 the signal vanishes once per beat"
    )
    frequency = Number(25.0, 0.1, 200.0, unit="Hz", scale="log", wire="audio", doc="modulation frequency")
    out = Output()
    state = waveshaping.PHASE
    muted_by = ("signal",)

    def run(signal, depth, frequency, rate, state, out):
        waveshaping.roughen(signal, depth, frequency, rate, state, out)
