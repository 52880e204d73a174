"""`underfoot monitor`: footsteps as they happen."""

import json
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import ended_by_signals
from underfoot.commands.files import FORCES_FLOOR, RUN_CODE, complete_sources, require_outputs_writable
from underfoot.commands.options import SECONDS, command, require_seconds
from underfoot.commands.session_target import RECORD, SessionOptions
from underfoot.commands.telling import tell
from underfoot.devices.accelerometers import FORM
from underfoot.devices.transports import target_forms
from underfoot.errors import BadFile
from underfoot.options import argument, option, shared

if TYPE_CHECKING:
    from underfoot.floor.step_finder import Detections
    from underfoot.monitoring import FileStream, SessionStream


@dataclass(frozen=True)
class MonitorOptions(SessionOptions):
    """Options of the command; None if not given."""

    source: str = argument("walks", shell_complete=complete_sources())
    floor: Path | None = shared(FORCES_FLOOR)
    steps: Path | None = option("CSV file to write: one line per footstep.", is_written=True)
    contacts: Path | None = option("CSV file to write: one line per contact and sample.", is_written=True)
    patch: Path | None = option("Patch to play during the session.", presets="patches")
    run_code: bool = shared(RUN_CODE)
    record: Path | None = shared(RECORD)
    accelerometers: str = option(f"{FORM}, separated by spaces. Reports what they measure.", "", metavar="LIST")
    seconds: float | None = shared(SECONDS)
    pace: bool = option("Play a file in real time, as --record and --patch do, not at once.", False)
    as_json: bool = option("Print each footstep as one line of JSON.", False, "--json")


@command(
    MonitorOptions,
    help=f"""Print footsteps as they happen.

    SOURCE is "simulator", simulator:PARAMETERS.json, simulator:people=N,path=PATH, {target_forms(described=True)},
    a force CSV, the preset walk "corridor", a C3D file, or a recording. Tile number 0 of hardware is the floor's first.
    The floor is 2 x 2 tiles unless --floor names another.

    A line has the step's number, start, tile and side, how long it was down, its first peak, valley and second peak,
    impulse, rate of loading, person, and length.
    """,
)
def monitor(options: MonitorOptions) -> None:
    """Print footsteps as they happen."""
    from underfoot import monitoring

    require_seconds(options.seconds)
    inputs = (options.source, options.floor, options.patch)
    require_outputs_writable(options.steps, options.contacts, options.record, inputs=inputs)
    stream = monitoring.open_stream(
        options.source,
        options.floor,
        options.seconds,
        options.pace,
        options.record,
        options.patch,
        monitoring.StreamOptions(options.profiles, options.sensor_rate, options.sound, options.accelerometers),
    )
    with report_compiling():
        _follow(stream, options)
    for warning in stream.warnings():
        tell(warning)
    if stream.failure:
        raise BadFile(stream.failure)


_Write = Callable[["Detections"], None]


def _follow(stream: "FileStream | SessionStream", options: MonitorOptions) -> None:
    """Print and write what the stream brings, until it ends or a signal ends it."""
    from underfoot.floor.gait_summary import GaitTotals
    from underfoot.monitoring import step_figures, step_line

    gait, figures = GaitTotals(), partial(step_figures, recorded=stream.notes is not None)
    with ExitStack() as stack:
        stack.callback(stream.close)
        stack.enter_context(ended_by_signals(stream.stop))
        tables: list[_Write] | None = None
        for found in stream:
            if tables is None:  # not before: a session that cannot begin leaves the files that were there
                tables = list(_tables(stream, options, stack))
            _put(found, tables, stream)
            gait.add(found.steps)
            for step in found.steps:
                print(json.dumps(figures(step)) if options.as_json else step_line(step), flush=True)
            for line in found.messages:
                tell(line)
    if not options.as_json:
        for line in gait.lines():
            tell(line)


def _tables(stream: "FileStream | SessionStream", options: MonitorOptions, stack: ExitStack) -> Iterator[_Write]:
    """Open the tables that are asked for."""
    from underfoot.records.tables import contact_table, step_table

    if options.contacts is not None:
        put_contacts = stack.enter_context(contact_table(options.contacts, stream.floor, live=stream.is_live))
        yield lambda found: put_contacts(found.rows)
    if options.steps is not None:
        is_recorded = stream.notes is not None
        put_steps = stack.enter_context(step_table(options.steps, live=stream.is_live, recorded=is_recorded))
        yield lambda found: put_steps(found.steps)


def _put(found: "Detections", tables: list[_Write], stream: "FileStream | SessionStream") -> None:
    """Write what was found. A live stream goes on without a table that the disk refuses; what is in it is kept."""
    for write in list(tables):
        try:
            write(found)
        except BadFile as error:
            if not stream.is_live:
                raise
            tables.remove(write)
            stream.failure = f"{error}; it has what came before"
            tell(stream.failure)
