"""`underfoot analyse`: what the trials of one or many sessions say."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from underfoot.commands.files import FILE
from underfoot.commands.options import grouped
from underfoot.errors import BadValue

if TYPE_CHECKING:
    from underfoot.experiments.protocol import Protocol
    from underfoot.experiments.table import Row


@dataclass(frozen=True)
class AnalyseOptions:
    """What the command line says."""

    sessions: tuple[Path, ...]
    report: Path | None
    csv: Path | None
    bids: Path | None
    bootstrap: int
    lapses: bool
    as_json: bool


@click.command()
@click.argument("sessions", metavar="SESSION...", type=FILE, nargs=-1, required=True)
@click.option("--report", type=FILE, help="Folder for a page with tables and pictures.")
@click.option("--csv", type=FILE, help="Write all trials, a row each.")
@click.option("--bids", type=FILE, help="Folder for BIDS: behavioural files, and force and vibration of each trial.")
@click.option("--bootstrap", type=click.IntRange(0, 100_000), default=399, show_default=True,
              help="Draws for intervals of curves; 0: at once, from the regression's covariance.")  # fmt: skip
@click.option("--lapses", is_flag=True, help="Give psychometric curves a lapse rate.")
@click.option("--json", "as_json", is_flag=True, help="Print all tables as JSON.")
@grouped(AnalyseOptions)
def analyse(options: AnalyseOptions) -> None:
    """Analyse SESSIONs of a study: session files of one protocol, or CSVs of trials."""
    from underfoot.experiments.analysis.analyses import analysed
    from underfoot.experiments.analysis.report import data_of, text_of, write_page
    from underfoot.experiments.analysis.settings import Settings
    from underfoot.experiments.exchange import write_bids, write_csv

    rows, protocol = _read(options.sessions)
    findings = analysed(rows, protocol, Settings(bootstrap=options.bootstrap, with_lapses=options.lapses))
    title = protocol.title if protocol is not None else options.sessions[0].stem
    if options.csv is not None:
        write_csv(options.csv, rows)
    if options.bids is not None:
        write_bids(options.bids, rows, title, protocol)
        for path in options.sessions:
            _write_recordings(options.bids, path, title)
    if options.report is not None:
        people = ", ".join(dict.fromkeys(str(row["participant"]) for row in rows))
        write_page(options.report / "analysis.html", title, findings, [("participants", people)])
    print(json.dumps(data_of(findings)) if options.as_json else text_of(findings))


def _write_recordings(folder: Path, path: Path, task: str) -> None:
    """Force and vibration of a session's trials, where the file is a session."""
    from underfoot.experiments.physio import write_physio
    from underfoot.experiments.store import SessionFile
    from underfoot.records.recording import is_recording

    if is_recording(path):
        file = SessionFile.open(path)
        try:
            write_physio(folder, file, task)
        finally:
            file.close()


def _read(paths: tuple[Path, ...]) -> "tuple[list[Row], Protocol | None]":
    """The trials of all files; the protocol that session files share."""
    from underfoot.experiments.exchange import read_csv
    from underfoot.experiments.store import SessionFile
    from underfoot.experiments.table import rows_of
    from underfoot.records.recording import is_recording

    rows: list[Row] = []
    protocol, text = None, ""
    for path in paths:
        if not is_recording(path):
            rows += read_csv(path)
            continue
        file = SessionFile.open(path)
        try:
            known = file.about["protocol"]
            if text and known != text:
                raise BadValue(f"{path} is of another protocol than {paths[0]}; analyse them one by one")
            if protocol is None:
                protocol, text = file.stored_protocol(), known
            rows += rows_of(protocol, file.participant, file.entries())
        finally:
            file.close()
    return rows, protocol
