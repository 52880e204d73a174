"""Progress report of a command while kernels are compiled, which takes half a minute at first use."""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from underfoot.commands.telling import tell
from underfoot.files import cache_refusal
from underfoot.quantities import counted

if TYPE_CHECKING:
    from underfoot.engine.child_process import ChildProcess
    from underfoot.engine.requests import CompileRequest

_EVERY_S = 1.0


@contextmanager
def report_compiling(request: "Callable[[], CompileRequest] | None" = None) -> Iterator[None]:
    """Report on standard error, once a second, while kernels are compiled in this block.

    With a request, made when the first kernel is compiled, another process compiles what it asks for as well.
    """
    from numba.core import event

    reporter = _CompileReporter(request)

    class CompileListener(event.Listener):
        def on_start(self, event: event.Event) -> None:
            reporter.start()

        def on_end(self, event: event.Event) -> None:
            reporter.end()

    try:
        with event.install_listener("numba:compile", CompileListener()):
            yield
    finally:
        reporter.stop()


@dataclass
class _CompileReporter:
    """A line on standard error that is written anew as time goes by, until what was begun is compiled."""

    request: "Callable[[], CompileRequest] | None"
    begun: int = 0
    count: int = 0
    _began_s: float = 0.0
    _ended_s: float = 0.0
    _compiler: "ChildProcess | None" = None
    _thread: threading.Thread | None = None
    _done: threading.Event = field(default_factory=threading.Event)

    def start(self) -> None:
        """Note that a kernel is being compiled."""
        if self.count == self.begun:
            self._began_s += time.perf_counter() - self._ended_s  # both are 0 at first; later the pause does not count
        self.begun += 1
        if self._thread is not None:
            return
        if self.request is not None:
            from underfoot.engine.child_process import ChildProcess

            self._compiler = ChildProcess("compiler", "underfoot.engine.compiler")
            self._compiler.send(self.request())
        self._thread = threading.Thread(target=self._tell, name="compiling", daemon=True)
        self._thread.start()

    def end(self) -> None:
        """Note that a kernel was compiled."""
        self._ended_s = time.perf_counter()
        self.count += 1

    def stop(self) -> None:
        """Note that the block has ended."""
        if self._thread is None:
            return
        self._done.set()
        self._thread.join()
        if self._compiler is not None:
            self._compiler.end(0.0)

    def _tell(self) -> None:
        again = "\r" if sys.stderr.isatty() else ""
        tell("first use: compiling kernels, which takes up to a minute")
        told = 0
        while not self._done.wait(_EVERY_S if again else 5 * _EVERY_S):
            if told < self.begun:  # a session goes on for weeks
                told = self.count
                self._line(again, "" if again and told < self.begun else "\n")
        if told < self.begun:
            self._line(again, "\n")
        if refusal := cache_refusal():
            tell(refusal)

    def _line(self, begin: str, end: str) -> None:
        kernels = counted(self.count, "kernel")
        until_s = time.perf_counter() if self.count < self.begun else self._ended_s
        text = f"underfoot: {kernels} compiled in {until_s - self._began_s:.0f} s"
        print(f"{begin}{text}", end=end, file=sys.stderr, flush=True)
