"""Controls of nodes while a program runs: ramps from the old value to the new one.

A control that a wire drives follows its signal instead, sampled at the start of each span. Parameters that kernels read
every frame are signals themselves.
"""

from underfoot.clock import RAMP, SPAN
from underfoot.kernels import inlined, kernel
from underfoot.patch.tables import Tables


@kernel
def on_ramp(begin: float, end: float, frames: int) -> float:
    """Return a control `frames` after the start of its ramp from `begin` to `end`."""
    if frames >= RAMP:
        return end
    if frames <= 0:
        return begin
    return begin + (end - begin) * (frames / RAMP)


@inlined
def fill_signal_controls(p: Tables, frame: int, n: int) -> None:
    """Fill the buffers of parameters that are signals: once when steady, frame by frame while they change."""
    for j in range(p.signal_controls.size):
        state = p.signal_moving[j]
        if state == 0:
            continue
        at = p.buffer_at[p.signal_controls[j]]
        q = p.drivers.size + j
        begin, end, start = p.ramp[q, 0], p.ramp[q, 1], p.ramp_start[q]
        if state == 2 or frame >= start + RAMP:
            for i in range(p.output.shape[1]):
                p.buffers[at + i] = end
            p.signal_moving[j] = 0
            continue
        for i in range(n):
            p.buffers[at + i] = on_ramp(begin, end, frame + i - start)


@inlined
def read_controls(p: Tables, k: int, row: int, frame: int, f: int) -> None:
    """Read the controls of one row at frame `f` of the block, the start of a span."""
    memory = p.nodes[k].control_memory + row * p.nodes[k].controls
    for j in range(p.nodes[k].controls):
        q = p.nodes[k].controls_at + j
        buffer = p.drivers[q]
        if buffer < 0:
            p.control[memory + j] = on_ramp(p.ramp[q, 0], p.ramp[q, 1], frame + f - p.ramp_start[q])
        else:
            value = p.buffers[p.buffer_at[buffer] + row * p.row_stride[buffer] + f]
            p.control[memory + j] = min(max(value, p.ramp[q, 2]), p.ramp[q, 3])


@inlined
def finish_ramps(p: Tables, frame: int, n: int) -> None:
    """Give all rows the controls at the last span edge of the block, and end completed ramps."""
    last = frame + n - 1 - (frame + n - 1) % SPAN
    if last < frame:
        return
    for k in range(p.nodes.shape[0]):
        if p.moving[k] == 0:
            continue
        moving = False
        for j in range(p.nodes[k].controls):
            q = p.nodes[k].controls_at + j
            if p.drivers[q] >= 0:
                continue
            moving |= last < p.ramp_start[q] + RAMP
            for row in range(p.output.shape[0]):
                value = on_ramp(p.ramp[q, 0], p.ramp[q, 1], last - p.ramp_start[q])
                p.control[p.nodes[k].control_memory + row * p.nodes[k].controls + j] = value
        p.moving[k] = moving
