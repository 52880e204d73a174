"""Envelopes: slow, non-negative signals that multiply a vibration."""

import math

import numpy as np

from underfoot.layouts import Layout
from underfoot.models.filtering import second_order
from underfoot.models.signals import breakpoints, envelopes
from underfoot.models.signals.events import AT_ONCE, STARTS
from underfoot.models.signals.glide import multiply
from underfoot.parameters import Choice, Number, Rows
from underfoot.patch.node import Input, Output, node, prepared_columns


@node("attack-decay", "Shapes", "Attack-decay")
class AttackDecay:
    """Attack-hold-decay envelope, an ADSR at full sustain, triggered by events.

    An event's strength scales its height.
    """

    also_called = "AR, AD, EG, line, vline"
    accuracy = "exact: the closed form, to 1e-9"
    strike = Input(kind="event", doc="starts a note; the event's duration is used if it has one")
    attack = Number(0.01, 0.0005, 2.0, unit="s", scale="log", wire="span", doc="rise time")
    decay = Number(0.05, 0.0005, 10.0, unit="s", scale="log", wire="span", doc="fall time at the end of the note")
    duration = Number(
        0.2, 0.001, 20.0, unit="s", scale="log", wire="span", doc="length of a note whose event has no duration"
    )
    amplitude = Number(1.0, 0.0, 10.0, scale="gain", wire="span", doc="height at strength 1")
    out = Output()
    state, coefficients = envelopes.NOTE_STATE, envelopes.NOTE_COEFFICIENTS

    def lasts(values):
        return values["duration"] + values["decay"]

    def design(attack, decay, duration, amplitude, rate, coefficients):
        envelopes.design_note(attack, decay, duration, amplitude, rate, coefficients)

    def run(strike, rate, frame, coefficients, state, out):
        envelopes.run_note(strike, rate, frame, coefficients, state, out)

    def tail(state):
        return envelopes.tail_note(state)


@node("breakpoints", "Shapes", "Breakpoint envelope")
class Breakpoints:
    """Piecewise linear level and frequency over time, for the amplitude and pitch of a tone.

    The level is 0 after the last point. A start during playback begins again; the level gets there in 5 ms.
    """

    also_called = "line, vline, function, curve, ramp, sweep, chirp"
    accuracy = "exact: linear between points, to 1e-9"
    points = Rows(
        ((0.0, 0.0, 80.0), (0.02, 1.0, 120.0), (0.3, 0.0, 80.0)),
        (("time s", 0.0, 3600.0), ("level", -100.0, 100.0), ("frequency Hz", 0.0, 5000.0)),
        most=4000,
        doc="time, level and frequency of each point; played in order of time",
    )
    amplitude = Number(1.0, 0.0, 100.0, scale="gain", wire="audio", doc="factor on the levels")
    begin = Choice("at events", options=STARTS, doc="what starts playback")
    start = Input(kind="event", doc="starts playback; its strength scales the level")
    out = Output(doc="the level")
    frequency = Output("Hz", doc="frequency; 0 when nothing plays")
    state = breakpoints.STATE

    def lasts(values):
        return max((time_s for time_s, _, _ in values["points"]), default=0.0)

    @prepared_columns
    def table(values, rate):
        return np.array(sorted(values["points"], key=lambda point: point[0])).reshape(-1, 3)

    def run(table, amplitude, begin, start, rate, frame, state, out, frequency):
        if begin == AT_ONCE and state.has_begun == 0.0:
            breakpoints.begin(float(frame), 1.0, state)
        breakpoints.run(table, frame, rate, start, state, out, frequency)
        for i in range(out.size):
            out[i] *= amplitude[i]

    def tail(begin, state):
        return math.inf if state.is_playing != 0.0 or begin == AT_ONCE else 0.0


@node("contact-envelope", "Shapes")
class ContactEnvelope:
    """Gate: 1 while somebody stands on the tile, else 0, with ramps of 5 ms."""

    also_called = "ASR, switch, presence"
    accuracy = "exact: the closed form, to 1e-9"
    force = Input("N")
    out = Output()
    state, coefficients = envelopes.CONTACT_STATE, envelopes.CONTACT_COEFFICIENTS

    def design(rate, coefficients):
        envelopes.design_contact(rate, coefficients)

    def run(force, coefficients, state, out):
        envelopes.run_contact(force, coefficients, state, out)

    def tail(state, coefficients):
        return envelopes.tail_contact(state, coefficients)


@node("force-envelope", "Shapes")
class ForceEnvelope:
    """Envelope proportional to the force: 1 at the full force (thesis: 750 N)."""

    also_called = "envelope follower"
    accuracy = "exact: to 1e-12"
    force = Input("N")
    full_force = Number(
        envelopes.FULL_FORCE_N, 10.0, 10_000.0, unit="N", scale="log", wire="span", doc="force that gives 1"
    )
    out = Output()
    state = Layout("force_envelope", "gain")
    muted_by = ("force",)

    def run(force, full_force, frame, state, out):
        gain = 1.0 / full_force
        if state.gain == 0.0:
            state.gain = gain
        state.gain = multiply(force, state.gain, gain, frame, out)


@node("strain-rate-envelope", "Shapes")
class StrainRateEnvelope:
    """Strain rate of a compressible layer (equation 6.1): large while the foot loads the tile, 0 while it rests."""

    also_called = "derivative, differentiate, slope, delta, change"
    accuracy = "exact: SciPy's bilinear, to 1e-9; of the continuous step's response, 1e-5 at 12.5 Hz and 48 kHz"
    force = Input("N")
    frequency = Number(
        envelopes.STRAIN_HZ, 0.5, 200.0, unit="Hz", scale="log", wire="span", doc="natural frequency of the layer"
    )
    damping = Number(envelopes.STRAIN_DAMPING, 0.05, 10.0, scale="log", doc="damping ratio of the layer")
    mass = Number(
        envelopes.STRAIN_MASS_KG, 0.01, 1000.0, unit="kg", scale="log", doc="mass of the layer; divides the output"
    )
    part = Choice("absolute", options=envelopes.PARTS, doc="treatment of unloading, where the rate is negative")
    out = Output()
    state, coefficients = second_order.MOVING_STATE, second_order.COEFFICIENTS

    def design(frequency, damping, mass, rate, coefficients):
        envelopes.design_strain_rate(frequency, damping, mass, rate, coefficients)

    def run(force, part, coefficients, frame, state, out):
        second_order.run_moving(force, coefficients, frame, state, out)
        envelopes.take_part(part, out)

    def tail(state, coefficients):
        return second_order.tail_moving(state, coefficients)
