"""Things that are struck: modal objects, and hammers that hit them."""

from workbench.kernels import kernel
from workbench.models import impact_row, modal_events
from workbench.parameters import Number, Rows
from workbench.patch.node import Input, Output, event_list, frames, moved, node, rest_kernel, run_kernel

FLOOR = 1e-5
"""Acceleration in m/s^2 below which a mode is let go: 126 dB below full scale, far below what can be felt."""
FASTEST = 100.0
"""m/s: no hammer is thrown faster, whatever the strength of its event."""
_SCALED = 128  # room for the scaled copy of one column of modes
_HAMMER = 7

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
        return impact_row.state_size(len(values["modes"]))

    def tuning(values, rate):
        return 9 + _HAMMER + 4 * _SCALED + impact_row.tuning_size(len(values["modes"]))

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        modes = int(d[0])
        begin = 9 + _HAMMER + 4 * _SCALED
        table = frames(t, begin + impact_row.tuning_size(modes))[begin:]
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
            blows[3 * i + 1] = min(speed, FASTEST) if speed > 0.0 else 0.0
        state, force, acceleration = frames(s, impact_row.state_size(modes)), frames(y[1], n), frames(y[0], n)
        impact_row.ring(state, table, hammer, blows, count, force, acceleration, force[:0], frame, n)
        for i in range(n):
            acceleration[i] *= x[0][i]

    @rest_kernel
    def rest(c, s, t, d):
        modes = int(d[0])
        begin = 9 + _HAMMER + 4 * _SCALED
        table = frames(t, begin + impact_row.tuning_size(modes))[begin:]
        return impact_row.rest(frames(s, impact_row.state_size(modes)), table)


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
        return modal_events.state_size(len(values["modes"]))

    def tuning(values, rate):
        return 2 + 3 * _SCALED + modal_events.tuning_size(len(values["modes"]))

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        modes = int(d[0])
        begin = 2 + 3 * _SCALED
        table = frames(t, begin + modal_events.tuning_size(modes))[begin:]
        if moved(c, t, 2):
            work = frames(t, begin)[2:]
            modal_events.tune(
                table,
                _scaled(d, 0, c[0], work[:_SCALED]),
                _scaled(d, 1, c[1], work[_SCALED:]),
                _scaled(d, 2, 1.0, work[2 * _SCALED :]),
                rate,
                FLOOR,
            )
        state, out = frames(s, modal_events.state_size(modes)), frames(y[0], n)
        modal_events.ring(state, table, event_list(e[0]), int(e[0][0]), out, frame, n)
        for i in range(n):
            out[i] *= x[0][i]

    @rest_kernel
    def rest(c, s, t, d):
        modes = int(d[0])
        begin = 2 + 3 * _SCALED
        table = frames(t, begin + modal_events.tuning_size(modes))[begin:]
        return modal_events.rest(frames(s, modal_events.state_size(modes)), table)
