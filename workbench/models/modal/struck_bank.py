"""Modal bank struck by events (equation 3.4): free ringing 64 frames at a time, one real-time row.

Blocks lie at multiples of 64 session frames, whatever the calls. An event adds its tabulated response to the rest of
its block, and its exact contribution to the phasors at the block's end; so the output does not depend, to the bit, on
how frames are split into calls. After the first `_FEW` events of a block, contributions are added up frame by frame at
its end: grains of sand strike in most frames. What was struck before new modes come, at the block's middle, has those
it was struck with up to the block's end, in both forms.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import SPAN
from underfoot.kernels import Floats, kernel
from underfoot.lanes import all_four, four, put
from underfoot.layouts import Layout, Memory
from underfoot.memory import LANES
from underfoot.models.modal.phasors import BLOCK, PHASORS, POWERS, add_advanced, free_block, in_use, tabulate

STATE = Layout(
    "struck_bank",
    *("active", "struck_lately", "given", "strikes", "halved"),
    block=BLOCK,
    waiting=BLOCK,
    phasors=PHASORS,
    half_re=("row",),
    half_im=("row",),
)
"""Modes in use, whether an event came lately, how many frames of the block were output, its number of events, and the
design with which its first half was added up (0: it was not); the block's output, strengths by frame that are not in
the phasors yet, the phasors at its end, and the share in these of what waited at its middle."""
COEFFICIENTS = Layout(
    "struck_bank_coefficients",
    *("modes", "floor_squared", "amplitude_sum", "designs"),
    response=BLOCK,
    amplitudes=PHASORS,
    powers=POWERS,
)
"""Number of modes, the square of the amplitude below which one is dropped, the sum of the magnitudes of amplitudes, and
the number of calls of `design`; the response to an event of strength 1, the amplitudes (in `amplitudes.re`), and the
powers of the poles."""

_PATIENCE = 32 * BLOCK  # interval between searches for modes below the floor
_FEW = 8
"""Events of a block that are added to the phasors one by one; all frames together cost as much as these."""


@kernel
def design(
    modes: NDArray[np.float64], pitch: float, decay: float, rate_hz: float, floor: float, coefficients: Memory
) -> None:
    """Design the bank of modes a exp(-b t) sin(2 pi f t); `modes` [3, m] has rows of f (Hz), b (1/s) and a.

    `pitch` is a factor on all frequencies and `decay` one on all decays. Present ringing goes on with the new values.
    A mode at or above half the rate is left out, because it would alias. A mode whose amplitude falls below `floor`
    (output units; 120 dB below a loud signal is a good choice) is dropped; the cost falls with the last mode that
    sounds, so list slow decays first.
    """
    count, designs = modes.shape[1], coefficients.designs
    coefficients.values[:] = 0.0
    coefficients.designs = designs + 1.0
    coefficients.modes, coefficients.floor_squared = count, floor * floor
    phasors = coefficients.amplitudes
    for m in range(count):
        frequency = modes[0, m] * pitch
        if frequency < 0.5 * rate_hz:
            tabulate(coefficients.powers, m, frequency, modes[1, m] * decay, rate_hz)
            phasors.re[m] = modes[2, m]
    free_block(coefficients.response, coefficients.powers, phasors, phasors.row)
    for m in range(count):
        phasors.re[m] = modes[2, m] if modes[0, m] * pitch < 0.5 * rate_hz else 0.0
        coefficients.amplitude_sum += abs(phasors.re[m])


@kernel
def ring(events: Memory, frame: int, coefficients: Memory, state: Memory, out: Floats) -> None:
    """Run from session frame `frame` on into `out`; an event of strength 1 adds sum a exp(-b t) sin(2 pi f t).

    An event acts from the frame that contains its time; one before `frame` acts at once.
    """
    block, powers, phasors = state.block, coefficients.powers, state.phasors
    done, event, count, n = 0, 0, len(events), out.size
    while done < n:
        start = (frame + done) % BLOCK
        length = min(BLOCK - start, n - done)
        is_struck = event < count and events.time[event] < frame + done + length
        straight = length == BLOCK and not is_struck  # this block need not be kept
        if start == 0:
            if (frame + done) % _PATIENCE == 0:
                _drop(coefficients, state)
            goal = out[done : done + BLOCK] if straight else block
            free_block(goal, powers, phasors, int(state.active))
        while event < count and events.time[event] < frame + done + length:
            at = int(math.floor(events.time[event])) - (frame + done)
            _strike(coefficients, state, start + max(at, 0), events.strength[event])
            event += 1
        if not straight:
            for i in range(length):
                out[done + i] = block[start + i]
        if state.strikes > _FEW:  # now, as the modes may be others from the next span on
            if start + length == BLOCK:
                _add_waiting(coefficients, state)
            elif start + length == SPAN:
                _add_up(coefficients, state, state.half_re, state.half_im)
                state.halved = coefficients.designs
        if start + length == BLOCK:
            state.strikes = 0.0
        done += length
        state.given = (start + length) % BLOCK if state.active > 0.0 else 0.0


@kernel
def tail(state: Memory, coefficients: Memory) -> float:
    """Return an upper bound of |output| from here on without events."""
    block, phasors = state.block, state.phasors
    bound = 0.0
    if state.given > 0.0:
        for i in range(int(state.given), BLOCK):
            bound = max(bound, abs(block[i]))
    for m in range(int(state.active)):
        bound += math.sqrt(phasors.re[m] ** 2 + phasors.im[m] ** 2)
    if state.strikes > _FEW:
        for k in range(BLOCK):
            bound += abs(state.waiting[k]) * coefficients.amplitude_sum
    return bound


@kernel
def _drop(coefficients: Memory, state: Memory) -> None:
    """Set modes under the floor to exactly 0, unless recent events may still be building them up."""
    if state.struck_lately == 0.0:
        re, im = state.phasors.re, state.phasors.im
        last = 0
        for m in range(int(state.active)):
            if re[m] * re[m] + im[m] * im[m] > coefficients.floor_squared:
                last = m + 1
            else:
                re[m] = im[m] = 0.0
        state.active = in_use(last, re.size)
        if last == 0:
            state.block[:] = 0.0
            state.phasors.values[:] = 0.0
    state.struck_lately = 0.0


@kernel
def _strike(coefficients: Memory, state: Memory, at: int, strength: float) -> None:
    """Add an event at frame `at` of the block: its tabulated response, and its phasors at the block's end."""
    block, response = state.block, coefficients.response
    for i in range(BLOCK - at):
        block[at + i] += strength * response[i]
    state.strikes += 1.0
    if state.strikes <= _FEW:
        add_advanced(coefficients.powers, coefficients.amplitudes, strength, BLOCK - at, state.phasors)
    else:
        state.waiting[at] += strength
    state.active = state.phasors.row
    state.struck_lately = 1.0


@kernel
def _add_waiting(coefficients: Memory, state: Memory) -> None:
    """Add to the phasors what was struck in the block: its first half apart, if it had other modes."""
    phasors, work_re, work_im = state.phasors, state.phasors.work_re, state.phasors.work_im
    if state.halved != 0.0 and state.halved != coefficients.designs:
        _add(state.half_re, state.half_im, phasors)
        for k in range(SPAN):
            state.waiting[k] = 0.0
    state.halved = 0.0
    _add_up(coefficients, state, work_re, work_im)
    _add(work_re, work_im, phasors)
    state.waiting[:] = 0.0


@kernel
def _add_up(coefficients: Memory, state: Memory, re: Floats, im: Floats) -> None:
    """Set `re` and `im` to the phasors, at the block's end, of the strengths that wait: each turned since its frame."""
    powers, amplitudes, waiting = coefficients.powers, coefficients.amplitudes, state.waiting
    for m in range(0, re.size, LANES):
        a, b = four(powers.p1_re, m), four(powers.p1_im, m)
        x, y = all_four(0.0), all_four(0.0)
        for k in range(BLOCK):
            struck = x + all_four(waiting[k])
            x, y = struck * a - y * b, y * a + struck * b
        amplitude = four(amplitudes.re, m)
        put(re, m, amplitude * x)
        put(im, m, amplitude * y)


@kernel
def _add(re: Floats, im: Floats, phasors: Memory) -> None:
    for m in range(0, re.size, LANES):
        put(phasors.re, m, four(phasors.re, m) + four(re, m))
        put(phasors.im, m, four(phasors.im, m) + four(im, m))
