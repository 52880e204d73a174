"""A hammer in contact, and the modes that it drives: the memory of one row, and how it moves in steps of any length.

What begins a contact copies everything that it needs from the object, so that one that is under way ends with the old
modes.
"""

import cmath
import math

from underfoot.kernels import kernel, modal_kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.modal.contact_step import CONTACT, STEP, prepare, solve
from underfoot.models.modal.phasors import BLOCK, PHASORS, POWERS

PAIR = Layout("complex_row", re=("row",), im=("row",))
"""A complex number for each mode."""

AUDIBLE = Layout("audible", displacement=("row",), speed_re=("row",), speed_im=("row",), pole_modulus=("row",))
"""What turns a phasor into the displacement and the speed of the struck point, 0 where the mode would alias; and how
fast a phasor of size 1 can move it."""

OBJECT = Layout(
    "struck_object",
    *("modes", "floor", "rate"),
    powers=POWERS,
    audible=AUDIBLE,
    decay=("row",),
    angular=("row",),
    mobility=("row",),
    acceleration=PAIR,
)
"""A modal object as its hammer meets it: how many modes, the acceleration below which one drops out, the rate; decays
(1/s), damped angular frequencies (rad/s), mobilities, and what turns a phasor into a frame's acceleration."""

STATE = Layout(
    "struck_object_state",
    *("in_contact", "active", "struck_lately", "rung_from", "given"),
    *("penetration", "speed", "elastic_force", "force", "force_rate"),
    *("mass", "damping", "load", "substeps", "substeps_left"),
    *("free_change", "free_moment", "surface", "surface_speed"),
    contact=CONTACT,
    acceleration_block=BLOCK,
    displacement_block=BLOCK,
    work=BLOCK,
    begin=PAIR,
    end=PAIR,
    spare=PHASORS,
    step=STEP,
    z=PAIR,
    audible=AUDIBLE,
    turn=PAIR,
)
"""Of a row; zeros are at rest. Whether the hammer is there, modes in use, whether one struck of late; the frame of the
block that its ringing was computed from, and how many frames of it were given out, 0 where none is kept. Then the
hammer: penetration (m), speed (m/s), k x^a, last force (N) and its rate (N/s); its mass, mu and load; sub-steps of a
frame, and how many there may be until there are fewer a frame; what the free modes do to D and W of the next sub-step;
and the struck point as heard at the frame's start. Then phasors: at `rung_from`, at the block's end, to work with, and
of the contact (`z`); what was known of the object when it began; and the poles to the power of a frame."""

_FEW = 8  # sub-steps that are not worth a step of their own


@kernel
def set_step(s: Memory, known: Memory, h: float) -> None:
    """Prepare steps of `h` seconds."""
    contact = s.contact
    free = h * h / s.mass
    contact.a, contact.b, contact.c = free / 2.0, free / 12.0, 0.0
    contact.nu = s.damping / h
    for m in range(int(known.modes)):
        a, b, c = prepare(s.step, m, known.decay[m], known.angular[m], known.mobility[m], h)
        contact.a += a
        contact.b += b
        contact.c += c
    s.free_change, s.free_moment = _move(s, 0.0, 0.0, 0.0)


@kernel
def advance(s: Memory, known: Memory, h: float, steps: int) -> float:
    """`steps` steps of `h` seconds; returns the impulse."""
    x, speed, elastic, force, force_rate = s.penetration, s.speed, s.elastic_force, s.force, s.force_rate
    mass, load, contact = s.mass, s.load, s.contact
    pressed = load * h * h / mass
    impulse = 0.0
    change, moment = s.free_change, s.free_moment
    for step in range(steps):
        free_d = h * speed + 0.5 * pressed - change
        free_w = pressed / 12.0 - moment
        slope = force_rate * h
        f0, f1, d, elastic = solve(contact, x, elastic, free_d, free_w, force + 0.5 * slope, slope)
        x += d
        speed -= h / mass * (f0 - load)
        parts = f0 == 0.0 and force != 0.0
        force, force_rate = f0 + 0.5 * f1, f1 / h
        impulse += h * f0
        change, moment = _move(s, 1.0, f0, f1)
        if parts and steps - step > _FEW:
            s.penetration, s.speed = x, speed
            left = (steps - 1 - step) * h
            if out_of_reach(s, left):
                _fly(s, known, left)
                return impulse
    s.penetration, s.speed, s.elastic_force, s.force, s.force_rate = x, speed, elastic, force, force_rate
    s.free_change, s.free_moment = change, moment
    return impulse


@modal_kernel
def _move(s: Memory, step: float, f0: float, f1: float) -> tuple[float, float]:
    """Move the modes on by a step (`step` 1) or not (0); return what the next adds to the surface's D and W."""
    re, im, by = s.z.re, s.z.im, s.step
    change_re, change_im, moment_re, moment_im = by.change_re, by.change_im, by.moment_re, by.moment_im
    push_re, push_im, tilt_re, tilt_im = by.push_re, by.push_im, by.tilt_re, by.tilt_im
    change = 0.0
    moment = 0.0
    for m in range(re.size):
        x, y = re[m], im[m]
        a, b = change_re[m], change_im[m]
        u = x + (step * (a * x - b * y) + f0 * push_re[m] + f1 * tilt_re[m])
        v = y + (step * (a * y + b * x) + f0 * push_im[m] + f1 * tilt_im[m])
        re[m] = u
        im[m] = v
        change += a * v + b * u
        moment += moment_re[m] * v + moment_im[m] * u
    return change, moment


@modal_kernel
def audible_motion(s: Memory) -> tuple[float, float]:
    """The struck point's displacement and speed, of the modes that are heard."""
    re, im = s.z.re, s.z.im
    weight, speed_re, speed_im = s.audible.displacement, s.audible.speed_re, s.audible.speed_im
    displacement = 0.0
    speed = 0.0
    for m in range(re.size):
        displacement += weight[m] * im[m]
        speed += speed_re[m] * re[m] + speed_im[m] * im[m]
    return displacement, speed


@modal_kernel
def _most(s: Memory) -> tuple[float, float, float]:
    """The surface's displacement, and the most that it and its speed can be while it rings freely."""
    re, im, pole_modulus = s.z.re, s.z.im, s.audible.pole_modulus
    displacement = 0.0
    most = 0.0
    fastest = 0.0
    for m in range(re.size):
        size = math.sqrt(re[m] ** 2 + im[m] ** 2)
        displacement += im[m]
        most += size
        fastest += pole_modulus[m] * size
    return displacement, most, fastest


@kernel
def out_of_reach(s: Memory, seconds: float) -> bool:
    """Whether hammer and surface, apart now, cannot meet within `seconds`."""
    fastest = _most(s)[2] + s.speed + s.load / s.mass * seconds
    return fastest * seconds < -s.penetration


@kernel
def has_left(s: Memory) -> bool:
    """Whether the surface cannot come back to the hammer, which nothing presses and nothing slows down."""
    if s.penetration > 0.0 or s.speed > 0.0 or s.load > 0.0:
        return False
    displacement, most, _ = _most(s)
    return s.penetration + displacement <= -most


@kernel
def fly_frame(s: Memory, seconds: float) -> None:
    """A frame, of so many seconds, without contact."""
    _glide(s, s.turn, seconds)


@kernel
def _fly(s: Memory, known: Memory, seconds: float) -> None:
    """One step of any length without contact."""
    spare = s.spare
    for m in range(spare.re.size):
        turn = cmath.exp(complex(-known.decay[m], known.angular[m]) * seconds)
        spare.re[m], spare.im[m] = turn.real, turn.imag
    _glide(s, spare, seconds)


@kernel
def _glide(s: Memory, turn: Memory, seconds: float) -> None:
    pull = s.load / s.mass * seconds
    s.penetration += (s.speed + 0.5 * pull) * seconds - _turned(s, turn)
    s.speed += pull
    s.elastic_force = s.force = s.force_rate = 0.0
    s.free_change, s.free_moment = _move(s, 0.0, 0.0, 0.0)


@modal_kernel
def _turned(s: Memory, turn: Memory) -> float:
    """Turn the modes by the complex numbers of `turn`; return the surface's change."""
    re, im, turn_re, turn_im = s.z.re, s.z.im, turn.re, turn.im
    change = 0.0
    for m in range(re.size):
        x, y = re[m], im[m]
        a, b = turn_re[m], turn_im[m]
        v = a * y + b * x
        re[m] = a * x - b * y
        im[m] = v
        change += v - y
    return change
