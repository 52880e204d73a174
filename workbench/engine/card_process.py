"""Sound cards in a process of their own: PortAudio waits without end for a server that hangs, and lists cards once.

Whoever asks waits for some seconds. Then the process is killed, and the reason is one line.
"""

import threading
import time
from collections import deque
from collections.abc import Callable
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any

from msgspec import Struct

from underfoot.engine.child_process import ChildProcess, leave_to_session, wait_for_any
from underfoot.errors import DeviceError, UnderfootError

ANSWER_S = 5.0
"""Time in seconds that PortAudio has to find or open a card, or to close it, beside what it plays."""
SILENT_CARD = "the sound card and its server do not answer; look whether other programs sound, and try again"
_BEGIN_S = 60.0  # until a process is there and has imported what it needs, on a busy machine
_END_S, _LOOK_S = 1.0, 0.1
"""Time that the process has to close what it made, and between two looks whether it lives."""


class CardProcess:
    """What `make(*given)` returns, if anything, in a process of its own. Arguments and results are pickled.

    `DeviceError` where the card does not answer; the next call then makes everything anew.
    """

    def __init__(self, make: Callable[..., object], *given: object) -> None:
        """Wait until it is made; raise its `UnderfootError` if that fails."""
        self._made_of = (make, *given)
        self._sending = threading.Lock()
        self._until_s = 0.0
        self._answers = deque[object]()
        self._process: ChildProcess | None = None
        self._begin()

    def call(self, name: str, *arguments: object, within_s: float = 0.0) -> Any:  # noqa: ANN401 - of the method
        """Return what a method returns, or raise its error. It may take `within_s` seconds, and `ANSWER_S`."""
        process = self._process or self._begin()
        self._until_s = time.perf_counter() + within_s + ANSWER_S
        self._send(process, _Call(name, arguments))
        return self._answer(process)

    def tell(self, name: str) -> None:
        """Have a method called at once, also during a call, from any thread. A call then ends within `ANSWER_S`."""
        process = self._process
        if process is not None:
            self._until_s = min(self._until_s, time.perf_counter() + ANSWER_S)
            self._send(process, _Call(name))

    @property
    def is_there(self) -> bool:
        """Whether the process, and what it made, is there."""
        return self._process is not None and self._process.is_alive

    def close(self) -> None:
        """End the process, which closes what it made."""
        self._end(_END_S)

    def _end(self, within_s: float) -> None:
        process, self._process = self._process, None
        self._answers.clear()
        if process is not None:
            process.end(within_s)

    def _begin(self) -> ChildProcess:
        self._process = process = ChildProcess("sound card", __name__, *self._made_of)
        try:
            for within_s in (_BEGIN_S, ANSWER_S):
                self._until_s = time.perf_counter() + within_s
                self._answer(process)
        except BaseException:
            self._end(0.0)
            raise
        return process

    def _send(self, process: ChildProcess, call: "_Call") -> None:
        with self._sending:
            process.send(call)

    def _answer(self, process: ChildProcess) -> object:
        """Return the next answer; where it is the error of a device, or does not come, end the process."""
        while not self._answers:
            is_over = not process.is_alive
            self._answers.extend(process.receive())
            if not self._answers and (is_over or time.perf_counter() > self._until_s):
                self._end(0.0)
                raise DeviceError("the process of the sound card ended; try again" if is_over else SILENT_CARD)
            if not self._answers:
                wait_for_any((process,), _LOOK_S)
        answer = self._answers.popleft()
        if isinstance(answer, DeviceError):
            self._end(0.0)
        if isinstance(answer, UnderfootError):
            raise answer
        return answer


class _Call(Struct, frozen=True):
    """A call of a method, which is answered; or, without arguments, of one that is not, and does not wait."""

    name: str
    arguments: tuple[object, ...] | None = None


def run(connection: Connection, make: Callable[..., object], *given: object) -> None:
    """Make what uses a card, and do what is asked until the connection ends; the main function of the process."""
    leave_to_session("SIGINT", "SIGHUP")
    connection.send(None)  # from now on it is the card that is waited for
    calls = SimpleQueue[_Call | None]()
    try:
        made: Any = make(*given)
        connection.send(None)
        threading.Thread(target=_receive, args=(connection, made, calls), name="calls", daemon=True).start()
        while (call := calls.get()) is not None:
            connection.send(_done(made, call))
        if made is not None:
            made.close()
    except UnderfootError as error:
        connection.send(error)
    except OSError:
        return  # nobody waits for the answer


def _receive(connection: Connection, made: Any, calls: SimpleQueue[_Call | None]) -> None:  # noqa: ANN401 - as made
    """Take calls off the connection; what is not answered is done at once, beside the call that is being done."""
    try:
        while isinstance(call := connection.recv(), _Call):
            if call.arguments is None:
                getattr(made, call.name)()
            else:
                calls.put(call)
    except (EOFError, OSError):
        calls.put(None)


def _done(made: Any, call: _Call) -> object:  # noqa: ANN401 - as made
    """Return what a call returns, or its error."""
    try:
        return getattr(made, call.name)(*(call.arguments or ()))
    except UnderfootError as error:
        return error
