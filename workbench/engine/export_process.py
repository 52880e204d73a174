"""A process that exports a recording, for a window that goes on meanwhile."""

import signal
import time
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.engine.survey_process import TELL_S, Progress
from underfoot.errors import UnderfootError
from underfoot.records.exports import Material, Stopped, format_of
from underfoot.records.recording import Recording


@dataclass(frozen=True)
class ExportRequest:
    """Which recording is exported to which file, and what of its vibration goes where there is room for one kind."""

    source: str
    path: str
    vibration: str = "measured"


def run(connection: Connection, request: ExportRequest) -> None:
    """The process's main function: sends `Progress`, and at last a line that says what came of it.

    Any message to it stops it, and then nothing is left of the file.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever opened the window
    due = time.monotonic() + TELL_S

    def tell(words: str, share: float) -> bool:
        nonlocal due
        if time.monotonic() >= due:
            due = time.monotonic() + TELL_S
            connection.send(Progress(words, share))
        return not connection.poll()

    with suppress(OSError):
        try:
            path = Path(request.path)
            with Recording(Path(request.source)) as recording:
                format_of(path).write(Material(recording, request.vibration, tell), path)
            connection.send(f"The recording was exported to {path}")
        except Stopped:
            connection.send("The export was stopped; nothing of it is left.")
        except UnderfootError as error:
            connection.send(str(error))
        except MemoryError:
            connection.send(f"There is not enough memory for {request.path}; export a shorter recording, or as .h5")
