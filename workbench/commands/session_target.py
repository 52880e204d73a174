"""The target of a command that opens a session: a simulator or hardware, with or without sound."""

from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec.structs import replace

from underfoot.commands.files import FILE, FLOOR, OUTPUT
from underfoot.errors import BadValue
from underfoot.records.recording_format import SUFFIXES, name_now

if TYPE_CHECKING:
    from underfoot.engine.target import Target


TARGET = click.option(
    "--target", default="simulator", show_default=True, help="simulator, or hardware, as for `monitor`."
)
"""The option of every command that opens a session with its own forces."""

TARGET_FLOOR = click.option("--floor", type=FLOOR, help="Floor JSON of the target; by default the default floor.")
"""The floor of that target."""

PROFILES = click.option("--profiles", type=FILE, help="Folder of the tiles' profiles.")
"""The option of every command that opens a session."""


def _recording(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    return value / f"{name_now()}{SUFFIXES[0]}" if value is not None and value.is_dir() else value


RECORD = click.option(
    "--record",
    type=OUTPUT,
    callback=_recording,
    help="Record the session to this file; in a folder that is there, to one named by the time.",
)
"""The option of every command whose session can be recorded."""

SENSOR_RATE = click.option("--sensor-rate", type=float, help="Samples per second of hardware tiles; by default 1000.")
"""The option of every command that opens a session with hardware."""

SOUND = click.option(
    "--sound", metavar="DEVICE", help='Sound card to play on, "default" for the system\'s; by default none.'
)
"""The option of every command whose session may play."""


def _level(context: click.Context, parameter: click.Parameter, value: float) -> float:
    if not -120.0 <= value <= 0.0:
        raise BadValue(f"--level is {value:g}; allowed: -120 to 0 dB")
    return value


LEVEL = click.option(
    "--level",
    type=float,
    default=-20.0,
    show_default=True,
    callback=_level,
    help="Output level in dB of full scale.",
)
"""The option of commands that play for others: nobody moves the window's slider."""


def session_target(
    name: str,
    floor: Path | None,
    profiles: Path | None,
    sound: str | None,
    sensor_hz: float | None,
    *,
    walker: bool,
) -> "Target":
    """Return the target `name` on a floor, with a sound device ("default" for the system's, None for none).

    `walker` says whether somebody walks on a simulated floor. Raise `BadValue` if a session cannot have this target.
    """
    from underfoot.engine.target import live_target, require_source, sound_device

    target = live_target(name, floor, sensor_hz)
    if target is None:
        raise BadValue(f"--target is {name}; allowed: simulator, or hardware as `underfoot monitor` names it")
    target = replace(target, sound=sound_device(sound), walker=walker, profiles=str(profiles or ""))
    require_source(target)
    return target
