"""A hammer and a modal object (equations 3.3 and 3.4), one row of real time: steps in contact, phasors out of it.

An event throws the hammer at the surface: contact begins at the event's time, and the frames until the hammer has left
for good are computed in equal sub-steps (`contact_step`), as many as the asked error takes. All other frames are free
ringing, 64 at a time (`phasors`). Blocks lie at multiples of 64 session frames and sub-steps divide frames, so
that the bits do not depend on how the frames are split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous (`contact_motion`).
"""

import cmath
import math

from underfoot.kernels import kernel, modal_kernel
from underfoot.models.modal.contact_motion import (
    ACCELERATION,
    ACTIVE,
    ALLOWED,
    ANGULAR,
    BEGIN,
    DECAY,
    DISPLACEMENT,
    ELASTIC,
    END,
    EXPONENT,
    FORCE,
    FROM,
    GAIN,
    GIVEN,
    IN_CONTACT,
    LATELY,
    MASS,
    PACE,
    ROWS,
    SHOW,
    SHOW_IM,
    SHOW_RE,
    SHOWN,
    SPARE,
    SPEED,
    STIFFNESS,
    SUBSTEPS,
    SURFACE,
    SURFACE_SPEED,
    T_ROWS,
    TABLE,
    TREND,
    TURN,
    WAY,
    WEIGHT,
    WORK,
    Z,
    advance,
    fly_frame,
    has_left,
    known_of,
    listen,
    out_of_reach,
    rows_of,
    set_step,
)
from underfoot.models.modal.phasors import BLOCK, P64, advanced, free_block, in_use, padded, tabulate, waves_size

MOST_SUBSTEPS = 4096
"""Of a frame, in real time as offline: beyond them contact is no longer resolved, though it still makes no energy."""

_PATIENT, _IMPATIENT, _LEAST = 8192, 2048, 8
"""A hammer that chatters on the object may take so many sub-steps; then, and after each `_IMPATIENT` more, a frame has
half as many, down to `_LEAST`. A blow that leaves takes (10 / error)^(1/4), at most some hundreds."""
_PATIENCE = 16 * BLOCK  # how often modes that fell below the floor are looked for
_SLOWEST = 1e-6  # rad/s: a mode slower than this moves as a free mass, and a phasor must turn


@kernel
def tune(t, frequencies_hz, decays_per_s, masses_kg, shapes, rate_hz, floor):
    """Set `t`: modes of damped frequency f and decay b, with modal mass and shape at the struck point.

    A mode at or above half the rate takes part in the contact, but is left out of displacement and acceleration, where
    it would alias. A mode drops out when its acceleration has fallen below `floor` (m/s^2), and so does the cost of
    those behind the last that sounds: list slow decays first. A contact that is under way ends with the old modes.
    """
    modes = frequencies_hz.size
    t[:] = 0.0
    t[0] = modes
    t[1] = floor
    t[2] = rate_hz
    known = known_of(t)
    for m in range(modes):
        angular = max(2.0 * math.pi * frequencies_hz[m], _SLOWEST)
        decay = decays_per_s[m]
        tabulate(t[TABLE:], padded(modes), _waves(t), m, angular / (2.0 * math.pi), decay, rate_hz)
        heard = 1.0 if frequencies_hz[m] < 0.5 * rate_hz else 0.0
        known[SHOW, m], known[SHOW_RE, m], known[SHOW_IM, m] = heard, heard * angular, -heard * decay
        known[PACE, m] = math.hypot(angular, decay)
        known[DECAY, m], known[ANGULAR, m] = decay, angular
        known[GAIN, m] = shapes[m] ** 2 / (masses_kg[m] * angular)
        weight = complex(-decay, angular) * complex(known[0, m] - 1.0, known[1, m]) * (heard * rate_hz)
        known[WEIGHT, m], known[WEIGHT + 1, m] = weight.real, weight.imag


@kernel
def ring(s, t, hammer, events, count, force, acceleration, displacement, frame, n):
    """Compute `n` frames from session frame `frame`.

    `hammer`: mass (kg), stiffness (N/m^exponent), exponent, damping mu (s/m), a constant load on it (N), the relative
    error asked of the displacement, and sub-steps a frame, where 0 leaves them to the error; all are read when an event
    throws it. `events` is flat, (time, velocity in m/s, duration) for each of `count` events, in order of time, at most
    one a frame; one before `frame` acts at once. A throw takes the hammer from wherever it is; the object rings on.

    Out: contact force (N) and acceleration of the struck point (m/s^2), both the mean over each frame, and its
    displacement (m) at each frame. Without the displacement (an array of length 0, in every call) it costs less.
    """
    rows, known = rows_of(s, t), known_of(t)
    show = displacement.size > 0
    done = 0
    event = 0
    while done < n:
        until = n
        first = 0
        impulse = 0.0
        if event < count:
            at = max(int(math.floor(events[3 * event])) - frame, 0)
            if at <= done:
                part = min(max(events[3 * event] - (frame + done), 0.0), 1.0)
                first, impulse = _throw(s, t, rows, known, hammer, (frame + done) % BLOCK, part, events[3 * event + 1])
                event += 1
                if event < count:
                    at = max(int(math.floor(events[3 * event])) - frame, done + 1)
                    until = min(until, at)
            else:
                until = min(until, at)
        if s[IN_CONTACT] != 0.0:
            done = _contact(s, t, rows, known, first, impulse, force, acceleration, displacement, done, until)
            if s[IN_CONTACT] == 0.0:
                _let_ring(s, t, rows, known, (frame + done) % BLOCK, show)
        else:
            start = (frame + done) % BLOCK
            last = min(until, done + BLOCK - start)
            straight = last - done == BLOCK and not show  # nothing is to be kept of this block
            if start == 0:
                if (frame + done) % _PATIENCE == 0:
                    _drop(s, rows, known, t[1])
                goal = acceleration[done:last] if straight else s[ACCELERATION : ACCELERATION + BLOCK]
                _begin_block(s, t, rows, known, goal, show)
            for i in range(done, last):
                force[i] = 0.0
                if not straight:
                    acceleration[i] = s[ACCELERATION + start + i - done]
                if show:
                    displacement[i] = s[DISPLACEMENT + start + i - done]
            done = last
            s[GIVEN] = (frame + done) % BLOCK


@kernel
def rest(s, t):
    """An upper bound of |acceleration| from here on, if no event comes; infinite while the hammer is there."""
    if s[IN_CONTACT] != 0.0:
        return math.inf
    bound = 0.0
    if s[GIVEN] > 0.0:
        for i in range(ACCELERATION + int(s[GIVEN]), ACCELERATION + BLOCK):
            bound = max(bound, abs(s[i]))
    rows, known = rows_of(s, t), known_of(t)
    for m in range(int(s[ACTIVE])):
        bound += _loudness(rows, known, m)
    return bound


@kernel
def substeps(error, mass_kg, stiffness, exponent, velocity_m_s, mobility_per_kg, rate_hz):
    """Sub-steps a frame for a relative error of `error` in the displacement; at least 1, at most `MOST_SUBSTEPS`.

    `mobility_per_kg` is the sum of shape^2 / mass. The contact lasts about 2.94 x / v, x the depth of a lossless one.
    """
    velocity_m_s = max(velocity_m_s, 1e-9)
    mass = 1.0 / (1.0 / mass_kg + mobility_per_kg)
    depth = ((exponent + 1.0) * mass * velocity_m_s**2 / (2.0 * stiffness)) ** (1.0 / (exponent + 1.0))
    steps = (10.0 / error) ** 0.25
    return int(min(max(math.ceil(steps * velocity_m_s / (2.94 * depth * rate_hz)), 1.0), MOST_SUBSTEPS))


@kernel
def _waves(t):
    modes = int(t[0])
    first = TABLE + T_ROWS * padded(modes)
    return t[first : first + waves_size(modes)]


@kernel
def _loudness(rows, known, m):
    """The size of a mode's acceleration, of its phasor at the block's end."""
    size = rows[END, m] ** 2 + rows[END + 1, m] ** 2
    return math.sqrt(size * (known[WEIGHT, m] ** 2 + known[WEIGHT + 1, m] ** 2))


@kernel
def _begin_block(s, t, rows, known, goal, show):
    """Free ringing from the last block's end on, its acceleration to `goal`."""
    active = int(s[ACTIVE])
    for m in range(active):
        rows[BEGIN, m], rows[BEGIN + 1, m] = rows[END, m], rows[END + 1, m]
    _turn(rows, END, known, P64, active)
    _fill(s, t, rows, known, 0, active, goal, show)


@kernel
def _fill(s, t, rows, known, start, active, goal, show):
    """The block's frames from `start` on, of its phasors there: displacement, and acceleration to `goal`."""
    row = rows.shape[1]
    phasors = s[ROWS + SPARE * row :]
    s[FROM] = start
    if show:
        for m in range(active):
            rows[SPARE, m] = known[SHOW, m] * rows[BEGIN, m]
            rows[SPARE + 1, m] = known[SHOW, m] * rows[BEGIN + 1, m]
        block = s[WORK : WORK + BLOCK]
        free_block(block, t[TABLE:], row, _waves(t), phasors, active)
        for i in range(BLOCK - start):
            s[DISPLACEMENT + start + i] = block[i]
    _turn(rows, SPARE, known, WEIGHT, active)
    free_block(goal, t[TABLE:], row, _waves(t), phasors, active)


@modal_kernel
def _turn(rows, goal, known, by, active):
    """The phasors at `FROM` times complex numbers, a row of real and one of imaginary parts, to rows `goal`."""
    for m in range(active):
        x, y = rows[BEGIN, m], rows[BEGIN + 1, m]
        a, b = known[by, m], known[by + 1, m]
        rows[goal, m] = a * x - b * y
        rows[goal + 1, m] = a * y + b * x


@kernel
def _drop(s, rows, known, floor):
    """Set modes under the floor to exactly 0, unless a blow of late may still be building them up."""
    if s[LATELY] == 0.0:
        last = 0
        for m in range(int(s[ACTIVE])):
            if _loudness(rows, known, m) > floor:
                last = m + 1
            else:
                rows[END, m] = rows[END + 1, m] = 0.0
        s[ACTIVE] = in_use(last, rows.shape[1])
    s[LATELY] = 0.0


@kernel
def _let_ring(s, t, rows, known, start, show):
    """The hammer has gone at frame `start` of a block: go on with free ringing."""
    row = rows.shape[1]
    goal = END if start == 0 else BEGIN
    for m in range(row):
        rows[goal, m], rows[goal + 1, m] = rows[Z, m], rows[Z + 1, m]
    s[ACTIVE] = row
    s[LATELY] = 1.0
    s[GIVEN] = start
    if start > 0:
        for m in range(row):
            rows[END, m], rows[END + 1, m] = advanced(
                t[TABLE:], row, m, rows[BEGIN, m], rows[BEGIN + 1, m], BLOCK - start
            )
        block = s[WORK : WORK + BLOCK]
        _fill(s, t, rows, known, start, row, block, show)
        for i in range(BLOCK - start):
            s[ACCELERATION + start + i] = block[i]


@kernel
def _throw(s, t, rows, known, hammer, start, part, velocity):
    """Put the hammer on the surface, `part` of a frame after frame `start` of the block, at `velocity`.

    Returns the sub-step of the frame to go on with, and the impulse so far.
    """
    modes = int(t[0])
    if s[IN_CONTACT] == 0.0:
        _take_over(s, t, rows, start)
    rows[SHOWN : SHOWN + 4] = known[SHOW : SHOW + 4]
    rows[TURN : TURN + 2] = known[0:2]
    s[SURFACE], s[SURFACE_SPEED] = listen(rows)
    speed = 0.0
    mobility = 0.0
    for m in range(modes):
        pole = complex(-known[DECAY, m], known[ANGULAR, m])
        z = complex(rows[Z, m], rows[Z + 1, m])
        if part > 0.0:
            z *= cmath.exp(pole * (part / t[2]))
        rows[Z, m], rows[Z + 1, m] = z.real, z.imag
        speed += (pole * z).imag
        mobility += known[GAIN, m] * known[ANGULAR, m]
    for i in range(5):
        s[MASS + i] = hammer[i]
    steps = int(hammer[6])
    if s[IN_CONTACT] == 0.0:
        s[ALLOWED] = _PATIENT if steps == 0 else math.inf
    if steps == 0:
        speed = abs(velocity) + abs(speed)
        steps = substeps(hammer[5], s[MASS], s[STIFFNESS], s[EXPONENT], speed, mobility, t[2])
    s[IN_CONTACT] = 1.0
    s[SUBSTEPS] = steps
    s[WAY] = s[ELASTIC] = s[FORCE] = s[TREND] = 0.0
    s[SPEED] = velocity
    impulse = 0.0
    first = math.ceil(part * steps - 1e-9)
    h = (first / steps - part) / t[2]
    if h * steps * t[2] > 1e-9:
        set_step(s, rows, known, modes, h)
        impulse = advance(s, rows, known, h, 1)
    set_step(s, rows, known, modes, 1.0 / (steps * t[2]))
    return first, impulse


@kernel
def _take_over(s, t, rows, start):
    """The phasors at frame `start` of the block, from free ringing."""
    rows[Z : Z + 2] = 0.0
    for m in range(int(s[ACTIVE])):
        if start == 0:
            rows[Z, m], rows[Z + 1, m] = rows[END, m], rows[END + 1, m]
        else:
            rows[Z, m], rows[Z + 1, m] = advanced(
                t[TABLE:], rows.shape[1], m, rows[BEGIN, m], rows[BEGIN + 1, m], start - int(s[FROM])
            )


@kernel
def _contact(s, t, rows, known, first, impulse, force, acceleration, displacement, done, until):
    """Frames `done` to `until`, or to where the hammer has left for good; returns how far it came.

    The first frame goes on from sub-step `first`, with the impulse so far.
    """
    steps = int(s[SUBSTEPS])
    h = 1.0 / (steps * t[2])
    while done < until:
        if displacement.size > 0:
            displacement[done] = s[SURFACE]
        before = s[SURFACE_SPEED]
        if first == 0 and steps > 1 and s[WAY] < 0.0 and out_of_reach(s, rows, 1.0 / t[2]):
            fly_frame(s, rows, 1.0 / t[2])
        else:
            impulse += advance(s, rows, known, h, steps - first)
            s[ALLOWED] -= steps - first
        s[SURFACE], s[SURFACE_SPEED] = listen(rows)
        force[done] = impulse * t[2]
        acceleration[done] = (s[SURFACE_SPEED] - before) * t[2]
        first = 0
        impulse = 0.0
        done += 1
        if has_left(s, rows):
            s[IN_CONTACT] = 0.0
            break
        if s[ALLOWED] < 0.0 and steps > _LEAST:
            steps = max(steps // 2, _LEAST)
            h = 1.0 / (steps * t[2])
            s[SUBSTEPS], s[ALLOWED] = steps, _IMPATIENT
            set_step(s, rows, known, int(t[0]), h)
    return done
