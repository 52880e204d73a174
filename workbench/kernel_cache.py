"""Cache of compiled kernels on disk, each under a digest of everything that its machine code depends on.

Numba's own cache checks the kernel's source file: it recompiles after an edited comment, and misses a change in a
function that the kernel calls from another file. Here a kernel's digest covers its bytecode, the constants that it
reads, and the digests of what it calls. Comments, docstrings and line numbers do not count.

A kernel is loaded without the data that only the compiler needs, which would take three times as long.
"""

import hashlib
import pickle
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from functools import cache, cached_property
from importlib import import_module
from pathlib import Path
from types import CodeType, FunctionType, ModuleType
from typing import Any
from zlib import crc32

import llvmlite.binding as llvm
from numba.core.base import BaseContext
from numba.core.caching import CompileResultCacheImpl, FunctionCache, IndexDataCacheFile, NullCache, _CacheLocator
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import CompileResult
from numba.core.environment import Environment, lookup_environment
from numba.core.runtime import rtsys
from numba.core.targetconfig import ConfigStack
from numba.core.typing.templates import Signature

from underfoot.files import cache_folder

_KEPT = 4
"""Digests kept per kernel: for several checkouts, or for the version before the last edit."""
_LONGEST_COMPILE_S = 60.0
"""Longest wait for another process that compiles the same kernel."""
_LIBRARIES = frozenset({"llvmlite", "numba", "numpy"}) | sys.stdlib_module_names
"""Libraries whose results depend on their version alone, which is in Numba's index or the file's name; the objects they
read may differ between processes, such as `sys.modules`."""


class KernelCache:
    """Cache of the compiled versions of `function`, for Numba. The digest is taken at first use, when all names exist.

    If the folder cannot be written to, every process compiles the kernels that are not in it.
    """

    def __init__(self, function: Callable[..., Any], options: str) -> None:
        assert isinstance(function, FunctionType)
        self._function, self._options = function, options

    def load_overload(self, signature: Signature, context: BaseContext) -> CompileResult | None:
        """Return the version compiled for a signature, or None: then this process must compile it, and others wait."""
        found = self._load(signature, context)
        if found is None and isinstance(self._files, _Files):
            with suppress(OSError):  # a wait that timed out raises an OSError, too: then compile as well
                self._files.lock()
            found = self._load(signature, context)
        if found is None:
            _leave_blas_out()
        return found

    def save_overload(self, signature: Signature, compiled: CompileResult) -> None:
        """Store a compiled version; the oldest digests are deleted. Without room it is only kept in memory."""
        with suppress(OSError):  # the disk is full, or another process has just deleted the same digests
            self._files.save_overload(signature, compiled)
            if isinstance(self._files, _Files):
                _prune(self._files.stem)

    def release(self) -> None:
        """Let other processes that wait for this one compile it."""
        if isinstance(self._files, _Files):
            self._files.unlock()

    def _load(self, signature: Signature, context: BaseContext) -> CompileResult | None:
        try:
            return self._files.load_overload(signature, context)
        except Exception:  # damaged, or with another checkout's types: unpickling can raise anything
            with suppress(OSError):
                self._files.flush()
            return None

    @property
    def cache_path(self) -> str | None:
        """Folder of the cache."""
        return self._files.cache_path

    @cached_property
    def _files(self) -> "_Files":
        try:
            return _Files(self._function, digest(self._function, self._options))
        except OSError:
            return NullCache()


@cache
def _leave_blas_out() -> None:
    """Keep Numba from importing SciPy's linear algebra with its first kernel: 0.15 s for code that no kernel uses."""
    from numba.np import linalg

    def none() -> None:
        raise ImportError

    found, linalg.ensure_blas = linalg.ensure_blas, none
    try:
        import_module("numba.np.arraymath")
    finally:
        linalg.ensure_blas = found


def digest(function: FunctionType, options: str = "") -> str:
    """Return the digest of a kernel's machine code, apart from signature, processor and Numba's version.

    >>> def twice(x): return 2.0 * x
    >>> def thrice(x): return 3.0 * x
    >>> def commented(x):
    ...     '''Three times.'''
    ...     return 3.0 * x  # of x
    >>> digest(twice) == digest(thrice), digest(commented) == digest(thrice)
    (False, True)
    """
    found = hashlib.sha256(options.encode())
    reached, waiting = {function}, [function]
    while waiting:
        own, called = _own(waiting.pop())
        found.update(own)
        waiting += [one for one in called if one not in reached]
        reached.update(called)
    return found.hexdigest()


def options_text(options: dict[str, Any]) -> str:
    """Return compiler options in a fixed order; the order of a set differs between processes."""
    return repr(sorted((name, sorted(flags) if isinstance(flags, set) else flags) for name, flags in options.items()))


@cache
def _own(function: FunctionType) -> tuple[bytes, tuple[FunctionType, ...]]:
    """Return the digest of a function's own code and constants, and the functions that it calls."""
    code = function.__code__
    names = sorted(_names(code))
    cells = zip(code.co_freevars, (cell.cell_contents for cell in function.__closure__ or ()), strict=True)
    values = [*cells, *((name, function.__globals__[name]) for name in names if name in function.__globals__)]
    for name, value in list(values):
        if isinstance(value, ModuleType) and not _is_library(value.__name__):
            values += [(f"{name}.{one}", vars(value)[one]) for one in names if one in vars(value)]
    called = [found for _, value in values if (found := _function_of(value)) is not None]
    parts = [*_code_parts(code, function.__doc__), repr(function.__defaults__)]
    parts += [f"{name} {_value_text(value)}" for name, value in values]
    return hashlib.sha256("\0".join(parts).encode()).digest(), tuple(called)


def _code_parts(code: CodeType, doc: str | None = None) -> Iterator[str]:
    yield f"{code.co_argcount} {code.co_names} {code.co_varnames} {code.co_code.hex()}"
    for place, constant in enumerate(code.co_consts):
        if isinstance(constant, CodeType):
            yield from _code_parts(constant)
        elif isinstance(constant, frozenset):
            yield repr(sorted(constant, key=repr))
        else:
            yield repr(None if place == 0 and constant == doc else constant)


def _names(code: CodeType) -> set[str]:
    """Return every name that is looked up, also in nested functions."""
    return set(code.co_names).union(*(_names(part) for part in code.co_consts if isinstance(part, CodeType)))


def _function_of(value: object) -> FunctionType | None:
    """Return the Python function behind a kernel, an intrinsic or our own function; None for anything else."""
    function = getattr(value, "py_func", value)
    return function if isinstance(function, FunctionType) and not _is_library(function.__module__) else None


def _is_library(module: str) -> bool:
    return module.partition(".")[0] in _LIBRARIES


def _value_text(value: object) -> str:
    """Return the part of a value that machine code can depend on, except functions, which have their own digest."""
    if isinstance(value, ModuleType) or _function_of(value) is not None:
        return options_text(getattr(value, "options", {}))
    if isinstance(value, type):
        arrays = value.__annotations__ if hasattr(value, "_fields") else ""  # of `array_tables`, with their data types
        return f"{value.__module__}.{value.__qualname__} {arrays}"
    text = value.tobytes().hex() if hasattr(value, "tobytes") else repr(value)
    return text if " at 0x" not in text else type(value).__qualname__


class _Locator(_CacheLocator):
    """Tells Numba the location of a kernel's files, and their source stamp."""

    def __init__(self, function: FunctionType, mark: str) -> None:
        self._py_file, self._mark = function.__code__.co_filename, mark

    def get_cache_path(self) -> str:
        return str(cache_folder() / "kernels")

    def get_source_stamp(self) -> str:
        return self._mark

    def get_disambiguator(self) -> str:
        return self._mark[:16]


_CALLED: ContextVar[str | None] = ContextVar("called", default=None)


@contextmanager
def called(name: str) -> Iterator[None]:
    """Name the function compiled in this block that is called from outside, "" for none.

    What it calls is a part of it, Numba's own functions too, but for what Python can call.
    """
    before = _CALLED.set(name)
    try:
        yield
    finally:
        _CALLED.reset(before)


class _PartCodegen:
    """What Numba asks of the code generator of a part."""

    def set_env(self, name: str, environment: Environment) -> None:
        """Do nothing."""


class _Library(JITCodeLibrary):
    """Machine code of a kernel. For loaded code, bitcode is read only when another kernel that calls it is compiled.

    A part is optimised within the kernels that call it, and gets no machine code of its own.
    """

    _loaded: tuple[bytes, bytes] | None = None

    def __init__(self, codegen: JITCPUCodegen, name: str) -> None:
        super().__init__(codegen, name)
        from_outside, flags = _CALLED.get(), ConfigStack.top_or_none()
        self._is_part = from_outside not in (None, name) and flags is not None and flags.no_cpython_wrapper

    def _optimize_functions(self, module: llvm.ModuleRef) -> None:
        """Optimise what a module defines. Numba also sets up the passes for what it only declares: nine of ten."""
        module.data_layout = self._codegen._data_layout
        for function in module.functions:
            if not function.is_declaration:
                passes, builder = self._codegen._function_pass_manager()
                passes.run(function, builder)

    def _optimize_final_module(self) -> None:
        if not self._is_part:
            super()._optimize_final_module()

    def _finalize_final_module(self) -> None:
        if self._is_part:
            self._finalize_dynamic_globals()
            self._finalized = True
            return
        super()._finalize_final_module()
        for variable in self._final_module.global_variables:  # environments of the parts that it contains
            environment = lookup_environment(variable.name)
            if environment is not None:
                self._codegen.set_env(variable.name, environment)

    @property
    def codegen(self) -> "JITCPUCodegen | _PartCodegen":
        """The code generator; for a part, one that sets no environment: its variable is in its callers' code."""
        return _PartCodegen() if self._is_part else self._codegen

    @classmethod
    def _unserialize(cls, codegen: JITCPUCodegen, state: tuple[str, str, tuple[bytes, bytes]]) -> "_Library":
        name, _, (code, bitcode) = state
        made = cls(codegen, name)
        made._loaded = code, bitcode
        made.enable_object_caching()
        made._set_compiled_object(code)
        made._finalize_final_module()
        return made

    def get_pointer_to_function(self, name: str) -> int:
        """Return the address of a function, or 0."""
        if self._loaded is not None and name.encode() + b"\0" in self._loaded[0]:
            self._codegen._engine._defined_symbols.add(name)
        return super().get_pointer_to_function(name)

    def _get_module_for_linking(self) -> llvm.ModuleRef:
        if self._loaded is not None:
            self._shared_module, self._loaded = llvm.parse_bitcode(self._loaded[1]), None
            self._codegen._engine._load_defined_symbols(self._shared_module)
        return super()._get_module_for_linking()


class _Results(CompileResultCacheImpl):
    """Content of Numba's files of a kernel."""

    def reduce(self, compiled: CompileResult) -> tuple[object, ...]:
        """Return a compiled version as plain data, without the environments of library functions: only exceptions that
        a kernel does not raise read those, and loading one imports its module."""
        *data, environments = super().reduce(compiled)
        own = tuple(environment for environment in environments if not _is_library(environment.globals["__name__"]))
        return *data, own


class _CheckedFile(IndexDataCacheFile):
    """Numba's pair of files, with a checksum at their ends, where unpickling ignores it.

    After a power cut, zeros in machine code would end every process that loads it, and another bit would give other
    numbers.
    """

    def _dump(self, content: object) -> bytes:
        data: bytes = super()._dump(content)
        return data + crc32(data).to_bytes(4)

    def _load_data(self, name: str) -> object:
        data = Path(self._data_path(name)).read_bytes()
        if crc32(data[:-4]).to_bytes(4) != data[-4:]:
            raise ValueError(f"{name} is damaged")
        return pickle.loads(data)


class _Files(FunctionCache):
    """Numba's files of one kernel, under its digest."""

    def __init__(self, function: FunctionType, mark: str) -> None:
        locator = _Locator(function, mark)
        self._can_write = True
        try:
            locator.ensure_cache_path()
        except OSError:
            if not Path(locator.get_cache_path()).is_dir():
                raise
            self._can_write = False  # another user's, or a container's: what is in it is loaded all the same

        class Located(_Results):
            _locator_classes = (type("Here", (), {"from_function": staticmethod(lambda *_: locator)}),)

        self._impl_class = Located
        self._lock: Any = None
        super().__init__(function)
        self._cache_file = _CheckedFile(self.cache_path, self._impl.filename_base, mark)

    def load_overload(self, signature: Signature, context: BaseContext) -> CompileResult | None:
        """Return a compiled version, or None. Unlike Numba's, it does not fill the context with types and functions for
        the compiler: the compiler does that itself."""
        rtsys.initialize(context)
        context.codegen()._library_class = _Library
        return self._load_overload(signature, context)

    def lock(self) -> None:
        """Wait until no other process compiles this kernel; none can that keeps it, if the folder is read-only."""
        if not self._can_write:
            return
        from filelock import FileLock  # 50 ms, and only needed for compiling

        path = Path(self.cache_path, f"{self._impl.filename_base}.lock")
        if self._lock is None:
            self._lock = FileLock(path, _LONGEST_COMPILE_S, thread_local=False)
        self._lock.acquire(poll_interval=0.01)

    def unlock(self) -> None:
        """Let another process compile it."""
        if self._lock is not None:
            self._lock.release()
            if not self._lock.is_locked:
                self._lock = None  # one that exists when a process is forked is of no use to the fork

    @property
    def stem(self) -> Path:
        """Common prefix of the files of all digests of this kernel."""
        return Path(self.cache_path, self._impl.filename_base.rpartition("-")[0])


def _prune(stem: Path) -> None:
    """Remove all but the newest digests of a kernel; another process may do the same at the same time."""
    found = list(stem.parent.glob(f"{stem.name}-*.nbi"))
    if len(found) <= _KEPT:
        return
    for old in sorted(found, key=lambda path: path.stat().st_mtime)[:-_KEPT]:
        for path in [old, old.with_suffix(".lock"), *old.parent.glob(f"{old.stem}.*.nbc")]:
            path.unlink(missing_ok=True)
