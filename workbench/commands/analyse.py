"""`underfoot analyse`: results of the trials of one or many sessions."""

import json
from dataclasses import dataclass
from pathlib import Path

import click

from underfoot.commands.files import complete_presets, require_folders_writable, require_outputs_writable
from underfoot.commands.options import command
from underfoot.commands.protocols import opened_protocol
from underfoot.options import argument, option


@dataclass(frozen=True)
class AnalyseOptions:
    """Options of the command."""

    sessions: tuple[Path, ...] = argument(metavar="SESSION...")
    protocol: str | None = option(
        "Protocol of CSVs of trials: a file, or a preset's name. Sessions contain their own.",
        shell_complete=complete_presets("protocols"),
    )
    report: Path | None = option("Folder for a page with tables and pictures.")
    csv: Path | None = option("Write all trials, one per row.", is_written=True)
    estimates: Path | None = option(
        "Write what each person was asked, and their estimates, one person per row.", is_written=True
    )
    bids: Path | None = option("Folder for BIDS: behavioural files, and force and vibration of each trial.")
    bootstrap: int = option(
        "Draws for intervals of curves; 0: at once, from the regression's covariance.",
        399,
        type=click.IntRange(0, 100_000),
    )
    lapses: bool = option("Give psychometric curves a lapse rate.", False)
    as_json: bool = option("Print all tables as JSON.", False, "--json")


@command(AnalyseOptions)
def analyse(options: AnalyseOptions) -> None:
    """Analyse SESSIONs of a study: session files of one protocol, or CSVs of trials."""
    from underfoot.experiments.analysis.report import data_of, text_of
    from underfoot.experiments.analysis.settings import Settings
    from underfoot.studies.results import results_of

    require_folders_writable(options.report, options.bids)
    require_outputs_writable(options.csv, options.estimates, inputs=options.sessions)
    protocol = None if options.protocol is None else opened_protocol(options.protocol)[0]
    results = results_of(options.sessions, protocol)
    settings = Settings(bootstrap=options.bootstrap, with_lapses=options.lapses)
    findings = results.findings(settings)
    if options.csv is not None:
        results.write_csv(options.csv)
    if options.estimates is not None:
        results.write_estimates(options.estimates, settings)
    if options.bids is not None:
        findings[0].remarks += results.write_bids(options.bids)
    if options.report is not None:
        results.write_report(options.report, findings)
    print(json.dumps(data_of(findings)) if options.as_json else text_of(findings))
