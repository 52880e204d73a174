"""Held values with a glide from each to the next."""

import math

from underfoot.kernels import Floats, kernel
from underfoot.layouts import Layout, Memory

HELD = Layout("held", "has_begun", "begin", "target", "since", "glide")
"""Start and target of a glide, the frames since it began, and its duration in frames."""
SEQUENCE = Layout("sequence", "has_begun", "phase", "step", held=HELD)
"""Position in the sequence in steps, and the step that is held."""


@kernel
def value(held: Memory) -> float:
    """Return the present output, on a line to the held value.

    >>> held = HELD.zeros()
    >>> take(held, 2.0, 0.0, 10.0)
    >>> take(held, 4.0, 0.0, 10.0)
    >>> held.since = 5.0
    >>> value(held)
    3.0
    """
    if held.since >= held.glide:
        return held.target
    return held.begin + (held.target - held.begin) * (held.since / held.glide)


@kernel
def take(held: Memory, target: float, since: float, glide_frames: float) -> None:
    """Hold another value, begun `since` frames ago, with a glide of `glide_frames`; the first value is immediate."""
    held.begin = value(held) if held.has_begun == 1.0 else target
    held.has_begun, held.target, held.since, held.glide = 1.0, target, since, glide_frames


@kernel
def sample(
    signal: Floats, triggers: Memory, glide_s: float, rate: float, frame: int, held: Memory, out: Floats
) -> None:
    """Fill `out` with the value of `signal` at the last event of `triggers`; 0 before the first, which is a step."""
    glide = glide_s * rate
    k = 0
    for i in range(out.size):
        while k < len(triggers) and math.floor(triggers.time[k]) <= frame + i:
            take(held, signal[i], 0.0, glide)
            k += 1
        out[i] = value(held)
        held.since += 1.0


@kernel
def play(
    values: Floats, steps_a_frame: float, events: Memory, glide_frames: float, frame: int, state: Memory, out: Floats
) -> None:
    """Fill `out` with `values`, one per step. With `steps_a_frame` 0 each event advances by one step.

    Otherwise steps count from session frame 0, and each event restarts at the first.

    >>> import numpy as np
    >>> from underfoot.models.signals.events import event_list
    >>> out = np.empty(6)
    >>> play(np.array([1.0, 5.0]), 0.5, event_list(), 0.0, 0, SEQUENCE.zeros(), out)
    >>> out
    array([1., 1., 5., 5., 1., 1.])
    """
    if state.has_begun == 0.0:
        state.has_begun, state.phase = 1.0, (frame * steps_a_frame) % values.size
        state.step = math.floor(state.phase)
        take(state.held, values[int(state.step)], 0.0, glide_frames)
    k = 0
    for i in range(out.size):
        now = frame + i
        while k < len(events) and math.floor(events.time[k]) <= now:
            if steps_a_frame > 0.0:
                state.phase = (now - events.time[k]) * steps_a_frame  # below 0 until the next frame
            else:
                state.phase = (math.floor(state.phase) + 1.0) % values.size
                state.step = -1.0
            k += 1
        step = max(math.floor(state.phase), 0.0)
        if step != state.step:
            state.step = step
            since = (state.phase - step) / steps_a_frame if steps_a_frame > 0.0 else 0.0
            take(state.held, values[int(step)], min(max(since, 0.0), 1.0), glide_frames)
        out[i] = value(state.held)
        state.held.since += 1.0
        state.phase += steps_a_frame
        if state.phase >= values.size:
            state.phase -= values.size
