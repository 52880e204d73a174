"""`underfoot monitor`: footsteps as they happen."""

import json
import signal
import sys
from contextlib import ExitStack
from pathlib import Path

import click

from underfoot.commands.files import FILE, require_room
from underfoot.devices.transports import target_forms
from underfoot.errors import BadFile, BadValue


@click.command(
    help=f"""Print footsteps as they happen.

    SOURCE is "simulator" or simulator:PARAMETERS.json, {target_forms(described=True)},
    a force CSV, or a recording. Tile number 0 of hardware is the floor's first; the floor is 2 x 2 tiles unless --floor
    names another.
    """
)
@click.argument("source")
@click.option("--floor", type=FILE, help="Floor JSON; beside a force CSV it is found by itself.")
@click.option("--steps", type=FILE, help="CSV of the footsteps.")
@click.option("--contacts", type=FILE, help="CSV of every contact at every sample.")
@click.option("--patch", type=FILE, help="Patch that the session plays meanwhile.")
@click.option("--record", type=FILE, help="Record the session to this file.")
@click.option("--profiles", type=FILE, help="Folder of the tiles' profiles: readings to newtons.")
@click.option("--sensor-rate", type=float, help="Samples a second of tiles of hardware; 1000 by default.")
@click.option("--seconds", type=float, help="Stop after this long.")
@click.option("--pace", is_flag=True, help="Play a file back in real time instead of as fast as it goes.")
@click.option("--json", "as_json", is_flag=True, help="Print each footstep as a line of JSON.")
def monitor(
    source: str,
    floor: Path | None,
    steps: Path | None,
    contacts: Path | None,
    patch: Path | None,
    record: Path | None,
    profiles: Path | None,
    sensor_rate: float | None,
    seconds: float | None,
    pace: bool,
    as_json: bool,
) -> None:
    """Print footsteps as they happen."""
    from underfoot import monitoring
    from underfoot.records.tables import contact_table, step_table

    if seconds is not None and not seconds > 0.0:
        raise BadValue(f"--seconds is {seconds:g}; allowed: above 0")
    if sensor_rate is not None and not 20.0 <= sensor_rate <= 100_000.0:
        raise BadValue(f"--sensor-rate is {sensor_rate:g}; allowed: 20 to 100000 Hz")
    require_room(steps, contacts, record, inputs=(source, floor, patch))
    stream = monitoring.open_stream(source, floor, seconds, pace, record, patch, profiles, sensor_rate)
    with ExitStack() as stack:
        stack.callback(stream.close)
        for number in (signal.SIGINT, signal.SIGTERM):
            stack.callback(signal.signal, number, signal.signal(number, lambda *_: stream.stop()))
        write_steps = stack.enter_context(step_table(steps)) if steps else None
        write_contacts = stack.enter_context(contact_table(contacts, stream.floor)) if contacts else None
        for found in stream:
            if write_contacts:
                write_contacts(found.rows)
            if write_steps:
                write_steps(found.steps)
            for step in found.steps:
                print(json.dumps(monitoring.figures(step)) if as_json else monitoring.line(step), flush=True)
            for line in found.news:
                print(f"underfoot: {line}", file=sys.stderr, flush=True)
    for warning in stream.warnings():
        print(f"underfoot: {warning}", file=sys.stderr)
    if stream.failure:
        raise BadFile(stream.failure)
