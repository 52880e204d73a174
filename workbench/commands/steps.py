"""`underfoot steps`: the footsteps of a recording, and which of them are left out of means."""

from pathlib import Path

import click

from underfoot.commands.compare import survey_told
from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import FILE, require_recording
from underfoot.errors import BadValue


@click.command()
@click.argument("recording", type=FILE)
@click.argument("numbers", metavar="[STEP]...", type=int, nargs=-1)
@click.option(
    "--leave-out", "why", metavar="WHY", help='Leave the STEPs out of means for a reason; "" takes them in again.'
)
def steps(recording: Path, numbers: tuple[int, ...], why: str | None) -> None:
    """Print the footsteps of RECORDING as CSV, all or by their numbers, or leave some out of means.

    What is measured stays in the file. compare and the window pass over a step that is left out, and over what is
    measured from it to the next ones; exports have the reason.
    """
    from underfoot.records.recording import Recording
    from underfoot.records.survey import RecordedForces
    from underfoot.records.tables import recorded_step_lines

    require_recording(recording)
    numbers = tuple(dict.fromkeys(numbers))
    with Recording(recording) as opened, report_compiling(None):
        found = {one.step.step: one.step for one in survey_told(opened).steps}
        unknown = [str(number) for number in numbers if number not in found]
        if unknown or (why is not None and not numbers):
            given = f"{recording} has no step {', '.join(unknown)}" if unknown else "--leave-out needs the steps"
            allowed = f"1 to {max(found)}" if found else "none: there are no steps"
            raise BadValue(f"{given}; allowed: {allowed}, as `underfoot steps {recording.name}` lists them")
        chosen = [found[number] for number in numbers or found]
        if why is None:
            print("\n".join(recorded_step_lines(chosen)))
            return
        forces = RecordedForces(opened)
        opened.leave_out([(forces.frame_at(step.start_s), step.tile) for step in chosen], why)
    told = ", ".join(map(str, numbers))
    print(f"left out: {told} ({' '.join(why.split())})" if why.strip() else f"count again: {told}")
