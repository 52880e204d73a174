"""What Numba is told of kernels. Only kernels that are called import this."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import FunctionType
from typing import Any

from numba import config, types
from numba.core.caching import NullCache
from numba.core.ccallback import CFunc
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.sigutils import normalize_signature
from numba.extending import intrinsic

from underfoot import lane_lowering, memory_lowering
from underfoot.kernel_cache import KernelCache, digest, options_text


class _Dispatcher(CPUDispatcher):
    """Compiles a kernel once for all integers, not for a literal 0 anew: half the time that all kernels take."""

    def compile(self, sig: Any) -> Any:
        """Compile, or load, the form for a signature."""
        with released(self._cache):
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """What Numba asks where one kernel calls another."""
        return super().get_call_template([types.unliteral(one) for one in args], kws)


def compiled(function: Callable[..., Any], options: dict[str, Any], is_kept: bool) -> Any:
    """What compiles a kernel for the arguments that it is called with, or the function where Numba is switched off."""
    if config.DISABLE_JIT:
        return function
    made = _Dispatcher(function, targetoptions=options)
    if is_kept:
        made._cache = KernelCache(function, f"{options_text(options)} {LOWERING}")
    return made


def type_of_intrinsic(function: Callable[..., Any]) -> types.Type:
    """The type of an intrinsic of this definition."""
    context = cpu_target.typing_context
    made = intrinsic(function)
    context.refresh()
    return context.resolve_value_type(made)


def compiled_callback(signature: Any, function: Callable[..., Any]) -> CFunc:
    """The function, compiled for this signature, or loaded."""
    callback: Any = CFunc(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
    callback._cache = KernelCache(function, f"callback {signature} {LOWERING}")
    with released(callback._cache):
        callback.compile()
    return callback


@contextmanager
def released(kept: KernelCache | NullCache) -> Iterator[None]:
    """Let nobody wait for a kernel that could not be compiled."""
    try:
        yield
    finally:
        if isinstance(kept, KernelCache):
            kept.release()


def _functions(module: str, named: Mapping[str, Any]) -> Iterator[FunctionType]:
    """Every function of a module, those of its classes too."""
    for value in named.values():
        if getattr(value, "__module__", "") == module:
            if isinstance(value, FunctionType):
                yield value
            elif isinstance(value, type):
                yield from _functions(module, vars(value))


LOWERING = "".join(
    digest(function)[:8]
    for module in (memory_lowering, lane_lowering)
    for function in _functions(module.__name__, vars(module))
)
"""What identifies how memories and lanes are compiled: part of every kernel's digest, which does not see what Numba
calls."""
