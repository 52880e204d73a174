"""Computations of the workspace: simulation of a study, analysis of its sessions, and export to other programs."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from underfoot.engine.worker_pool import Job, cores, in_parallel
from underfoot.errors import BadMeasurement, UnderfootError
from underfoot.experiments.analysis.analyses import analysed
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.analysis.power import power_of
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.observers import truths_of
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.simulation import jobs_of, summaries
from underfoot.experiments.study import Entry
from underfoot.experiments.table import rows_of
from underfoot.quantities import counted
from underfoot.studies.results import analysed_elsewhere, analysed_files, written_files
from underfoot.studies.simulated import simulate_locally
from underfoot.widgets.background import Task
from underfoot.widgets.experiment.people_dialog import SimulatedPeople
from underfoot.widgets.experiment.studies import StudyFile


def simulated_study(study: StudyFile, people: SimulatedPeople, task: Task) -> list[Findings]:
    """Return bias and spread of every estimate over simulated people."""
    jobs = jobs_of(study.protocol, study.folder, people.count, people.settings)
    who = counted(people.count, "person", "people")

    def seen(done: int) -> None:
        task.report(f"Simulating {who}: {sum(job.end - job.first for job in jobs[:done])} done…")

    summed = summaries(simulate_locally(jobs, cores(), seen, task.is_stopped))
    return [power_of(summed, people.count, truths_of(study.protocol, dict(people.settings.truth)))]


def answers_so_far(protocol: Protocol, participant: str, entries: Sequence[Entry]) -> list[Findings]:
    """Return the findings from one participant's answers so far; [] if there are too few."""
    try:
        return analysed(rows_of(protocol, participant, entries), protocol, Settings(bootstrap=0))
    except BadMeasurement:
        return []


def analysed_in_process(
    paths: Sequence[Path], protocol: Protocol, settings: Settings, task: Task, *, are_its: bool
) -> list[Findings]:
    """Return the findings of a protocol's own sessions, or of other files than these, computed in a process."""
    analyse = analysed_files if are_its else analysed_elsewhere
    return _in_process(partial(analyse, tuple(paths), settings), protocol, task)


def written_in_process(
    paths: Sequence[Path], protocol: Protocol, form: str, where: Path, settings: Settings, task: Task
) -> list[Findings]:
    """Write the trials of sessions (`results.written_files`)."""
    return _in_process(partial(written_files, tuple(paths), form, where, settings), protocol, task)


def _in_process(work: Callable[[Job], list[Findings]], job: Job, task: Task) -> list[Findings]:
    """Return the result of `work(job)`, computed in a separate process that can be stopped.

    `work` must be in a module that does not import Qt.
    """
    for _, findings in in_parallel(work, [job], 1, is_stopped=task.is_stopped):
        if isinstance(findings, UnderfootError):
            raise findings
        return findings
    return []
