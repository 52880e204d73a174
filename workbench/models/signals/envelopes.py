"""What shapes a vibration in time: attack and decay of a note (thesis 3.3.7), and the force envelopes of thesis 6.1."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from underfoot.errors import require
from underfoot.kernels import kernel
from underfoot.models.filtering import second_order

NOTE_STATE, NOTE_TUNING = 6, 4
"""Floats of state and tuning of an attack-decay envelope."""
CONTACT_STATE, CONTACT_TUNING = 1, 1
"""Floats of state and tuning of the constant envelope."""
STRAIN_STATE, STRAIN_TUNING = second_order.SECTION_STATE, second_order.SECTION_TUNING
"""Floats of state and tuning of the dynamic envelope."""

SHORTEST_SEGMENT_S = 0.5e-3
"""No attack or decay of a running note is shorter: a step would click."""
CONTACT_RAMP_S = 5e-3
"""The constant envelope rises and falls in this time."""
FULL_FORCE_N = 750.0
"""The force at which the proportional envelope is 1 (6.3.5)."""
STRAIN_HZ, STRAIN_DAMPING = 12.5, 1.0
"""The compressible layer's frequency f0 and damping ratio (6.3.5)."""
STRAIN_MASS_KG = FULL_FORCE_N * math.exp(-1.0) / (2.0 * math.pi * STRAIN_HZ)
"""The M of (6.1), an arbitrary gain in the thesis: this one lets a step of 750 N peak at 1."""
SIGNED, ABSOLUTE, POSITIVE = 0, 1, 2
"""What the dynamic envelope gives of a strain rate that is negative while unloading."""


def attack_decay(
    time_s: ArrayLike, start_s: float, duration_s: float, amplitude: float, attack_s: float, decay_s: float
) -> NDArray[np.float64]:
    """One note's envelope at each of `time_s`: up to `amplitude` in `attack_s`, held, 0 again after `duration_s`.

    The thesis gives the times and no shape; both segments are raised cosines here, which start and end without a
    corner. Where attack and decay do not fit into the duration both are shortened in proportion. Raises `BadValue` for
    a duration not above 0 and for an attack or decay below 0.

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
def tune_note(t, attack_s, decay_s, duration_s, amplitude, rate):
    """Fill `t` (NOTE_TUNING); `duration_s` is for events that do not know theirs, `amplitude` for a strength of 1."""
    shortest = SHORTEST_SEGMENT_S * rate
    t[0] = max(attack_s * rate, shortest)
    t[1] = max(decay_s * rate, shortest)
    t[2] = duration_s * rate
    t[3] = amplitude


@kernel
def run_note(s, t, events, count, frame, rate, y, n):
    """Fill `n` frames of `y` with the envelope of the notes that `events` (3 `count` floats, sorted) begin.

    Onsets are sub-sample. A note that begins while another sounds rises or falls from the present value to its own
    peak, amplitude times strength; it keeps the attack, decay and amplitude it began with.

    >>> s, t, y = np.zeros(NOTE_STATE), np.zeros(NOTE_TUNING), np.empty(200)
    >>> tune_note(t, 0.02, 0.02, 0.1, 1.0, 1000.0)
    >>> run_note(s, t, np.array([5.5, 2.0, 0.0]), 1, 0, 1000.0, y, 200)
    >>> bool(y[:6].max() == 0.0), bool(y.max() == 2.0), bool(y[106:].max() == 0.0)
    (True, True, True)
    """
    following = 0
    for i in range(n):
        now = frame + i
        while following < count and math.floor(events[3 * following]) <= now:
            _begin_note(s, t, events[3 * following], events[3 * following + 1], events[3 * following + 2] * rate)
            following += 1
        if s[3] > 0.0 and now - s[0] >= s[3]:
            for j in range(NOTE_STATE):
                s[j] = 0.0
        y[i] = _note_value(s, now) if s[3] > 0.0 else 0.0


@kernel
def rest_note(s, t):
    """An upper bound of |output| from here on without another event: exactly 0 once the note has ended."""
    return max(abs(s[1]), abs(s[2]))


@kernel
def tune_contact(t, rate):
    """Fill `t` (CONTACT_TUNING) for the constant envelope."""
    t[0] = 1.0 / max(CONTACT_RAMP_S * rate, 1.0)


@kernel
def run_contact(s, t, force_n, y, n):
    """The constant envelope: 1 while `force_n` is above 0, else 0, with a linear ramp of 5 ms between."""
    level, step = s[0], t[0]
    for i in range(n):
        if force_n[i] > 0.0:
            level = min(1.0, level + step)
        else:
            level = max(0.0, level - step)
        y[i] = level
    s[0] = level


@kernel
def rest_contact(s, t):
    """The largest output from here on if the force stays 0."""
    return max(0.0, s[0] - t[0])


@kernel
def proportional(force_n, full_force_n, y, n):
    """The force-proportional envelope, `F / F0`; the thesis's F0 is 750 N.

    >>> y = np.empty(1)
    >>> proportional(np.array([375.0]), FULL_FORCE_N, y, 1)
    >>> y
    array([0.5])
    """
    gain = 1.0 / full_force_n
    for i in range(n):
        y[i] = gain * force_n[i]


@kernel
def tune_strain_rate(t, frequency_hz, damping, mass_kg, rate):
    """Fill `t` (STRAIN_TUNING) for `x'' + 2 z w0 x' + w0^2 x = F / M` (6.1), force to x', plain bilinear transform.

    `frequency_hz` is w0 / 2 pi, held at 0.49 of the rate; `damping` z, at least 0.01; `mass_kg` M, above 0.
    """
    w0 = 2.0 * math.pi * min(max(frequency_hz, 1e-3), second_order.HIGHEST * rate)
    second_order.tune_section(t, 0.5 * w0 / rate, 2.0 * max(damping, 0.01), 0.0, 1.0 / (mass_kg * w0), 0.0)


@kernel
def run_strain_rate(s, t, force_n, choice, y, n):
    """The dynamic envelope: strain rate of a layer under `force_n`, SIGNED, ABSOLUTE or only its POSITIVE part.

    A step's response is `t exp(-w0 t) / M`: it peaks 1 / w0 = 12.73 ms after the step (the thesis's 80 ms is 1 / f0).
    """
    second_order.run(s, t, force_n, y, n)
    if choice == ABSOLUTE:
        for i in range(n):
            y[i] = abs(y[i])
    elif choice == POSITIVE:
        for i in range(n):
            y[i] = max(y[i], 0.0)


@kernel
def rest_strain_rate(s, t):
    """An upper bound of |output| from here on if the force stays 0."""
    return second_order.rest(s, t)


# A note's state: onset (session frames), value at onset, peak, duration, attack and decay (frames). Duration 0: none.


@kernel
def _begin_note(s, t, onset, strength, duration):
    present = _note_value(s, onset) if s[3] > 0.0 else 0.0
    attack, decay = t[0], t[1]
    length = max(duration if duration > 0.0 else t[2], 2.0)
    fit = min(1.0, length / (attack + decay))
    s[0], s[1], s[2], s[3], s[4], s[5] = onset, present, t[3] * strength, length, attack * fit, decay * fit


@kernel
def _note_value(s, now):
    age = now - s[0]
    left = s[3] - age
    if age <= 0.0:
        return s[1]
    if age < s[4]:
        return s[1] + (s[2] - s[1]) * 0.5 * (1.0 - math.cos(math.pi * age / s[4]))
    if left <= 0.0:
        return 0.0
    if left < s[5]:
        return s[2] * 0.5 * (1.0 - math.cos(math.pi * left / s[5]))
    return s[2]
