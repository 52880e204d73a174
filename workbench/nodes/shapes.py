"""Nodes that shape and join signals."""

from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node, rest_kernel, run_kernel


@node("gain", "Shapes")
class Gain:
    """A signal times a factor, which a wire may drive."""

    signal = Input(doc="what is made louder or softer")
    gain = Number(1.0, 0.0, 1000.0, wire="audio", doc="factor; 2 is 6 dB louder")
    out = Output()
    muted_by = ("signal", "gain")

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        signal, gain, out = x[0], x[1], y[0]
        for i in range(n):
            out[i] = signal[i] * gain[i]


@node("multiply", "Shapes")
class Multiply:
    """One signal times another: an envelope on a tone, say. Without a wire, b counts as 0."""

    a = Input()
    b = Input()
    out = Output()
    muted_by = ("a", "b")

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        a, b, out = x[0], x[1], y[0]
        for i in range(n):
            out[i] = a[i] * b[i]


@node("mix", "Shapes")
class Mix:
    """The sum of up to four signals, each with its level."""

    a = Input()
    b = Input()
    c = Input()
    d = Input()
    level_a = Number(1.0, -10.0, 10.0, wire="audio", doc="factor on a")
    level_b = Number(1.0, -10.0, 10.0, wire="audio", doc="factor on b")
    level_c = Number(1.0, -10.0, 10.0, wire="audio", doc="factor on c")
    level_d = Number(1.0, -10.0, 10.0, wire="audio", doc="factor on d")
    out = Output()

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        a, b, third, fourth, out = x[0], x[1], x[2], x[3], y[0]
        level_a, level_b, level_c, level_d = x[4], x[5], x[6], x[7]
        for i in range(n):
            out[i] = a[i] * level_a[i] + b[i] * level_b[i] + third[i] * level_c[i] + fourth[i] * level_d[i]


@node("scale", "Shapes")
class Scale:
    """A signal in another unit or range: in the input's range, low becomes out low and high becomes out high."""

    signal = Input(doc="in any unit")
    low = Number(0.0, -1e6, 1e6, doc="input that gives out low")
    high = Number(1.0, -1e6, 1e6, doc="input that gives out high")
    out_low = Number(0.0, -1e6, 1e6, doc="output at low and below")
    out_high = Number(1.0, -1e6, 1e6, doc="output at high and above")
    out = Output(doc="held between out low and out high")

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        signal, out = x[0], y[0]
        low, high, out_low, out_high = c[0], c[1], c[2], c[3]
        slope = 0.0 if high == low else 1.0 / (high - low)
        for i in range(n):
            share = min(max((signal[i] - low) * slope, 0.0), 1.0)
            out[i] = out_low + share * (out_high - out_low)

    @rest_kernel
    def rest(c, s, t, d):
        slope = 0.0 if c[1] == c[0] else 1.0 / (c[1] - c[0])
        return abs(c[2] + min(max(-c[0] * slope, 0.0), 1.0) * (c[3] - c[2]))
