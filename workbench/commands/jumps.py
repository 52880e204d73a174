"""`underfoot jumps`: the jumps in a recording."""

from pathlib import Path

import click

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import FILE
from underfoot.commands.surveying import survey_told


@click.command()
@click.argument("recording", type=FILE)
def jumps(recording: Path) -> None:
    """Print the jumps in RECORDING as CSV: height by flight time and by impulse, contact before, peaks, weight.

    A jump is a time of 0.1 to 1 s in which nothing is on the floor. By impulse it is known after 1 s of standing still.
    """
    from underfoot.records.jumps import Jump, jumps_in
    from underfoot.records.recording import Recording
    from underfoot.records.tables import measures_csv

    with Recording(recording) as opened, report_compiling(None):
        found = jumps_in(opened, survey_told(opened))
    print(measures_csv(Jump, found))
