"""Which analysis is for which method, and all of them for a table of trials."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

from underfoot.errors import BadMeasurement, require
from underfoot.experiments.analysis import bayesian, constant, identification, labels, ratings, staircase, targets
from underfoot.experiments.analysis.estimate import Estimate
from underfoot.experiments.analysis.findings import Findings
from underfoot.experiments.analysis.settings import Settings
from underfoot.experiments.methods import METHODS
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.table import Row, counted, grouped


@dataclass(frozen=True)
class Analysis:
    """What one person's rows estimate, what those of all say, and the columns that both need."""

    estimates: Callable[[Sequence[Row], Settings], list[Estimate]]
    findings: Callable[[Sequence[Row], Settings], Findings]
    needs: tuple[str, ...]


ANALYSES: Mapping[str, Analysis] = {
    "absolute-identification": Analysis(identification.estimates, identification.findings, ("correct", "number")),
    "constant-stimuli": Analysis(constant.estimates, constant.findings, ("stimulus",)),
    "staircases": Analysis(staircase.estimates, staircase.findings, ("staircase", "comparison", "level_db")),
    "rating": Analysis(ratings.estimates, ratings.findings, ("stimulus", "rating")),
    "free-labels": Analysis(labels.estimates, labels.findings, ("stimulus", "label")),
    "target-selection": Analysis(
        targets.estimates, targets.findings, ("selected", "time_s", "width_m", "distance_m", "bearing_rad")
    ),
    "bayesian": Analysis(bayesian.estimates, bayesian.findings, ("level_db",)),
}


def settings_of(protocol: Protocol | None, stage: str, settings: Settings) -> Settings:
    """The settings with the parameters of the method of a stage; the methods' own without a protocol."""
    if protocol is None:
        return settings
    use = protocol.stage(stage).method
    return (
        settings
        if use is None
        else replace(settings, given=METHODS[use.kind].checked(use.parameters, protocol.stimuli))
    )


def analysed(rows: Sequence[Row], protocol: Protocol | None, settings: Settings) -> list[Findings]:
    """The findings of every stage of trials that counts. `BadMeasurement` where no trial counts.

    `BadValue` for a method that there is not, or a column that it needs and no row has.
    """
    found = []
    for (stage, method), part in grouped(counted(rows), "stage", "method").items():
        require(method in ANALYSES, "method", method, ", ".join(ANALYSES))
        analysis = ANALYSES[method]
        have = {name for row in part for name in row}
        for name in analysis.needs:
            require(name in have, "columns", name, f"a table of {method} has the columns {', '.join(analysis.needs)}")
        findings = analysis.findings(part, settings_of(protocol, stage, settings))
        findings.title = f"{METHODS[method].name}: {stage}"
        found.append(findings)
    if not found:
        raise BadMeasurement("there is no trial that counts: all are practice, spoiled, or there are none")
    return found
