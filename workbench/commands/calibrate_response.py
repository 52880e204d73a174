"""`underfoot calibrate response`: from a sweep and its recording, on the simulator, or through a sound card."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

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
from underfoot.errors import BadFile, BadValue

if TYPE_CHECKING:
    import numpy as np

    from underfoot.calibration.procedures.procedure import Bench, Page, Result
    from underfoot.calibration.science.sweep import Measured
    from underfoot.floor.layout import Floor, Tile

TARGETS = "simulator[:PARAMETERS.json], sound"


@click.command()
@click.option(
    "--sweep", type=FILE, help="WAV of the sweep as it was played: one pass, or several with silence between."
)
@click.option("--recorded", type=FILE, help="WAV of what the accelerometer made of it, at the same rate.")
@click.option("--channel", type=int, help="Channel of --recorded, from 0; by default the one that holds the sweep.")
@click.option("--target", default="", help=f"Measure on this target instead: {TARGETS}.")
@click.option("--sensitivity", type=float, help="m/s^2 at full scale of the input; 1 for files, 100 on a target.")
@click.option("--order", type=int, default=14, show_default=True, help="Order of the equaliser: even, 2 to 24.")
@click.option("--level", type=float, help="How loud a target plays, of full scale: 0.01 to 0.45.")
@click.option("--no-loads", is_flag=True, help="Leave out somebody standing on it, and a foot on a corner.")
@click.option("--output", "output_device", default="", help="Sound card of --target sound; the default one without.")
@click.option("--input", "input_device", default="", help="Its input; the default one without.")
@click.option("--input-channel", type=int, default=0, show_default=True, help="Channel of the accelerometer, from 0.")
@of_a_tile
def response(
    sweep: Path | None,
    recorded: Path | None,
    channel: int | None,
    target: str,
    sensitivity: float | None,
    order: int,
    level: float | None,
    no_loads: bool,
    output_device: str,
    input_device: str,
    input_channel: int,
    floor: Path | None,
    tile: str,
    serial: str,
    seed: int,
    profile: Path | None,
    report: Path | None,
    as_json: bool,
) -> None:
    """Measure how a tile answers its shaker, and design its equaliser."""
    from underfoot.models.filtering.equaliser import MOST_ORDER

    if (sweep is None) != (recorded is None) or (sweep is None) == (not target):
        raise BadValue("give either --sweep and --recorded, or --target")
    if sensitivity is not None and not 0.0 < sensitivity < 1e9:
        raise BadValue(f"--sensitivity is {sensitivity:g}; allowed: above 0, below 1e9 m/s^2")
    if order % 2 or not 2 <= order <= MOST_ORDER:
        raise BadValue(f"--order is {order}; allowed: even numbers 2 to {MOST_ORDER}")
    require_writable(profile, report)
    everything = floor_of(floor)
    one = tile_of(everything, tile)
    known = own_profile(profile, one.id, serial)
    if sweep is not None and recorded is not None:
        result = _from_files(sweep, recorded, channel, sensitivity, order)
    else:
        bench = _bench(target, everything, one, seed, output_device, input_device, input_channel)
        values = {"order": order, "sensitivity": sensitivity, "level": level}
        result = _on_target(one, bench, values, not no_loads, target == "sound")
    conclude(result, known, profile, report, as_json)


def _from_files(sweep: Path, recorded: Path, channel: int | None, sensitivity: float | None, order: int) -> "Result":
    from dataclasses import replace

    from underfoot.calibration.procedures.procedure import Refused
    from underfoot.calibration.science.response import Findings, result_of

    played, rate_hz = _read(sweep)
    heard, heard_hz = _read(recorded)
    if heard_hz != rate_hz:
        raise Refused(f"sweep and recording do not fit: {sweep} is at {rate_hz} Hz, {recorded} at {heard_hz} Hz")
    loudest = abs(played).max(axis=0)
    try:
        found = _channel_of(played[:, int(loudest.argmax())], heard, rate_hz, channel)
        result = result_of(Findings({"none": found}, sensitivity or 1.0, rate_hz, order))
    except BadValue as error:
        raise BadFile(f"{sweep} and {recorded}: {error}") from None
    if sensitivity is None:
        unknown = "no --sensitivity was given: recorded samples count as m/s^2"
        result = replace(result, warnings=(*result.warnings, unknown))
    return result


def _channel_of(played: "np.ndarray", heard: "np.ndarray", rate_hz: int, channel: int | None) -> "Measured":
    """What the recording's channel tells, or the only one that holds the sweep."""
    from underfoot.calibration.procedures.procedure import Refused
    from underfoot.calibration.science.sweep import measure

    several = heard.shape[1]
    if channel is not None:
        if not 0 <= channel < several:
            raise BadValue(f"--channel is {channel}; allowed: 0 to {several - 1}")
        return measure(played, heard[:, channel], rate_hz)
    found: dict[int, Measured] = {}
    reasons: list[Refused] = []
    for k in range(several):
        try:
            found[k] = measure(played, heard[:, k], rate_hz)
        except Refused as reason:
            reasons.append(reason)
    # One accelerometer on both channels of a stereo file is one measurement.
    if len(found) > 1 and not _alike(heard[:, list(found)]):
        raise Refused(f"channels {', '.join(map(str, found))} all hold the sweep; say --channel")
    if not found:
        raise reasons[int(abs(heard).max(axis=0).argmax())]
    return next(iter(found.values()))


def _alike(channels: "np.ndarray") -> bool:
    """Whether channels are one signal, louder or softer."""
    import numpy as np

    return bool((np.corrcoef(channels, rowvar=False) > 0.9999).all())


def _read(path: Path) -> tuple["np.ndarray", int]:
    """The samples of a WAV, float64 [frame, channel], and its rate."""
    import soundfile

    try:
        samples, rate_hz = soundfile.read(path, dtype="float64", always_2d=True)
    except (OSError, soundfile.LibsndfileError) as error:
        reason = getattr(error, "error_string", None) or getattr(error, "strerror", None) or str(error)
        raise BadFile(f"{path} cannot be read: {reason.rstrip('.').lower()}") from None
    if not samples.size:
        raise BadFile(f"{path} holds no samples")
    return samples, int(rate_hz)


def _bench(target: str, floor: "Floor", tile: "Tile", seed: int, output: str, input: str, heard_on: int) -> "Bench":
    from underfoot.engine.loop import output_channels
    from underfoot.engine.sounding import SimulatedShaker, SoundCard

    if target == "sound":
        return SoundCard(output, input, output_channels(floor)[floor.index(tile.id)], heard_on)
    simulated = simulated_tile(target, tile, seed)
    if simulated is None:
        raise BadValue(f"--target is {target!r}; allowed: {TARGETS}")
    return SimulatedShaker(simulated)


def _on_target(tile: "Tile", bench: "Bench", values: dict[str, Any], loads: bool, with_person: bool) -> "Result":
    from underfoot.calibration.procedures.procedure import step
    from underfoot.calibration.procedures.response import FrequencyResponse

    procedure = FrequencyResponse(tile)
    given = {name: value for name, value in values.items() if value is not None}
    try:
        while procedure.result is None:
            page = procedure.page
            if page.may_skip and not loads:
                procedure.skip()
                continue
            _show(page, with_person)
            step(procedure, bench, given)
    finally:
        bench.close()
    return procedure.result


def _show(page: "Page", with_person: bool) -> None:
    """Say what is done; where a person has something to do, wait for it."""
    print(f"underfoot: {page.title}. {page.do}", file=sys.stderr, flush=True)
    if with_person and page.sound is None and sys.stdin.isatty():
        click.pause("underfoot: press any key", err=True)
