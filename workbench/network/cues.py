"""Cues: requests of other programs by OSC. Each is one class with its address, its arguments and their ranges.

A cue that comes in is checked against what it declares here, and against the floor, the presets and the patch where it
is carried out (`cue_player.py`). Nothing in a cue names a file.
"""

import math
from typing import ClassVar

from msgspec import Struct
from msgspec.structs import fields

from underfoot.arguments import choice
from underfoot.errors import BadValue, require
from underfoot.network.osc import Argument, Message

ALL = "all"
"""Name of all tiles."""

GAIN_DB = (-80.0, 20.0)
STRENGTH = (0.0, 10.0)
LONGEST_TEXT = 200
NO_NUMBER = -1
"""Number of a cue that was sent without one."""


class Cue(Struct, frozen=True):
    """Base of all cues. `number` is chosen by the sender, and returned in the answer."""

    address: ClassVar[str]
    takes_anything: ClassVar[bool] = False
    """Whether its arguments do not matter: the buttons of many programs send a value with each press."""
    cues: ClassVar[dict[str, type["Cue"]]] = {}

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        Cue.cues[cls.address] = cls

    def check(self) -> None:
        """Raise `BadValue` for values that are never allowed, whatever is played."""


class PlayCue(Cue, frozen=True):
    """Play a preset on a tile, or on "all", at a gain in decibels, instead of what is played there."""

    address: ClassVar[str] = "/underfoot/play"

    preset: str
    tile: str
    gain_db: float
    number: int = NO_NUMBER

    def check(self) -> None:
        _require_between("gain_db", self.gain_db, GAIN_DB, " dB")


class StopCue(Cue, frozen=True):
    """Play the floor's own patch on a tile, or on "all", again, and undo all values that were set."""

    address: ClassVar[str] = "/underfoot/stop"

    tile: str = ALL
    number: int = NO_NUMBER


class StrikeCue(Cue, frozen=True):
    """Send an event to every strike node, on a tile or on "all"."""

    address: ClassVar[str] = "/underfoot/strike"

    tile: str
    strength: float = 1.0
    number: int = NO_NUMBER

    def check(self) -> None:
        _require_between("strength", self.strength, STRENGTH)


class SetCue(Cue, frozen=True):
    """Set a parameter of a node of the patch that is played."""

    address: ClassVar[str] = "/underfoot/set"

    node: str
    parameter: str
    value: Argument
    number: int = NO_NUMBER

    def check(self) -> None:
        require(not isinstance(self.value, float) or math.isfinite(self.value), "value", self.value, "a finite number")


class MarkCue(Cue, frozen=True):
    """Set a mark in the recording, and send it to listeners."""

    address: ClassVar[str] = "/underfoot/mark"

    text: str
    number: int = NO_NUMBER

    def check(self) -> None:
        require(bool(self.text), "text", self.text, f"1 to {LONGEST_TEXT} characters")


class PanicCue(Cue, frozen=True):
    """Silence at once, whatever its arguments are. Only a person at this computer can restart the sound."""

    address: ClassVar[str] = "/underfoot/panic"
    takes_anything: ClassVar[bool] = True


class HelloCue(Cue, frozen=True):
    """Ask for the description of this floor."""

    address: ClassVar[str] = "/underfoot/hello"


def cue_of(message: Message) -> Cue:
    """Return the cue of a message; `BadValue` for an unknown address or wrong arguments.

    >>> cue_of(Message("/underfoot/play", ("gravel", "t1", -6)))
    PlayCue(preset='gravel', tile='t1', gain_db=-6.0, number=-1)
    >>> cue_of(Message("/underfoot/play", ("gravel", "t1", float("nan"))))
    Traceback (most recent call last):
    underfoot.errors.BadValue: gain_db is nan; allowed: -80 to 20 dB
    """
    choice("the address", message.address, Cue.cues)
    kind = Cue.cues[message.address]
    if kind.takes_anything:
        return kind()
    declared = fields(kind)
    least = sum(one.required for one in declared)
    if not least <= len(message.arguments) <= len(declared):
        names = " ".join(one.name for one in declared) or "none"
        raise BadValue(f"{message.address} has {len(message.arguments)} arguments; allowed: {names}")
    pairs = zip(declared, message.arguments, strict=False)
    cue = kind(**{one.name: _converted(one.name, one.type, given) for one, given in pairs})
    cue.check()
    return cue


def number_of(message: Message) -> int:
    """Return the number that the sender chose for a cue, also where the cue is none that can be carried out.

    >>> number_of(Message("/underfoot/mark", ("", 7))), number_of(Message("/underfoot/mark")), number_of(Message("/no"))
    (7, -1, -1)
    """
    kind = Cue.cues.get(message.address)
    names = [one.name for one in fields(kind)] if kind else []
    if "number" not in names or len(message.arguments) <= names.index("number"):
        return NO_NUMBER
    try:
        return int(_converted("number", int, message.arguments[names.index("number")]))
    except BadValue:
        return NO_NUMBER


def _converted(name: str, wanted: object, given: Argument) -> Argument:
    """Return an argument with the declared type: an integer is taken for a float, and a whole float for an integer, as
    Pure Data sends floats only."""
    if wanted is float and type(given) is int:
        given = float(given)
    if wanted is int and type(given) is float and given.is_integer():
        given = int(given)
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
