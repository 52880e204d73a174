"""`underfoot export`: a recording for other programs."""

from pathlib import Path

import click

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import FILE, OUTPUT, require_outputs_writable
from underfoot.commands.telling import tell_share


class _Formats(click.Command):
    """Its help lists the formats that there are."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        from underfoot.records.exports import formats

        with formatter.section("Formats"):
            formatter.write_dl([(one.suffix, f"{one.title}. Not carried: {one.cannot}.") for one in formats().values()])


@click.command(cls=_Formats)
@click.argument("recording", type=FILE)
@click.option("-o", "--output", type=OUTPUT, required=True, help="File to write; its suffix selects the format.")
@click.option(
    "--vibration",
    type=click.Choice(["commanded", "measured", "vibration"]),
    default="measured",
    show_default=True,
    help="The kind of vibration for formats that hold one: commanded or measured m/s^2, or the drive.",
)
@click.option("--from", "from_s", type=float, metavar="S", help="Export from this second; by default the first.")
@click.option("--to", "to_s", type=float, metavar="S", help="Export up to this second; by default the last.")
def export(recording: Path, output: Path, vibration: str, from_s: float | None, to_s: float | None) -> None:
    """Write RECORDING for other programs."""
    from underfoot.records.exports import ExportSource, format_of, write_export
    from underfoot.records.recording import Recording
    from underfoot.records.survey import RecordedForces

    require_outputs_writable(output, inputs=[recording])
    with Recording(recording) as opened, report_compiling(None):
        stretch_s = None
        if from_s is not None or to_s is not None:
            length_s = RecordedForces(opened).length_s
            stretch_s = (0.0 if from_s is None else from_s, length_s if to_s is None else to_s)
        write_export(ExportSource(opened, vibration, tell_share(), stretch_s), output)
    print(f"{output} is written, as {format_of(output).title.replace('NAME', output.stem)}")
