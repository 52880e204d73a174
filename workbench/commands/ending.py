"""The signals that end a command."""

import os
import signal
import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

_OUTPUTS = (1, 2)
_STUCK_S = 3.0
"""Seconds after a signal in which a command that computes has ended by itself."""


@contextmanager
def ended_by_signals(end: Callable[[], object]) -> Iterator[None]:
    """Call `end` in this block at Ctrl-C, at a request to end, and when the terminal is closed, as with a connection.

    What is printed from then on to a terminal that is closed is dropped. `nohup` is respected.
    """
    terminals = [output for output in _OUTPUTS if os.isatty(output)]

    def hang_up() -> None:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for output in terminals:
            os.dup2(nowhere, output)
        os.close(nowhere)
        end()

    calls = {signal.SIGINT: end, signal.SIGTERM: end}
    closed = getattr(signal, "SIGHUP", None)  # which Windows does not have
    if closed is not None and signal.getsignal(closed) != signal.SIG_IGN:
        calls[closed] = hang_up
    with ExitStack() as stack:
        for number, call in calls.items():
            stack.callback(signal.signal, number, signal.signal(number, lambda *_, call=call: call()))
        yield


@contextmanager
def interrupted_by_signals() -> Iterator[None]:
    """Raise `KeyboardInterrupt` in this block at these signals; end the process if the block goes on after that.

    Python waits with it until a kernel returns, which one of an own node may never do.
    """
    left = threading.Event()
    heard, told = socket.socketpair()
    told.setblocking(False)

    def watch() -> None:
        if heard.recv(1) and not left.wait(_STUCK_S):
            os._exit(130)

    watching = threading.Thread(target=watch, name="signals", daemon=True)
    with heard, ended_by_signals(interrupt):
        before = signal.set_wakeup_fd(told.fileno(), warn_on_full_buffer=False)
        watching.start()
        try:
            yield
        finally:
            left.set()
            signal.set_wakeup_fd(before)
            told.close()
            watching.join()


def interrupt() -> None:
    """Raise `KeyboardInterrupt`."""
    raise KeyboardInterrupt
