"""What the workspace computes of a study: simulated people, and the sessions so far."""

from collections.abc import Sequence
from pathlib import Path

from underfoot.engine.worker_pool import cores
from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.analysis.power import power_of
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.simulation import jobs_of, summaries
from underfoot.experiments.store import SessionFile
from underfoot.experiments.study import Entry
from underfoot.experiments.table import Row, rows_of
from underfoot.studies.simulated import simulated_here
from underfoot.widgets.experiment.studies import StudyFile


def simulated_study(study: StudyFile, people: int) -> list[Findings]:
    """Bias and spread of every estimate over so many simulated people."""
    jobs = jobs_of(study.protocol, study.folder, people)
    return [power_of(summaries(simulated_here(jobs, cores())), people)]


def answers_so_far(protocol: Protocol, participant: str, entries: Sequence[Entry]) -> list[Findings]:
    """What one participant's answers say up to now; nothing where they say nothing yet."""
    try:
        return analysed(rows_of(protocol, participant, entries), protocol, Settings(bootstrap=0))
    except BadMeasurement:
        return []


def analysed_sessions(study: StudyFile, paths: Sequence[Path]) -> list[Findings]:
    """What the sessions in files say; those of another version of the protocol are left out, and said."""
    rows: list[Row] = []
    left_out = []
    text = study.protocol.dumps().decode()
    for path in paths:
        file = SessionFile.open(path)
        if file.about["protocol"] == text:
            rows += rows_of(study.protocol, file.participant, file.entries())
        else:
            left_out.append(path.stem)
        file.close()
    findings = analysed(rows, study.protocol, Settings())
    if left_out:
        findings[0].remarks.append(f"Begun with another version of the protocol, left out: {', '.join(left_out)}.")
    return findings
