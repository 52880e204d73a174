"""Compiler intrinsics: the call of a kernel that returns a number, by address, and the processor's cycle counter."""

from typing import TYPE_CHECKING

from underfoot.kernels import Intrinsic

if TYPE_CHECKING:
    from llvmlite import ir
    from numba import types

    from underfoot.emission import Arguments, BaseContext, Emission, Signature, TypingContext


@Intrinsic
def call_tail(
    context: "TypingContext", address: "types.Type", c: "types.Type", s: "types.Type", t: "types.Type", d: "types.Type"
) -> "Emission":
    """Call a node's `tail` kernel by its address; returns a bound of the row's remaining output."""
    from llvmlite import ir
    from numba import types

    i64 = types.int64

    def code(context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments") -> "ir.Value":
        function = ir.FunctionType(ir.DoubleType(), [ir.IntType(64)] * 4)
        return builder.call(builder.inttoptr(args[0], function.as_pointer()), args[1:])

    return types.float64(i64, i64, i64, i64, i64), code


@Intrinsic
def cycles(context: "TypingContext") -> "Emission":
    """Return the processor's cycle counter."""
    from llvmlite import ir
    from numba import types

    def code(context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments") -> "ir.Value":
        function = builder.module.declare_intrinsic("llvm.readcyclecounter", fnty=ir.FunctionType(ir.IntType(64), []))
        return builder.call(function, [])

    return types.int64(), code
