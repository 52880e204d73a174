"""Things that are struck: modal objects, and hammers that hit them."""

import math

from underfoot.kernels import kernel
from underfoot.models.modal import contact_motion, struck_bank
from underfoot.models.modal import hammer as impact_row
from underfoot.models.signals.random import stream_key, uniform
from underfoot.parameters import Count, Number, Rows
from underfoot.patch.node import Input, Output, event_list, frames, moved, node, rest_kernel, run_kernel

FLOOR = 1e-5
"""Acceleration in m/s^2 below which a mode is let go: 126 dB below full scale, far below what can be felt."""
FASTEST = 100.0
"""m/s: no hammer is thrown faster, whatever the strength of its event."""
SLOWEST = 1e-12
"""m/s: a slower hammer is only laid on the object. With the smallest of numbers its contact would not converge."""
_SCALED = 128  # room for the scaled copy of one column of modes
_HAMMER = 7
_MOST_DRAWN = 200
_DRAWN = 6 + 3 * _MOST_DRAWN  # where the table of a drawn bank begins in its tuning

WOODEN = (
    (92.0, 22.0, 0.9, 1.0),
    (168.0, 30.0, 0.7, 0.8),
    (251.0, 42.0, 0.6, 0.7),
    (384.0, 60.0, 0.5, 0.6),
    (530.0, 85.0, 0.5, 0.5),
    (742.0, 120.0, 0.4, 0.4),
)
"""Modes of a wooden board under a foot, designed by ear and hand: frequency, decay, modal mass, shape."""


def _columns(rows, count):
    """How many rows, then the table column by column, as `_scaled` reads it."""
    return [len(rows), *(row[column] for column in range(count) for row in rows)]


@kernel
def _scaled(d, column, factor, out):
    """One column of the table of modes times a factor."""
    count = int(d[0])
    for m in range(count):
        out[m] = d[1 + column * count + m] * factor
    return out[:count]


@node("impact", "Impacts")
class Impact:
    """A hammer that hits a modal object (3.3, 3.4): sub-steps in contact, as many as the asked error takes.

    A strike throws the hammer at velocity times the event's strength. The object rings on through further blows.
    """

    strike = Input(kind="event", doc="a blow; its strength scales the velocity")
    velocity = Number(0.5, 0.001, 20.0, unit="m/s", scale="log", doc="of the hammer at strength 1")
    mass = Number(0.05, 1e-4, 10.0, unit="kg", scale="log", doc="of the hammer")
    stiffness = Number(1e5, 1e3, 1e13, unit="N/m^a", scale="log", doc="of the contact: soft 1e4, hard 1e11")
    exponent = Number(1.5, 1.0, 4.0, doc="a: 1 a spring, 1.5 a sphere")
    damping = Number(0.3, 0.0, 10.0, unit="s/m", doc="mu = lambda / k: the loss in contact")
    error = Number(1e-3, 1e-7, 0.1, scale="log", doc="relative error asked of the displacement")
    pitch = Number(1.0, 0.1, 10.0, scale="log", doc="factor on all frequencies")
    decay = Number(1.0, 0.1, 10.0, scale="log", doc="factor on all decays: more is drier")
    level = Number(1.0, 0.0, 100.0, wire="audio", doc="factor on the acceleration")
    modes = Rows(
        WOODEN,
        (
            ("frequency Hz", 1.0, 20_000.0),
            ("decay 1/s", 0.1, 10_000.0),
            ("mass kg", 1e-4, 1e3),
            ("shape", -10.0, 10.0),
        ),
        most=_SCALED,
        doc="the object's modes: frequency and decay of the damped ringing, modal mass, shape at the struck point",
    )
    acceleration = Output("m/s^2", doc="of the struck point")
    force = Output("N", doc="in the contact")

    def prepare(values, rate):
        return _columns(sorted(values["modes"], key=lambda mode: mode[1]), 4)

    def state(values, rate):
        return contact_motion.state_size(len(values["modes"]))

    def tuning(values, rate):
        return 9 + _HAMMER + 4 * _SCALED + contact_motion.tuning_size(len(values["modes"]))

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        modes = int(d[0])
        begin = 9 + _HAMMER + 4 * _SCALED
        table = frames(t, begin + contact_motion.tuning_size(modes))[begin:]
        hammer = frames(t, 9 + _HAMMER)[9:]
        if moved(c, t, 8):
            work = frames(t, begin)[9 + _HAMMER :]
            impact_row.tune(
                table,
                _scaled(d, 0, c[6], work[:_SCALED]),
                _scaled(d, 1, c[7], work[_SCALED:]),
                _scaled(d, 2, 1.0, work[2 * _SCALED :]),
                _scaled(d, 3, 1.0, work[3 * _SCALED :]),
                rate,
                FLOOR,
            )
            hammer[0], hammer[1], hammer[2], hammer[3], hammer[5] = c[1], c[2], c[3], c[4], c[5]
        count = int(e[0][0])
        blows = event_list(e[0])
        for i in range(count):
            speed = c[0] * blows[3 * i + 1]
            blows[3 * i + 1] = min(speed, FASTEST) if speed > SLOWEST else 0.0
        state, force, acceleration = frames(s, contact_motion.state_size(modes)), frames(y[1], n), frames(y[0], n)
        impact_row.ring(state, table, hammer, blows, count, force, acceleration, force[:0], frame, n)
        for i in range(n):
            acceleration[i] *= x[0][i]

    @rest_kernel
    def rest(c, s, t, d):
        modes = int(d[0])
        begin = 9 + _HAMMER + 4 * _SCALED
        table = frames(t, begin + contact_motion.tuning_size(modes))[begin:]
        return impact_row.rest(frames(s, contact_motion.state_size(modes)), table)


@node("modal-bank", "Impacts", "Modal bank")
class ModalBank:
    """Modes that ring after each event: the sum of a exp(-b t) sin(2 pi f t), from the event's frame on."""

    strike = Input(kind="event", doc="rings all modes, by its strength")
    pitch = Number(1.0, 0.1, 10.0, scale="log", doc="factor on all frequencies")
    decay = Number(1.0, 0.1, 10.0, scale="log", doc="factor on all decays: more is drier")
    level = Number(1.0, 0.0, 100.0, wire="audio", doc="factor on the output")
    modes = Rows(
        ((180.0, 90.0, 1.0), (310.0, 140.0, 0.8), (470.0, 200.0, 0.6), (690.0, 300.0, 0.4)),
        (("frequency Hz", 1.0, 20_000.0), ("decay 1/s", 0.1, 10_000.0), ("amplitude m/s^2", -100.0, 100.0)),
        most=_SCALED,
        doc="frequency, decay and amplitude of each",
    )
    out = Output("m/s^2")

    def prepare(values, rate):
        return _columns(sorted(values["modes"], key=lambda mode: mode[1]), 3)

    def state(values, rate):
        return struck_bank.state_size(len(values["modes"]))

    def tuning(values, rate):
        return 2 + 3 * _SCALED + struck_bank.tuning_size(len(values["modes"]))

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        modes = int(d[0])
        begin = 2 + 3 * _SCALED
        table = frames(t, begin + struck_bank.tuning_size(modes))[begin:]
        if moved(c, t, 2):
            work = frames(t, begin)[2:]
            struck_bank.tune(
                table,
                _scaled(d, 0, c[0], work[:_SCALED]),
                _scaled(d, 1, c[1], work[_SCALED:]),
                _scaled(d, 2, 1.0, work[2 * _SCALED :]),
                rate,
                FLOOR,
            )
        _ring(x[0], y[0], e[0], s, table, modes, frame, n)

    @rest_kernel
    def rest(c, s, t, d):
        return _remainder(s, t, 2 + 3 * _SCALED, int(d[0]))


@node("drawn-bank", "Impacts", "Drawn modal bank")
class DrawnBank:
    """A modal bank whose modes are drawn: p(f) ~ f^alpha from low to high, amplitudes ~ f^-r (7.26).

    Every tile has the same modes, and another draw has others. The squares of the amplitudes sum to 1.
    """

    strike = Input(kind="event", doc="rings all modes, by its strength")
    low = Number(150.0, 1.0, 20_000.0, unit="Hz", scale="log", doc="least frequency")
    high = Number(1200.0, 1.0, 20_000.0, unit="Hz", scale="log", doc="largest frequency; none lies above half the rate")
    alpha = Number(0.0, -5.0, 5.0, doc="exponent of the density of modes: 0 evenly, -1 evenly an octave")
    rolloff = Number(0.5, -3.0, 6.0, doc="r: amplitudes fall by 6.02 r dB an octave")
    quality = Number(8.0, 0.5, 10_000.0, scale="log", doc="pi f / decay of a mode at the least frequency")
    damping = Number(1.0, 0.0, 3.0, doc="exponent of decay over frequency: 1 the same quality, 0 the same decay")
    level = Number(1.0, 0.0, 100.0, wire="audio", doc="factor on the output")
    modes = Count(24, 1, _MOST_DRAWN, doc="how many")
    draw = Count(1, 0, 1_000_000, doc="which of the possible banks")
    out = Output("m/s^2")

    def prepare(values, rate):
        key = stream_key("modes", values["draw"])
        return [values["modes"], *sorted(uniform(key, mode) for mode in range(values["modes"]))]

    def state(values, rate):
        return struck_bank.state_size(values["modes"])

    def tuning(values, rate):
        return _DRAWN + struck_bank.tuning_size(values["modes"])

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        modes = int(d[0])
        table = frames(t, _DRAWN + struck_bank.tuning_size(modes))[_DRAWN:]
        if moved(c, t, 6):
            drawn = frames(t, _DRAWN)[6:].reshape(3, _MOST_DRAWN)[:, :modes]
            draw_modes(frames(d, 1 + modes)[1:], c[0], c[1], c[2], c[3], c[4], c[5], drawn)
            struck_bank.tune(table, drawn[0], drawn[1], drawn[2], rate, FLOOR)
        _ring(x[0], y[0], e[0], s, table, modes, frame, n)

    @rest_kernel
    def rest(c, s, t, d):
        return _remainder(s, t, _DRAWN, int(d[0]))


@kernel
def draw_modes(draws, low_hz, high_hz, alpha, rolloff, quality, damping, modes):
    """Fill `modes` [3, m], rows of frequency (Hz), decay (1/s) and amplitude, from `draws` [m], uniform in (0, 1).

    Frequencies have the density p(f) ~ f^alpha and rise with the draws; decays are pi low / quality (f / low)^damping;
    amplitudes are proportional to f^-rolloff, and their squares sum to 1.

    >>> import numpy as np
    >>> modes = np.zeros((3, 2))
    >>> draw_modes(np.array([0.25, 0.75]), 100.0, 500.0, 0.0, 0.0, 10.0, 1.0, modes)
    >>> modes[0].round(9)
    array([200., 400.])
    """
    width = max(math.log(high_hz / low_hz), 0.0)
    power = alpha + 1.0
    span = math.expm1(power * width)
    squares = 0.0
    for m in range(draws.size):
        # Near alpha = -1 the law is that of the logarithm, to which the general one tends.
        above = draws[m] * width if abs(power) < 1e-9 else math.log1p(draws[m] * span) / power
        modes[0, m] = low_hz * math.exp(above)
        modes[1, m] = math.pi * low_hz / quality * math.exp(damping * above)
        modes[2, m] = math.exp(-rolloff * above)
        squares += modes[2, m] ** 2
    for m in range(draws.size):
        modes[2, m] /= math.sqrt(squares)


@kernel
def _ring(level, out, strikes, s, table, modes, frame, n):
    """Let a bank ring by the events in; `level` and `out` are frames, `table` is what `struck_bank.tune` filled."""
    state, signal = frames(s, struck_bank.state_size(modes)), frames(out, n)
    struck_bank.ring(state, table, event_list(strikes), int(strikes[0]), signal, frame, n)
    for i in range(n):
        signal[i] *= level[i]


@kernel
def _remainder(s, t, begin, modes):
    """A bound of what a bank can still put out, whose table begins at `begin` of its tuning."""
    table = frames(t, begin + struck_bank.tuning_size(modes))[begin:]
    return struck_bank.rest(frames(s, struck_bank.state_size(modes)), table)
