"""Declaration of kernels: compiled by Numba without the interpreter lock, cached on disk, in strict float64.

Strict, because a kernel exists more than once: on its own, inlined in its callers, and in every process's cache. If the
compiler may contract or reorder operations, these copies differ in their last bits (measured: a tone's bytes changed
between the process that compiled it and the next one, which loaded it), and the same patch must give the same bytes.

Numba is imported by the first call of a kernel: a window that only shows nodes need not wait for it.
"""

from collections.abc import Callable
from functools import cached_property, update_wrapper
from operator import attrgetter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import UnderfootError

if TYPE_CHECKING:
    from llvmlite import ir
    from numba import types
    from numba.core.ccallback import CFunc
    from numba.core.registry import CPUDispatcher

    from underfoot.emission import Arguments, BaseContext, Emission, Signature, TypingContext

Floats = NDArray[np.float64]
"""Arrays of float64, which kernels take where they are contiguous."""

_STRICT = {"nopython": True, "nogil": True, "error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
_COMPILED_ONLY = "a patch runs as compiled code only; unset NUMBA_DISABLE_JIT, which is for models by themselves"


class Kernel:
    """Function that is compiled, or loaded from the cache, at its first call from Python.

    `py_func` is the function itself. In a kernel that calls it, it is a part: optimised there, without machine code of
    its own.
    """

    def __init__(self, function: Callable[..., Any], **options: object) -> None:
        update_wrapper(self, function)
        self.py_func = function
        self.options = {**_STRICT, **options}

    __call__ = property(attrgetter("compiled"))  # no interpreter frame: the output callback calls kernels

    @cached_property
    def compiled(self) -> "CPUDispatcher":
        """Numba's dispatcher for calls from Python."""
        from underfoot.compilation import compiled

        return compiled(self.py_func, self.options)

    @cached_property
    def part(self) -> "CPUDispatcher":
        """Numba's dispatcher for calls from other kernels."""
        from underfoot.compilation import part

        return part(self.py_func, self.options)

    def specialised(self, *arguments: object) -> Callable[..., Any]:
        """Return the kernel compiled, or loaded, for arguments of these types; called with others, it may crash.

        It is for what is called in every block. To find the version for its arguments takes Numba 0.1 us per array:
        more than passing them.
        """
        from underfoot.compilation import IS_DISABLED

        if IS_DISABLED:
            return self.compiled
        types = tuple(map(self.compiled.typeof_pyval, arguments))
        if types not in self.compiled.overloads:
            self.compiled.compile(types)
        return self.compiled.overloads[types].entry_point

    @property
    def _numba_type_(self) -> "types.Type":
        """Numba type of the kernel in a kernel that calls it."""
        return self.part._numba_type_


class Intrinsic:
    """Function that emits its own machine code (an intrinsic of Numba). Python calls `in_python` instead.

    `function(context, *types)` returns a signature, and a function that emits code. `in_python` is for kernels that run
    as plain Python, where Numba is disabled.
    """

    def __init__(self, function: Callable[..., "Emission"], in_python: Callable[..., Any] | None = None) -> None:
        self.py_func, self.__doc__ = function, function.__doc__
        self._in_python = in_python

    def __call__(self, *args: object) -> Any:  # noqa: ANN401 - what the intrinsic makes
        if self._in_python is None:
            raise UnderfootError(_COMPILED_ONLY)
        return self._in_python(*args)

    @cached_property
    def _numba_type_(self) -> "types.Type":
        """Numba type of the intrinsic in a kernel that calls it."""
        from underfoot.compilation import type_of_intrinsic

        return type_of_intrinsic(self.py_func)


def kernel(function: Callable[..., Any]) -> Kernel:
    """Compile a kernel whose bits depend neither on how frames are split nor on the process that compiled it."""
    return Kernel(function)


def block_kernel(function: Callable[..., Any]) -> Kernel:
    """Compile a kernel that the output callback calls, and that is short: it keeps the interpreter lock.

    To release and take the lock takes longer than the rest of the call, and lets another thread take it in the middle
    of a block.
    """
    return Kernel(function, nogil=False)


def modal_kernel(function: Callable[..., Any]) -> Kernel:
    """Compile a kernel whose inner loop runs over modes: it may contract, and reassociate sums over modes."""
    return Kernel(function, fastmath={"contract", "nsz", "arcp", "reassoc"})


def inlined(function: Callable[..., Any]) -> Kernel:
    """Declare a helper that is inlined into each kernel that calls it, for code that runs every frame."""
    return Kernel(function, forceinline=True)


def allocating(declared: Kernel) -> Kernel:
    """Let a declared kernel make arrays.

    The others are compiled without Numba's counts of references to arrays, which it keeps at every call even where
    nothing is made: of tracking, they were a third of the run time and of the code.
    """
    declared.options["_nrt"] = True
    return declared


def callback(signature: "str | Signature", function: Callable[..., Any]) -> "CFunc":
    """Compile or load, at once, a kernel that is called by its address."""
    from underfoot.compilation import IS_DISABLED, compiled_callback

    if IS_DISABLED:
        raise UnderfootError(_COMPILED_ONLY)
    return compiled_callback(signature, function)


def modal_inlined(function: Callable[..., Any]) -> Kernel:
    """Declare a helper inlined into modal kernels. It may contract; its sums keep their order."""
    return Kernel(function, forceinline=True, fastmath={"contract", "nsz"})


@inlined
def copy(values: Floats, out: Floats) -> None:
    """Copy an array to another of its size.

    Assigning a slice may allocate, since the two might overlap, and compiles Numba's string functions.
    """
    for i in range(out.size):
        out[i] = values[i]


@Intrinsic
def call_at(context: "TypingContext", address: "types.Type", *arguments: "types.Type") -> "Emission":
    """Call a `callback` that returns nothing by its address, which unlike a kernel's code is not in its caller's."""
    from llvmlite import ir
    from numba import types
    from numba.core.cgutils import unpack_tuple

    def code(context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments") -> "ir.Value":
        given = unpack_tuple(builder, args[1])
        function = ir.FunctionType(ir.VoidType(), [one.type for one in given])
        builder.call(builder.inttoptr(args[0], function.as_pointer()), given)
        return context.get_dummy_value()

    return types.void(types.int64, types.StarArgTuple(tuple(map(types.unliteral, arguments)))), code


def _prefer_widest(context: "TypingContext") -> "Emission":
    """Let the loops of the calling kernel use the processor's widest vectors.

    The compiler prefers half of them on processors with 512 bits. Long loops over modes gain a quarter to a third from
    full width (measured at 64 and 200 modes); short loops, which are everything else, lose.
    """
    from numba import types

    def code(context: "BaseContext", builder: "ir.IRBuilder", signature: "Signature", args: "Arguments") -> "ir.Value":
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')  # bypasses llvmlite's list of known names
        return context.get_dummy_value()

    return types.void(), code


widest = Intrinsic(_prefer_widest, in_python=lambda: None)
