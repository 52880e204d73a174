"""Export of a recording in a separate process, while the window stays responsive."""

from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from underfoot.clock import once_in
from underfoot.engine.child_process import leave_to_session
from underfoot.engine.survey_process import TELL_S, Progress
from underfoot.errors import UnderfootError
from underfoot.records.exports import ExportSource, ExportStopped, write_export
from underfoot.records.recording import Recording


@dataclass(frozen=True)
class ExportRequest:
    """Recording to export, output path, the kind of vibration for formats that store only one, and the stretch in
    seconds; None for the whole recording."""

    source: str
    path: str
    vibration: str = "measured"
    stretch_s: tuple[float, float] | None = None


def run(connection: Connection, request: ExportRequest) -> None:
    """Send `Progress` while exporting, and finally a line with the result; the main function of the process.

    Any message to it stops the export, and removes the incomplete file.
    """
    leave_to_session("SIGINT")
    is_due = once_in(TELL_S)

    def progress(text: str, share: float) -> bool:
        if is_due():
            connection.send(Progress(text, share))
        return not connection.poll()

    with suppress(OSError):
        try:
            path = Path(request.path)
            with Recording(Path(request.source)) as recording:
                write_export(ExportSource(recording, request.vibration, progress, request.stretch_s), path)
            connection.send(f"The recording was exported to {path}")
        except ExportStopped:
            connection.send("The export was stopped; nothing of it is left.")
        except UnderfootError as error:
            connection.send(str(error))
        except MemoryError:
            connection.send(f"There is not enough memory for {request.path}; export a stretch, or as .h5")
