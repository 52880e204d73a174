"""A process that answers once, beside the window, which goes on meanwhile."""

from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection

from underfoot.engine.child_process import leave_to_session
from underfoot.errors import UnderfootError


def run(connection: Connection, work: Callable[[], object]) -> None:
    """Send what `work()` returns, or a line with the reason of a failure; the main function of the process."""
    leave_to_session("SIGINT")
    try:
        answer = work()
    except UnderfootError as error:
        answer = str(error)
    with suppress(OSError):  # nobody waits any more
        connection.send(answer)
