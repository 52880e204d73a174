"""Child processes of a session: start, send and receive, end."""

import gc
import multiprocessing
import os
import signal
import sys
import threading
import time
from _thread import interrupt_main
from collections import deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing import connection, resource_tracker
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from msgspec import Struct

from underfoot.patch.node_files import NodeFile, running

ORPHAN_S = 15.0
"""Time in seconds that a process has to close its files and devices after its parent is gone."""


class ChildProcess:
    """A process that runs `run(connection, *given)` of a module, which only it imports, and the connection to it.

    If `daemon`, it is killed when its parent ends.
    """

    def __init__(self, name: str, module: str, *given: object, daemon: bool = True) -> None:
        _require_guard()
        run_tracker()
        context = multiprocessing.get_context("spawn")  # a fork would inherit threads' locks and the card's handles
        self.name = name
        self._connection, theirs = context.Pipe()
        self._nodes = running()
        self._process = context.Process(
            target=_run, args=(module, theirs, self._nodes, *given), name=f"underfoot {name}", daemon=daemon
        )
        with held_back(signal.SIGINT):  # Ctrl-C goes to all processes, and this one may only be importing yet
            self._process.start()
        theirs.close()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid or 0

    @property
    def is_alive(self) -> bool:
        """Whether it is running."""
        return self._process.is_alive()

    def send(self, message: object) -> None:
        """Send a message; dropped if the process has died, since its successor receives the full state.

        Custom nodes registered in the meantime are sent first.
        """
        with suppress(OSError):
            nodes = running()
            if nodes != self._nodes:
                self._nodes = nodes
                self._connection.send(_Nodes(nodes))
            self._connection.send(message)

    def receive(self) -> list[Any]:
        """Return all messages received since the last call, also from a process that has died."""
        messages = []
        with suppress(EOFError, OSError):
            while self._connection.poll():
                messages.append(self._connection.recv())
        return messages

    def hang_up(self) -> None:
        """Close the connection, which asks the process to end."""
        self._connection.close()

    def kill(self) -> None:
        """Kill it at once."""
        self._process.kill()

    def end(self, within_s: float) -> str:
        """Close the connection, wait, kill the process after `within_s` seconds, and return how it ended."""
        self.hang_up()
        self._process.join(within_s)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        code = self._process.exitcode
        self._process.close()
        return f"signal {-code}" if code is not None and code < 0 else f"exit status {code}"

    def reap(self) -> str:
        """Release it once it has ended by itself; return how, if it failed, else ""."""
        failed = self._process.exitcode != 0
        how = self.end(0.0)
        return how if failed else ""


def engine_process() -> ChildProcess:
    """Start an engine process, which loads the common kernels and waits for its `Setup`."""
    return ChildProcess("engine", "underfoot.engine.process")


def run_tracker() -> None:
    """Start Python's process that removes shared memory, before anything else does, so that it outlives a terminal.

    It ignores Ctrl-C, but ends at SIGHUP, which the end of a terminal sends to all processes; this one would then start
    another, which knows nothing of the memory.
    """
    if hasattr(signal, "SIGHUP"):
        with held_back(signal.SIGHUP):
            resource_tracker.ensure_running()


@contextmanager
def held_back(*numbers: int) -> Iterator[None]:
    """Block signals, where the system can: in this thread in this block, and in what it starts until `let_through`."""
    if not hasattr(signal, "pthread_sigmask"):  # as on Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def let_through(*numbers: int) -> bool:
    """Let signals through again; return false, and hold them back still, if one of them has come."""
    if hasattr(signal, "pthread_sigmask"):
        if signal.sigpending() & {*numbers}:
            return False
        signal.pthread_sigmask(signal.SIG_UNBLOCK, numbers)
    return True


def leave_to_session(*names: str) -> None:
    """Ignore these signals, of those that the system has: the process that opened the session gets them, too.

    A shell sends Ctrl-C (SIGINT), and the end of its terminal (SIGHUP), to all processes of a command; a service
    manager, SIGTERM.
    """
    for name in names:
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)


def raise_at_end(connection: Connection, number: signal.Signals) -> None:
    """In a child process, raise a signal in the main thread once nobody waits for what it does."""
    assert isinstance(connection, _Listening)
    connection.raise_at_end(number)


def _require_guard() -> None:
    """Exit if the main script has no `__main__` guard: each child process would run it again and start more.

    Code behind a guard is not run there. A program run as a package, or a notebook, is not imported by children at
    all.
    """
    main = sys.modules["__main__"]
    path, spec = getattr(main, "__file__", None), getattr(main, "__spec__", None)
    if path is None or (spec is not None and spec.name.endswith("__main__")):
        return
    try:
        text = Path(path).read_text(encoding="utf-8", errors="replace")
    except OSError:
        return
    if "__name__" not in text and path.endswith(".py"):
        raise SystemExit(
            f'underfoot: {path} starts processes, each of which reads it again; put what it does into `if __name__ == "'
            '__main__":`'
        )


class _Nodes(Struct, frozen=True):
    """Custom node files that the user agreed to run, sent before the process needs them."""

    files: tuple[NodeFile, ...]


class _Listening:
    """A child's end of the connection, which handles messages about custom nodes itself.

    A thread takes the messages off the connection: while this process compiles, for example, the other one would wait
    for room in it.
    """

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._messages: deque[object] = deque()
        self._came = threading.Condition()
        threading.Thread(target=self._take, name="messages", daemon=True).start()

    def __getattr__(self, name: str) -> object:
        return getattr(self._connection, name)

    def poll(self, timeout: float | None = 0.0) -> bool:
        """Return whether there is a message, or the end of the connection, within so many seconds."""
        with self._came:
            return self._came.wait_for(lambda: bool(self._messages), timeout)

    def recv(self) -> object:
        """Return the next message for the process."""
        while self.poll(None) and not isinstance(self._messages[0], _End):
            message = self._messages.popleft()
            if not isinstance(message, _Nodes):
                return message
            _run_nodes(message.files)
        raise EOFError

    def raise_at_end(self, number: signal.Signals) -> None:
        """Raise a signal in the main thread once the connection has ended."""

        def wait() -> None:
            with self._came:
                self._came.wait_for(lambda: bool(self._messages) and isinstance(self._messages[-1], _End))
            if hasattr(signal, "pthread_kill"):
                signal.pthread_kill(threading.main_thread().ident or 0, number)
            else:  # there, nothing that waits can be interrupted, only what computes
                interrupt_main(number)

        threading.Thread(target=wait, name="end", daemon=True).start()

    def _take(self) -> None:
        try:
            while True:
                self._put(self._connection.recv())
        except (EOFError, OSError):
            return
        finally:
            self._put(_End())

    def _put(self, message: object) -> None:
        with self._came:
            self._messages.append(message)
            self._came.notify_all()


class _End(Struct, frozen=True):
    """The end of the connection."""


def _run_nodes(files: tuple[NodeFile, ...]) -> None:
    if files:  # otherwise nothing about nodes is loaded here
        import_module("underfoot.patch.custom_nodes").run_received(files)


def _run(module: str, connection: Connection, nodes: tuple[NodeFile, ...], *given: object) -> None:
    gc.set_threshold(100_000)  # or the interpreter looks through all that is being imported, again and again
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    _run_nodes(nodes)
    import_module(module).run(_Listening(connection), *given)
    gc.freeze()  # or it looks through all that was loaded as it ends


def _end_with_parent() -> None:
    """End this process `ORPHAN_S` after its parent, even while it is busy, for example compiling.

    A process that listens ends sooner by itself, when its connection closes.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        time.sleep(ORPHAN_S)
        os._exit(1)


def wait_for_any(children: Iterable[ChildProcess], within_s: float) -> None:
    """Wait until one of the children has sent something or died, at most `within_s` seconds."""
    connection.wait([child._connection for child in children], within_s)


class RestartLimit:
    """Limits restarts of processes that die: at most `most` deaths within `within_s` seconds."""

    def __init__(self, most: int, within_s: float) -> None:
        self._most, self._within_s = most, within_s
        self._deaths: list[float] = []

    def allows_after_death(self) -> bool:
        """Count a death now; return whether the process may be restarted."""
        now = time.perf_counter()
        self._deaths = [when for when in self._deaths if now - when < self._within_s] + [now]
        return len(self._deaths) <= self._most
