"""A program as arrays: what each holds, and how all of them are handed to compiled code at once."""

from typing import Annotated, Any, NamedTuple, get_type_hints

import numpy as np

from underfoot.kernels import intrinsic

NODE = np.dtype(
    [
        (name, np.int64)
        for name in (
            *("run", "tail"),  # addresses of its kernels; 0 where it has no tail
            *("inputs", "inputs_at", "outputs", "outputs_at"),  # how many buffers, and the first
            *("event_inputs", "event_inputs_at", "event_outputs", "event_outputs_at"),
            *("controls", "controls_at", "control_memory"),
            *("state_size", "state_at", "coefficients_size", "coefficients_at", "data_at"),  # float64 values
            *("watched", "watched_at", "sleep_rule", "is_driven"),
        )
    ]
)
"""What the driver knows of a node: how many of each it has, and where they begin in the tables."""

B1 = Annotated[np.ndarray, np.dtype(np.uint8), 1]
B2 = Annotated[np.ndarray, np.dtype(np.uint8), 2]
F1 = Annotated[np.ndarray, np.dtype(np.float64), 1]
F2 = Annotated[np.ndarray, np.dtype(np.float64), 2]
F3 = Annotated[np.ndarray, np.dtype(np.float64), 3]
I1 = Annotated[np.ndarray, np.dtype(np.int64), 1]
I2 = Annotated[np.ndarray, np.dtype(np.int64), 2]
N1 = Annotated[np.ndarray, NODE, 1]
U2 = Annotated[np.ndarray, np.dtype(np.uint64), 2]


class Tables(NamedTuple):
    """A program as arrays, each with its type and dimensions. A buffer holds one signal's frames of a block."""

    nodes: N1
    keys: U2  # [node, row]
    masked: B2  # [node, row]: not for this tile
    asleep: B2  # [node, row]
    ran: I2  # [node, row]: frames that were not slept
    cycles: I1  # [node]: processor cycles spent
    moving: B1  # [node]: a control is in its ramp
    inputs: I1  # buffers of inputs, node after node
    watched: I1  # buffers whose being zero lets a node sleep
    event_inputs: I1  # event lists of inputs
    last_event: I2  # [entry of event_inputs, row]: session frame of the last event taken
    cursor: I1  # [entry of event_inputs]: the next event of this block
    buffers: F1  # all buffers
    bits: I1  # the same memory
    buffer_at: I1  # [buffer]: where its row 0 begins
    row_stride: I1  # [buffer]: from a row to the next; 0 where rows share the buffer
    is_zero: B1  # [buffer]: all frames are known to be zero
    nonzero: B2  # [buffer, interval]: some frame of the sleep interval so far is not zero
    was_nonzero: B2  # [buffer, row]: the part of this interval before the block was not all zero
    hosts: I1  # buffers that the engine fills and somebody waits for
    brought: I1  # [signal of the engine]: its buffer, or -1
    unfed: B1  # [row]: what the engine filled is known to be zero
    events: F2  # [list, EVENTS with room for a block]
    event_stride: I1  # [list]: 1 where the list has a row for each tile
    staged: F2  # [input, EVENTS with room for a block]: the events of one stretch
    control: F1  # controls, node after node, row after row
    drivers: I1  # [control]: the buffer that drives it, or -1
    ramp: F2  # [control, (from, to, low, high)]
    ramp_start: I1  # [control]
    signal_controls: I1  # buffers that hold a parameter
    signal_ramp: F2  # [signal control, (from, to)]
    signal_start: I1  # [signal control]
    signal_moving: B1  # [signal control]: 1 in its ramp, 2 still to be filled
    state: F1  # node after node, row after row
    coefficients: F1  # the same
    data: F1  # node after node
    sinks: I1  # buffers that tiles play
    sound_sinks: I1  # buffers that are heard
    played: F2  # [row, frame]: output, and sound behind it
    output: F2  # [row, frame]
    sound: F2  # [1, frame]: what is heard, of all rows
    zero_rows: B1  # [row]: silent, and no_sound behind it
    silent: B1  # [row]: the output is known to be zero
    no_sound: B1  # [1]: sound is known to be zero
    idle: B1  # [row]: every node slept through the block before this one
    scopes: I1  # buffers that somebody looks at
    scope: F3  # [scope, row, frame]
    fault: I1  # [3]: node or -1, row, session frame of the first value that was not finite
    pointers: I1  # room for the pointers of one call
    settings: F1  # the rate


ALL, ANY, GUARDED = range(3)
"""What lets a row sleep: all watched inputs zero and nothing left in it; any of them zero; or all of them, whatever is
left in it, because nobody would hear it."""


def declared(kind: type) -> tuple[tuple[str, Any, int], ...]:
    """Name, type and dimensions of each array of a named tuple, of its annotations."""
    return tuple((name, *hint.__metadata__) for name, hint in get_type_hints(kind, include_extras=True).items())


def addresses(tables: Any) -> np.ndarray:
    """Where the arrays of a named tuple are: int64 [table, (address, three dimensions)], as compiled code takes them.

    Handing over some forty arrays one by one would cost more than running a small patch. Who has the addresses keeps
    the arrays.
    """
    for array, (name, dtype, dimensions) in zip(tables, declared(type(tables)), strict=True):
        assert array.dtype == dtype, name
        assert array.ndim == dimensions, name
        assert array.flags.c_contiguous, name
    return np.array([(a.ctypes.data, *a.shape, *([1] * (3 - a.ndim))) for a in tables], np.int64)


def borrow(context: Any, where: Any, kind: type) -> Any:
    """What an intrinsic gives that makes a named tuple of the arrays at these addresses; they are not counted."""
    from llvmlite import ir
    from numba import from_dtype, types
    from numba.np.arrayobj import populate_array

    arrays = [types.Array(from_dtype(dtype), dimensions, "C") for _, dtype, dimensions in declared(kind)]
    result = types.NamedTuple(arrays, kind)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        table = context.make_array(signature.args[0])(context, builder, args[0])
        word = context.get_value_type(types.intp)

        def entry(i: int) -> Any:
            return builder.load(builder.gep(table.data, [ir.Constant(ir.IntType(64), i)]))

        made = []
        for row, one in enumerate(arrays):
            array = context.make_array(one)(context, builder)
            shape = [entry(4 * row + 1 + d) for d in range(one.ndim)]
            size = ir.Constant(word, context.get_abi_sizeof(context.get_data_type(one.dtype)))
            strides = [size]
            for length in reversed(shape[1:]):
                strides.insert(0, builder.mul(strides[0], length))
            data = builder.inttoptr(entry(4 * row), context.get_data_type(one.dtype).as_pointer())
            populate_array(array, data, shape, strides, size, None)
            made.append(array._getvalue())
        return context.make_tuple(builder, signature.return_type, made)

    return result(where), code


@intrinsic
def tables_at(context: Any, where: Any) -> Any:
    """The arrays at these addresses as `Tables`."""
    return borrow(context, where, Tables)
