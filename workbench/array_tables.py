"""Many arrays as one named tuple, passed to compiled code by address to keep calls cheap."""

from functools import cache
from typing import TYPE_CHECKING, Annotated, get_type_hints

import numpy as np

from underfoot.kernels import Intrinsic

if TYPE_CHECKING:
    from llvmlite import ir
    from numba import types

    from underfoot.emission import Arguments, BaseContext, Emission, Signature, TypingContext

B1 = Annotated[np.ndarray, np.dtype(np.uint8), 1]
B2 = Annotated[np.ndarray, np.dtype(np.uint8), 2]
F1 = Annotated[np.ndarray, np.dtype(np.float64), 1]
F2 = Annotated[np.ndarray, np.dtype(np.float64), 2]
F3 = Annotated[np.ndarray, np.dtype(np.float64), 3]
F4 = Annotated[np.ndarray, np.dtype(np.float64), 4]
I1 = Annotated[np.ndarray, np.dtype(np.int64), 1]
I2 = Annotated[np.ndarray, np.dtype(np.int64), 2]
U2 = Annotated[np.ndarray, np.dtype(np.uint64), 2]


@cache
def declared(kind: type) -> tuple[tuple[str, np.dtype, int], ...]:
    """Return name, type and dimensions of each array of a named tuple, from its annotations."""
    return tuple((name, *hint.__metadata__) for name, hint in get_type_hints(kind, include_extras=True).items())


def addresses(tables: tuple[np.ndarray, ...]) -> np.ndarray:
    """Return the addresses of a named tuple's arrays: int64 [table, (address, four dimensions)], for compiled code.

    Passing some forty arrays one by one would cost more than running a small patch. The holder of the addresses must
    keep the arrays.
    """
    kind = type(tables)
    for array, (name, dtype, dimensions) in zip(tables, declared(kind), strict=True):
        assert array.dtype == dtype, name
        assert array.ndim == dimensions, name
        assert array.flags.c_contiguous, name
    return np.array([(a.ctypes.data, *a.shape, *([1] * (4 - a.ndim))) for a in tables], np.int64)


def arrays_at(kind: type) -> Intrinsic:
    """Return the intrinsic that makes a named tuple of the arrays at these addresses: an array, or its address.

    It counts no references.
    """
    return Intrinsic(lambda context, where: _borrowed(context, where, kind))


def _borrowed(context: "TypingContext", where: "types.Type", kind: type) -> "Emission":
    from llvmlite import ir
    from numba import from_dtype, types
    from numba.np.arrayobj import populate_array

    arrays = [types.Array(from_dtype(dtype), dimensions, "C") for _, dtype, dimensions in declared(kind)]
    result = types.NamedTuple(arrays, kind)

    def code(context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments") -> "ir.Value":
        word = context.get_value_type(types.intp)
        if isinstance(signature.args[0], types.Array):
            first = context.make_array(signature.args[0])(context, builder, args[0]).data
        else:
            first = builder.inttoptr(args[0], word.as_pointer())

        def entry(i: int) -> "ir.Value":
            return builder.load(builder.gep(first, [ir.Constant(ir.IntType(64), i)]))

        made = []
        for row, one in enumerate(arrays):
            array = context.make_array(one)(context, builder)
            shape = [entry(5 * row + 1 + d) for d in range(one.ndim)]
            size = ir.Constant(word, context.get_abi_sizeof(context.get_data_type(one.dtype)))
            strides = [size]
            for length in reversed(shape[1:]):
                strides.insert(0, builder.mul(strides[0], length))
            data = builder.inttoptr(entry(5 * row), context.get_data_type(one.dtype).as_pointer())
            populate_array(array, data, shape, strides, size, None)
            made.append(array._getvalue())
        return context.make_tuple(builder, signature.return_type, made)

    return result(where), code
