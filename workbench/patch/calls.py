"""Compiler intrinsics: calls of kernels by address, and the processor's cycle counter."""

from typing import Any

from underfoot.kernels import intrinsic


@intrinsic
def call_run(  # type: ignore[no-untyped-def]
    context, address, x, y, c, s, t, d, e, o, key, rate, frame, n
):
    """Call a node's `run` kernel by its address; the arguments in between are addresses of its arrays."""
    from llvmlite import ir
    from numba import types

    i64, f64 = types.int64, types.float64
    signature = types.void(i64, i64, i64, i64, i64, i64, i64, i64, i64, types.uint64, f64, i64, i64)

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        word = ir.IntType(64)
        function = ir.FunctionType(ir.VoidType(), [word] * 9 + [ir.DoubleType(), word, word])
        builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])
        return context.get_dummy_value()

    return signature, code


@intrinsic
def call_tail(context: Any, address: Any, c: Any, s: Any, t: Any, d: Any) -> Any:
    """Call a node's `tail` kernel by its address; returns a bound of the row's remaining output."""
    from llvmlite import ir
    from numba import types

    i64 = types.int64

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        function = ir.FunctionType(ir.DoubleType(), [ir.IntType(64)] * 4)
        return builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])

    return types.float64(i64, i64, i64, i64, i64), code


@intrinsic
def cycles(context: Any) -> Any:
    """Return the processor's cycle counter."""
    from llvmlite import ir
    from numba import types

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        function = builder.module.declare_intrinsic("llvm.readcyclecounter", fnty=ir.FunctionType(ir.IntType(64), []))
        return builder.call(function, [])

    return types.int64(), code
