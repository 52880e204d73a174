"""`underfoot plate`: calibrate a variable stiffness plate, move it, or emulate one."""

import json
import time
from dataclasses import dataclass
from pathlib import Path

from underfoot.commands.files import require_folders_writable, require_outputs_writable
from underfoot.commands.options import command, require_only
from underfoot.errors import BadValue
from underfoot.options import option


@dataclass(frozen=True)
class PlateOptions:
    """Options of the command."""

    footsteps: Path | None = option("CSV of footsteps: position,footstep,force_n,displacement_mm.")
    output: Path | None = option("Write the calibration.", flag="-o --output", is_written=True)
    report: Path | None = option("Folder for a page with pictures and a table of all footsteps.")
    port: str | None = option('Serial port of a plate to move, or "simulated".')
    calibration: Path | None = option("Its calibration.")
    stiffness: float | None = option("Move the plate to this stiffness, N/mm. Nobody may stand on it.")
    emulate: bool = option("Emulate a plate on a pseudo-terminal, and print its name, until Ctrl-C.", False)
    as_json: bool = option("Print the calibration as JSON.", False, "--json")


@command(PlateOptions)
def plate(options: PlateOptions) -> None:
    """Calibrate, move or emulate a variable stiffness plate."""
    if options.emulate:
        require_only(options, "--emulate", "")
        _emulate()
    elif options.footsteps is not None:
        require_only(options, "--footsteps", "--output --report --json")
        _calibrate(options, options.footsteps)
    elif options.stiffness is not None and options.port and (options.calibration or options.port == "simulated"):
        require_only(options, "--port", "--calibration --stiffness")
        _move(f"{options.port}:{options.calibration or ''}".removesuffix(":"), options.stiffness)
    else:
        raise BadValue("give --footsteps, or --port with --calibration and --stiffness, or --emulate")


def _calibrate(options: PlateOptions, footsteps: Path) -> None:
    from underfoot.calibration.files.plate_profiles import read_plate_profiles
    from underfoot.calibration.results.plate import error_words
    from underfoot.calibration.science.plate_stiffness import drawings_of, line_of, plate_fit
    from underfoot.drawing.page import page
    from underfoot.drawing.svg import svg
    from underfoot.files import make_folder, write_file

    require_outputs_writable(options.output, inputs=(footsteps,))
    require_folders_writable(options.report)
    profiles = read_plate_profiles(footsteps)
    fit = plate_fit([line_of(position, *samples) for (position, _), samples in profiles.items()])
    if options.output is not None:
        fit.calibration.save(options.output)
    verdict = f"{len(fit.lines)} footsteps. {error_words(fit)}"
    if options.report is not None:
        drawings = drawings_of(fit, list(profiles.values()))
        body = [f"<p>{verdict}</p>", *(svg(drawing) for drawing in drawings)]
        write_file(make_folder(options.report) / "plate.html", page("Variable stiffness plate", body).encode())
    pairs = list(zip(fit.calibration.positions, fit.calibration.stiffness_n_mm, strict=True))
    if options.as_json:
        print(json.dumps({"points": pairs, "error": fit.calibration.error, "good": fit.good}))
        return
    for position, stiffness in pairs:
        print(f"position {position:.3f}: {stiffness:.1f} N/mm")
    print(verdict)


def _move(text: str, stiffness_n_mm: float) -> None:
    from underfoot.devices.plate import MOVE_S, plate_of, split_plate

    moved, (port, _) = plate_of(text), split_plate(text)
    try:
        moved.request_stiffness(stiffness_n_mm)
        position = moved.calibration.position(stiffness_n_mm)
        print(f"{port} goes to position {position:.3f}, in {MOVE_S:g} s", flush=True)
        while not moved.poll(is_loaded=False):
            time.sleep(0.02)
    finally:
        moved.close()
    print(f"{port} is at {stiffness_n_mm:g} N/mm")


def _emulate() -> None:
    from underfoot.devices.emulation.plate import EmulatedPlate

    emulated, told = EmulatedPlate(), 0
    print(emulated.name, flush=True)
    try:
        while True:
            time.sleep(0.1)
            for begin, end, seconds in emulated.servo.moves[told:]:
                print(f"moves from {begin:.3f} to {end:.3f} in {seconds:g} s", flush=True)
                told += 1
    except KeyboardInterrupt:
        pass
    finally:
        emulated.close()
