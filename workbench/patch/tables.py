"""A program as arrays: what each holds, and how all of them are handed to compiled code at once."""

from typing import Annotated, NamedTuple, get_type_hints

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

B1 = Annotated[np.ndarray, types.uint8, 1]
B2 = Annotated[np.ndarray, types.uint8, 2]
F1 = Annotated[np.ndarray, types.float64, 1]
F2 = Annotated[np.ndarray, types.float64, 2]
F3 = Annotated[np.ndarray, types.float64, 3]
I1 = Annotated[np.ndarray, types.int64, 1]
I2 = Annotated[np.ndarray, types.int64, 2]
U2 = Annotated[np.ndarray, types.uint64, 2]


class Tables(NamedTuple):
    """A program as arrays, each with its type and dimensions. The constants below name the columns of `nodes`."""

    nodes: I2  # [node, column]
    keys: U2  # [node, row]
    masked: B2  # [node, row]: not for this tile
    asleep: B2  # [node, row]
    ran: I2  # [node, row]: frames that were not slept
    cycles: I1  # [node]: processor cycles spent
    moving: B1  # [node]: a control is in its ramp
    signals_in: I1  # lanes of inputs, node after node
    watched: I1  # lanes whose silence lets a node sleep
    events_in: I1  # event lists of inputs
    last_event: I2  # [entry of events_in, row]: session frame of the last event taken
    cursor: I1  # [entry of events_in]: the next event of this block
    lanes: F1  # all lanes
    bits: I1  # the same memory
    lane_at: I1  # [lane]: where row 0 of a lane begins
    lane_step: I1  # [lane]: from a row to the next; 0 where rows share the lane
    clean: B1  # [lane]: all frames are known to be zero
    loud: B2  # [lane, nap]: some frame of the nap so far is not zero
    carry: B2  # [lane, row]: the part of this nap before this block was loud
    hosts: I1  # lanes that the engine fills and somebody waits for
    events: F2  # [list, 1 + 3 * block]
    event_step: I1  # [list]: 1 where the list has a row for each tile
    stage: F2  # [input, 1 + 3 * block]: the events of one stretch
    control: F1  # controls, node after node, row after row
    drivers: I1  # [control]: the lane that drives it, or -1
    ramp: F2  # [control, (from, to, low, high)]
    ramp_start: I1  # [control]
    signal_controls: I1  # lanes that hold a parameter
    signal_ramp: F2  # [signal control, (from, to)]
    signal_start: I1  # [signal control]
    signal_moving: B1  # [signal control]: 1 in its ramp, 2 still to be filled
    state: F1  # node after node, row after row
    tuning: F1  # the same
    data: F1  # node after node
    sinks: I1  # lanes that are played
    output: F2  # [row, frame]
    still: B1  # [row]: the output is known to be zero
    idle: B1  # [row]: every node slept through the block before this one
    scopes: I1  # lanes that somebody looks at
    scope: F3  # [scope, row, frame]
    fault: I1  # [3]: node or -1, row, session frame of the first value that was not finite
    pointers: I1  # room for the pointers of one call
    settings: F1  # the rate


TABLES = tuple((name, *hint.__metadata__) for name, hint in get_type_hints(Tables, include_extras=True).items())
"""Name, type and dimensions of each table."""

(
    RUN,
    REST,
    INS,
    IN_AT,
    OUTS,
    OUT_AT,
    EVENT_INS,
    EVENT_IN_AT,
    EVENT_OUTS,
    EVENT_OUT_AT,
    CONTROLS,
    CONTROL_AT,
    CONTROL_MEMORY,
    STATE,
    STATE_AT,
    TUNING,
    TUNING_AT,
    DATA_AT,
    WATCHED,
    WATCHED_AT,
    MODE,
    DRIVEN,
    COLUMNS,
) = range(23)


ALL, ANY, GUARDED = range(3)
"""What puts a row to sleep: all watched inputs silent and nothing left in it; any of them; or all of them, whatever is
left in it, because nobody would hear it."""


def addresses(tables: Tables) -> np.ndarray:
    """Where the arrays of a program are: int64 [table, (address, three dimensions)], as `run_block` takes them.

    Handing over some forty arrays one by one would cost more than running a small patch.
    """
    for array, (name, dtype, dimensions) in zip(tables, TABLES, strict=True):
        assert array.dtype == np.dtype(str(dtype)), name
        assert array.ndim == dimensions, name
        assert array.flags.c_contiguous, name
    return np.array([(a.ctypes.data, *a.shape, *([1] * (3 - a.ndim))) for a in tables], np.int64)


@intrinsic
def tables_at(context, where):
    """The arrays at these addresses as `Tables`; they are borrowed, and not counted."""
    arrays = [types.Array(dtype, dimensions, "C") for _, dtype, dimensions in TABLES]
    result = types.NamedTuple(arrays, Tables)

    def code(context, builder, signature, args):
        table = context.make_array(signature.args[0])(context, builder, args[0])
        word = context.get_value_type(types.intp)

        def entry(i):
            return builder.load(builder.gep(table.data, [ir.Constant(ir.IntType(64), i)]))

        made = []
        for row, kind in enumerate(arrays):
            array = context.make_array(kind)(context, builder)
            shape = [entry(4 * row + 1 + d) for d in range(kind.ndim)]
            size = ir.Constant(word, context.get_abi_sizeof(context.get_data_type(kind.dtype)))
            strides = [size]
            for length in reversed(shape[1:]):
                strides.insert(0, builder.mul(strides[0], length))
            data = builder.inttoptr(entry(4 * row), context.get_data_type(kind.dtype).as_pointer())
            populate_array(array, data, shape, strides, size, None)
            made.append(array._getvalue())
        return context.make_tuple(builder, signature.return_type, made)

    return result(where), code
