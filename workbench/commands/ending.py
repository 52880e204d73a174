"""The signals that end a command which runs until it is told to."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

_OUTPUTS = (1, 2)


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
