"""`underfoot sway`: the sway of who stands in a recording."""

from pathlib import Path

import click
from msgspec.structs import astuple

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import FILE
from underfoot.commands.surveying import survey_told
from underfoot.errors import BadValue


@click.command()
@click.argument("recording", type=FILE)
@click.option("--from", "from_s", type=float, metavar="S", help="Second at which the stretch begins; with --to.")
@click.option("--to", "to_s", type=float, metavar="S", help="Second at which it ends.")
def sway(recording: Path, from_s: float | None, to_s: float | None) -> None:
    """Print the sway of who stands in RECORDING as CSV: path, velocity, 95 % ellipse, standard deviations and ranges.

    A line is a stretch of more than 5 s in which somebody stands still, or the one from --from to --to.
    """
    from underfoot.records.recording import Recording
    from underfoot.records.sway import Sway, standing_stretches, sway_of
    from underfoot.records.tables import csv_line

    if (from_s is None) != (to_s is None):
        raise BadValue("a stretch has a beginning and an end; allowed: both --from and --to, or none of them")
    with Recording(recording) as opened, report_compiling(None):
        balance = survey_told(opened).balance
    if from_s is None or to_s is None:
        stretches = standing_stretches(balance)
        if not stretches:
            raise BadValue(
                f"nobody stands still for more than 5 s in {recording}; allowed: a stretch, by --from and --to"
            )
    else:
        stretches = [(from_s, to_s)]
    found = [sway_of(balance, *stretch) for stretch in stretches]
    lines = (csv_line(f"{value:.3f}" for value in astuple(one)) for one in found)
    print("\n".join([csv_line(Sway.__struct_fields__), *lines]))
