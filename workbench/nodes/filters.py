"""Second-order filters."""

from underfoot.models.filtering import second_order
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node


class _Section:
    """Common part: a second-order section whose coefficients may change while it runs."""

    accuracy = "exact: SciPy's design, to 1e-9"
    state, coefficients = second_order.MOVING_STATE, second_order.COEFFICIENTS

    def run(signal, coefficients, frame, state, out):
        second_order.run_moving(signal, coefficients, frame, state, out)

    def tail(state, coefficients):
        return second_order.tail_moving(state, coefficients)


def _q() -> Number:
    doc = "quality factor; 0.71 is maximally flat, more gives a resonant peak"
    return Number(second_order.BUTTERWORTH, 0.1, 50.0, scale="log", wire="span", doc=doc)


@node("low-pass", "Filters", "Low-pass")
class LowPass(_Section):
    """Second-order low-pass, 12 dB per octave."""

    also_called = "LPF, lop, lores, onepole, VCF, SVF, biquad, smooth, average, slew, lag, slide, ease, portamento"
    signal = Input()
    cutoff = Number(300.0, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="cutoff frequency")
    q = _q()
    out = Output()

    def design(cutoff, q, rate, coefficients):
        second_order.design_low_pass(cutoff, q, rate, coefficients)


@node("high-pass", "Filters", "High-pass")
class HighPass(_Section):
    """Second-order high-pass, 12 dB per octave."""

    also_called = "HPF, hip, VCF, SVF, biquad"
    signal = Input()
    cutoff = Number(60.0, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="cutoff frequency")
    q = _q()
    out = Output()

    def design(cutoff, q, rate, coefficients):
        second_order.design_high_pass(cutoff, q, rate, coefficients)


@node("band-pass", "Filters", "Band-pass")
class BandPass(_Section):
    """Second-order band-pass with gain 1 at its centre."""

    also_called = "BPF, bp, reson, VCF, SVF, biquad"
    signal = Input()
    centre = Number(250.0, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="centre frequency")
    width = Number(100.0, 0.5, 20_000.0, unit="Hz", scale="log", wire="span", doc="bandwidth at -3 dB")
    out = Output()

    def design(centre, width, rate, coefficients):
        second_order.design_band_pass(centre, width, rate, coefficients)
