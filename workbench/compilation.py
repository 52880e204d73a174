"""What Numba is told of kernels. Only kernels that are called import this."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from numba import types
from numba.core.caching import NullCache
from numba.core.ccallback import CFunc
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

from underfoot.kernel_cache import KernelCache, options_text
from underfoot.kernels import Kernel
from underfoot.memory_lowering import LOWERING


class Dispatcher(CPUDispatcher):
    """Compiles a kernel once for all integers, not for a literal 0 anew: half the time that all kernels take."""

    @classmethod
    def of(cls, kernel: Kernel) -> "Dispatcher":
        """What compiles a kernel for the arguments that it is called with."""
        made = cls(kernel.py_func, targetoptions=dict(kernel.options))
        if kernel.is_kept:
            made._cache = KernelCache(kernel.py_func, f"{options_text(kernel.options)} {LOWERING}")
        return made

    def compile(self, sig: Any) -> Any:
        """Compile, or load, the form for a signature."""
        with released(self._cache):
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What Numba asks where one kernel calls another."""
        return super().get_call_template([types.unliteral(one) for one in args], kws)


def type_of_intrinsic(function: Callable[..., Any]) -> types.Type:
    """The type of an intrinsic of this definition."""
    context = cpu_target.typing_context
    made = intrinsic(function)
    context.refresh()
    return context.resolve_value_type(made)


def compiled_callback(signature: Any, function: Callable[..., Any]) -> CFunc:
    """The function, compiled for this signature, or loaded."""
    compiled: Any = CFunc(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
    compiled._cache = KernelCache(function, f"callback {signature} {LOWERING}")
    with released(compiled._cache):
        compiled.compile()
    return compiled


@contextmanager
def released(kept: KernelCache | NullCache) -> Iterator[None]:
    """Let nobody wait for a kernel that could not be compiled."""
    try:
        yield
    finally:
        if isinstance(kept, KernelCache):
            kept.release()
