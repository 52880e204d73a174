"""How kernels are compiled: Numba without the interpreter lock, kept on disk, in strict float64.

Strict, because a kernel exists more than once: on its own, inlined in its callers, and in every process's cache. Where
the compiler may contract or re-order, these copies differ in their last bits (measured: a tone's bytes changed between
the process that compiled it and the next one, which loaded it), and the same patch must give the same bytes.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numba import types
from numba.core.ccallback import CFunc
from numba.core.registry import CPUDispatcher
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic
from numpy.typing import NDArray

from underfoot.kernel_cache import KernelCache, options_text
from underfoot.layouts import LOWERING

Floats = NDArray[np.float64]
"""What kernels compute on: contiguous arrays of float64."""


_OPTIONS = {"nopython": True, "nogil": True, "error_model": "numpy"}


class _Dispatcher(CPUDispatcher):
    """Compiles a kernel once for all integers, not for a literal 0 anew: half the time that all kernels take."""

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What Numba asks where one kernel calls another."""
        return super().get_call_template([types.unliteral(one) for one in args], kws)


def kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel whose bits do not depend on how a stretch of frames is split, nor on who compiled it."""
    return _kept(function, {})


def modal_kernel(function: Callable[..., Any]) -> Any:
    """Compile a kernel whose inner loop runs over modes: it may contract, and re-associate sums over modes."""
    return _kept(function, {"fastmath": {"contract", "nsz", "arcp", "reassoc"}})


def inlined(function: Callable[..., Any]) -> Any:
    """A part of kernels that is compiled into each: what runs in every frame."""
    options = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return _Dispatcher(function, targetoptions=_OPTIONS | options)


def callback(signature: Any, function: Callable[..., Any]) -> CFunc:
    """A kernel that is called by its address: compiled, or loaded, at once."""
    compiled: Any = CFunc(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
    compiled._cache = KernelCache(function, f"callback {signature} {LOWERING}")
    compiled.compile()
    return compiled


def _kept(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    dispatcher = _Dispatcher(function, targetoptions=_OPTIONS | options)
    dispatcher._cache = KernelCache(function, f"{options_text(options)} {LOWERING}")
    return dispatcher


def modal_inlined(function: Callable[..., Any]) -> Any:
    """A part of modal kernels that is compiled into each. It may contract; its sums stay in their order."""
    options = {"forceinline": True, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}
    return _Dispatcher(function, targetoptions=_OPTIONS | options | {"fastmath": {"contract", "nsz"}})


@intrinsic
def widest(context: Any) -> Any:
    """Let the loops of the kernel that calls this use the processor's widest vectors.

    The compiler prefers half of them where there are 512 bits. Long loops over modes gain a quarter to a third from all
    (measured at 64 and 200 modes); short loops, of which everything else is made, lose.
    """

    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')  # past llvmlite's list of known names
        return context.get_dummy_value()

    return types.void(), code
