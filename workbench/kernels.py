"""How kernels are declared: compiled by Numba without the interpreter lock, kept on disk, in strict float64.

Strict, because a kernel exists more than once: on its own, inlined in its callers, and in every process's cache. Where
the compiler may contract or re-order, these copies differ in their last bits (measured: a tone's bytes changed between
the process that compiled it and the next one, which loaded it), and the same patch must give the same bytes.

Numba is imported by the first kernel that is called: a window that only shows nodes need not wait for it.
"""

from collections.abc import Callable
from functools import cached_property, update_wrapper
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
"""What kernels compute on: contiguous arrays of float64."""

_PART = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True}
_INLINED = {**_PART, "forceinline": True}


class Kernel:
    """A function that is compiled, or loaded from the cache, when it is first called.

    `py_func` is the function itself, `compiled` what Numba made of it.
    """

    def __init__(self, function: Callable[..., Any], is_kept: bool, **options: Any) -> None:
        update_wrapper(self, function)
        self.py_func, self.is_kept = function, is_kept
        self.options = {"nopython": True, "nogil": True, "error_model": "numpy", **options}

    __call__ = property(attrgetter("compiled"))  # past the interpreter: the output callback calls kernels

    @cached_property
    def compiled(self) -> Any:
        """Numba's dispatcher."""
        from underfoot.compilation import compiled

        return compiled(self.py_func, self.options, self.is_kept)

    @property
    def _numba_type_(self) -> Any:
        """What it is to a kernel that calls it."""
        return self.compiled._numba_type_


class Intrinsic:
    """A function of compiled code alone, which writes its code itself; Numba's word for it."""

    def __init__(self, function: Callable[..., Any]) -> None:
        self.py_func, self.__doc__ = function, function.__doc__

    @cached_property
    def _numba_type_(self) -> Any:
        """What it is to a kernel that calls it."""
        from underfoot.compilation import type_of_intrinsic

        return type_of_intrinsic(self.py_func)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel whose bits do not depend on how a stretch of frames is split, nor on who compiled it."""
    return Kernel(function, is_kept=True)


def modal_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel whose inner loop runs over modes: it may contract, and re-associate sums over modes."""
    return Kernel(function, is_kept=True, fastmath={"contract", "nsz", "arcp", "reassoc"})


def part(function: Callable[..., Any]) -> Any:
    """A part of one kernel, which is compiled with it."""
    return Kernel(function, is_kept=False, **_PART)


def inlined(function: Callable[..., Any]) -> Any:
    """A part of kernels that is compiled into each: what runs in every frame."""
    return Kernel(function, is_kept=False, **_INLINED)


def intrinsic(function: Callable[..., Any]) -> Any:
    """What compiled code cannot say by itself: `function(context, *types)` gives a signature, and what writes code."""
    return Intrinsic(function)


def callback(signature: Any, function: Callable[..., Any]) -> Any:
    """A kernel that is called by its address: compiled, or loaded, at once."""
    from underfoot.compilation import compiled_callback

    return compiled_callback(signature, function)


def modal_inlined(function: Callable[..., Any]) -> Any:
    """A part of modal kernels that is compiled into each. It may contract; its sums stay in their order."""
    return Kernel(function, is_kept=False, **_INLINED, fastmath={"contract", "nsz"})


@intrinsic
def widest(context: Any) -> Any:
    """Let the loops of the kernel that calls this use the processor's widest vectors.

    The compiler prefers half of them where there are 512 bits. Long loops over modes gain a quarter to a third from all
    (measured at 64 and 200 modes); short loops, of which everything else is made, lose.
    """
    from numba import types

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')  # past llvmlite's list of known names
        return context.get_dummy_value()

    return types.void(), code
