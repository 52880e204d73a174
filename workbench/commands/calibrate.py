"""`underfoot calibrate fsr|centroid|response`: the wizards, on a target or on measurements in a file."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from underfoot.commands.calibrate_response import response
from underfoot.commands.files import FILE
from underfoot.commands.profiles import (
    conclude,
    floor_of,
    of_a_tile,
    own_profile,
    require_writable,
    simulated_tile,
    tile_of,
)
from underfoot.devices.transports import split_target, target_forms, transport_of
from underfoot.errors import BadFile, BadValue

if TYPE_CHECKING:
    from underfoot.calibration.procedures.procedure import Bench, Page, Procedure, Result
    from underfoot.floor.layout import Tile


@click.group()
def calibrate() -> None:
    """Turn readings into newtons, newtons into places, and drive into accelerations that can be trusted."""


calibrate.add_command(response)

_TARGET = click.option(
    "--target",
    default="",
    help=f"Measure there: simulator[:PARAMETERS.json] (which presses), {target_forms()}.",
)
_CELL = click.option(
    "--cell", default="", help="Load cell on the target: TILE.SENSOR:NEWTONS_A_COUNT:ZERO, as 9.1:0.05:120."
)


@calibrate.command()
@click.option("--pairs", type=FILE, help="CSV of readings beside a reference: time_s,tile,sensor,reading,force_n.")
@_TARGET
@_CELL
@click.option("--divider-ohm", type=float, help="Resistor in series with a sensor; R = Rs/F + R0 is tried then, too.")
@click.option("--divider-falling", is_flag=True, help="The reading falls with force.")
@of_a_tile
def fsr(
    pairs: Path | None,
    target: str,
    cell: str,
    floor: Path | None,
    tile: str,
    serial: str,
    divider_ohm: float | None,
    divider_falling: bool,
    seed: int,
    profile: Path | None,
    report: Path | None,
    as_json: bool,
) -> None:
    """Linearise force sensing resistors against a reference."""
    from underfoot.calibration.files.tables import read_pairs
    from underfoot.calibration.procedures.fsr import FsrProcedure, result_of
    from underfoot.calibration.science.linearisation import Divider, linearise

    _require_one("--pairs", pairs, target)
    require_writable(profile, report)
    if divider_ohm is not None and not divider_ohm > 0.0:
        raise BadValue(f"--divider-ohm is {divider_ohm:g}; allowed: above 0")
    divider = None if divider_ohm is None else Divider(divider_ohm, falling=divider_falling)
    if pairs is not None:
        table = read_pairs(pairs, tile)
        known = own_profile(profile, table.tile, serial)
        try:
            found = linearise(table, divider)
        except BadValue as error:
            raise BadFile(f"{pairs}: {error}") from None
        conclude(result_of(found, f"pairs of {pairs.name}"), known, profile, report, as_json)
        return
    everything = floor_of(floor)
    one = tile_of(everything, tile)
    known = own_profile(profile, one.id, serial)
    place = (everything.index(one.id), cell)
    values = {"reference": "load cell" if cell or _presses(target) else "known weights"}
    result = _measured(FsrProcedure(one, divider), target, one, seed, values, place)
    conclude(result, known, profile, report, as_json)


@calibrate.command()
@click.option("--presses", type=FILE, help="CSV of loads at known places: tile,x_m,y_m,force_n,r1,r2,r3,r4.")
@_TARGET
@_CELL
@click.option("--quick", is_flag=True, help="Nine places instead of fifty, on a target.")
@of_a_tile
def centroid(
    presses: Path | None,
    target: str,
    cell: str,
    floor: Path | None,
    tile: str,
    serial: str,
    quick: bool,
    seed: int,
    profile: Path | None,
    report: Path | None,
    as_json: bool,
) -> None:
    """Measure how true the contact centroid is, and learn what corrects it."""
    from underfoot.calibration.files.tables import read_presses
    from underfoot.calibration.procedures.centroid import CentroidProcedure, result_of
    from underfoot.calibration.procedures.fsr import FsrProcedure
    from underfoot.calibration.science.centroid import assessed

    _require_one("--presses", presses, target)
    require_writable(profile, report)
    if presses is not None and floor is None:
        raise BadValue("--presses needs --floor: the sensors' places are in the floor JSON")
    everything = floor_of(floor)
    if presses is not None:
        table = read_presses(presses, tile)
        one = tile_of(everything, table.tile)
        known = own_profile(profile, one.id, serial)
        try:
            found = assessed(table, one, known)
        except BadValue as error:
            raise BadFile(f"{presses}: {error}") from None
        conclude(result_of(found, table), known, profile, report, as_json)
        return
    one = tile_of(everything, tile)
    known = own_profile(profile, one.id, serial)
    values = {"form": "quick" if quick else "full"}
    place = (everything.index(one.id), cell)
    if not known.is_calibrated:
        if not _presses(target):
            raise BadValue("readings of a target are counts; calibrate fsr first, and give its --profile")
        result = _measured(FsrProcedure(one), target, one, seed, {}, place)
        known = result.apply(known)
    result = _measured(CentroidProcedure(one, known, seed), target, one, seed, values, place)
    conclude(result, known, profile, report, as_json)


def _presses(target: str) -> bool:
    """Whether the target presses by itself."""
    from underfoot.engine.target import simulation_of

    return simulation_of(target) is not None


def _require_one(option: str, file: Path | None, target: str) -> None:
    if (file is None) == (not target):
        raise BadValue(f"give either {option} or --target")


def _measured(
    procedure: "Procedure",
    target: str,
    tile: "Tile",
    seed: int,
    values: Mapping[str, object],
    place: tuple[int, str],
) -> "Result":
    """Run on a target. The simulator's refusals end it; a person is told, and tries again."""
    from underfoot.calibration.procedures.procedure import Refused, run

    by_hand = not _presses(target)

    def seen(page: "Page") -> None:
        print(f"underfoot: {page.title}" + (f". {page.do}" if by_hand else ""), file=sys.stderr, flush=True)

    bench = _bench(target, tile, seed, *place)
    try:
        while True:
            try:
                return run(procedure, bench, values, seen)
            except Refused as error:
                if not by_hand or procedure.page.press is None:
                    raise
                print(f"underfoot: {error}; again", file=sys.stderr, flush=True)
    finally:
        bench.close()


def _bench(target: str, tile: "Tile", seed: int, row: int, cell: str) -> "Bench":
    from underfoot.calibration.procedures.device_bench import LinkBench, cell_of
    from underfoot.calibration.procedures.simulated_bench import SimulatedBench

    simulated = simulated_tile(target, tile, seed)
    if simulated is not None:
        if cell:
            raise BadValue("--cell is for hardware; the simulator has a load cell of its own")
        return SimulatedBench(simulated, seed)
    hardware = split_target(target)
    if hardware is None:
        raise BadValue(f"--target is {target!r}; allowed: simulator[:PARAMETERS.json], {target_forms()}")
    return LinkBench(transport_of(*hardware), row, cell_of(cell) if cell else None)
