"""Studies with simulated participants: each person's estimates beside the true values, before the first real session.

Each person is drawn only from the seed and the person's number. The results are therefore identical for one process,
several processes or a cluster, in any order.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from underfoot.arguments import seed_of
from underfoot.errors import require
from underfoot.experiments.analysis.analyses import ANALYSES, settings_of
from underfoot.experiments.analysis.estimate import Estimate
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.observers import SimulatedParticipant
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.study import Study
from underfoot.experiments.table import Row, counted, grouped, rows_of

MOST_PEOPLE = 1_000_000
SHARES = (0.25, 0.5, 1.0)
"""After which shares of the blocks estimates are made, or of the trials where there is one block."""

EstimateRow = tuple[int, str, float, float, float, float, float, str]
"""Person, estimate, share of the trials, value, low, high, truth, unit."""


@dataclass(frozen=True)
class SimulationSettings:
    """Settings of a simulation: seed, number of bootstrap draws (0: intervals by covariance), and true values."""

    seed: int = 1
    bootstrap: int = 0
    truth: tuple[tuple[str, float], ...] = ()


@dataclass(frozen=True)
class Job:
    """People `first` to `end` (exclusive) of a simulated study; plain data that can be sent to any process."""

    protocol: bytes
    folder: str
    first: int
    end: int
    settings: SimulationSettings = SimulationSettings()


def jobs_of(
    protocol: Protocol, folder: Path, people: int, settings: SimulationSettings | None = None, each: int = 20
) -> list[Job]:
    """Return jobs of `each` people for `people` participants of a study; `folder` contains its patches."""
    require(1 <= people <= MOST_PEOPLE, "people", people, f"1 to {MOST_PEOPLE}")
    settings = settings or SimulationSettings()
    seed_of(settings.seed)
    text = protocol.dumps()
    return [Job(text, str(folder), first, min(first + each, people), settings) for first in range(0, people, each)]


def simulate(job: Job) -> list[EstimateRow]:
    """Return the estimates of a job's people. A module-level function of plain data, which any process can run.

    Where several stages have estimates, these have the stage in their names.
    """
    protocol = Protocol.loads(job.protocol, folder=Path(job.folder))
    settings, found = job.settings, list[EstimateRow]()
    several = sum(stage.method is not None and not stage.practice for stage in protocol.stages) > 1
    for person in range(job.first, job.end):
        rows, participant = simulated_rows(protocol, person, settings.seed, dict(settings.truth))
        truths = {stage: observer.truths() for stage, observer in participant.observers.items()}
        for share in SHARES:
            for stage, one in _estimates(protocol, rows, share, settings.bootstrap):
                name = f"{one.name} in {stage}" if several else one.name
                truth = truths[stage].get(one.name, math.nan)
                found.append((person, name, share, one.value, one.low, one.high, truth, one.unit))
    return found


def simulated_rows(
    protocol: Protocol, person: int, seed: int, truth: Mapping[str, float]
) -> tuple[list[Row], SimulatedParticipant]:
    """Return the trials that a simulated person answered, and the simulated participant."""
    participant = SimulatedParticipant(protocol, truth, np.random.default_rng([seed, person]))
    name = f"S{person + 1}"
    study = Study(protocol, name)
    while not study.is_done:
        study.answer(participant.answer(study.page))
    return list(rows_of(protocol, name, study.entries)), participant


def _estimates(protocol: Protocol, rows: Sequence[Row], share: float, bootstrap: int) -> Iterable[tuple[str, Estimate]]:
    for (stage, method), part in grouped(counted(rows), "stage", "method").items():
        settings = settings_of(protocol, stage, Settings(bootstrap=bootstrap if share == 1.0 else 0))
        for estimate in ANALYSES[method].estimates(_first(part, share), settings):
            yield stage, estimate


def _first(rows: Sequence[Row], share: float) -> Sequence[Row]:
    """Return the first `share` of a stage's blocks, or, of a single block, of its trials."""
    last = max(int(row["block"]) for row in rows)
    if last == 1:
        return rows[: max(round(share * len(rows)), 1)]
    return [row for row in rows if int(row["block"]) <= max(round(share * last), 1)]


@dataclass(frozen=True)
class Summary:
    """Estimates of one quantity over many people, compared with the true values, after a share of the trials.

    `truth` is the mean true value; people differ in it with a standard deviation of `differ`. `bias` and `spread` are
    mean and standard deviation of the error, estimate minus true value. `covered` is the share of 95 % intervals that
    contain the true value; `missing` is the share of people without an estimate.
    """

    name: str
    share: float
    truth: float
    mean: float
    median: float
    bias: float
    spread: float
    covered: float
    missing: float
    differ: float = 0.0
    unit: str = ""

    def spread_of(self, people: int) -> float:
        """Return the standard error of the mean over `people` participants.

        >>> Summary("x", 1.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.95, 0.0, differ=3.0).spread_of(25)
        1.0
        """
        return math.hypot(self.spread, self.differ) / math.sqrt(people)


def summaries(found: Iterable[EstimateRow]) -> list[Summary]:
    """Return one summary per estimate and share of the trials, over all people, in any order of `found`."""
    by_name: dict[tuple[str, float], list[EstimateRow]] = {}
    for one in sorted(found, key=lambda f: (f[0], f[1], f[2])):
        by_name.setdefault((one[1], one[2]), []).append(one)
    return [_summary(name, share, several) for (name, share), several in sorted(by_name.items())]


def _summary(name: str, share: float, several: Sequence[EstimateRow]) -> Summary:
    values, lows, highs, truths = (np.array([one[k] for one in several]) for k in (3, 4, 5, 6))
    there = np.isfinite(values)
    truth, unit = float(truths.mean()), max(one[7] for one in several)  # one that is missing has none
    if not there.any():
        return Summary(name, share, truth, math.nan, math.nan, math.nan, math.nan, math.nan, 1.0, unit=unit)
    kept, errors = values[there], (values - truths)[there]
    judged = there & ~np.isnan(lows) & ~np.isnan(highs) & ~np.isnan(truths)
    covered = float(((lows <= truths) & (truths <= highs))[judged].mean()) if judged.any() else math.nan
    spread, differ = (float(of.std(ddof=1)) if len(kept) > 1 else math.nan for of in (errors, truths))
    return Summary(
        name, share, truth, float(kept.mean()), float(np.median(kept)), float(errors.mean()), spread, covered,
        float(1 - there.mean()), 0.0 if math.isnan(differ) else differ, unit,
    )  # fmt: skip
