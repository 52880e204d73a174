"""Numba settings of kernels, imported only when a kernel is called."""

import dis
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import wraps
from types import FunctionType
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import config, types
from numba.core.caching import NullCache
from numba.core.ccallback import CFunc
from numba.core.errors import NumbaError, UnsupportedBytecodeError
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.sigutils import normalize_signature
from numba.core.typing.templates import AbstractTemplate, Signature
from numba.extending import intrinsic

from underfoot import lane_lowering, memory_lowering
from underfoot.errors import BadFile
from underfoot.kernel_cache import KernelCache, called, digest, options_text


class _Dispatcher(CPUDispatcher):
    """Compiles a kernel once for all integers, not again for a literal 0: half the compile time of all kernels."""

    is_part = False

    def compile(self, sig: Signature | tuple[types.Type, ...]) -> Callable[..., Any]:
        """Compile or load the version for a signature."""
        with released(self._cache), called("" if self.is_part else self.py_func.__qualname__):
            return super().compile(sig)

    def get_call_template(
        self, args: Sequence[types.Type], kws: Mapping[str, types.Type]
    ) -> tuple[type[AbstractTemplate], str, tuple[types.Type, ...], dict[str, types.Type]]:
        """Return the call template that Numba uses where one kernel calls another."""
        return super().get_call_template([types.unliteral(arg) for arg in args], kws)


llvm.ffi.lib._lock._cblist.clear()
"""Numba tells of each of LLVM's tens of thousands of calls twice, for timers that nobody reads."""

IS_DISABLED = bool(config.DISABLE_JIT)
"""Whether kernels run as plain Python (NUMBA_DISABLE_JIT=1)."""


def compiled(function: Callable[..., Any], options: dict[str, Any]) -> object:
    """Return the dispatcher that compiles a kernel for its argument types, or its plain form if Numba is disabled."""
    if IS_DISABLED:
        return _plain(function)
    made = _Dispatcher(function, targetoptions=options)
    made._cache = KernelCache(function, f"{options_text(options)} {LOWERING}")
    return made


def part(function: Callable[..., Any], options: dict[str, Any]) -> CPUDispatcher:
    """Return the dispatcher that compiles a kernel for others that call it. Python cannot: the interpreter crashes."""
    made = _Dispatcher(function, targetoptions={**options, "no_cpython_wrapper": True})
    made.is_part = True
    return made


def _plain(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that gives this one what it has in compiled code: records with attributes, NumPy's numbers."""

    @wraps(function)
    def call(*args: object) -> object:
        with np.errstate(all="ignore"):  # as compiled: 1 / 0 is infinite, and random bits wrap around
            return function(*map(_as_compiled, args))

    return call


def _as_compiled(value: object) -> object:
    if isinstance(value, float):
        return np.float64(value)
    if hasattr(value, "with_numpy_numbers"):
        return value.with_numpy_numbers()
    if isinstance(value, np.ndarray) and value.dtype.names:
        return value.view(np.recarray)
    if isinstance(value, np.void) and value.dtype.names:
        return value.view((np.record, value.dtype))
    if isinstance(value, tuple) and hasattr(value, "_make"):
        return value._make(map(_as_compiled, value))
    return value


def type_of_intrinsic(function: Callable[..., Any]) -> types.Type:
    """Return the type of an intrinsic with this definition."""
    context = cpu_target.typing_context
    made = intrinsic(function)
    context.refresh()
    return context.resolve_value_type(made)


def compiled_callback(signature: str | Signature, function: Callable[..., Any]) -> CFunc:
    """Return the function compiled for this signature, or loaded; `BadFile` names its file if it cannot be."""
    callback: Any = CFunc(function, normalize_signature(signature), locals={}, options={"error_model": "numpy"})
    callback._cache = KernelCache(function, f"callback {signature} {LOWERING}")
    with released(callback._cache), called(function.__qualname__):
        try:
            callback.compile()
        except (NumbaError, UnsupportedBytecodeError, AttributeError, TypeError) as error:
            line, reason = _fault(str(error))
            line = _line_of_name(reason, function) or line
            owner, _, name = function.__name__.rpartition("_")  # adapters are called so: Gain_run
            raise BadFile(f"{function.__code__.co_filename}{line}: {name} of {owner} {reason}") from error
    return callback


def _fault(text: str) -> tuple[str, str]:
    """Return the place in a file and the reason, on one line, of what Numba says on many.

    >>> _fault("Failed in nopython mode" + chr(10) + "NameError: name 'a' is not defined")
    ('', "cannot be compiled: NameError: name 'a' is not defined")
    """
    place = re.search(r'File "[^"]*", line (\d+):\n\s*def ', text)  # not of the adapter, which has no such line
    said = [line for line in map(str.strip, text.splitlines()) if line and not line.startswith(("Failed in", "During"))]
    reason = said[0] if said else text
    if reason.startswith("No implementation") and len(said) > 1:
        reason = f"there is no {said[1].removeprefix('>>> ')}"
    return (f", line {place[1]}" if place else ""), f"cannot be compiled: {reason[:300]}"


def _line_of_name(reason: str, adapter: Callable[..., Any]) -> str:
    """Return where a node's function, or a kernel of its file, reads what is not there: Numba says its name only."""
    named = re.search(r"NameError: name '(\w+)' is not defined", reason)
    functions = [value.py_func for value in adapter.__globals__.values() if hasattr(value, "py_func")]
    functions += [value.py_func for one in functions for value in one.__globals__.values() if hasattr(value, "py_func")]
    for code in (one.__code__ for one in functions if one.__code__.co_filename == adapter.__code__.co_filename):
        for read in dis.get_instructions(code):
            if named and read.opname == "LOAD_GLOBAL" and read.argval == named[1] and read.positions:
                return f", line {read.positions.lineno}"
    return ""


@contextmanager
def released(kept: KernelCache | NullCache) -> Iterator[None]:
    """Release the lock on a kernel that could not be compiled."""
    try:
        yield
    finally:
        if isinstance(kept, KernelCache):
            kept.release()


def _functions(module: str, named: Mapping[str, Any]) -> Iterator[FunctionType]:
    """Yield every function of a module, including those of its classes."""
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
"""Digest of the lowering of memories and lanes, part of every kernel's digest, which does not see the functions that
Numba calls."""
