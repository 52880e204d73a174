"""Envelopes of vibration: attack and decay of a note (thesis 3.3.7), and the force envelopes of thesis 6.1."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.filtering import second_order

NOTE_STATE = Layout("note", "onset", "start_value", "peak", "duration", "attack", "decay")
"""State of the present note: onset (session frames), value at its onset, peak, and times in frames; the duration is 0
without a note."""
NOTE_COEFFICIENTS = Layout("note_coefficients", "attack", "decay", "duration", "amplitude")
"""Attack, decay and default duration of a note in frames, and its peak at strength 1."""
CONTACT_STATE = Layout("contact_envelope", "level")
CONTACT_COEFFICIENTS = Layout("contact_envelope_coefficients", "step")

SHORTEST_SEGMENT_S = 0.5e-3
"""Shortest attack or decay of a real-time note, to avoid clicks."""
CONTACT_RAMP_S = 5e-3
"""Rise and fall time of the constant envelope."""
FULL_FORCE_N = 750.0
"""Force at which the proportional envelope is 1 (6.3.5)."""
STRAIN_HZ, STRAIN_DAMPING = 12.5, 1.0
"""Frequency f0 and damping ratio of the compressible layer (6.3.5)."""
STRAIN_MASS_KG = FULL_FORCE_N * math.exp(-1.0) / (2.0 * math.pi * STRAIN_HZ)
"""M of (6.1), an arbitrary gain in the thesis; here a step of 750 N peaks at 1."""
PARTS = ("signed", "absolute", "positive")
"""Treatments of the dynamic envelope's negative strain rate while unloading; the index of each is its code."""
SIGNED, ABSOLUTE, POSITIVE = range(3)


def attack_decay(
    time_s: ArrayLike, start_s: float, duration_s: float, amplitude: float, attack_s: float, decay_s: float
) -> NDArray[np.float64]:
    """Return a note's envelope at each of `time_s`: up to `amplitude` in `attack_s`, held, 0 after `duration_s`.

    The thesis gives times but no shape; here both segments are raised cosines, without corners. If attack and decay do
    not fit into the duration, both are shortened in proportion. Raises `BadValue` for a duration not above 0 and for an
    attack or decay below 0.

    >>> attack_decay([0.0, 0.01, 0.05, 0.09, 0.1], 0.0, 0.1, 2.0, 0.02, 0.02).round(6)
    array([0., 1., 2., 1., 0.])
    """
    require(math.isfinite(duration_s) and duration_s > 0, "duration_s", duration_s, "above 0")
    require(math.isfinite(attack_s) and attack_s >= 0, "attack_s", attack_s, "0 or more")
    require(math.isfinite(decay_s) and decay_s >= 0, "decay_s", decay_s, "0 or more")
    age = np.asarray(time_s, dtype=np.float64) - start_s
    fit = min(1.0, duration_s / max(attack_s + decay_s, 1e-300))
    tiny = np.finfo(np.float64).tiny
    rise = np.clip(age / max(attack_s * fit, tiny), 0.0, 1.0)
    fall = np.clip((duration_s - age) / max(decay_s * fit, tiny), 0.0, 1.0)
    return amplitude * 0.25 * (1.0 - np.cos(np.pi * rise)) * (1.0 - np.cos(np.pi * fall))


@kernel
def design_note(
    attack_s: float, decay_s: float, duration_s: float, amplitude: float, rate: float, coefficients: Memory
) -> None:
    """Set a note's times and peak; `duration_s` is for events without duration, `amplitude` for strength 1."""
    shortest = SHORTEST_SEGMENT_S * rate
    coefficients.attack = max(attack_s * rate, shortest)
    coefficients.decay = max(decay_s * rate, shortest)
    coefficients.duration = duration_s * rate
    coefficients.amplitude = amplitude


@kernel
def run_note(events: Memory, rate: float, frame: int, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Fill `out` with the envelope of the notes that `events` start.

    Onsets are sub-sample. A note that starts during another rises or falls from the present value to its own peak,
    amplitude times strength; it keeps the attack, decay and amplitude of its start.

    >>> from underfoot.models.signals.events import event_list
    >>> coefficients, state, envelope = NOTE_COEFFICIENTS.zeros(), NOTE_STATE.zeros(), np.empty(200)
    >>> design_note(0.02, 0.02, 0.1, 1.0, 1000.0, coefficients)
    >>> run_note(event_list((5.5, 2.0)), 1000.0, 0, coefficients, state, envelope)
    >>> bool(envelope[:6].max() == 0.0), bool(envelope.max() == 2.0), bool(envelope[106:].max() == 0.0)
    (True, True, True)
    """
    count, following = len(events), 0
    for i in range(out.size):
        now = frame + i
        while following < count and events.time[following] <= now:
            _begin_note(state, coefficients, events, following, rate)
            following += 1
        if state.duration > 0.0 and now - state.onset >= state.duration:
            state.onset = state.start_value = state.peak = state.duration = state.attack = state.decay = 0.0
        out[i] = _note_value(state, now) if state.duration > 0.0 else 0.0
        while following < count and events.time[following] < now + 1.0:  # it starts within this frame
            _begin_note(state, coefficients, events, following, rate)
            following += 1


@kernel
def tail_note(state: Memory) -> float:
    """Return an upper bound of |output| if no other event comes: exactly 0 once the note has ended."""
    return max(abs(state.start_value), abs(state.peak))


@kernel
def design_contact(rate: float, coefficients: Memory) -> None:
    """Set the ramp of the constant envelope."""
    coefficients.step = 1.0 / max(CONTACT_RAMP_S * rate, 1.0)


@kernel
def run_contact(force_n: Floats, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Fill `out` with the constant envelope: 1 while `force_n` is above 0, else 0, with linear ramps of 5 ms."""
    level, step = state.level, coefficients.step
    for i in range(out.size):
        if force_n[i] > 0.0:
            level = min(1.0, level + step)
        else:
            level = max(0.0, level - step)
        out[i] = level
    state.level = level


@kernel
def tail_contact(state: Memory, coefficients: Memory) -> float:
    """Return the largest output from here on if the force stays 0."""
    return max(0.0, state.level - coefficients.step)


@kernel
def design_strain_rate(frequency_hz: float, damping: float, mass_kg: float, rate: float, coefficients: Memory) -> None:
    """Design a layer `x'' + 2 z w0 x' + w0^2 x = F / M` (6.1), from force to x', by the plain bilinear transform.

    The step response is `t exp(-w0 t) / M`: it peaks 1 / w0 = 12.73 ms after the step (the thesis's 80 ms is 1 / f0).
    `frequency_hz` is w0 / 2 pi, limited to 0.49 of the rate; `damping` z, at least 0.01; `mass_kg` M, above 0.
    """
    w0 = 2.0 * math.pi * min(max(frequency_hz, 1e-3), second_order.HIGHEST * rate)
    second_order.design(0.5 * w0 / rate, 2.0 * max(damping, 0.01), 0.0, 1.0 / (mass_kg * w0), 0.0, coefficients)


@kernel
def take_part(part: int, out: Floats) -> None:
    """Keep the requested part of a strain rate: all of it, its absolute value, or its positive part.

    >>> rate = np.array([-1.0, 2.0])
    >>> take_part(ABSOLUTE, rate)
    >>> rate
    array([1., 2.])
    """
    if part == ABSOLUTE:
        for i in range(out.size):
            out[i] = abs(out[i])
    elif part == POSITIVE:
        for i in range(out.size):
            out[i] = max(out[i], 0.0)


@kernel
def _begin_note(state: Memory, coefficients: Memory, events: Memory, k: int, rate: float) -> None:
    onset, strength, duration = events.time[k], events.strength[k], events.duration[k] * rate
    present = _note_value(state, onset) if state.duration > 0.0 else 0.0
    attack, decay = coefficients.attack, coefficients.decay
    length = max(duration if duration > 0.0 else coefficients.duration, 2.0)
    fit = min(1.0, length / (attack + decay))
    state.onset, state.start_value, state.peak = onset, present, coefficients.amplitude * strength
    state.duration, state.attack, state.decay = length, attack * fit, decay * fit


@kernel
def _note_value(state: Memory, now: float) -> float:
    age = now - state.onset
    left = state.duration - age
    if age <= 0.0:
        return state.start_value
    if age < state.attack:
        rise = 0.5 * (1.0 - math.cos(math.pi * age / state.attack))
        return state.start_value + (state.peak - state.start_value) * rise
    if left <= 0.0:
        return 0.0
    if left < state.decay:
        return state.peak * 0.5 * (1.0 - math.cos(math.pi * left / state.decay))
    return state.peak
