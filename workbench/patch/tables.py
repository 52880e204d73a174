"""Arrays of a program, and their transfer to compiled code."""

from typing import Annotated, NamedTuple

import numpy as np

from underfoot.array_tables import B1, B2, F1, F2, F3, I1, I2, U2, arrays_at

NODE = np.dtype(
    [
        (name, np.int64)
        for name in (
            *("run", "tail"),  # addresses of its kernels; 0 for no tail
            *("inputs", "inputs_at", "outputs", "outputs_at"),  # number of buffers, and the first
            *("event_inputs", "event_inputs_at", "event_outputs", "event_outputs_at"),
            *("controls", "controls_at", "control_memory"),
            *("state_size", "state_at", "coefficients_size", "coefficients_at", "data_at"),  # float64 values
            *("watched", "watched_at", "sleep_rule", "is_driven"),
        )
    ]
)
"""Node record of the driver: numbers of buffers, lists and values, and their positions in the tables."""

N1 = Annotated[np.ndarray, NODE, 1]


class Tables(NamedTuple):
    """Arrays of a program, with type and dimensions. A buffer holds one signal's frames of a block."""

    nodes: N1
    keys: U2  # [node, row]
    masked: B2  # [node, row]: does not apply to this tile
    asleep: B2  # [node, row]
    ran: I2  # [node, row]: frames run
    cycles: I1  # [node]: processor cycles spent in the blocks that are timed
    blocks_per_timed: I1  # [1]: how many blocks there are for each that is timed
    moving: B1  # [node]: a control is ramping
    inputs: I1  # buffers of inputs, node after node
    watched: I1  # buffers that must be zero for a node to sleep
    event_inputs: I1  # event lists of inputs
    last_event: I2  # [entry of event_inputs, row]: session frame of the last event taken
    cursor: I1  # [entry of event_inputs]: the next event of this block
    buffers: F1  # all buffers
    bits: I1  # the same memory
    buffer_at: I1  # [buffer]: where its row 0 begins
    row_stride: I1  # [buffer]: from a row to the next; 0 where rows share the buffer
    unread: B1  # [buffer]: an output that goes nowhere, so that it need not be looked at
    is_zero: B1  # [buffer]: all frames are known to be zero, or unread
    nonzero: B2  # [buffer, interval]: some frame of the sleep interval so far is not zero
    was_nonzero: B2  # [buffer, row]: the part of this interval before the block had nonzero frames
    read_engine_buffers: I1  # buffers that the engine fills and a node reads
    engine_buffers: I1  # [signal of the engine]: its buffer, or -1
    engine_zero: B1  # [row]: the engine's signals are known to be zero
    events: F2  # [list, EVENTS with room for a block]
    event_stride: I1  # [list]: 1 where the list has a row for each tile
    staged: F2  # [input, EVENTS with room for a block]: the events of one stretch
    control: F1  # controls, node after node, row after row
    drivers: I1  # [control]: the buffer that drives it, or -1
    ramp: F2  # [control, then signal control, (from, to, low, high)]; only what a wire drives is limited
    ramp_start: I1  # [control, then signal control]
    signal_controls: I1  # buffers that hold a parameter
    signal_moving: B1  # [signal control]: 1 ramping, 2 still to be filled
    state: F1  # node after node, row after row
    coefficients: F1  # the same
    data: F1  # node after node
    sinks: I1  # buffers that tiles play
    sound_sinks: I1  # buffers of the sound output
    played: F2  # [row, frame]: output, then sound
    output: F2  # [row, frame]
    sound: F2  # [1, frame]: sum of all rows
    zero_rows: B1  # [row]: silent, then no_sound
    silent: B1  # [row]: the output is known to be zero
    no_sound: B1  # [1]: sound is known to be zero
    idle: B1  # [row]: every node slept throughout the previous block
    scopes: I1  # buffers that are displayed
    scope: F3  # [scope, row, frame]
    fault: I2  # [node]: row or -1, session frame of the first value that was not finite
    pointers: I1  # working memory for the pointers of one call
    settings: F1  # the rate


ALL, ANY, GUARDED = range(3)
"""Condition for a row to sleep: all watched inputs zero and no tail; any of them zero; or all of them zero, whatever
its tail, because it is inaudible."""

tables_at = arrays_at(Tables)
