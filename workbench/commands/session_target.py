"""The target of a command that opens a session: a simulator or hardware, with or without sound."""

from dataclasses import dataclass
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


def _recording(context: click.Context, parameter: click.Parameter, value: Path | None) -> Path | None:
    if value is None or value.is_dir():
        return value and value / f"{name_now()}{SUFFIXES[0]}"
    if value.suffix.lower() not in SUFFIXES:  # a folder that is missing would be a file, and refused at the next start
        raise BadValue(f"--record is {value}; allowed: a folder that is there, or a file NAME{SUFFIXES[0]}")
    return value


RECORD: Path | None = option(
    "Record the session to this file, NAME.underfoot; in a folder that is there, to one named by the time.",
    callback=_recording,
)
"""The option of every command whose session can be recorded."""


def _level(context: click.Context, parameter: click.Parameter, value: float) -> float:
    if not -120.0 <= value <= 0.0:
        raise BadValue(f"--level is {value:g}; allowed: -120 to 0 dB")
    return value


LEVEL: float = option("Output level in dB of full scale.", -20.0, show_default=True, callback=_level)
"""The option of commands that play for others: nobody moves the window's slider."""


@dataclass(frozen=True, kw_only=True)
class SessionOptions:
    """The options of every command that opens a session."""

    profiles: Path | None = option("Folder of the tiles' profiles.")
    sensor_rate: float | None = option("Samples per second of hardware tiles; by default 1000.")
    sound: str | None = option('Sound card to play on, "default" for the system\'s; by default none.', metavar="DEVICE")


@dataclass(frozen=True, kw_only=True)
class TargetOptions(SessionOptions):
    """The options of every command that opens a session with its own forces."""

    target: str = option(
        "simulator, or hardware, as for `monitor`.",
        "simulator",
        show_default=True,
        shell_complete=complete_names(live_targets),
    )
    floor: Path | None = option("Floor JSON of the target; by default the default floor.", presets="floors")

    def session_target(self, *, walker: bool) -> "Target":
        """Return the target, of which `walker` says whether somebody walks on a simulated floor.

        Raise `BadValue` if a session cannot have it.
        """
        from underfoot.engine.target import live_target, require_source, sound_device

        found = live_target(self.target, self.floor, self.sensor_rate)
        if found is None:
            allowed = "simulator, or hardware as `underfoot monitor` names it"
            raise BadValue(f"--target is {self.target}; allowed: {allowed}")
        profiles = str(self.profiles or "")
        found = replace(found, sound=sound_device(self.sound), walker=walker, profiles=profiles)
        require_source(found)
        return found
