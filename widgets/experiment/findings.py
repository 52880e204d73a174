"""What the workspace computes of a study: simulated people, and the sessions so far."""

from collections.abc import Sequence
from pathlib import Path

from underfoot.engine.worker_pool import cores, in_parallel
from underfoot.errors import BadMeasurement, UnderfootError
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
from underfoot.widgets.experiment.background import Task
from underfoot.widgets.experiment.studies import StudyFile


def simulated_study(study: StudyFile, people: int, task: Task) -> list[Findings]:
    """Bias and spread of every estimate over so many simulated people."""
    jobs = jobs_of(study.protocol, study.folder, people)

    def seen(done: int) -> None:
        task.say(f"Simulating {people} people: {sum(job.end - job.first for job in jobs[:done])} done…")

    return [power_of(summaries(simulated_here(jobs, cores(), seen, task.is_stopped)), people)]


def answers_so_far(protocol: Protocol, participant: str, entries: Sequence[Entry]) -> list[Findings]:
    """What one participant's answers say up to now; nothing where they say nothing yet."""
    try:
        return analysed(rows_of(protocol, participant, entries), protocol, Settings(bootstrap=0))
    except BadMeasurement:
        return []


def analysed_sessions(study: StudyFile, paths: Sequence[Path], task: Task) -> list[Findings]:
    """What the sessions in files say, computed by a process of its own, which can be stopped."""
    for _, findings in in_parallel(_analysed, [(study.protocol, paths)], 1, is_stopped=task.is_stopped):
        if isinstance(findings, UnderfootError):
            raise findings
        return list(findings)
    return []


def _analysed(job: tuple[Protocol, Sequence[Path]]) -> list[Findings]:
    """What sessions say; those of another version of the protocol are left out, and said."""
    protocol, paths = job
    rows: list[Row] = []
    left_out = []
    text = protocol.dumps().decode()
    for path in paths:
        file = SessionFile.open(path)
        if file.about["protocol"] == text:
            rows += rows_of(protocol, file.participant, file.entries())
        else:
            left_out.append(path.stem)
        file.close()
    findings = analysed(rows, protocol, Settings())
    if left_out:
        findings[0].remarks.append(f"Begun with another version of the protocol, left out: {', '.join(left_out)}.")
    return findings
