"""Delay with feedback."""

import math

from underfoot.layouts import Layout
from underfoot.models.signals.glide import glided
from underfoot.parameters import Number
from underfoot.patch.node import Input, Output, node

LONGEST_S = 0.5
_INAUDIBLE = 1e-12
_DAMPED_HZ = 48_000.0
"""Rate at which `damping` is the pole of the one-pole low-pass; at another rate, the pole of the same time constant."""
_FASTEST = 0.5  # frames per frame: largest change of the delay, as on a tape


@node("delay", "Shapes")
class Delay:
    """Delay line with feedback, a comb filter: echoes get weaker with the feedback and duller with the damping."""

    also_called = "echo, tapin, pipe, flanger, chorus"
    accuracy = "exact: linear interpolation between frames, to 1e-12"
    signal = Input()
    time = Number(
        0.12, 0.001, LONGEST_S, unit="s", scale="log", wire="span", doc="time between a sound and its echo; it glides"
    )
    feedback = Number(0.4, 0.0, 0.95, wire="span", doc="gain from one echo to the next; 0 gives a single echo")
    damping = Number(
        0.2,
        0.0,
        0.99,
        wire="span",
        doc="high-frequency loss per echo; 0 is none; it adds up to damping / (1 - damping) / 48 ms to time",
    )
    out = Output(doc="echoes only, without the direct signal")
    state = Layout(
        "delay", "has_begun", "frames", "place", "low_passed", "quiet", "feedback", "damping", line=("length",)
    )

    def sizes(values, rate):
        return {"length": math.ceil(LONGEST_S * rate) + 2}

    def run(signal, time, feedback, damping, rate, frame, state, out):
        line, length = state.line, state.length
        damping **= _DAMPED_HZ / rate
        if state.has_begun == 0.0:
            state.has_begun, state.frames, state.feedback, state.damping = 1.0, time * rate, feedback, damping
        frames, place, low_passed, quiet = state.frames, int(state.place), state.low_passed, state.quiet
        for i in range(out.size):
            frames += min(max(time * rate - frames, -_FASTEST), _FASTEST)
            whole = int(frames)
            later, earlier = line[(place - whole) % length], line[(place - whole - 1) % length]
            echo = later + (frames - whole) * (earlier - later)
            state.feedback = glided(state.feedback, feedback, frame + i)
            state.damping = glided(state.damping, damping, frame + i)
            low_passed += (1.0 - state.damping) * (echo - low_passed)
            line[place] = signal[i] + state.feedback * low_passed
            out[i] = low_passed
            quiet = quiet + 1.0 if max(abs(line[place]), abs(low_passed)) < _INAUDIBLE else 0.0
            place = (place + 1) % length
        state.frames, state.place, state.low_passed, state.quiet = frames, place, low_passed, quiet

    def tail(state):
        return _INAUDIBLE if state.has_begun == 0.0 or state.quiet >= state.length else math.inf
