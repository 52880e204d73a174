"""The signals that end a command."""

import os
import signal
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

_OUTPUTS = (1, 2)
_STUCK_S = 3.0
"""Seconds after a signal in which a command that computes has ended by itself."""


@contextmanager
def ended_by_signals(end: Callable[[], object]) -> Iterator[None]:
    """Call `end` in this block at Ctrl-C, at a request to end, and when the terminal is closed, as with a connection.

    What is printed from then on to a terminal that is closed is dropped. `nohup` is respected. A signal that was
    dropped earlier, in `raised_at_signals`, ends it at once.
    """
    with _told_of_signals(lambda number: end()):
        if _dropped:
            end()
        yield


@contextmanager
def raised_at_signals() -> Iterator[None]:
    """Raise `Interrupted` in this block at these signals.

    LLVM, which compiles kernels, drops what is raised while it calls Python, and Numba then fails for want of the code
    that was to be kept there: what was dropped is raised from that. Where nothing was dropped, errors are the block's
    own, also after a signal. Python drops it, too, in a callback at the end of each import, and the block goes on.
    """
    report = sys.unraisablehook

    def interrupt(number: int) -> None:
        raise Interrupted(number)

    def keep(unraisable: "sys.UnraisableHookArgs") -> None:
        if isinstance(unraisable.exc_value, Interrupted):
            _dropped.append(unraisable.exc_value)
        else:
            report(unraisable)

    sys.unraisablehook = keep
    try:
        with _told_of_signals(interrupt):
            yield
    except Exception as error:
        if _dropped:
            raise _dropped[0] from error
        raise
    finally:
        sys.unraisablehook = report
        _dropped.clear()


@contextmanager
def interrupted_by_signals() -> Iterator[None]:
    """Raise `Interrupted` in this block at these signals; end the process if the block goes on after that.

    Python waits with it until a kernel returns, which one of an own node may never do.
    """
    left = threading.Event()
    heard, told = socket.socketpair()
    told.setblocking(False)

    def watch() -> None:
        number = heard.recv(1)
        if number and not left.wait(_STUCK_S):
            os._exit(_status(number[0]))

    watching = threading.Thread(target=watch, name="signals", daemon=True)
    with heard, raised_at_signals():
        before = signal.set_wakeup_fd(told.fileno(), warn_on_full_buffer=False)
        watching.start()
        try:
            yield
        finally:
            left.set()
            signal.set_wakeup_fd(before)
            told.close()
            watching.join()


class Interrupted(KeyboardInterrupt):
    """A signal ends the command; `status` is its exit status, which tells a shell or a service manager the signal."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.status = _status(number)


_dropped: list[Interrupted] = []
"""What was raised in `raised_at_signals`, and dropped."""


def _status(number: int) -> int:
    return 128 + number


@contextmanager
def _told_of_signals(end: Callable[[int], object]) -> Iterator[None]:
    """Call `end` with the number of each of these signals; first drop what goes to a terminal that is closed."""
    terminals = [output for output in _OUTPUTS if os.isatty(output)]

    def hang_up(number: int) -> None:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        for output in terminals:
            os.dup2(nowhere, output)
        os.close(nowhere)
        end(number)

    calls: dict[int, Callable[[int], object]] = {signal.SIGINT: end, signal.SIGTERM: end}
    closed = getattr(signal, "SIGHUP", None)  # which Windows does not have
    if closed is not None and signal.getsignal(closed) != signal.SIG_IGN:
        calls[closed] = hang_up
    with ExitStack() as stack:
        for number in calls:
            stack.callback(signal.signal, number, signal.signal(number, lambda number, _: calls[number](number)))
        yield
