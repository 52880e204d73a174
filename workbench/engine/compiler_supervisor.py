"""Supervision of the compiler: one process, started when first needed, and the requests whose answers still count."""

from typing import Any

from underfoot.engine.child_process import ChildProcess
from underfoot.engine.engine_supervisor import END_S
from underfoot.engine.reports import Compiled, Outlines, Preview
from underfoot.engine.requests import CompileRequest, ErrorCurveRequest, OutlinesRequest, PreviewRequest

SHARED = -1
"""Ticket of a request to compile the program that the engine is loading; its answer is not used."""


class CompilerSupervisor:
    """The compiler's process. A new request to compile, or for a picture, replaces the earlier one.

    Pictures are previews and outlines. A process started in place of a dead one is sent the awaited picture again, but
    not the patch to compile.
    """

    def __init__(self) -> None:
        self._process: ChildProcess | None = None
        self._ticket = self._compile_ticket = 0
        self._awaited: PreviewRequest | OutlinesRequest | None = None

    @property
    def pids(self) -> dict[str, int]:
        """The process id by name; empty without a process."""
        return {"compiler": self._process.pid} if self._process is not None else {}

    @property
    def is_started(self) -> bool:
        """Whether there is a process."""
        return self._process is not None

    @property
    def awaits_picture(self) -> bool:
        """Whether a picture was requested and has not come yet."""
        return self._awaited is not None

    def new_ticket(self) -> int:
        """Return the ticket of the next request."""
        self._ticket += 1
        return self._ticket

    def start(self, *first: CompileRequest) -> None:
        """Start the process, if there is none, with these requests, then the awaited picture."""
        if self._process is None:
            self._process = ChildProcess("compiler", "underfoot.engine.compiler")
            for request in (*first, *filter(None, [self._awaited])):
                self._process.send(request)

    def compile(self, request: CompileRequest) -> None:
        """Compile a patch's kernels, in a new process if necessary; `Compiled` follows."""
        self._compile_ticket = request.ticket
        if self._process is None:
            self.start(request)
        else:
            self._process.send(request)

    def request_picture(self, request: PreviewRequest | OutlinesRequest) -> None:
        """Request a picture: at once if there is a process, or when it starts."""
        self._awaited = request
        if self._process is not None:
            self._process.send(request)

    def measure_errors(self, request: ErrorCurveRequest) -> None:
        """Request an error curve, if there is a process."""
        if self._process is not None:
            self._process.send(request)

    def receive(self) -> list[Any]:
        """Return the answers, without those to compile requests that were replaced."""
        answers = self._process.receive() if self._process is not None else []
        for answer in answers:
            if (
                self._awaited is not None
                and isinstance(answer, Preview | Outlines)
                and answer.ticket == self._awaited.ticket
            ):
                self._awaited = None
        return [one for one in answers if not isinstance(one, Compiled) or one.ticket == self._compile_ticket]

    @property
    def has_died(self) -> bool:
        """Whether the process has ended."""
        return self._process is not None and not self._process.is_alive

    def reap(self) -> str:
        """Release a process that died, and return the reason."""
        assert self._process is not None
        reason, self._process = self._process.end(END_S), None
        return reason

    def close(self) -> None:
        """End the process; it has no unfinished work."""
        if self._process is not None:
            self._process.end(0.0)
