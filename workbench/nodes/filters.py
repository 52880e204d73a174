"""Filters of second order, for one band or edge."""

from underfoot.models.filtering import second_order
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, frames, moved, node, rest_kernel, run_kernel

_TUNING = 2 + second_order.SECTION_TUNING


@node("low-pass", "Filters", "Low-pass")
class LowPass:
    """Lets pass what is below the cutoff, 12 dB an octave."""

    signal = Input()
    cutoff = Number(300.0, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="where it begins to cut")
    q = Number(second_order.BUTTERWORTH, 0.1, 50.0, scale="log", wire="span", doc="0.71 is flat, more is a peak")
    out = Output()
    state = second_order.SECTION_STATE
    tuning = _TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        section = frames(t, _TUNING)[2:]
        if moved(c, t, 2):
            second_order.tune_low_pass(section, c[0], c[1], rate)
        second_order.run(frames(s, second_order.SECTION_STATE), section, frames(x[0], n), frames(y[0], n), n)

    @rest_kernel
    def rest(c, s, t, d):
        return second_order.rest(frames(s, second_order.SECTION_STATE), frames(t, _TUNING)[2:])


@node("high-pass", "Filters", "High-pass")
class HighPass:
    """Lets pass what is above the cutoff, 12 dB an octave."""

    signal = Input()
    cutoff = Number(60.0, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="where it begins to cut")
    q = Number(second_order.BUTTERWORTH, 0.1, 50.0, scale="log", wire="span", doc="0.71 is flat, more is a peak")
    out = Output()
    state = second_order.SECTION_STATE
    tuning = _TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        section = frames(t, _TUNING)[2:]
        if moved(c, t, 2):
            second_order.tune_high_pass(section, c[0], c[1], rate)
        second_order.run(frames(s, second_order.SECTION_STATE), section, frames(x[0], n), frames(y[0], n), n)

    @rest_kernel
    def rest(c, s, t, d):
        return second_order.rest(frames(s, second_order.SECTION_STATE), frames(t, _TUNING)[2:])


@node("band-pass", "Filters", "Band-pass")
class BandPass:
    """Lets pass a band around its centre, with gain 1 there."""

    signal = Input()
    centre = Number(250.0, 1.0, 20_000.0, unit="Hz", scale="log", wire="span", doc="middle of the band")
    width = Number(100.0, 0.5, 20_000.0, unit="Hz", scale="log", wire="span", doc="width of the band at -3 dB")
    out = Output()
    state = second_order.SECTION_STATE
    tuning = _TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        section = frames(t, _TUNING)[2:]
        if moved(c, t, 2):
            second_order.tune_band_pass(section, c[0], c[1], rate)
        second_order.run(frames(s, second_order.SECTION_STATE), section, frames(x[0], n), frames(y[0], n), n)

    @rest_kernel
    def rest(c, s, t, d):
        return second_order.rest(frames(s, second_order.SECTION_STATE), frames(t, _TUNING)[2:])
