"""`underfoot sway`: the sway of who stands in a recording."""

from pathlib import Path

import click

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import FILE
from underfoot.commands.surveying import survey_told
from underfoot.errors import BadValue


@click.command()
@click.argument("recording", type=FILE)
@click.option("--from", "from_s", type=float, metavar="S", help="Second at which a stretch begins; by default 0.")
@click.option("--to", "to_s", type=float, metavar="S", help="Second at which it ends; by default the last.")
def sway(recording: Path, from_s: float | None, to_s: float | None) -> None:
    """Print the sway of who stands in RECORDING as CSV: path, velocity, 95 % ellipse, standard deviations and ranges.

    A line is a stretch of more than 5 s in which somebody stands still, or the one that --from, --to or both give.
    """
    from underfoot.records.recording import Recording
    from underfoot.records.sway import Sway, standing_stretches, sway_of
    from underfoot.records.tables import measures_csv

    with Recording(recording) as opened, report_compiling(None):
        survey = survey_told(opened)
    if from_s is None and to_s is None:
        stretches = standing_stretches(survey.balance)
        if not stretches:
            raise BadValue(
                f"nobody stands still for more than 5 s in {recording}; allowed: a stretch, by --from and --to"
            )
    else:
        stretches = [(0.0 if from_s is None else from_s, survey.until_s if to_s is None else to_s)]
    found = [sway_of(survey.balance, *stretch) for stretch in stretches]
    print(measures_csv(Sway, found))
