"""A hammer and a modal object (equations 3.3 and 3.4), one row of real time: sub-steps in contact, phasors out of it.

An event throws the hammer at the surface: contact begins at the event's time, and the frames until the hammer has left
for good are computed in equal sub-steps (`impact_contact`), as many as the asked error takes. All other frames are free
ringing, 64 at a time (`modal_phasors`). Blocks lie at multiples of 64 session frames and sub-steps divide frames, so
that the bits do not depend on how the frames are split into calls.

A row is a state `s`, all zero at rest, and a tuning `t`, both float64 and contiguous.
"""

import cmath
import math

from workbench.kernels import kernel, modal_kernel
from workbench.models.impact_contact import CHANGE, COEFFICIENTS, CURVE, PUSH, TILT, prepare, solve
from workbench.models.modal_phasors import BLOCK, P64, PHASOR_ROWS, TABLE_ROWS, advanced, free_block, padded, tabulate

MOST_SUBSTEPS = 4096
"""Of a frame, in real time as offline: beyond them contact is no longer resolved, though it still makes no energy."""

_PATIENT, _IMPATIENT, _LEAST = 8192, 2048, 8
"""A hammer that chatters on the object may take so many sub-steps; then, and after each `_IMPATIENT` more, a frame has
half as many, down to `_LEAST`. A blow that leaves takes (10 / error)^(1/4), at most some hundreds."""
_FEW = 8  # sub-steps that are not worth a step of their own
_PATIENCE = 8 * BLOCK  # how often modes that fell below the floor are looked for
_SLOWEST = 1e-6  # rad/s: a mode slower than this moves as a free mass, and a phasor must turn

# s: numbers, two blocks and one to work with, rows of one number a mode.
_IN_CONTACT, _ACTIVE, _LATELY = 0, 1, 2  # whether the hammer is there, modes in use, whether a blow came of late
_FROM = 3  # the frame of the block that its ringing was computed from
_WAY, _SPEED, _ELASTIC, _FORCE, _TREND = 4, 5, 6, 7, 8  # into the surface (m), m/s, k x^a, last force (N), its N/s
_MASS, _STIFFNESS, _EXPONENT, _DAMPING, _LOAD = 9, 10, 11, 12, 13  # as the hammer's, in order
_SUBSTEPS, _A, _B, _C = 14, 15, 16, 17
_CHANGE, _CURVE = 18, 19  # what the free modes do to D and W of the next sub-step
_SURFACE, _SURFACE_SPEED = 20, 21  # of the struck point at the frame's start, as heard
_ALLOWED = 22  # sub-steps until there are fewer a frame
_ACCELERATION, _DISPLACEMENT, _WORK, _ROWS = 32, 32 + BLOCK, 32 + 2 * BLOCK, 32 + 3 * BLOCK
# Rows of s, of which phasors take two: at `_FROM`, at the block's end, to work with; then those of contact, and what
# was tuned when it began.
_BEGIN, _END, _SPARE, _COEFFICIENTS = 0, 2, 4, 4 + PHASOR_ROWS
_Z = _COEFFICIENTS + COEFFICIENTS
_SHOWN = _Z + 2
_S_ROWS = _SHOWN + 4
# t: modes, floor, rate; rows: the table of powers, then what else is known of the modes. `_SHOW` and the two after it
# turn a phasor into displacement and speed, 0 where the mode is not heard; `_WEIGHT` into the frame's acceleration.
_TABLE = 8
_SHOW, _SHOW_RE, _SHOW_IM, _PACE, _DECAY, _ANGULAR, _GAIN, _WEIGHT = range(TABLE_ROWS, TABLE_ROWS + 8)
_T_ROWS = _WEIGHT + 2


@kernel
def state_size(modes):
    """The floats of `s`.

    >>> state_size(10)
    576
    """
    return _ROWS + _S_ROWS * padded(modes)


@kernel
def tuning_size(modes):
    """The floats of `t`.

    >>> tuning_size(10)
    344
    """
    return _TABLE + _T_ROWS * padded(modes)


@kernel
def tune(t, frequencies_hz, decays_per_s, masses_kg, shapes, rate_hz, floor):
    """Set `t`: modes of damped frequency f and decay b, with modal mass and shape at the struck point.

    A mode at or above half the rate takes part in the contact, but is left out of displacement and acceleration, where
    it would alias. A mode drops out when its acceleration has fallen below `floor` (m/s^2), and so does the cost of
    those behind the last that sounds: list slow decays first. A contact that is under way ends with the old modes.
    """
    modes = frequencies_hz.size
    row = padded(modes)
    t[:] = 0.0
    t[0] = modes
    t[1] = floor
    t[2] = rate_hz
    known = _known(t)
    for m in range(modes):
        angular = max(2.0 * math.pi * frequencies_hz[m], _SLOWEST)
        decay = decays_per_s[m]
        tabulate(t[_TABLE:], row, m, angular / (2.0 * math.pi), decay, rate_hz)
        heard = 1.0 if frequencies_hz[m] < 0.5 * rate_hz else 0.0
        known[_SHOW, m], known[_SHOW_RE, m], known[_SHOW_IM, m] = heard, heard * angular, -heard * decay
        known[_PACE, m] = math.hypot(angular, decay)
        known[_DECAY, m], known[_ANGULAR, m] = decay, angular
        known[_GAIN, m] = shapes[m] ** 2 / (masses_kg[m] * angular)
        weight = complex(-decay, angular) * complex(known[0, m] - 1.0, known[1, m]) * (heard * rate_hz)
        known[_WEIGHT, m], known[_WEIGHT + 1, m] = weight.real, weight.imag


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
    rows, known = _rows(s, t), _known(t)
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
        if s[_IN_CONTACT] != 0.0:
            done = _contact(s, t, rows, known, first, impulse, force, acceleration, displacement, done, until)
            if s[_IN_CONTACT] == 0.0:
                _let_ring(s, t, rows, known, (frame + done) % BLOCK, show)
        else:
            start = (frame + done) % BLOCK
            if start == 0:
                if (frame + done) % _PATIENCE == 0:
                    _drop(s, rows, known, t[1])
                _begin_block(s, t, rows, known, show)
            for i in range(done, min(until, done + BLOCK - start)):
                force[i] = 0.0
                acceleration[i] = s[_ACCELERATION + start + i - done]
                if show:
                    displacement[i] = s[_DISPLACEMENT + start + i - done]
            done = min(until, done + BLOCK - start)


@kernel
def rest(s, t):
    """An upper bound of |acceleration| from here on, if no event comes; infinite while the hammer is there."""
    if s[_IN_CONTACT] != 0.0:
        return math.inf
    bound = 0.0
    for i in range(_ACCELERATION, _ACCELERATION + BLOCK):
        bound = max(bound, abs(s[i]))
    rows, known = _rows(s, t), _known(t)
    for m in range(int(s[_ACTIVE])):
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
def _rows(s, t):
    row = padded(int(t[0]))
    return s[_ROWS : _ROWS + _S_ROWS * row].reshape((_S_ROWS, row))


@kernel
def _known(t):
    row = padded(int(t[0]))
    return t[_TABLE : _TABLE + _T_ROWS * row].reshape((_T_ROWS, row))


@kernel
def _loudness(rows, known, m):
    """The size of a mode's acceleration, of its phasor at the block's end."""
    size = rows[_END, m] ** 2 + rows[_END + 1, m] ** 2
    return math.sqrt(size * (known[_WEIGHT, m] ** 2 + known[_WEIGHT + 1, m] ** 2))


@kernel
def _begin_block(s, t, rows, known, show):
    """Free ringing from the last block's end on."""
    active = int(s[_ACTIVE])
    for m in range(active):
        rows[_BEGIN, m], rows[_BEGIN + 1, m] = rows[_END, m], rows[_END + 1, m]
    _fill(s, t, rows, known, 0, active, show)


@kernel
def _fill(s, t, rows, known, start, active, show):
    """The blocks from frame `start` on and the phasors at their end, from those at `start`."""
    row = rows.shape[1]
    table = t[_TABLE:]
    s[_FROM] = start
    _turn(rows, _SPARE, known, _WEIGHT, active)
    if start == 0:
        _turn(rows, _END, known, P64, active)
    else:
        for m in range(active):
            rows[_END, m], rows[_END + 1, m] = advanced(
                table, row, m, rows[_BEGIN, m], rows[_BEGIN + 1, m], BLOCK - start
            )
    block = s[_WORK : _WORK + BLOCK]
    phasors = s[_ROWS + _SPARE * row :]
    free_block(block, table, row, phasors, active)
    for i in range(BLOCK - start):
        s[_ACCELERATION + start + i] = block[i]
    if show:
        for m in range(active):
            rows[_SPARE, m] = known[_SHOW, m] * rows[_BEGIN, m]
            rows[_SPARE + 1, m] = known[_SHOW, m] * rows[_BEGIN + 1, m]
        free_block(block, table, row, phasors, active)
        for i in range(BLOCK - start):
            s[_DISPLACEMENT + start + i] = block[i]


@modal_kernel
def _turn(rows, goal, known, by, active):
    """The phasors at `_FROM` times complex numbers, a row of real and one of imaginary parts, to rows `goal`."""
    for m in range(active):
        x, y = rows[_BEGIN, m], rows[_BEGIN + 1, m]
        a, b = known[by, m], known[by + 1, m]
        rows[goal, m] = a * x - b * y
        rows[goal + 1, m] = a * y + b * x


@kernel
def _drop(s, rows, known, floor):
    """Set modes under the floor to exactly 0, unless a blow of late may still be building them up."""
    if s[_LATELY] == 0.0:
        last = 0
        for m in range(int(s[_ACTIVE])):
            if _loudness(rows, known, m) > floor:
                last = m + 1
            else:
                rows[_END, m] = rows[_END + 1, m] = 0.0
        s[_ACTIVE] = padded(last)
    s[_LATELY] = 0.0


@kernel
def _let_ring(s, t, rows, known, start, show):
    """The hammer has gone at frame `start` of a block: go on with free ringing."""
    row = rows.shape[1]
    goal = _END if start == 0 else _BEGIN
    for m in range(row):
        rows[goal, m], rows[goal + 1, m] = rows[_Z, m], rows[_Z + 1, m]
    s[_ACTIVE] = row
    s[_LATELY] = 1.0
    if start > 0:
        _fill(s, t, rows, known, start, row, show)


@kernel
def _throw(s, t, rows, known, hammer, start, part, velocity):
    """Put the hammer on the surface, `part` of a frame after frame `start` of the block, at `velocity`.

    Returns the sub-step of the frame to go on with, and the impulse so far.
    """
    modes = int(t[0])
    if s[_IN_CONTACT] == 0.0:
        table = t[_TABLE:]
        rows[_Z : _Z + 2] = 0.0
        for m in range(int(s[_ACTIVE])):
            if start == 0:
                rows[_Z, m], rows[_Z + 1, m] = rows[_END, m], rows[_END + 1, m]
            else:
                rows[_Z, m], rows[_Z + 1, m] = advanced(
                    table, rows.shape[1], m, rows[_BEGIN, m], rows[_BEGIN + 1, m], start - int(s[_FROM])
                )
    rows[_SHOWN : _SHOWN + 4] = known[_SHOW : _SHOW + 4]
    s[_SURFACE], s[_SURFACE_SPEED] = _listen(rows)
    speed = 0.0
    mobility = 0.0
    for m in range(modes):
        pole = complex(-known[_DECAY, m], known[_ANGULAR, m])
        z = complex(rows[_Z, m], rows[_Z + 1, m]) * cmath.exp(pole * (part / t[2]))
        rows[_Z, m], rows[_Z + 1, m] = z.real, z.imag
        speed += (pole * z).imag
        mobility += known[_GAIN, m] * known[_ANGULAR, m]
    for i in range(5):
        s[_MASS + i] = hammer[i]
    steps = int(hammer[6])
    if s[_IN_CONTACT] == 0.0:
        s[_ALLOWED] = _PATIENT if steps == 0 else math.inf
    if steps == 0:
        speed = abs(velocity) + abs(speed)
        steps = substeps(hammer[5], s[_MASS], s[_STIFFNESS], s[_EXPONENT], speed, mobility, t[2])
    s[_IN_CONTACT] = 1.0
    s[_SUBSTEPS] = steps
    s[_WAY] = s[_ELASTIC] = s[_FORCE] = s[_TREND] = 0.0
    s[_SPEED] = velocity
    impulse = 0.0
    first = math.ceil(part * steps - 1e-9)
    h = (first / steps - part) / t[2]
    if h * steps * t[2] > 1e-9:
        _set_step(s, rows, known, modes, h)
        impulse = _advance(s, rows, known, h, 1)
    _set_step(s, rows, known, modes, 1.0 / (steps * t[2]))
    return first, impulse


@kernel
def _contact(s, t, rows, known, first, impulse, force, acceleration, displacement, done, until):
    """Frames `done` to `until`, or to where the hammer has left for good; returns how far it came.

    The first frame goes on from sub-step `first`, with the impulse so far.
    """
    steps = int(s[_SUBSTEPS])
    h = 1.0 / (steps * t[2])
    while done < until:
        if displacement.size > 0:
            displacement[done] = s[_SURFACE]
        before = s[_SURFACE_SPEED]
        if first == 0 and steps > 1 and s[_WAY] < 0.0 and _out_of_reach(s, rows, 1.0 / t[2]):
            _fly(s, rows, known, 1.0 / t[2])
        else:
            impulse += _advance(s, rows, known, h, steps - first)
            s[_ALLOWED] -= steps - first
        s[_SURFACE], s[_SURFACE_SPEED] = _listen(rows)
        force[done] = impulse * t[2]
        acceleration[done] = (s[_SURFACE_SPEED] - before) * t[2]
        first = 0
        impulse = 0.0
        done += 1
        if _has_left(s, rows):
            s[_IN_CONTACT] = 0.0
            break
        if s[_ALLOWED] < 0.0 and steps > _LEAST:
            steps = max(steps // 2, _LEAST)
            h = 1.0 / (steps * t[2])
            s[_SUBSTEPS], s[_ALLOWED] = steps, _IMPATIENT
            _set_step(s, rows, known, int(t[0]), h)
    return done


@kernel
def _set_step(s, rows, known, modes, h):
    """Prepare sub-steps of `h` seconds."""
    free = h * h / s[_MASS]
    s[_A], s[_B], s[_C] = free / 2.0, free / 12.0, 0.0
    coefficients = rows[_COEFFICIENTS:]
    for m in range(modes):
        a, b, c = prepare(coefficients, m, known[_DECAY, m], known[_ANGULAR, m], known[_GAIN, m], h)
        s[_A] += a
        s[_B] += b
        s[_C] += c
    s[_CHANGE], s[_CURVE] = _move(rows, 0.0, 0.0, 0.0)


@kernel
def _advance(s, rows, known, h, steps):
    """`steps` sub-steps of `h` seconds; returns the impulse."""
    x, speed, elastic, force, trend = s[_WAY], s[_SPEED], s[_ELASTIC], s[_FORCE], s[_TREND]
    mass, stiffness, exponent, load = s[_MASS], s[_STIFFNESS], s[_EXPONENT], s[_LOAD]
    a, b, c = s[_A], s[_B], s[_C]
    nu = s[_DAMPING] / h
    pressed = load * h * h / mass
    impulse = 0.0
    change, curve = s[_CHANGE], s[_CURVE]
    for step in range(steps):
        free_d = h * speed + 0.5 * pressed - change
        free_w = pressed / 12.0 - curve
        slope = trend * h
        f0, f1, d, elastic = solve(
            x, elastic, stiffness, exponent, nu, a, b, c, free_d, free_w, force + 0.5 * slope, slope
        )
        x += d
        speed -= h / mass * (f0 - load)
        parts = f0 == 0.0 and force != 0.0
        force, trend = f0 + 0.5 * f1, f1 / h
        impulse += h * f0
        change, curve = _move(rows, 1.0, f0, f1)
        if parts and steps - step > _FEW:
            s[_WAY], s[_SPEED] = x, speed
            left = (steps - 1 - step) * h
            if _out_of_reach(s, rows, left):
                _fly(s, rows, known, left)
                return impulse
    s[_WAY], s[_SPEED], s[_ELASTIC], s[_FORCE], s[_TREND] = x, speed, elastic, force, trend
    s[_CHANGE], s[_CURVE] = change, curve
    return impulse


@modal_kernel
def _move(rows, step, f0, f1):
    """Move the modes on by a sub-step (`step` 1) or not (0); return what the next adds to the surface's D and W."""
    change = 0.0
    curve = 0.0
    for m in range(rows.shape[1]):
        x, y = rows[_Z, m], rows[_Z + 1, m]
        a, b = rows[_COEFFICIENTS + CHANGE, m], rows[_COEFFICIENTS + CHANGE + 1, m]
        u = x + (step * (a * x - b * y) + f0 * rows[_COEFFICIENTS + PUSH, m] + f1 * rows[_COEFFICIENTS + TILT, m])
        v = y + (
            step * (a * y + b * x) + f0 * rows[_COEFFICIENTS + PUSH + 1, m] + f1 * rows[_COEFFICIENTS + TILT + 1, m]
        )
        rows[_Z, m] = u
        rows[_Z + 1, m] = v
        change += a * v + b * u
        curve += rows[_COEFFICIENTS + CURVE, m] * v + rows[_COEFFICIENTS + CURVE + 1, m] * u
    return change, curve


@modal_kernel
def _listen(rows):
    """The struck point's displacement and speed, of the modes that are heard."""
    way = 0.0
    speed = 0.0
    for m in range(rows.shape[1]):
        way += rows[_SHOWN, m] * rows[_Z + 1, m]
        speed += rows[_SHOWN + 1, m] * rows[_Z, m] + rows[_SHOWN + 2, m] * rows[_Z + 1, m]
    return way, speed


@modal_kernel
def _most(rows):
    """The surface's displacement, and the most that it and its speed can be while it rings freely."""
    way = 0.0
    most = 0.0
    fastest = 0.0
    for m in range(rows.shape[1]):
        size = math.sqrt(rows[_Z, m] ** 2 + rows[_Z + 1, m] ** 2)
        way += rows[_Z + 1, m]
        most += size
        fastest += rows[_SHOWN + 3, m] * size
    return way, most, fastest


@kernel
def _out_of_reach(s, rows, seconds):
    """Whether hammer and surface, apart now, cannot meet within `seconds`."""
    fastest = _most(rows)[2] + s[_SPEED] + s[_LOAD] / s[_MASS] * seconds
    return fastest * seconds < -s[_WAY]


@kernel
def _has_left(s, rows):
    """Whether the surface cannot come back to the hammer, which nothing presses and nothing slows down."""
    if s[_WAY] > 0.0 or s[_SPEED] > 0.0 or s[_LOAD] > 0.0:
        return False
    way, most, _ = _most(rows)
    return s[_WAY] + way <= -most


@kernel
def _fly(s, rows, known, seconds):
    """One step of any length without contact."""
    way = 0.0
    for m in range(rows.shape[1]):
        z = complex(rows[_Z, m], rows[_Z + 1, m])
        then = z * cmath.exp(complex(-known[_DECAY, m], known[_ANGULAR, m]) * seconds)
        rows[_Z, m], rows[_Z + 1, m] = then.real, then.imag
        way += then.imag - z.imag
    pull = s[_LOAD] / s[_MASS] * seconds
    s[_WAY] += (s[_SPEED] + 0.5 * pull) * seconds - way
    s[_SPEED] += pull
    s[_ELASTIC] = s[_FORCE] = s[_TREND] = 0.0
    s[_CHANGE], s[_CURVE] = _move(rows, 0.0, 0.0, 0.0)
