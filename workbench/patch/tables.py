"""A program as arrays: what each holds, and how all of them are handed to compiled code at once."""

from collections import namedtuple

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.arrayobj import populate_array

TABLES = (
    ("nodes", types.int64, 2),  # [node, column]
    ("keys", types.uint64, 2),  # [node, row]
    ("masked", types.uint8, 2),  # [node, row]: not for this tile
    ("asleep", types.uint8, 2),  # [node, row]
    ("ran", types.int64, 2),  # [node, row]: frames that were not slept
    ("cycles", types.int64, 1),  # [node]: processor cycles spent
    ("moving", types.uint8, 1),  # [node]: a control is in its ramp
    ("signals_in", types.int64, 1),  # lanes of inputs, node after node
    ("watched", types.int64, 1),  # lanes whose silence lets a node sleep
    ("events_in", types.int64, 1),  # event lists of inputs
    ("last_event", types.int64, 2),  # [entry of events_in, row]: session frame of the last event taken
    ("cursor", types.int64, 1),  # [entry of events_in]: the next event of this block
    ("lanes", types.float64, 1),  # all lanes
    ("bits", types.int64, 1),  # the same memory
    ("lane_at", types.int64, 1),  # [lane]: where row 0 of a lane begins
    ("lane_step", types.int64, 1),  # [lane]: from a row to the next; 0 where rows share the lane
    ("clean", types.uint8, 1),  # [lane]: all frames are known to be zero
    ("loud", types.uint8, 2),  # [lane, nap]: some frame of the nap so far is not zero
    ("carry", types.uint8, 2),  # [lane, row]: the part of this nap before this block was loud
    ("hosts", types.int64, 1),  # lanes that the engine fills
    ("events", types.float64, 2),  # [list, 1 + 3 * block]
    ("event_step", types.int64, 1),  # [list]: 1 where the list has a row for each tile
    ("stage", types.float64, 2),  # [input, 1 + 3 * block]: the events of one stretch
    ("control", types.float64, 1),  # controls, node after node, row after row
    ("drivers", types.int64, 1),  # [control]: the lane that drives it, or -1
    ("ramp", types.float64, 2),  # [control, (from, to, low, high)]
    ("ramp_start", types.int64, 1),  # [control]
    ("signal_controls", types.int64, 1),  # lanes that hold a parameter
    ("signal_ramp", types.float64, 2),  # [signal control, (from, to)]
    ("signal_start", types.int64, 1),  # [signal control]
    ("signal_moving", types.uint8, 1),  # [signal control]: 1 in its ramp, 2 still to be filled
    ("state", types.float64, 1),  # node after node, row after row
    ("tuning", types.float64, 1),  # the same
    ("data", types.float64, 1),  # node after node
    ("sinks", types.int64, 1),  # lanes that are played
    ("output", types.float64, 2),  # [row, frame]
    ("still", types.uint8, 1),  # [row]: the output is known to be zero
    ("scopes", types.int64, 1),  # lanes that somebody looks at
    ("scope", types.float64, 3),  # [scope, row, frame]
    ("fault", types.int64, 1),  # [3]: node or -1, row, session frame of the first value that was not finite
    ("pointers", types.int64, 1),  # room for the pointers of one call
    ("settings", types.float64, 1),  # the rate
)
"""A program as arrays: name, type and dimensions of each. Columns of `nodes` are named by the constants below."""

Tables = namedtuple("Tables", [name for name, _, _ in TABLES])

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
    MUTED_BY_ANY,
    DRIVEN,
    COLUMNS,
) = range(23)


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
