"""Hammer on a modal object (equations 3.3 and 3.4), one real-time row: sub-steps in contact, phasors otherwise.

An event launches the hammer at the surface. Contact begins at the event's time, and the frames until the hammer has
left for good are computed in equal sub-steps (`contact_step`), as many as the requested error requires. All other
frames are free ringing, 64 at a time (`phasors`). Blocks lie at multiples of 64 session frames and sub-steps divide
frames, so that the output does not depend, to the bit, on how frames are split into calls.
"""

import cmath
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.kernels import Floats, copy, kernel, modal_kernel
from underfoot.lanes import four, put
from underfoot.layouts import Layout, Memory
from underfoot.memory import LANES
from underfoot.models.modal.contact_motion import (
    FEW,
    advance,
    audible_displacement,
    audible_speed,
    fly_frame,
    has_left,
    out_of_reach,
    set_step,
    stay,
)
from underfoot.models.modal.phasors import BLOCK, advance_phasors, free_block, in_use, tabulate

HAMMER = Layout("hammer", "mass", "stiffness", "exponent", "damping", "load", "error", "substeps")
"""Mass (kg), stiffness (N/m^exponent), exponent, damping mu (s/m), a constant load on the hammer (N), the asked
relative error of the displacement, and sub-steps per frame (0: determined by the error)."""

MOST_SUBSTEPS = 4096
"""Largest number of sub-steps per frame, in real time and offline. A contact that needs more is not resolved, but still
gains no energy."""

FLOOR_M_S2 = 1e-5
"""Acceleration below which nodes drop a mode: 126 dB below full scale, far below the threshold of touch."""

_PATIENT, _IMPATIENT, _LEAST = 8192, 2048, 8
"""Sub-step budget of a hammer that chatters on the object: after `_PATIENT`, and each further `_IMPATIENT`, sub-steps
per frame are halved, down to `_LEAST`. A strike that leaves takes (10 / error)^(1/4), at most some hundreds."""
_PATIENCE = 16 * BLOCK  # interval between searches for modes below the floor
_LEAST_SPEED = 1e-9  # m/s, of a hammer whose sub-steps are counted
_MISSED = 0.02
"""Relative error of a mode's excitation by a contact of one sub-step per radian of the mode."""
_HEARD_S = 0.1  # the error is that of a blow and this much of its ringing
_SLOWEST = 1e-6  # rad/s: lowest frequency of a phasor; slower modes are indistinguishable from a free mass


class Response(NamedTuple):
    """Response over a stretch: contact force (N) and acceleration of the struck point (m/s^2), both means over each
    frame, and its displacement (m) at each frame. Without displacement (length 0 in every call) it costs less."""

    force: Floats
    acceleration: Floats
    displacement: Floats


@kernel
def design(modes: NDArray[np.float64], pitch: float, decay: float, rate_hz: float, floor: float, known: Memory) -> None:
    """Design the struck object: `modes` [4, m] has rows of damped frequency (Hz), decay (1/s), modal mass (kg), shape.

    `pitch` is a factor on all frequencies and `decay` one on all decays. A mode at or above half the rate takes part in
    the contact, but is left out of displacement and acceleration, where it would alias. A mode is dropped when its
    acceleration has fallen below `floor` (m/s^2); the cost falls with the last mode that sounds, so list slow decays
    first. A contact that is under way ends with the old modes.
    """
    known.values[:] = 0.0
    known.modes, known.floor, known.rate = modes.shape[1], floor, rate_hz
    audible, acceleration, powers = known.audible, known.acceleration, known.powers
    for m in range(modes.shape[1]):
        frequency = modes[0, m] * pitch
        angular = max(2.0 * math.pi * frequency, _SLOWEST)
        decay_per_s = modes[1, m] * decay
        tabulate(powers, m, angular / (2.0 * math.pi), decay_per_s, rate_hz)
        heard = 1.0 if frequency < 0.5 * rate_hz else 0.0
        audible.displacement[m], audible.speed_re[m], audible.speed_im[m] = heard, heard * angular, -heard * decay_per_s
        audible.pole_modulus[m] = math.hypot(angular, decay_per_s)
        known.decay[m], known.angular[m] = decay_per_s, angular
        known.mobility[m] = modes[3, m] ** 2 / (modes[2, m] * angular)
        turned = complex(powers.p1_re[m] - 1.0, powers.p1_im[m])
        weight = complex(-decay_per_s, angular) * turned * (heard * rate_hz)
        acceleration.re[m], acceleration.im[m] = weight.real, weight.imag


@kernel
def ring(strikes: Memory, hammer: Memory, frame: int, known: Memory, s: Memory, out: Response) -> None:
    """Compute a stretch of frames from session frame `frame` on.

    Each of `strikes` launches the `hammer`, which is read then, at a velocity (m/s) equal to its strength; one before
    `frame` acts at once. A strike takes the hammer from wherever it is; the object rings on. `known` is the object.
    """
    done, event, count, n = 0, 0, len(strikes), out.force.size
    while done < n:
        until = n
        first = 0
        impulse = 0.0
        if event < count:
            at = max(int(math.floor(strikes.time[event])) - frame, 0)
            if at <= done:
                part = min(max(strikes.time[event] - (frame + done), 0.0), 1.0)
                first, impulse = _release(hammer, strikes.strength[event], (frame + done) % BLOCK, part, known, s)
                event += 1
                if event < count:
                    at = max(int(math.floor(strikes.time[event])) - frame, done + 1)
                    until = min(until, at)
            else:
                until = min(until, at)
        if s.in_contact != 0.0:
            done = _contact(first, impulse, known, s, out, done, until)
            if s.in_contact == 0.0:
                _let_ring((frame + done) % BLOCK, known, s, out.displacement.size > 0)
        else:
            done = _ring_on(frame, known, s, out, done, until)


@kernel
def tail(state: Memory, known: Memory) -> float:
    """Return an upper bound of |acceleration| from here on without events; infinite while the hammer is present."""
    if state.in_contact != 0.0:
        return math.inf
    bound = 0.0
    if state.given > 0.0:
        block = state.acceleration_block
        for i in range(int(state.given), BLOCK):
            bound = max(bound, abs(block[i]))
    for m in range(int(state.active)):
        bound += _loudness(state, known, m)
    return bound


@kernel
def substeps(hammer: Memory, velocity: float, mobility: float, rate: float) -> int:
    """Return the sub-steps per frame that resolve the contact to the hammer's error, 1 to `MOST_SUBSTEPS`.

    `mobility` is the sum of shape^2 / mass of the modes (1/kg).
    """
    steps = (10.0 / hammer.error) ** 0.25
    return _within(steps / (rate * _contact_s(hammer, velocity, mobility)))


@kernel
def _contact_s(hammer: Memory, velocity: float, mobility: float) -> float:
    """Return about how long (s) a contact lasts, or takes to stop a hammer that damping stops: 2.94 depth / speed."""
    velocity = max(velocity, _LEAST_SPEED)
    mass = 1.0 / (1.0 / hammer.mass + mobility)
    stiffness = hammer.stiffness * max(1.0, 0.5 * hammer.damping * velocity)
    power = hammer.exponent + 1.0
    return 2.94 * (power * mass * velocity**2 / (2.0 * stiffness)) ** (1.0 / power) / velocity


@kernel
def _within(steps: float) -> int:
    return int(min(max(math.ceil(steps), 1.0), MOST_SUBSTEPS))


@kernel
def _substeps_of_modes(hammer: Memory, velocity: float, mobility: float, known: Memory) -> int:
    """Return the sub-steps per frame that excite the audible modes to the hammer's error (docs/models.md#impacts).

    `mobility` is the sum of shape^2 / mass.
    """
    exponent, audible, velocity = hammer.exponent, known.audible, max(velocity, _LEAST_SPEED)
    order = min(exponent + 2.0, 4.0)
    lasts = _contact_s(hammer, velocity, mobility)
    impulse = 2.0 * velocity / (1.0 / hammer.mass + mobility)
    kink = hammer.stiffness * velocity**exponent * (1.0 + hammer.damping * velocity) * math.gamma(exponent + 1.0)
    ringing = wrong = pressed = 0.0
    for m in range(int(known.modes)):
        pole = audible.pole_modulus[m]
        push = audible.displacement[m] * known.mobility[m]
        excited = push * impulse * kink / (kink + impulse * pole ** (exponent + 1.0))
        lingers = 0.25 / (known.decay[m] + 0.5 / _HEARD_S)
        ringing += lingers * excited**2
        wrong += lingers * (excited * (pole / known.rate) ** order) ** 2
        pressed += push * impulse / (1.0 + pole * lasts)
    size = ringing + lasts * pressed**2
    if not size > 0.0:
        return 1
    error = _MISSED * math.sqrt(wrong / size)
    return _within((error / hammer.error) ** (1.0 / order))


@kernel
def _loudness(s: Memory, known: Memory, m: int) -> float:
    """Return the amplitude of a mode's acceleration, from its phasor at the block's end."""
    end, weight = s.end, known.acceleration
    size = end.re[m] ** 2 + end.im[m] ** 2
    return math.sqrt(size * (weight.re[m] ** 2 + weight.im[m] ** 2))


@kernel
def _ring_on(frame: int, known: Memory, s: Memory, out: Response, done: int, until: int) -> int:
    """Ring freely from frame `done` to the end of its block, or `until`; return the frame reached."""
    show = out.displacement.size > 0
    start = (frame + done) % BLOCK
    last = min(until, done + BLOCK - start)
    straight = last - done == BLOCK and not show  # this block need not be kept
    if start == 0:
        if (frame + done) % _PATIENCE == 0:
            _drop(known, s)
        goal = out.acceleration[done:last] if straight else s.acceleration_block
        _begin_block(known, s, goal, show)
    for i in range(done, last):
        out.force[i] = 0.0
        if not straight:
            out.acceleration[i] = s.acceleration_block[start + i - done]
        if show:
            out.displacement[i] = s.displacement_block[start + i - done]
    s.given = (frame + last) % BLOCK
    return last


@kernel
def _begin_block(known: Memory, s: Memory, goal: Floats, show: bool) -> None:
    """Ring freely from the last block's end; write the acceleration to `goal`."""
    active = int(s.active)
    for m in range(active):
        s.begin.re[m], s.begin.im[m] = s.end.re[m], s.end.im[m]
    powers = known.powers
    _turn(s.begin, powers.p64_re, powers.p64_im, active, s.end)
    _fill(0, active, known, s, goal, show)


@kernel
def _fill(start: int, active: int, known: Memory, s: Memory, goal: Floats, show: bool) -> None:
    """Write the block's frames from `start` on, from its phasors there: displacement, and acceleration to `goal`."""
    spare, begin = s.spare, s.begin
    s.rung_from = start
    if show:
        heard = known.audible.displacement
        for m in range(active):
            spare.re[m] = heard[m] * begin.re[m]
            spare.im[m] = heard[m] * begin.im[m]
        block = s.work
        free_block(block, known.powers, spare, active)
        for i in range(BLOCK - start):
            s.displacement_block[start + i] = block[i]
    _turn(begin, known.acceleration.re, known.acceleration.im, active, spare)
    free_block(goal, known.powers, spare, active)


@modal_kernel
def _turn(begin: Memory, by_re: Floats, by_im: Floats, active: int, goal: Memory) -> None:
    """Multiply phasors by complex numbers, into `goal`."""
    re, im, goal_re, goal_im = begin.re, begin.im, goal.re, goal.im
    for m in range(0, active, LANES):
        x, y = four(re, m), four(im, m)
        a, b = four(by_re, m), four(by_im, m)
        put(goal_re, m, a * x - b * y)
        put(goal_im, m, a * y + b * x)


@kernel
def _drop(known: Memory, s: Memory) -> None:
    """Set modes under the floor to exactly 0, unless a recent strike may still be building them up."""
    if s.struck_lately == 0.0:
        last = 0
        for m in range(int(s.active)):
            if _loudness(s, known, m) > known.floor:
                last = m + 1
            else:
                s.end.re[m] = s.end.im[m] = 0.0
        s.active = in_use(last, s.row)
    s.struck_lately = 0.0


@kernel
def _let_ring(start: int, known: Memory, s: Memory, show: bool) -> None:
    """Continue with free ringing after the hammer has left at frame `start` of a block."""
    goal = s.end if start == 0 else s.begin
    for m in range(s.row):
        goal.re[m], goal.im[m] = s.z.re[m], s.z.im[m]
    s.active = s.row
    s.struck_lately = 1.0
    s.given = start
    if start > 0:
        advance_phasors(s.begin, known.powers, BLOCK - start, s.row, s.end)
        block = s.work
        _fill(start, s.row, known, s, block, show)
        for i in range(BLOCK - start):
            s.acceleration_block[start + i] = block[i]


@kernel
def _release(hammer: Memory, velocity: float, start: int, part: float, known: Memory, s: Memory) -> tuple[int, float]:
    """Put the hammer on the surface, `part` of a frame after frame `start` of the block, at `velocity`.

    Returns the sub-step at which the frame continues, and the impulse so far.
    """
    if s.in_contact == 0.0:
        _take_over(start, known, s)
    copy(known.audible.values, s.audible.values)
    copy(known.powers.p1_re, s.turn.re)
    copy(known.powers.p1_im, s.turn.im)
    s.surface, s.surface_speed = audible_displacement(s), audible_speed(s)
    z, speed, mobility = s.z, 0.0, 0.0
    for m in range(int(known.modes)):
        pole = complex(-known.decay[m], known.angular[m])
        phasor = complex(z.re[m], z.im[m])
        if part > 0.0:
            phasor *= cmath.exp(pole * (part / known.rate))
        z.re[m], z.im[m] = phasor.real, phasor.imag
        speed += (pole * phasor).imag
        mobility += known.mobility[m] * known.angular[m]
    s.mass, s.damping, s.load = hammer.mass, hammer.damping, hammer.load
    s.contact.stiffness, s.contact.exponent = hammer.stiffness, hammer.exponent
    steps = int(hammer.substeps)
    if s.in_contact == 0.0:
        s.substeps_left = _PATIENT if steps == 0 else math.inf
    if steps == 0:
        speed = abs(velocity) + abs(speed)
        steps = substeps(hammer, speed, mobility, known.rate)
        steps = max(steps, _substeps_of_modes(hammer, speed, mobility, known))
    s.in_contact = 1.0
    s.substeps = steps
    s.penetration = s.elastic_force = s.mean_force = s.force_slope = 0.0
    s.speed = velocity
    impulse = 0.0
    first = math.ceil(part * steps - 1e-9)
    h = (first / steps - part) / known.rate
    if h * steps * known.rate > 1e-9:
        set_step(s, known, h)
        impulse = advance(s, known, h, 1)
    set_step(s, known, 1.0 / (steps * known.rate))
    return first, impulse


@kernel
def _take_over(start: int, known: Memory, s: Memory) -> None:
    """Take the phasors at frame `start` of the block from free ringing."""
    z = s.z
    z.values[:] = 0.0
    if start > 0:
        advance_phasors(s.begin, known.powers, start - int(s.rung_from), int(s.active), z)
    else:
        for m in range(int(s.active)):
            z.re[m], z.im[m] = s.end.re[m], s.end.im[m]


@kernel
def _contact(first: int, impulse: float, known: Memory, s: Memory, out: Response, done: int, until: int) -> int:
    """Run frames `done` to `until`, or until the hammer has left for good; return the frame reached.

    The first frame continues from sub-step `first`, with the impulse so far.
    """
    rate = known.rate
    steps = int(s.substeps)
    h = 1.0 / (steps * rate)
    while done < until:
        if first == 0 and steps <= FEW and s.penetration > 0.0:
            shown = out.displacement[done:until]
            came = stay(s, h, steps, out.force[done:until], out.acceleration[done:until], shown)
            s.substeps_left -= steps * came
            done += came
        else:
            if out.displacement.size > 0:
                out.displacement[done] = s.surface if first > 0 else audible_displacement(s)
            before = s.surface_speed
            if first == 0 and steps > 1 and s.penetration < 0.0 and out_of_reach(s, 1.0 / rate):
                fly_frame(s, 1.0 / rate)
            else:
                impulse += advance(s, known, h, steps - first)
                s.substeps_left -= steps - first
            s.surface_speed = audible_speed(s)
            out.force[done] = impulse * rate
            out.acceleration[done] = (s.surface_speed - before) * rate
            first = 0
            impulse = 0.0
            done += 1
        if has_left(s):
            s.in_contact = 0.0
            break
        if s.substeps_left < 0.0 and steps > _LEAST:
            steps = max(steps // 2, _LEAST)
            h = 1.0 / (steps * rate)
            s.substeps, s.substeps_left = steps, _IMPATIENT
            set_step(s, known, h)
    return done
