"""Envelopes: slow curves from 0 up, to multiply vibration with."""

from underfoot.models.signals import envelopes
from underfoot.parameters import Choice, Number
from underfoot.patch.node import Input, Output, event_list, frames, moved, node, rest_kernel, run_kernel

STRAIN_RATES = ("signed", "absolute", "positive")


@node("attack-decay", "Shapes", "Attack-decay")
class AttackDecay:
    """A note's envelope at each event: up in the attack, held, and down in the decay; its strength is the height."""

    strike = Input(kind="event", doc="begins a note; an event's own duration is used where it has one")
    attack = Number(0.01, 0.0005, 2.0, unit="s", scale="log", doc="time to rise")
    decay = Number(0.05, 0.0005, 10.0, unit="s", scale="log", doc="time to fall at the end")
    duration = Number(0.2, 0.001, 20.0, unit="s", scale="log", doc="length of a note that does not know its own")
    amplitude = Number(1.0, 0.0, 10.0, doc="height at strength 1")
    out = Output()
    state = envelopes.NOTE_STATE
    tuning = 4 + envelopes.NOTE_TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        note = frames(t, 4 + envelopes.NOTE_TUNING)[4:]
        if moved(c, t, 4):
            envelopes.tune_note(note, c[0], c[1], c[2], c[3], rate)
        count = int(e[0][0])
        envelopes.run_note(
            frames(s, envelopes.NOTE_STATE), note, event_list(e[0]), count, frame, rate, frames(y[0], n), n
        )

    @rest_kernel
    def rest(c, s, t, d):
        return envelopes.rest_note(frames(s, envelopes.NOTE_STATE), frames(t, 4 + envelopes.NOTE_TUNING)[4:])


@node("contact-envelope", "Shapes")
class ContactEnvelope:
    """1 while the tile is stood on, 0 otherwise, with ramps of 5 ms."""

    force = Input("N")
    out = Output()
    state = envelopes.CONTACT_STATE
    tuning = envelopes.CONTACT_TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        ramp = frames(t, envelopes.CONTACT_TUNING)
        envelopes.tune_contact(ramp, rate)
        envelopes.run_contact(frames(s, envelopes.CONTACT_STATE), ramp, frames(x[0], n), frames(y[0], n), n)

    @rest_kernel
    def rest(c, s, t, d):
        return envelopes.rest_contact(frames(s, envelopes.CONTACT_STATE), frames(t, envelopes.CONTACT_TUNING))


@node("force-envelope", "Shapes")
class ForceEnvelope:
    """Proportional to the force: 1 at the full force (thesis: 750 N)."""

    force = Input("N")
    full_force = Number(envelopes.FULL_FORCE_N, 10.0, 10_000.0, unit="N", scale="log", doc="force that gives 1")
    out = Output()
    muted_by = ("force",)

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        envelopes.proportional(frames(x[0], n), c[0], frames(y[0], n), n)


@node("strain-rate-envelope", "Shapes")
class StrainRateEnvelope:
    """How fast a compressible layer is pressed in (equation 6.1): loud while the foot loads, not while it rests."""

    force = Input("N")
    frequency = Number(envelopes.STRAIN_HZ, 0.5, 200.0, unit="Hz", scale="log", doc="natural frequency of the layer")
    damping = Number(envelopes.STRAIN_DAMPING, 0.05, 10.0, scale="log", doc="damping ratio of the layer")
    mass = Number(envelopes.STRAIN_MASS_KG, 0.01, 1000.0, unit="kg", scale="log", doc="more mass, less of it")
    part = Choice("absolute", options=STRAIN_RATES, doc="what to make of unloading, where the rate is negative")
    out = Output()
    state = envelopes.STRAIN_STATE
    tuning = 3 + envelopes.STRAIN_TUNING

    @run_kernel
    def run(x, y, c, s, t, d, e, o, key, rate, frame, n):
        layer = frames(t, 3 + envelopes.STRAIN_TUNING)[3:]
        if moved(c, t, 3):
            envelopes.tune_strain_rate(layer, c[0], c[1], c[2], rate)
        state = frames(s, envelopes.STRAIN_STATE)
        envelopes.run_strain_rate(state, layer, frames(x[0], n), int(c[3]), frames(y[0], n), n)

    @rest_kernel
    def rest(c, s, t, d):
        layer = frames(t, 3 + envelopes.STRAIN_TUNING)[3:]
        return envelopes.rest_strain_rate(frames(s, envelopes.STRAIN_STATE), layer)
