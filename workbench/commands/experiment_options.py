"""The options of `underfoot experiment` as one record."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class ExperimentOptions:
    """Options of the command; None if not given."""

    protocol: str
    leave_out: str | None
    conditions: Path | None
    pilot: bool
    participant: str | None
    session: Path | None
    target: str
    floor: Path | None
    profiles: Path | None
    sensor_rate: float | None
    sound: str | None
    plate: str | None
    masking: str | None
    trigger: str | None
    lsl: bool
    simulate: int | None
    truth: tuple[str, ...]
    seed: int
    bootstrap: int
    processes: int | None
    cluster: str | None
    report: Path | None
    csv: Path | None
    levels: bool
    plan: str | None
    as_json: bool
