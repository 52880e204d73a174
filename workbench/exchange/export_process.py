"""A process that writes a patch in a format of another program, for a window that goes on meanwhile."""

import signal
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.errors import UnderfootError
from underfoot.exchange.format import Export
from underfoot.exchange.formats import FORMATS


@dataclass(frozen=True)
class ExportRequest:
    """What is to be written, in which format, and where."""

    export: Export
    format: str
    path: Path


def run(connection: Connection, request: ExportRequest) -> None:
    """The process's main function: answers with what is to be said of the file, or with why there is none."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the window
    write = FORMATS[request.format].write
    assert write is not None
    answer: tuple[str, ...] | str
    try:
        answer = write(request.export, request.path)
    except UnderfootError as error:
        answer = str(error)
    with suppress(OSError):  # nobody waits any more
        connection.send(answer)
