"""`underfoot steps`: the footsteps of a recording, and what is noted of them."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import click

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import FILE
from underfoot.commands.surveying import survey_told
from underfoot.errors import BadValue

if TYPE_CHECKING:
    from collections.abc import Sequence

    from underfoot.floor.footsteps import Step
    from underfoot.records.recording import Recording
    from underfoot.records.survey import Survey

_STANDING = "standing"
"""Given as a weight: that of a standing phase."""


@click.command()
@click.argument("recording", type=FILE)
@click.argument("numbers", metavar="[STEP]...", type=int, nargs=-1)
@click.option(
    "--leave-out", "why", metavar="WHY", help='Leave the STEPs out of means for a reason; "" takes them in again.'
)
@click.option(
    "--body-weight",
    metavar="WEIGHT",
    help='Note the body weight of who walks, as "71.4 kg", "700 N" or "standing": where somebody stands still for 2 s; '
    '"" removes it.',
)
@click.option("--person", type=click.IntRange(1), help="Whose weight it is, if not that of all.")
def steps(
    recording: Path, numbers: tuple[int, ...], why: str | None, body_weight: str | None, person: int | None
) -> None:
    """Print the footsteps of RECORDING as CSV, all or by their numbers, or leave some out of means, or note a weight.

    What is measured stays in the file. compare and the window pass over a step that is left out, and over what is
    measured from it to the next ones; exports have the reason.
    """
    from underfoot.records.notes import body_weight_n
    from underfoot.records.recording import Recording
    from underfoot.records.tables import recorded_step_lines

    with_steps, with_weight = bool(numbers) or why is not None, body_weight is not None
    if (with_steps and with_weight) or (person is not None and not with_weight):
        raise BadValue("a body weight is that of a person; allowed: --body-weight, also with --person, and no STEP")
    weight = (body_weight or "").strip()
    typed_n = body_weight_n(weight) if weight not in ("", _STANDING) else math.nan
    numbers = tuple(dict.fromkeys(numbers))
    with Recording(recording) as opened, report_compiling(None):
        surveyed = survey_told(opened)
        if body_weight is not None:
            _weigh(opened, surveyed, person, typed_n, is_found=weight == _STANDING)
            return
        found = {one.step.step: one.step for one in surveyed.steps}
        unknown = [str(number) for number in numbers if number not in found]
        if unknown or (why is not None and not numbers):
            given = f"{recording} has no step {', '.join(unknown)}" if unknown else "--leave-out needs the steps"
            allowed = f"1 to {max(found)}" if found else "none: there are no steps"
            raise BadValue(f"{given}; allowed: {allowed}, as `underfoot steps {recording.name}` lists them")
        chosen = [found[number] for number in numbers or found]
        if why is None:
            print("\n".join(recorded_step_lines(chosen)))
            return
        _leave_out(opened, chosen, why)


def _leave_out(recording: "Recording", steps: "Sequence[Step]", why: str) -> None:
    """Leave steps out for a reason, or take them in again, and say so; nothing without a step."""
    from underfoot.records.survey import RecordedForces

    forces = RecordedForces(recording)
    recording.leave_out([(forces.frame_at(step.start_s), step.tile) for step in steps], why)
    told = ", ".join(str(step.step) for step in steps)
    if told:
        print(f"left out: {told} ({' '.join(why.split())})" if why.strip() else f"count again: {told}")


def _weigh(recording: "Recording", found: "Survey", person: int | None, weight_n: float, *, is_found: bool) -> None:
    """Note a body weight, NaN for none, or that of a standing phase if it is to be found; say all that are noted."""
    from underfoot.records.standing import STILL_S, WHY, standing_phase

    known = {one.step.person for one in found.steps} - {0}
    if person is not None and person not in known:
        allowed = ", ".join(map(str, sorted(known))) or "none"
        raise BadValue(f"{recording.path} has no person {person}; allowed: {allowed}")
    source = "typed"
    if is_found:
        phase = standing_phase(found.balance)
        if not phase:
            raise BadValue(
                f"nobody stands still for {STILL_S:g} s in {recording.path}; allowed: a weight, as '71.4 kg'"
            )
        weight_n, source = phase.weight_n, str(phase)
        _leave_out(recording, [one.step for one in found.steps if phase.is_in(one.step)], WHY)
    recording.note_body_weight(person or 0, weight_n, source)
    noted = [
        f"body weight of {f'person {one.person}' if one.person else 'who walks'}: {one.weight_n:.1f} N ({one.source})"
        for one in recording.body_weights()
    ]
    print("\n".join(noted or ["no body weight is noted"]))
