"""Processes of a session: started, spoken to, ended, and not started again for ever."""

import multiprocessing
import os
import sys
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from multiprocessing import connection
from pathlib import Path
from typing import Any

from underfoot.patch.node_files import NodeFile, running

ORPHAN_S = 15.0
"""How long a process may still close what it has open when the one that started it is gone."""


class ChildProcess:
    """A process that runs a module's `run(connection, *given)`, and the connection to it. It alone imports the module.

    `daemon` ones are killed where whoever started them ends without a word.
    """

    def __init__(self, name: str, module: str, *given: Any, daemon: bool = True) -> None:
        _require_guard()
        context = multiprocessing.get_context("spawn")  # a fork would take over threads' locks and the card's handles
        self.name = name
        self._connection, theirs = context.Pipe()
        self._nodes = running()
        self._process = context.Process(
            target=_run, args=(module, theirs, self._nodes, *given), name=f"underfoot {name}", daemon=daemon
        )
        self._process.start()
        theirs.close()

    @property
    def pid(self) -> int:
        """The number that the system knows it by."""
        return self._process.pid or 0

    @property
    def is_alive(self) -> bool:
        """Whether it runs."""
        return self._process.is_alive()

    @property
    def has_failed(self) -> bool:
        """Whether it ended otherwise than by returning."""
        return self._process.exitcode != 0

    def send(self, message: object) -> None:
        """Send a message; one to a process that died is dropped, since the next one is told all that it must know.

        Custom nodes that this process runs by now go before it.
        """
        try:
            nodes = running()
            if nodes != self._nodes:
                self._nodes = nodes
                self._connection.send(_Nodes(nodes))
            self._connection.send(message)
        except OSError:
            return

    def receive(self) -> list[Any]:
        """What it has sent since, also where it has died since."""
        messages = []
        try:
            while self._connection.poll():
                messages.append(self._connection.recv())
        except (EOFError, OSError):
            return messages
        return messages

    def hang_up(self) -> None:
        """Close the connection, which asks the process to end."""
        self._connection.close()

    def kill(self) -> None:
        """End it at once, whatever it does."""
        self._process.kill()

    def end(self, within_s: float) -> str:
        """Hang up, wait, kill it if that takes too long, and say how it ended."""
        self.hang_up()
        self._process.join(within_s)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        code = self._process.exitcode
        self._process.close()
        return f"signal {-code}" if code is not None and code < 0 else f"exit status {code}"


def engine_process() -> ChildProcess:
    """An engine, which loads what every engine needs and waits for its `Setup`."""
    return ChildProcess("engine", "underfoot.engine.process")


def _require_guard() -> None:
    """End a script that would start itself without end, in one line: each process that it starts reads it again.

    What stands behind a guard is not read then. A program that is run as a package, and a notebook, are not read at
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


@dataclass(frozen=True)
class _Nodes:
    """Files of nodes that a person has agreed to run, of which a process is told before it needs them."""

    files: tuple[NodeFile, ...]


class _Listening:
    """A child's end of the connection, which takes for itself what is said of nodes."""

    def __init__(self, connection: Any) -> None:
        self._connection = connection

    def __getattr__(self, name: str) -> Any:
        return getattr(self._connection, name)

    def recv(self) -> Any:
        """The next message for the process."""
        message = self._connection.recv()
        while isinstance(message, _Nodes):
            _run_nodes(message.files)
            message = self._connection.recv()
        return message


def _run_nodes(files: tuple[NodeFile, ...]) -> None:
    if files:  # else nothing of nodes need be loaded here
        import_module("underfoot.patch.own_nodes").run_received(files)


def _run(module: str, connection: Any, nodes: tuple[NodeFile, ...], *given: Any) -> None:
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()
    _run_nodes(nodes)
    import_module(module).run(_Listening(connection), *given)


def _end_with_parent() -> None:
    """End this process some time after the one that started it, whatever it is busy with: compiling, say.

    One that listens ends by itself, and sooner, because its connection does.
    """
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        time.sleep(ORPHAN_S)
        os._exit(1)


def wait_for_any(children: Iterable[ChildProcess], within_s: float) -> None:
    """Wait until one of them has sent something, or has died."""
    connection.wait([child._connection for child in children], within_s)


class RestartLimit:
    """Says whether processes that died may be started again: not when more than `most` did so within `within_s`."""

    def __init__(self, most: int, within_s: float) -> None:
        self._most, self._within_s = most, within_s
        self._deaths: list[float] = []

    def allows_after_death(self) -> bool:
        """Count a death, now; whether what died may be started again."""
        now = time.monotonic()
        self._deaths = [when for when in self._deaths if now - when < self._within_s] + [now]
        return len(self._deaths) <= self._most
