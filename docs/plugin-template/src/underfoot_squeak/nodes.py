"""A squeak: a tone whose pitch rises with the load."""

import math

from underfoot.layouts import Layout
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node


@node("squeak", "Tones")
class Squeak:
    """A tone whose frequency rises with a signal: a board that squeaks the more, the harder it is stepped on."""

    signal = Input(doc="what makes it rise; at 0 it is silent")
    lowest = Number(120.0, 20.0, 2000.0, unit="Hz", scale="log", doc="where it begins")
    rise = Number(0.2, 0.0, 10.0, unit="Hz", doc="how much it rises for one unit of the signal")
    amplitude = Number(1.0, 0.0, 100.0, unit="m/s^2", doc="how strong it is")
    out = Output("m/s^2")
    state = Layout("squeak", "phase")

    def run(signal, lowest, rise, amplitude, rate, state, out):
        phase = state.phase
        for i in range(out.size):
            loaded = signal[i] > 0.0
            out[i] = amplitude * math.sin(2.0 * math.pi * phase) if loaded else 0.0
            phase = (phase + (lowest + rise * signal[i]) / rate) % 1.0 if loaded else 0.0
        state.phase = phase
