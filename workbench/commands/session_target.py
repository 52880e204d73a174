"""The target of a command that opens a session: a simulator or hardware, with or without sound."""

from pathlib import Path
from typing import TYPE_CHECKING

import click
from msgspec.structs import replace

from underfoot.commands.files import complete_names, live_targets
from underfoot.errors import BadValue
from underfoot.options import option
from underfoot.records.recording_format import SUFFIXES, name_now

if TYPE_CHECKING:
    from underfoot.engine.target import Target


TARGET: str = option(
    "simulator, or hardware, as for `monitor`.",
    "simulator",
    show_default=True,
    shell_complete=complete_names(live_targets),
)
"""The option of every command that opens a session with its own forces."""

TARGET_FLOOR: Path | None = option("Floor JSON of the target; by default the default floor.", presets="floors")
"""The floor of that target."""

PROFILES: Path | None = option("Folder of the tiles' profiles.")
"""The option of every command that opens a session."""


def _recording(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    return value / f"{name_now()}{SUFFIXES[0]}" if value is not None and value.is_dir() else value


RECORD: Path | None = option(
    "Record the session to this file; in a folder that is there, to one named by the time.",
    is_written=True,
    callback=_recording,
)
"""The option of every command whose session can be recorded."""

SENSOR_RATE: float | None = option("Samples per second of hardware tiles; by default 1000.")
"""The option of every command that opens a session with hardware."""

SOUND: str | None = option('Sound card to play on, "default" for the system\'s; by default none.', metavar="DEVICE")
"""The option of every command whose session may play."""


def _level(context: click.Context, parameter: click.Parameter, value: float) -> float:
    if not -120.0 <= value <= 0.0:
        raise BadValue(f"--level is {value:g}; allowed: -120 to 0 dB")
    return value


LEVEL: float = option("Output level in dB of full scale.", -20.0, show_default=True, callback=_level)
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
