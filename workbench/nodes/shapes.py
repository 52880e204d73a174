"""Arithmetic on signals: gain, product, absolute value, sum, scaling."""

from underfoot.models.signals import ranges
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node

FARTHEST = 1e6
"""Largest magnitude of an end of a range, in the unit of the signal."""


@node("gain", "Shapes")
class Gain:
    """Volume: multiply a signal by a factor, which a wire may drive."""

    also_called = "VCA, amplifier, fader, *, divide, math"
    accuracy = "exact: to 1e-12"
    signal = Input(doc="signal to scale")
    gain = Number(1.0, 0.0, 1000.0, scale="gain", wire="audio", doc="factor; 2 is +6 dB")
    out = Output()
    muted_by = ("signal", "gain")

    def run(signal, gain, out):
        for i in range(out.size):
            out[i] = signal[i] * gain[i]


@node("multiply", "Shapes")
class Multiply:
    """Product of two signals, e.g. an envelope and a tone. An unconnected b counts as 0."""

    also_called = "VCA, *, ring modulator, AM, switch, gate, math"
    accuracy = "exact: to 1e-12"
    a = Input()
    b = Input()
    out = Output()
    muted_by = ("a", "b")

    def run(a, b, out):
        for i in range(out.size):
            out[i] = a[i] * b[i]


@node("rectify", "Shapes")
class Rectify:
    """Absolute value of a signal. Behind it, a Low-pass of 10 Hz follows how strong a vibration or a sound is."""

    also_called = "abs, absolute, full wave, envelope follower, math"
    accuracy = "exact: to 1e-12"
    signal = Input()
    out = Output()
    muted_by = ("signal",)

    def run(signal, out):
        for i in range(out.size):
            out[i] = abs(signal[i])


@node("mix", "Shapes")
class Mix:
    """Add up to four signals, each times its own factor: a weighted sum."""

    also_called = "mixer, +, -, subtract, crossfade, xfade, math"
    accuracy = "exact: to 1e-12"
    a = Input()
    b = Input()
    c = Input()
    d = Input()
    level_a = Number(1.0, -10.0, 10.0, scale="gain", wire="audio", doc="factor on a")
    level_b = Number(1.0, -10.0, 10.0, scale="gain", wire="audio", doc="factor on b")
    level_c = Number(1.0, -10.0, 10.0, scale="gain", wire="audio", doc="factor on c")
    level_d = Number(1.0, -10.0, 10.0, scale="gain", wire="audio", doc="factor on d")
    out = Output()
    is_sum = True

    def run(a, b, c, d, level_a, level_b, level_c, level_d, out):
        for i in range(out.size):
            out[i] = a[i] * level_a[i] + b[i] * level_b[i] + c[i] * level_c[i] + d[i] * level_d[i]


class Mapped:
    """Common part: a signal that is mapped from one range to another, with limits."""

    accuracy = "exact: to 1e-12"
    signal = Input(doc="any unit")
    low = Number(0.0, -FARTHEST, FARTHEST, unit_of="signal", doc="input that gives out low")
    high = Number(1.0, -FARTHEST, FARTHEST, unit_of="signal", doc="input that gives out high")
    out_low = Number(0.0, -FARTHEST, FARTHEST, unit_of="out", doc="output at and below low")
    out_high = Number(1.0, -FARTHEST, FARTHEST, unit_of="out", doc="output at and above high")
    out = Output(doc="limited to out low and out high")
    state, coefficients = ranges.STATE, ranges.RANGES

    def run(signal, coefficients, frame, state, out):
        ranges.run(signal, coefficients, frame, state, out)


@node("scale", "Shapes")
class Scale(Mapped):
    """Map a signal linearly from one range to another: low to out low, high to out high."""

    also_called = "zmap, map range, offset, bias, invert, math"

    def design(low, high, out_low, out_high, coefficients):
        ranges.design(low, high, out_low, out_high, 1.0, coefficients)

    def tail(low, high, out_low, out_high, state):
        return max(abs(ranges.curve(0.0, low, high, out_low, out_high, 1.0)), ranges.tail(state))
