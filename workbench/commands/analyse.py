"""`underfoot analyse`: results of the trials of one or many sessions."""

import json
from dataclasses import dataclass
from pathlib import Path

import click

from underfoot.commands.files import FILE, OUTPUT, require_folders_writable, require_outputs_writable
from underfoot.commands.options import takes_options
from underfoot.commands.protocols import opened_protocol


@dataclass(frozen=True)
class AnalyseOptions:
    """Options of the command."""

    sessions: tuple[Path, ...]
    protocol: str | None
    report: Path | None
    csv: Path | None
    bids: Path | None
    bootstrap: int
    lapses: bool
    as_json: bool


@click.command()
@click.argument("sessions", metavar="SESSION...", type=FILE, nargs=-1, required=True)
@click.option("--protocol", help="Protocol of CSVs of trials: a file, or a preset's name. Sessions contain their own.")
@click.option("--report", type=FILE, help="Folder for a page with tables and pictures.")
@click.option("--csv", type=OUTPUT, help="Write all trials, one per row.")
@click.option("--bids", type=FILE, help="Folder for BIDS: behavioural files, and force and vibration of each trial.")
@click.option("--bootstrap", type=click.IntRange(0, 100_000), default=399, show_default=True,
              help="Draws for intervals of curves; 0: at once, from the regression's covariance.")  # fmt: skip
@click.option("--lapses", is_flag=True, help="Give psychometric curves a lapse rate.")
@click.option("--json", "as_json", is_flag=True, help="Print all tables as JSON.")
@takes_options(AnalyseOptions)
def analyse(options: AnalyseOptions) -> None:
    """Analyse SESSIONs of a study: session files of one protocol, or CSVs of trials."""
    from underfoot.experiments.analysis.report import data_of, text_of
    from underfoot.experiments.analysis.settings import Settings
    from underfoot.studies.results import results_of

    require_folders_writable(options.report, options.bids)
    require_outputs_writable(options.csv, inputs=options.sessions)
    protocol = None if options.protocol is None else opened_protocol(options.protocol)[0]
    results = results_of(options.sessions, protocol)
    settings = Settings(bootstrap=options.bootstrap, with_lapses=options.lapses)
    findings = results.findings(settings)
    if options.csv is not None:
        results.write_csv(options.csv)
    if options.bids is not None:
        findings[0].remarks += results.write_bids(options.bids)
    if options.report is not None:
        results.write_report(options.report, findings)
    print(json.dumps(data_of(findings)) if options.as_json else text_of(findings))
