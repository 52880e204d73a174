"""Export of a patch to another program's format in a process of its own, while the window goes on."""

from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.engine.child_process import leave_to_session
from underfoot.errors import UnderfootError
from underfoot.exchange.format import Export
from underfoot.exchange.formats import FORMATS


@dataclass(frozen=True)
class ExportRequest:
    """Patch, format, and output path."""

    export: Export
    format: str
    path: Path


def run(connection: Connection, request: ExportRequest) -> None:
    """Send the report on the file, or the reason of a failure; the main function of the process."""
    leave_to_session("SIGINT")
    write = FORMATS[request.format].write
    assert write is not None
    answer: tuple[str, ...] | str
    try:
        answer = write(request.export, request.path)
    except UnderfootError as error:
        answer = str(error)
    with suppress(OSError):  # nobody waits any more
        connection.send(answer)
