"""Cues: requests of other programs by OSC. Each is one class with its address, its arguments and their ranges.

A cue that comes in is checked against what it declares here, and against the floor, the presets and the patch where it
is carried out (`cue_player.py`). Nothing in a cue names a file.
"""

import math
from dataclasses import MISSING, dataclass, fields
from typing import ClassVar

from underfoot.errors import BadValue, require
from underfoot.network.osc import Argument, Message

ALL = "all"
"""Name of all tiles."""

GAIN_DB = (-80.0, 20.0)
STRENGTH = (0.0, 10.0)
LONGEST_TEXT = 200
NO_NUMBER = -1
"""Number of a cue that was sent without one."""


@dataclass(frozen=True)
class Cue:
    """Base of all cues. `number` is chosen by the sender, and returned in the answer."""

    address: ClassVar[str]
    cues: ClassVar[dict[str, type["Cue"]]] = {}

    def __init_subclass__(cls, address: str) -> None:
        super().__init_subclass__()
        cls.address = address
        Cue.cues[address] = cls

    def check(self) -> None:
        """Raise `BadValue` for values that are never allowed, whatever is played."""


@dataclass(frozen=True)
class PlayCue(Cue, address="/underfoot/play"):
    """Play a preset on a tile, or on "all", at a gain in decibels, instead of what is played there."""

    preset: str
    tile: str
    gain_db: float
    number: int = NO_NUMBER

    def check(self) -> None:
        _require_between("gain_db", self.gain_db, GAIN_DB, " dB")


@dataclass(frozen=True)
class StopCue(Cue, address="/underfoot/stop"):
    """Play the floor's own patch on a tile, or on "all", again, and undo all values that were set."""

    tile: str = ALL
    number: int = NO_NUMBER


@dataclass(frozen=True)
class StrikeCue(Cue, address="/underfoot/strike"):
    """Send an event to every strike node, on a tile or on "all"."""

    tile: str
    strength: float = 1.0
    number: int = NO_NUMBER

    def check(self) -> None:
        _require_between("strength", self.strength, STRENGTH)


@dataclass(frozen=True)
class SetCue(Cue, address="/underfoot/set"):
    """Set a parameter of a node of the patch that is played."""

    node: str
    parameter: str
    value: Argument
    number: int = NO_NUMBER

    def check(self) -> None:
        require(not isinstance(self.value, float) or math.isfinite(self.value), "value", self.value, "a finite number")


@dataclass(frozen=True)
class MarkCue(Cue, address="/underfoot/mark"):
    """Set a mark in the recording, and send it to listeners."""

    text: str
    number: int = NO_NUMBER

    def check(self) -> None:
        require(bool(self.text), "text", self.text, f"1 to {LONGEST_TEXT} characters")


@dataclass(frozen=True)
class PanicCue(Cue, address="/underfoot/panic"):
    """Silence at once. Only a person at this computer can restart the sound."""


@dataclass(frozen=True)
class HelloCue(Cue, address="/underfoot/hello"):
    """Ask for the description of this floor."""


def cue_of(message: Message) -> Cue:
    """Return the cue of a message; `BadValue` for an unknown address or wrong arguments.

    >>> cue_of(Message("/underfoot/play", ("gravel", "t1", -6)))
    PlayCue(preset='gravel', tile='t1', gain_db=-6.0, number=-1)
    >>> cue_of(Message("/underfoot/play", ("gravel", "t1", float("nan"))))
    Traceback (most recent call last):
    underfoot.errors.BadValue: gain_db is nan; allowed: -80 to 20 dB
    """
    require(message.address in Cue.cues, "the address", message.address, ", ".join(Cue.cues))
    kind = Cue.cues[message.address]
    declared = fields(kind)
    least = sum(one.default is MISSING for one in declared)
    if not least <= len(message.arguments) <= len(declared):
        names = " ".join(one.name for one in declared) or "none"
        raise BadValue(f"{message.address} has {len(message.arguments)} arguments; allowed: {names}")
    pairs = zip(declared, message.arguments, strict=False)
    cue = kind(**{one.name: _converted(one.name, one.type, given) for one, given in pairs})
    cue.check()
    return cue


def _converted(name: str, wanted: object, given: Argument) -> Argument:
    """Return an argument with the declared type; an integer is accepted for a float, nothing else."""
    if wanted is float and type(given) is int:
        given = float(given)
    if wanted in _WORDS and type(given) is not wanted:
        raise BadValue(f"{name} is {given!r}; allowed: {_WORDS[wanted]}")
    if isinstance(given, str):
        require(len(given) <= LONGEST_TEXT, name, given, f"at most {LONGEST_TEXT} characters")
    if isinstance(given, int) and abs(given) > _LARGEST:
        raise BadValue(f"{name} is {given}; allowed: whole numbers of 32 bits")
    return given


_LARGEST = 0x7FFFFFFF


_WORDS: dict[object, str] = {str: "text (s)", float: "a number (f, d or i)", int: "a whole number (i or h)"}


def _require_between(name: str, value: float, limits: tuple[float, float], unit: str = "") -> None:
    low, high = limits
    require(low <= value <= high, name, value, f"{low:g} to {high:g}{unit}")
