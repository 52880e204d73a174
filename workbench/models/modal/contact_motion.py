"""Motion of a hammer in contact and of the modes that it drives: the state of one row, and steps of any length.

At its start a contact copies all it needs from the object, so that a contact under way ends with the old modes.
"""

import cmath
import math
from typing import NamedTuple

from underfoot.kernels import Floats, kernel, modal_inlined, modal_kernel
from underfoot.lanes import all_four, four, put, total
from underfoot.layouts import Layout, Memory
from underfoot.memory import LANES
from underfoot.models.modal.contact_series import expand, solve_by_series
from underfoot.models.modal.contact_step import CONTACT, STEP, prepare, solve
from underfoot.models.modal.phasors import BLOCK, PHASORS, POWERS

PAIR = Layout("complex_row", re=("row",), im=("row",))
"""One complex number per mode."""

AUDIBLE = Layout("audible", displacement=("row",), speed_re=("row",), speed_im=("row",), pole_modulus=("row",))
"""Factors from a phasor to displacement and speed of the struck point, 0 where the mode would alias; and the speed per
unit of phasor."""

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
"""Modal object as seen by the hammer: number of modes, the acceleration below which a mode is dropped, the rate; decays
(1/s), damped angular frequencies (rad/s), mobilities, and the factor from a phasor to a frame's acceleration."""

STATE = Layout(
    "struck_object_state",
    *("in_contact", "active", "struck_lately", "rung_from", "given"),
    *("penetration", "speed", "elastic_force", "mean_force", "force_slope"),
    *("mass", "damping", "load", "substeps", "substeps_left", "step_s", "step_over_mass"),
    *("free_d", "free_w", "guess", "pressed", "surface", "surface_speed"),
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
"""State of a row; zeros are at rest. Whether the hammer is present, modes in use, whether one was struck lately; the
frame of the block that its ringing was computed from, and how many of its frames were output, 0 if no block is kept.
Hammer: penetration (m), speed (m/s), k x^a, F0 and F1 of the last sub-step (N); mass, mu and load; sub-steps per
frame, and how many remain until there are fewer per frame; sub-step (s), and sub-step over mass; D and W of the next
sub-step without force, a guess of its D, and load times h^2 / m (m). Struck point: its audible displacement at the
start of the frame in which the contact began, and its speed at the start of each frame. Phasors: at `rung_from`, at
the block's end, working memory, and of the contact (`z`). Object at the start of the contact, and the poles to the
power of a frame."""

FEW = 8
"""Largest number of remaining sub-steps for which a long flight step is not worth its cost."""


class _Touch(NamedTuple):
    """Hammer and surface between two sub-steps: penetration and its inverse, k x^a, hammer speed, F0 and F1 of the last
    sub-step; D and W of the next one without force, and a guess of its D."""

    x: float
    per_x: float
    elastic: float
    speed: float
    mean: float
    slope: float
    free_d: float
    free_w: float
    guess: float


@kernel
def set_step(s: Memory, known: Memory, h: float) -> None:
    """Prepare sub-steps of `h` seconds."""
    contact = s.contact
    if s.step_s > 0.0:  # F1 is relative to the step
        longer = h / s.step_s
        s.mean_force += 0.5 * s.force_slope * (1.0 - longer)
        s.force_slope *= longer
    s.step_s, s.step_over_mass = h, h / s.mass
    free = h * h / s.mass
    s.pressed = s.load * free
    contact.a, contact.b, contact.c = free / 2.0, free / 12.0, 0.0
    contact.nu = s.damping / h
    contact.d_push, contact.d_tilt, contact.w_push, contact.w_tilt = free, 0.0, 0.0, 0.0
    for m in range(int(known.modes)):
        prepare(contact, s.step, m, known.decay[m], known.angular[m], known.mobility[m], h)
    expand(contact.series, contact.exponent)
    _foresee(s)


@kernel
def _foresee(s: Memory) -> None:
    """Compute what the next step would do without force, from the present state."""
    change, moment = _free_motion(s)
    s.free_d = s.step_s * s.speed + 0.5 * s.pressed - change
    s.free_w = s.pressed / 12.0 - moment
    s.guess = s.free_d - s.contact.a * (s.mean_force + s.force_slope) + s.contact.b * s.force_slope


@modal_kernel
def advance(s: Memory, known: Memory, h: float, steps: int) -> float:
    """Run `steps` sub-steps of `h` seconds; return the impulse."""
    touch = _taken(s)
    total_force = 0.0
    for step in range(steps):
        pushed = touch.mean != 0.0 or touch.slope != 0.0
        touch = _stepped(s, touch)
        total_force += touch.mean
        if pushed and touch.mean == 0.0 and steps - step > FEW:
            s.penetration, s.speed = touch.x, touch.speed
            left = (steps - 1 - step) * h
            if out_of_reach(s, left):
                _fly(s, known, left)
                return h * total_force
    _keep(s, touch)
    return h * total_force


@modal_kernel
def stay(s: Memory, h: float, steps: int, force: Floats, acceleration: Floats, displacement: Floats) -> int:
    """Run frames of `steps` sub-steps of `h` seconds each, until the hammer is off the surface at a frame's end.

    Returns the number of frames. Fills the mean force, the mean acceleration, and the displacement unless it is empty.
    """
    touch = _taken(s)
    before = s.surface_speed
    rate = 1.0 / (steps * h)
    done = 0
    while done < force.size and touch.x > 0.0:
        if displacement.size > 0:
            displacement[done] = audible_displacement(s)
        total_force = 0.0
        for _ in range(steps):
            touch = _stepped(s, touch)
            total_force += touch.mean
        speed = audible_speed(s)
        force[done] = total_force * (h * rate)
        acceleration[done] = (speed - before) * rate
        before = speed
        done += 1
    _keep(s, touch)
    s.surface_speed = before
    return done


@modal_inlined
def _stepped(s: Memory, touch: _Touch) -> _Touch:
    """Return the state after one sub-step."""
    contact, x = s.contact, touch.x
    f0 = f1 = d = end = 0.0
    solved = False
    if x > 0.0:
        f0, f1, d, end, solved = solve_by_series(
            contact, x, touch.per_x, touch.elastic, touch.free_d, touch.free_w, touch.guess
        )
    per_y = 1.0 / (x + d)
    end *= per_y
    if not solved:
        mean, slope = touch.mean + touch.slope, touch.slope
        f0, f1, d, end = solve(contact, x, touch.elastic, touch.free_d, touch.free_w, mean, slope)
        per_y = 1.0 / (x + d)
    change, moment = _move(s, f0, f1)
    # Single sums, because the next solution waits for them.
    without = s.step_s * touch.speed + 1.5 * s.pressed - change
    return _Touch(
        x + d,
        per_y,
        end,
        touch.speed - s.step_over_mass * (f0 - s.load),
        f0,
        f1,
        without - contact.d_push * f0 - contact.d_tilt * f1,
        (s.pressed * (1.0 / 12.0) - moment) - contact.w_push * f0 - contact.w_tilt * f1,
        without - (contact.d_push + contact.a) * f0 - (contact.d_tilt + contact.a - contact.b) * f1,
    )


@modal_inlined
def _taken(s: Memory) -> _Touch:
    x, forces = s.penetration, (s.mean_force, s.force_slope)
    return _Touch(x, 1.0 / x, s.elastic_force, s.speed, *forces, s.free_d, s.free_w, s.guess)


@modal_inlined
def _keep(s: Memory, touch: _Touch) -> None:
    s.penetration, s.elastic_force, s.speed = touch.x, touch.elastic, touch.speed
    s.mean_force, s.force_slope = touch.mean, touch.slope
    s.free_d, s.free_w, s.guess = touch.free_d, touch.free_w, touch.guess


@modal_kernel
def _move(s: Memory, f0: float, f1: float) -> tuple[float, float]:
    """Advance the modes by a sub-step.

    Returns their contribution to the surface's D and W in the next sub-step, had there been no force in this one, so
    that the sums over modes need not wait for the force.
    """
    re, im, by = s.z.re, s.z.im, s.step
    mean, slope = all_four(f0), all_four(f1)
    change = all_four(0.0)
    moment = all_four(0.0)
    for m in range(0, re.size, LANES):
        x, y = four(re, m), four(im, m)
        a, b = four(by.change_re, m), four(by.change_im, m)
        x, y = x + a * x - b * y, y + a * y + b * x
        change = change + a * y + b * x
        moment = moment + four(by.moment_re, m) * y + four(by.moment_im, m) * x
        put(re, m, x + mean * four(by.push_re, m) + slope * four(by.tilt_re, m))
        put(im, m, y + mean * four(by.push_im, m) + slope * four(by.tilt_im, m))
    return total(change), total(moment)


@modal_kernel
def _free_motion(s: Memory) -> tuple[float, float]:
    """Return the contribution of the modes to the surface's D and W in the next sub-step."""
    re, im, by = s.z.re, s.z.im, s.step
    change = 0.0
    moment = 0.0
    for m in range(re.size):
        change += by.change_re[m] * im[m] + by.change_im[m] * re[m]
        moment += by.moment_re[m] * im[m] + by.moment_im[m] * re[m]
    return change, moment


@modal_kernel
def audible_displacement(s: Memory) -> float:
    """Return the displacement of the struck point, from the modes that do not alias."""
    displacement = 0.0
    for m in range(s.z.im.size):
        displacement += s.audible.displacement[m] * s.z.im[m]
    return displacement


@modal_kernel
def audible_speed(s: Memory) -> float:
    """Return the speed of the struck point, from the modes that do not alias."""
    re, im, speed_re, speed_im = s.z.re, s.z.im, s.audible.speed_re, s.audible.speed_im
    speed = all_four(0.0)
    for m in range(0, re.size, LANES):
        speed = speed + four(speed_re, m) * four(re, m) + four(speed_im, m) * four(im, m)
    return total(speed)


@modal_kernel
def _most(s: Memory) -> tuple[float, float, float]:
    """Return the surface's displacement, and bounds of displacement and speed while it rings freely."""
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
    """Return whether hammer and surface, now apart, cannot meet within `seconds`."""
    fastest = _most(s)[2] + s.speed + s.load / s.mass * seconds
    return fastest * seconds < -s.penetration


@kernel
def has_left(s: Memory) -> bool:
    """Return whether the surface cannot reach the hammer again, for a hammer without load."""
    if s.penetration > 0.0 or s.speed > 0.0 or s.load > 0.0:
        return False
    displacement, most, _ = _most(s)
    return s.penetration + displacement <= -most


@kernel
def fly_frame(s: Memory, seconds: float) -> None:
    """Advance by a frame of `seconds` without contact."""
    _glide(s, s.turn, seconds)


@kernel
def _fly(s: Memory, known: Memory, seconds: float) -> None:
    """Advance by a step of any length without contact."""
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
    s.elastic_force = s.mean_force = s.force_slope = 0.0
    _foresee(s)


@modal_kernel
def _turned(s: Memory, turn: Memory) -> float:
    """Multiply the phasors by the complex numbers of `turn`; return the change of the surface's displacement."""
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
