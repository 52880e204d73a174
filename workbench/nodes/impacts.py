"""Struck objects: modal resonators, and hammers that excite them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.layouts import Layout
from underfoot.models.modal import contact_motion, drawn_modes, hammer, phasors, struck_bank
from underfoot.parameters import Count, Number, Rows
from underfoot.patch.node import Input, Output, RequestedError, node, prepared, prepared_columns

FASTEST_M_S = 100.0
"""Largest speed of a hammer, whatever the strength of its event."""
SLOWEST_M_S = 1e-12
"""Speed at or below which a hammer only rests on the object: at the smallest values its contact would not
converge."""
_MOST_MODES = 128
_MOST_DRAWN = 200

WOODEN = (
    (92.0, 22.0, 0.9, 1.0),
    (168.0, 30.0, 0.7, 0.8),
    (251.0, 42.0, 0.6, 0.7),
    (384.0, 60.0, 0.5, 0.6),
    (530.0, 85.0, 0.5, 0.5),
    (742.0, 120.0, 0.4, 0.4),
)
"""Modes of a wooden board under a foot, tuned by ear and by hand: frequency, decay, modal mass, shape."""


def _by_decay(modes: Sequence[Sequence[float]]) -> NDArray[np.float64]:
    """Return a table of modes [column, mode], sorted by decay, slowest first."""
    return np.array(sorted(modes, key=lambda mode: mode[1])).T


@node("impact", "Impacts")
class Impact:
    """Hammer that strikes a modal object, such as a drum or a board (3.3, 3.4).

    The contact is integrated in sub-steps to the requested error. A strike launches the hammer at velocity times
    strength. The object keeps ringing through further strikes.
    """

    also_called = "hit, hammer, kick, bell, metal"
    accuracy = "requested: the error below, of the displacement; energy grows by at most 1e-11"
    requested_error = RequestedError(
        "of the displacement", "a blow, with 0.1 s of ringing", "underfoot.models.modal.strike_error"
    )
    strike = Input(kind="event", doc="launches the hammer; strength scales the velocity")
    velocity = Number(
        0.5, 0.001, 20.0, unit="m/s", scale="log", wire="span", added=0.05, doc="hammer velocity at strength 1"
    )
    mass = Number(0.05, 1e-4, 10.0, unit="kg", scale="log", doc="mass of the hammer")
    stiffness = Number(1e5, 1e3, 1e13, unit="N/m^a", scale="log", doc="contact stiffness: soft 1e4, hard 1e11")
    exponent = Number(1.5, 1.0, 4.0, doc="exponent a of the contact force: 1 is a spring, 1.5 a sphere")
    damping = Number(0.3, 0.0, 10.0, unit="s/m", scale="amplitude", doc="contact damping mu = lambda / k")
    error = Number(1e-3, 1e-7, 0.1, scale="log", doc="largest relative error of the displacement")
    pitch = Number(1.0, 0.1, 10.0, scale="log", fades=True, doc="factor on all mode frequencies")
    decay = Number(1.0, 0.1, 10.0, scale="log", fades=True, doc="factor on all decays: more is drier")
    level = Number(1.0, 0.0, 100.0, scale="gain", wire="audio", doc="factor on the acceleration")
    modes = Rows(
        WOODEN,
        (
            ("frequency Hz", 1.0, 20_000.0),
            ("decay 1/s", 0.1, 10_000.0),
            ("mass kg", 1e-4, 1e3),
            ("shape", -10.0, 10.0),
        ),
        most=_MOST_MODES,
        doc="modes of the object: frequency and decay of the damped ringing, modal mass, shape at the struck point",
    )
    acceleration = Output("m/s^2", doc="acceleration of the struck point")
    force = Output("N", doc="contact force")

    state = contact_motion.STATE
    coefficients = Layout("impact_coefficients", hammer=hammer.HAMMER, struck=contact_motion.OBJECT)

    def sizes(values, rate):
        return phasors.sizes(len(values["modes"]))

    @prepared_columns
    def table(values, rate):
        return _by_decay(values["modes"])

    def design(table, mass, stiffness, exponent, damping, error, pitch, decay, rate, coefficients):
        hammer.design(table, pitch, decay, rate, hammer.FLOOR_M_S2, coefficients.struck)
        thrown = coefficients.hammer
        thrown.mass, thrown.stiffness, thrown.exponent, thrown.damping = mass, stiffness, exponent, damping
        thrown.error = error

    def run(strike, velocity, level, frame, coefficients, state, acceleration, force):
        for k in range(len(strike)):
            speed = velocity * strike.strength[k]
            strike.strength[k] = min(speed, FASTEST_M_S) if speed > SLOWEST_M_S else 0.0
        out = hammer.Response(force, acceleration, force[:0])
        hammer.ring(strike, coefficients.hammer, frame, coefficients.struck, state, out)
        for i in range(acceleration.size):
            acceleration[i] *= level[i]

    def tail(state, coefficients):
        return hammer.tail(state, coefficients.struck)


@node("modal-bank", "Impacts", "Modal bank")
class ModalBank:
    """Bank of resonators, such as a drum or a board: damped sines, a exp(-b t) sin(2 pi f t), excited by events."""

    also_called = "ring, bell, metal, steel, plate, bubble, drop, reson, resonate"
    accuracy = "exact: the closed form, to 1e-9 after ten seconds"
    strike = Input(kind="event", doc="excites all modes; strength scales the amplitude")
    pitch = Number(1.0, 0.1, 10.0, scale="log", wire="span", doc="factor on all mode frequencies")
    decay = Number(1.0, 0.1, 10.0, scale="log", wire="span", doc="factor on all decays: more is drier")
    level = Number(1.0, 0.0, 100.0, scale="gain", wire="audio", doc="factor on the output")
    modes = Rows(
        ((180.0, 90.0, 1.0), (310.0, 140.0, 0.8), (470.0, 200.0, 0.6), (690.0, 300.0, 0.4)),
        (("frequency Hz", 1.0, 20_000.0), ("decay 1/s", 0.1, 10_000.0), ("amplitude m/s^2", -100.0, 100.0)),
        most=_MOST_MODES,
        doc="frequency, decay and amplitude of each mode",
    )
    out = Output("m/s^2")

    state, coefficients = struck_bank.STATE, struck_bank.COEFFICIENTS

    def sizes(values, rate):
        return phasors.sizes(len(values["modes"]))

    @prepared_columns
    def table(values, rate):
        return _by_decay(values["modes"])

    def design(table, pitch, decay, rate, coefficients):
        struck_bank.design(table, pitch, decay, rate, hammer.FLOOR_M_S2, coefficients)

    def run(strike, level, frame, coefficients, state, out):
        struck_bank.ring(strike, frame, coefficients, state, out)
        for i in range(out.size):
            out[i] *= level[i]

    def tail(state, coefficients):
        return struck_bank.tail(state, coefficients)


@node("drawn-bank", "Impacts", "Drawn modal bank")
class DrawnBank:
    """Modal bank with random modes: density p(f) ~ f^alpha from low to high, amplitudes ~ f^-r (7.26).

    All tiles have the same modes; `draw` selects another set. The squares of the amplitudes sum to 1.
    """

    also_called = "ring, metal, plate, resonate"
    accuracy = "exact: the closed form, to 1e-9 after ten seconds"
    strike = Input(kind="event", doc="excites all modes; strength scales the amplitude")
    low = Number(150.0, 1.0, 20_000.0, unit="Hz", scale="log", doc="lowest mode frequency")
    high = Number(
        1200.0, 1.0, 20_000.0, unit="Hz", scale="log", doc="highest frequency; modes from half the rate on are mute"
    )
    alpha = Number(0.0, -5.0, 5.0, doc="exponent of the mode density: 0 uniform in frequency, -1 uniform per octave")
    rolloff = Number(0.5, -3.0, 6.0, doc="r: amplitudes fall by 6.02 r dB per octave")
    quality = Number(8.0, 0.5, 10_000.0, scale="log", doc="quality factor, pi f / decay, at the lowest frequency")
    damping = Number(1.0, 0.0, 3.0, doc="exponent of decay over frequency: 1 is constant quality, 0 constant decay")
    level = Number(1.0, 0.0, 100.0, scale="gain", wire="audio", doc="factor on the output")
    modes = Count(24, 1, _MOST_DRAWN, doc="number of modes")
    draw = Count(1, 0, 1_000_000, doc="number of the random draw")
    out = Output("m/s^2")

    state = struck_bank.STATE
    coefficients = Layout("drawn_bank_coefficients", drawn=(3, "modes"), bank=struck_bank.COEFFICIENTS)

    def sizes(values, rate):
        return {"modes": values["modes"], **phasors.sizes(values["modes"])}

    @prepared
    def draws(values, rate):
        return drawn_modes.draws(values["modes"], values["draw"])

    def design(draws, low, high, alpha, rolloff, quality, damping, rate, coefficients):
        drawn = coefficients.drawn
        drawn_modes.place(draws, low, high, alpha, rolloff, quality, damping, drawn)
        struck_bank.design(drawn, 1.0, 1.0, rate, hammer.FLOOR_M_S2, coefficients.bank)

    def run(strike, level, frame, coefficients, state, out):
        struck_bank.ring(strike, frame, coefficients.bank, state, out)
        for i in range(out.size):
            out[i] *= level[i]

    def tail(state, coefficients):
        return struck_bank.tail(state, coefficients.bank)
