"""A hammer in contact, and the modes that it drives: the memory of one row, and how it moves in steps of any length.

What begins a contact copies everything that it needs from the tuning, so that one that is under way ends with the old
modes.
"""

import cmath
import math

from underfoot.kernels import kernel, modal_kernel
from underfoot.models.modal.contact_step import CHANGE, COEFFICIENTS, CURVE, PUSH, TILT, prepare, solve
from underfoot.models.modal.phasors import BLOCK, PHASOR_ROWS, TABLE_ROWS, padded, waves_size

_FEW = 8  # sub-steps that are not worth a step of their own

# s: numbers, blocks, rows of one number a mode.
IN_CONTACT, ACTIVE, LATELY = 0, 1, 2  # whether the hammer is there, modes in use, whether a blow came of late
FROM = 3  # the frame of the block that its ringing was computed from
WAY, SPEED, ELASTIC, FORCE, TREND = 4, 5, 6, 7, 8  # into the surface (m), m/s, k x^a, last force (N), its N/s
MASS, STIFFNESS, EXPONENT, DAMPING, LOAD = 9, 10, 11, 12, 13  # as the hammer's, in order
SUBSTEPS, A, B, C = 14, 15, 16, 17
FREE_CHANGE, FREE_CURVE = 18, 19  # what the free modes do to D and W of the next sub-step
SURFACE, SURFACE_SPEED = 20, 21  # of the struck point at the frame's start, as heard
ALLOWED = 22  # sub-steps until there are fewer a frame
GIVEN = 23  # frames of the block that were given out, 0 where none is kept
ACCELERATION, DISPLACEMENT, WORK, ROWS = 32, 32 + BLOCK, 32 + 2 * BLOCK, 32 + 3 * BLOCK
# Rows of s, of which phasors take two: at `FROM`, at the block's end, to work with; then those of contact, and what
# was tuned when it began.
BEGIN, END, SPARE, COEFFICIENT = 0, 2, 4, 4 + PHASOR_ROWS
Z = COEFFICIENT + COEFFICIENTS
SHOWN = Z + 2
TURN = SHOWN + 4  # the poles to the power of a frame
S_ROWS = TURN + 2
# t: modes, floor, rate; rows: the table of powers, then what else is known of the modes. `SHOW` and the two after it
# turn a phasor into displacement and speed, 0 where the mode is not heard; `WEIGHT` into the frame's acceleration.
# The waves of the modes come last.
TABLE = 8
SHOW, SHOW_RE, SHOW_IM, PACE, DECAY, ANGULAR, GAIN, WEIGHT = range(TABLE_ROWS, TABLE_ROWS + 8)
T_ROWS = WEIGHT + 2


@kernel
def state_size(modes):
    """The floats of `s`.

    >>> state_size(10) > state_size(2) > 0
    True
    """
    return ROWS + S_ROWS * padded(modes)


@kernel
def tuning_size(modes):
    """The floats of `t`.

    >>> tuning_size(10) > tuning_size(2) > 0
    True
    """
    return TABLE + T_ROWS * padded(modes) + waves_size(modes)


@kernel
def rows_of(s, t):
    """The rows of `s`."""
    row = padded(int(t[0]))
    return s[ROWS : ROWS + S_ROWS * row].reshape((S_ROWS, row))


@kernel
def known_of(t):
    """The rows of `t`."""
    row = padded(int(t[0]))
    return t[TABLE : TABLE + T_ROWS * row].reshape((T_ROWS, row))


@kernel
def set_step(s, rows, known, modes, h):
    """Prepare steps of `h` seconds."""
    free = h * h / s[MASS]
    s[A], s[B], s[C] = free / 2.0, free / 12.0, 0.0
    coefficients = rows[COEFFICIENT:]
    for m in range(modes):
        a, b, c = prepare(coefficients, m, known[DECAY, m], known[ANGULAR, m], known[GAIN, m], h)
        s[A] += a
        s[B] += b
        s[C] += c
    s[FREE_CHANGE], s[FREE_CURVE] = _move(rows, 0.0, 0.0, 0.0)


@kernel
def advance(s, rows, known, h, steps):
    """`steps` steps of `h` seconds; returns the impulse."""
    x, speed, elastic, force, trend = s[WAY], s[SPEED], s[ELASTIC], s[FORCE], s[TREND]
    mass, stiffness, exponent, load = s[MASS], s[STIFFNESS], s[EXPONENT], s[LOAD]
    a, b, c = s[A], s[B], s[C]
    nu = s[DAMPING] / h
    pressed = load * h * h / mass
    impulse = 0.0
    change, curve = s[FREE_CHANGE], s[FREE_CURVE]
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
            s[WAY], s[SPEED] = x, speed
            left = (steps - 1 - step) * h
            if out_of_reach(s, rows, left):
                _fly(s, rows, known, left)
                return impulse
    s[WAY], s[SPEED], s[ELASTIC], s[FORCE], s[TREND] = x, speed, elastic, force, trend
    s[FREE_CHANGE], s[FREE_CURVE] = change, curve
    return impulse


@modal_kernel
def _move(rows, step, f0, f1):
    """Move the modes on by a step (`step` 1) or not (0); return what the next adds to the surface's D and W."""
    change = 0.0
    curve = 0.0
    for m in range(rows.shape[1]):
        x, y = rows[Z, m], rows[Z + 1, m]
        a, b = rows[COEFFICIENT + CHANGE, m], rows[COEFFICIENT + CHANGE + 1, m]
        u = x + (step * (a * x - b * y) + f0 * rows[COEFFICIENT + PUSH, m] + f1 * rows[COEFFICIENT + TILT, m])
        v = y + (step * (a * y + b * x) + f0 * rows[COEFFICIENT + PUSH + 1, m] + f1 * rows[COEFFICIENT + TILT + 1, m])
        rows[Z, m] = u
        rows[Z + 1, m] = v
        change += a * v + b * u
        curve += rows[COEFFICIENT + CURVE, m] * v + rows[COEFFICIENT + CURVE + 1, m] * u
    return change, curve


@modal_kernel
def listen(rows):
    """The struck point's displacement and speed, of the modes that are heard."""
    way = 0.0
    speed = 0.0
    for m in range(rows.shape[1]):
        way += rows[SHOWN, m] * rows[Z + 1, m]
        speed += rows[SHOWN + 1, m] * rows[Z, m] + rows[SHOWN + 2, m] * rows[Z + 1, m]
    return way, speed


@modal_kernel
def _most(rows):
    """The surface's displacement, and the most that it and its speed can be while it rings freely."""
    way = 0.0
    most = 0.0
    fastest = 0.0
    for m in range(rows.shape[1]):
        size = math.sqrt(rows[Z, m] ** 2 + rows[Z + 1, m] ** 2)
        way += rows[Z + 1, m]
        most += size
        fastest += rows[SHOWN + 3, m] * size
    return way, most, fastest


@kernel
def out_of_reach(s, rows, seconds):
    """Whether hammer and surface, apart now, cannot meet within `seconds`."""
    fastest = _most(rows)[2] + s[SPEED] + s[LOAD] / s[MASS] * seconds
    return fastest * seconds < -s[WAY]


@kernel
def has_left(s, rows):
    """Whether the surface cannot come back to the hammer, which nothing presses and nothing slows down."""
    if s[WAY] > 0.0 or s[SPEED] > 0.0 or s[LOAD] > 0.0:
        return False
    way, most, _ = _most(rows)
    return s[WAY] + way <= -most


@kernel
def fly_frame(s, rows, seconds):
    """A frame, of so many seconds, without contact."""
    _glide(s, rows, TURN, seconds)


@kernel
def _fly(s, rows, known, seconds):
    """One step of any length without contact."""
    for m in range(rows.shape[1]):
        turn = cmath.exp(complex(-known[DECAY, m], known[ANGULAR, m]) * seconds)
        rows[SPARE, m], rows[SPARE + 1, m] = turn.real, turn.imag
    _glide(s, rows, SPARE, seconds)


@kernel
def _glide(s, rows, by, seconds):
    pull = s[LOAD] / s[MASS] * seconds
    s[WAY] += (s[SPEED] + 0.5 * pull) * seconds - _turned(rows, by)
    s[SPEED] += pull
    s[ELASTIC] = s[FORCE] = s[TREND] = 0.0
    s[FREE_CHANGE], s[FREE_CURVE] = _move(rows, 0.0, 0.0, 0.0)


@modal_kernel
def _turned(rows, by):
    """Turn the modes by the complex numbers of two rows; return the surface's change."""
    way = 0.0
    for m in range(rows.shape[1]):
        x, y = rows[Z, m], rows[Z + 1, m]
        a, b = rows[by, m], rows[by + 1, m]
        v = a * y + b * x
        rows[Z, m] = a * x - b * y
        rows[Z + 1, m] = v
        way += v - y
    return way
