"""The options of `underfoot experiment` as one record."""

from dataclasses import dataclass
from pathlib import Path

import click

from underfoot.commands.files import RUN_CODE, complete_presets
from underfoot.commands.session_target import TargetOptions
from underfoot.options import argument, option, shared


@dataclass(frozen=True)
class ExperimentOptions(TargetOptions):
    """Options of the command; None if not given."""

    protocol: str = argument(shell_complete=complete_presets("protocols"))
    leave_out: str | None = option(
        'Leave a session file out of the analysis for a reason; "" takes it in again.', metavar="WHY"
    )
    correct_id: str | None = option("Give the trials of a session file the id that it should have had.", metavar="ID")
    conditions: Path | None = option("CSV with one stimulus per line, which replace the protocol's.")
    pilot: bool = option("Try it on yourself: two trials of each stage, short pauses, kept apart.", False)
    participant: str | None = option("Run the study in the terminal, on a person with this id.")
    session: Path | None = option("Session file; an existing one is continued.", is_written=True)
    plate: str | None = option("Variable stiffness plate: serial port and calibration, PORT:FILE.json, or simulated.")
    masking: str | None = option(
        'Sound card of the masking noise and metronome; "default" for the system\'s.', metavar="DEVICE"
    )
    trigger: str | None = option("Serial port that gets a byte at each start, onset, end, answer and stop.")
    lsl: bool = option("Send markers and forces as LSL streams.", False)
    simulate: int | None = option("Run the study on this many simulated participants.")
    truth: tuple[str, ...] = option("True parameter of simulated participants.", (), metavar="NAME=VALUE")
    seed: int = option("Seed of simulated participants.", 1)
    bootstrap: int = option(
        "Draws for intervals of simulated curves; 0: from the regression's covariance.",
        0,
        type=click.IntRange(0, 10_000),
    )
    processes: int | None = option(
        "Processes for simulated participants; by default one per core.", type=click.IntRange(1, 1024)
    )
    cluster: str | None = option("Scheduler of a Dask cluster for simulated participants.", metavar="TCP://HOST:PORT")
    report: Path | None = option("Folder for a page with tables and pictures.")
    csv: Path | None = option(
        "Write the trials of simulated participants, as `analyse --csv` does, or a plan.", is_written=True
    )
    levels: bool = option("Measure the peak of every stimulus under a simulated footstep.", False)
    patches: Path | None = option(
        "Write the patch of every stimulus at its level into this new folder, to render or to open.", is_written=True
    )
    plan: str | None = option("Print the trials that the participant with this id will get, in order.", metavar="ID")
    run_code: bool = shared(RUN_CODE)
    as_json: bool = option("Print tables as JSON.", False, "--json")
