"""`underfoot experiment`: a study on a person, or on simulated people before the first one comes."""

import json
import sys
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.compiling import report_compiling
from underfoot.commands.ending import interrupted_by_signals
from underfoot.commands.experiment_options import ExperimentOptions
from underfoot.commands.files import require_folders_writable, require_outputs_writable
from underfoot.commands.options import command, require_only
from underfoot.commands.protocols import opened_protocol
from underfoot.commands.telling import tell
from underfoot.errors import BadFile, BadValue

if TYPE_CHECKING:
    from underfoot.experiments.protocol import Protocol
    from underfoot.experiments.simulation import EstimateRow


@command(ExperimentOptions)
def experiment(options: ExperimentOptions) -> None:
    """Run the study PROTOCOL: a protocol file, or the name of a preset; or go on with a session file, with the protocol
    that it was begun with.

    With --participant and --session it runs on a person, with --pilot on yourself; with --simulate on simulated people,
    whose truth is known, so that bias and spread of every estimate are known before the first person comes.
    """
    from underfoot.records.recording import is_recording

    if is_recording(Path(options.protocol)):
        _with_session(options)
        return
    if options.leave_out is not None or options.correct_id is not None:
        raise BadValue(f"{options.protocol} is no session file; only such can be left out, or get another id")
    protocol, folder = opened_protocol(options.protocol, options.conditions)
    values = {mode: getattr(options, mode.removeprefix("--")) for mode in _MODES}
    chosen = [mode for mode, value in values.items() if value is not None and value is not False]
    if len(chosen) != 1:
        raise BadValue(f"give one of {', '.join(_MODES)}; --participant with --session")
    require_only(options, chosen[0], _MODES[chosen[0]])
    require_folders_writable(options.report)
    page = options.report / "power.html" if options.report else None
    require_outputs_writable(options.csv, inputs=(options.protocol, options.conditions, page))
    if options.levels:
        _print_levels(protocol, folder, options.as_json)
    elif options.patches is not None:
        _write_patches(protocol, folder, options.patches)
    elif options.plan is not None:
        _print_plan(options, protocol, options.plan)
    elif options.simulate is not None:
        _simulated(options, protocol, folder)
    else:
        from underfoot.commands.participant import run_on_person, run_pilot

        (run_pilot if options.pilot else run_on_person)(options, protocol, folder)


_ON_A_PERSON = "--target --floor --profiles --sensor-rate --sound --plate --masking --trigger --lsl --run-code"
_MODES = {
    "--participant": f"--session --conditions {_ON_A_PERSON}",
    "--pilot": f"--session --conditions {_ON_A_PERSON}",
    "--simulate": "--conditions --truth --seed --bootstrap --processes --cluster --report --csv --run-code --json",
    "--levels": "--conditions --run-code --json",
    "--patches": "--conditions --run-code",
    "--plan": "--conditions --csv --run-code --json",
}
"""What the command can do with a protocol, and the options that count then."""


def _with_session(options: ExperimentOptions) -> None:
    """Correct what is said about a session, or go on with it, as it was begun."""
    if options.leave_out is not None or options.correct_id is not None:
        require_only(options, "a session to correct", "--leave-out --correct-id")
        _correct(options.protocol, options.leave_out, options.correct_id)
        return
    from underfoot.commands.participant import go_on_as_begun

    require_only(options, f"{options.protocol}, a session that goes on as it was begun", _ON_A_PERSON)
    go_on_as_begun(options)


def _correct(path: str, why: str | None, id: str | None) -> None:
    """Leave a session out of the analysis, or take it in again; give its trials another id."""
    from underfoot.experiments.store import SessionFile

    with closing(SessionFile.open(path)) as file:
        if id is not None:
            file.correct_id(id)
            print(f"{file.participant} is {file.counts_as} in tables")
        if why is not None:
            file.leave_out(why)
            print(f"{file.counts_as} is left out: {file.left_out}" if file.left_out else f"{file.counts_as} counts")


def _print_plan(options: ExperimentOptions, protocol: "Protocol", participant: str) -> None:
    """Print a participant's trials in their order, and write them where that is asked for."""
    from underfoot.experiments.analysis.findings import Findings, Table
    from underfoot.experiments.analysis.report import data_of, text_of
    from underfoot.experiments.plan import COLUMNS, plan_of
    from underfoot.experiments.trial_files import write_csv

    rows = plan_of(protocol, participant)
    if options.csv is not None:
        write_csv(options.csv, rows, COLUMNS)
    table = Table(f"Trials of {participant}", COLUMNS, tuple(tuple(row[name] for name in COLUMNS) for row in rows))
    found = [Findings(protocol.title, tables=[table])]
    print(json.dumps(data_of(found)) if options.as_json else text_of(found))


def _print_levels(protocol: "Protocol", folder: Path, as_json: bool) -> None:
    """Print each stimulus's peak as the protocol has it, and as it is under the simulated footstep."""
    from underfoot.studies.levels import measured_peak_m_s2

    found = {}
    played = {name: stimulus for name, stimulus in protocol.stimuli.items() if stimulus.patch}
    with interrupted_by_signals(), report_compiling():
        for name, stimulus in played.items():
            measured = measured_peak_m_s2(stimulus.at(0.0, folder))
            found[name] = {"level_m_s2": stimulus.level_m_s2, "measured_m_s2": float(f"{measured:.4g}")}
            if len(played) > 1:
                tell(f"{len(found)} of {len(played)}: {name}")
    if as_json:
        print(json.dumps(found))
        return
    for name, of in found.items():
        print(f"{name:12} wanted {of['level_m_s2']:8.3g} m/s^2   measured {of['measured_m_s2']:8.3g} m/s^2")


def _write_patches(protocol: "Protocol", folder: Path, new: Path) -> None:
    """Write each stimulus's patch with its settings, at its level, into a new folder."""
    from underfoot.files import make_folder
    from underfoot.patch.custom_nodes import copy_needed

    if new.exists():
        raise BadFile(f"{new} is there already; allowed: a new folder")
    patches = {new / f"{name}.json": one.at(0.0, folder) for name, one in protocol.stimuli.items() if one.patch}
    make_folder(new)
    for path, patch in patches.items():
        patch.save(path)
        copy_needed(patch.types.values(), None, new)
    print(*patches, sep="\n")


def _simulated(options: ExperimentOptions, protocol: "Protocol", folder: Path) -> None:
    """Simulate, and print or write what came of it."""
    from underfoot.experiments.analysis.power import power_of
    from underfoot.experiments.analysis.report import data_of, text_of, write_page
    from underfoot.experiments.observers import truths_of
    from underfoot.experiments.simulation import summaries

    people = options.simulate or 0
    truth = dict(_truth(options.truth))
    truths = truths_of(protocol, truth)
    found = power_of(summaries(_found(options, protocol, folder, people)), people, truths)
    if options.report is not None:
        facts = [("protocol", options.protocol), ("seed", str(options.seed)), *(("truth", t) for t in options.truth)]
        write_page(options.report / "power.html", f"{protocol.title}: before the first participant", [found], facts)
    if options.csv is not None:
        from underfoot.experiments.simulation import simulated_rows
        from underfoot.experiments.trial_files import columns_of_study, write_csv

        of_people = (simulated_rows(protocol, person, options.seed, truth)[0] for person in range(people))
        rows = [row for of_person in of_people for row in of_person]
        write_csv(options.csv, rows, columns_of_study(rows, protocol))
    print(json.dumps(data_of([found])) if options.as_json else text_of([found]))


def _found(options: ExperimentOptions, protocol: "Protocol", folder: Path, people: int) -> "list[EstimateRow]":
    from underfoot.engine.worker_pool import cores
    from underfoot.experiments.simulation import SimulationSettings, jobs_of
    from underfoot.studies.simulated import simulate_locally, simulate_on_cluster

    settings = SimulationSettings(options.seed, options.bootstrap, _truth(options.truth))
    jobs = jobs_of(protocol, folder, people, settings)

    def seen(done: int) -> None:
        if sys.stderr.isatty():
            print(f"\runderfoot: {done} of {len(jobs)} parts", end="\n" if done == len(jobs) else "", file=sys.stderr)

    if options.cluster is not None:
        return simulate_on_cluster(jobs, options.cluster, seen)
    return simulate_locally(jobs, options.processes or cores(), seen)


def _truth(given: tuple[str, ...]) -> tuple[tuple[str, float], ...]:
    found = {}
    for text in given:
        name, _, value = text.partition("=")
        try:
            found[name] = float(value)
        except ValueError:
            raise BadValue(f"--truth is {text!r}; allowed: NAME=VALUE with a number, as threshold_m_s2=0.5") from None
    return tuple(found.items())
