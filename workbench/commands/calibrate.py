"""`underfoot calibrate KIND`: calibrations without the window, on a target or from files.

Each subcommand is made of what a calibration declares (`calibration.declaration`), of the options of the rig that it
needs, and of those that every calibration of a tile has.
"""

import sys
from typing import TYPE_CHECKING

import click

from underfoot.commands import SentenceGroup
from underfoot.commands.compiling import report_compiling
from underfoot.commands.options import command, require_only
from underfoot.commands.telling import tell
from underfoot.errors import BadMeasurement, BadValue, DeviceError, UnderfootError

if TYPE_CHECKING:
    from underfoot.calibration.declaration import Calibration, MeasurementSetup
    from underfoot.calibration.procedure import Page
    from underfoot.calibration.result import Result
    from underfoot.commands.rigs import MeasuringRig
    from underfoot.commands.tile_options import TileOptions
    from underfoot.floor.layout import Floor


class Calibrations(SentenceGroup):
    """A command for each calibration, named as in the window; the part of the profile that it makes names it, too.

    What they need is imported when one is asked for.
    """

    def list_commands(self, ctx: click.Context) -> list[str]:
        from underfoot.calibration.procedures import CALIBRATIONS

        return [declared.command() for declared in CALIBRATIONS.values()]

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        from underfoot.calibration.procedures import CALIBRATIONS

        known = {declared.command(): declared for declared in CALIBRATIONS.values()} | CALIBRATIONS
        return command_of(known[cmd_name]) if cmd_name in known else None


@click.group(cls=Calibrations, no_args_is_help=False)
def calibrate() -> None:
    """Calibrate a tile: forces, places of contact, vibration, latency, and the stiffness of a plate on it."""


def command_of(declared: "type[Calibration]") -> click.Command:
    """Return the command of one calibration."""
    from underfoot.commands.rigs import RIGS
    from underfoot.commands.tile_options import TileOptions

    @command(declared, RIGS[declared.rig], TileOptions, name=declared.command(), help=declared.summary)
    def run(calibration: "Calibration", rig: "MeasuringRig", tile: "TileOptions") -> None:
        calibration.check(rig.target)
        tile.require_writable()
        if rig.target:
            _on_target(calibration, rig, tile)
            return
        require_only(rig, "files of a measurement", "--target")
        measured = calibration.from_files(tile.floor, tile.tile)
        known = tile.known(measured.tile)
        tile.conclude(measured.analyse(known), known)

    return run


def _on_target(calibration: "Calibration", rig: "MeasuringRig", options: "TileOptions") -> None:
    """Measure on a target, and put the result into the profile; first what the calibration requires."""
    from underfoot.calibration.declaration import MeasurementSetup
    from underfoot.calibration.procedures import CALIBRATIONS

    floor, tile = options.chosen()
    known = options.known(tile.id)
    if calibration.requires and known.part(calibration.requires) is None:
        if not rig.is_simulated:
            first = CALIBRATIONS[calibration.requires].command()
            raise BadValue(f"{calibration.command()} needs {first} first: calibrate {first}, and give its --profile")
        required = CALIBRATIONS[calibration.requires]()
        known = _measured(required, rig, floor, MeasurementSetup(tile, known, options.seed), options).apply(known)
    with report_compiling():
        setup = MeasurementSetup(tile, known, options.seed, sensors=rig.sensors)
        found = _measured(calibration, rig, floor, setup, options)
    options.conclude(found, known)


def _measured(
    calibration: "Calibration", rig: "MeasuringRig", floor: "Floor", setup: "MeasurementSetup", options: "TileOptions"
) -> "Result":
    """Run a procedure on a rig. On hardware a person reads what to do, and repeats what was refused.

    A line that is gone ends it only while nothing was measured. Whatever else ends it, its data are kept: also
    Ctrl-C, a request to end, and a terminal that is closed.
    """
    from underfoot.calibration.declaration import SHAKING
    from underfoot.calibration.procedure import run
    from underfoot.calibration.result import Inconclusive

    by_hand, shakes = not rig.is_simulated, calibration.rig == SHAKING

    def show(page: "Page") -> None:
        instruction = f". {page.instruction}" if by_hand or shakes else ""
        tell(f"{page.title}{instruction}")
        if by_hand and shakes and page.sound is None and sys.stdin.isatty():
            _wait_for_key()

    opened = rig.open(floor, setup.tile, setup.seed)
    try:
        procedure, answers = calibration.procedure(setup), calibration.answers(rig.has_load_cell)
        waits = False
        while True:
            try:
                if waits:
                    _wait_for_key()
                found = run(procedure, opened, answers, show, calibration.skips)
                return found.with_origin(simulated=rig.is_simulated)
            except (UnderfootError, KeyboardInterrupt) as error:
                page, measured = procedure.page, procedure.without_conclusion(str(error) or "interrupted")
                can_repeat = page.press is not None or (page.sound is not None and sys.stdin.isatty())
                is_final = isinstance(error, Inconclusive) or not isinstance(error, (BadMeasurement, DeviceError))
                is_nothing_lost = isinstance(error, DeviceError) and measured is None
                if not by_hand or not can_repeat or is_nothing_lost or is_final:
                    if measured is not None:
                        kept = measured.with_origin(simulated=rig.is_simulated)
                        options.keep(kept, setup.tile.id, by_hand=by_hand)
                    raise
                is_of_one = page.may_skip and page.press is not None and page.press.sensor is not None
                tell(f"{error}; again{', or end it, and name the sensor in --without' if is_of_one else ''}")
                waits = page.sound is not None
    finally:
        opened.close()


def _wait_for_key() -> None:
    """Wait for a key; Ctrl-C raises `KeyboardInterrupt`, where `click.pause` would go on, and play."""
    tell("press any key")
    click.getchar()
