"""Low-frequency oscillator for modulation: sine, triangle, saw and square, from -1 to 1.

To avoid clicks, the edges of saw and square, and the jump of a restart, are linear ramps of `EDGE_S`.
"""

import math

from underfoot.kernels import Floats, inlined, kernel
from underfoot.layouts import Layout, Memory
from underfoot.models.signals.glide import glided

STATE = Layout("low_frequency", "has_begun", "phase", "shift", "left", "since")
"""The phase in periods, without the shift; the present shift; the remaining step of a restart, and its age."""

SHAPES = ("sine", "triangle", "saw", "square")
SINE, TRIANGLE, SAW, SQUARE = range(4)
EDGE_S = 1e-3
"""Duration of an edge."""
_WIDEST_EDGE = 0.25
_SINE = tuple((-1.0) ** k * (2.0 * math.pi) ** (2 * k + 1) / math.factorial(2 * k + 1) for k in range(11))
"""Taylor series of sin(2 pi x) at 0; up to a quarter its remainder is below 1e-17."""


@kernel
def wave(shape: int, phase: float, edge: float) -> float:
    """Return the wave at `phase`, in periods from 0 to 1; `edge` is the duration of edges, in periods up to a quarter.

    Sine and triangle start at 0 and rise; saw and square start at -1 and rise, the saw all the way.

    >>> [round(wave(TRIANGLE, phase, 0.01), 6) for phase in (0.0, 0.25, 0.5, 0.75)]
    [0.0, 1.0, 0.0, -1.0]
    """
    if shape == SINE:
        return sine(phase)
    if shape == TRIANGLE:
        return 1.0 - abs(4.0 * ((phase + 0.25) % 1.0) - 2.0)
    if shape == SAW:
        falls = 1.0 - edge
        return 2.0 * phase / falls - 1.0 if phase < falls else 1.0 - 2.0 * (phase - falls) / edge
    away = phase % 0.5
    share = 2.0 * away / edge - 1.0 if away < edge else 1.0
    return share if phase < 0.5 else -share


@kernel
def run(
    restarts: Memory, shape: int, frequency_hz: float, shift: float, rate: float, frame: int, state: Memory, out: Floats
) -> None:
    """Fill `out` with the wave, from -1 to 1. `shift`, in periods, moves to a new value over a span.

    The phase counts from session frame 0, so that sleep does not change it; each event of `restarts` restarts the
    wave.

    >>> import numpy as np
    >>> from underfoot.models.signals.events import event_list
    >>> state, out = STATE.zeros(), np.empty(5)
    >>> run(event_list(), SINE, 250.0, 0.0, 1000.0, 0, state, out)
    >>> out.round(6) + 0.0
    array([ 0.,  1.,  0., -1.,  0.])
    """
    turn = frequency_hz / rate
    edge, edge_frames = min(EDGE_S * frequency_hz, _WIDEST_EDGE), EDGE_S * rate
    if state.has_begun == 0.0:
        state.has_begun, state.phase, state.shift = 1.0, (frame * turn) % 1.0, shift
        state.since = edge_frames
    phase, at, left, since = state.phase, state.shift, state.left, state.since
    k, count = 0, len(restarts)
    if count == 0 and at == shift and since >= edge_frames:
        state.phase = _fill_undisturbed(shape, phase, at, turn, edge, out)
        return
    for i in range(out.size):
        now = frame + i
        if at != shift:
            at = glided(at, shift, now)
        while k < count and math.floor(restarts.time[k]) <= now:
            was = wave(shape, _turned(phase + at), edge) + _made_up(left, since, edge_frames)
            phase, since = ((now - restarts.time[k]) * turn) % 1.0, 0.0
            left = was - wave(shape, _turned(phase + at), edge)
            k += 1
        out[i] = wave(shape, _turned(phase + at), edge)
        if since < edge_frames:  # an edge under way at the restart would add to its step, beyond the wave's ends
            out[i] = min(max(out[i] + _made_up(left, since, edge_frames), -1.0), 1.0)
            since += 1.0
        phase = _turned(phase + turn)
    state.phase, state.shift, state.left, state.since = phase, at, left, since


@kernel
def sine(phase: float) -> float:
    """Return sin(2 pi phase) for a phase from 0 to 1, to 1e-15. Loops compute it in lanes, in an eighth of the time.

    >>> [round(sine(phase), 12) + 0.0 for phase in (0.0, 1 / 12, 0.25, 0.5, 0.75)]
    [0.0, 0.5, 1.0, 0.0, -1.0]
    """
    past_half = phase - 0.5
    x = 0.25 - abs(abs(past_half) - 0.25)
    square, total = x * x, _SINE[10]
    for k in range(9, -1, -1):
        total = _SINE[k] + square * total
    return math.copysign(x * total, -past_half)


@inlined
def _fill_undisturbed(shape: int, phase: float, shift: float, turn: float, edge: float, out: Floats) -> float:
    """Fill `out` with the wave, without restarts and changes of the shift; return the phase after it."""
    for i in range(out.size):
        out[i] = _turned(phase + shift)
        phase = _turned(phase + turn)
    if shape == SINE:
        for i in range(out.size):
            out[i] = sine(out[i])
    else:
        for i in range(out.size):
            out[i] = wave(shape, out[i], edge)
    return phase


@kernel
def _turned(phase: float) -> float:
    """Wrap a phase below 2 to 0 to 1, without a costly division."""
    return phase - 1.0 if phase >= 1.0 else phase


@kernel
def _made_up(left: float, since: float, edge_frames: float) -> float:
    """Return what remains of a restart's step after `since` frames."""
    return left * (1.0 - since / edge_frames) if since < edge_frames else 0.0
