"""A kind of calibration, declared once: the command line, the window and the report read it from here.

Each file in `procedures/` declares one: a frozen dataclass that inherits from `Calibration`. Class attributes say what
it is called and what it is for; fields are the options of its command (`underfoot.options`); methods make its procedure
and read measurements from files. Adding a calibration is adding such a file; `procedures.CALIBRATIONS` finds it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from underfoot.calibration.procedure import Answers, Procedure
from underfoot.calibration.result import Result
from underfoot.clock import RATE_HZ
from underfoot.errors import BadValue

if TYPE_CHECKING:
    from underfoot.floor.layout import Tile
    from underfoot.floor.profile import Profile

PRESSING, SHAKING = "pressing", "shaking"
"""Rigs: one whose tile is pressed and read, and one whose shaker plays while an accelerometer records."""


@dataclass(frozen=True)
class Setup:
    """What a procedure is made for: a tile and what its profile knows.

    `seed` draws what is random in the procedure; `rate_hz` is of the sounds that it plays.
    """

    tile: "Tile"
    profile: "Profile"
    seed: int = 1
    rate_hz: int = RATE_HZ


@dataclass(frozen=True)
class FileMeasurement:
    """A measurement in files: the id of its tile, and what comes of it with what the tile's profile knows.

    `analyse` raises `BadFile` and `BadMeasurement`.
    """

    tile: str
    analyse: Callable[["Profile"], Result]


def named_tile(floor: Path | None, tile: str) -> str:
    """The id of a tile of a floor's file, or of the default floor; "" is the first one.

    >>> named_tile(None, "")
    't1'
    """
    from underfoot.floor.layout import Floor, default_floor

    layout = default_floor() if floor is None else Floor.load(floor)
    return layout.tiles[layout.index(tile) if tile else 0].id


class Calibration(ABC):
    """One kind of calibration; an instance has the options of its command."""

    kind: ClassVar[str]
    """The part of a profile that it makes; its command is called the same."""
    name: ClassVar[str]
    """What a button calls it, in a word or two."""
    title: ClassVar[str]
    """Its heading: the name, and what it turns into what."""
    about: ClassVar[str]
    """What is done and what comes of it, in two or three sentences."""
    summary: ClassVar[str]
    """The first line of its command's help."""
    rig: ClassVar[str]
    """The rig that it needs: `PRESSING` or `SHAKING`."""
    file_options: ClassVar[tuple[str, ...]]
    """The options that name files with a measurement; all of them, or none, where a target is measured."""
    requires: ClassVar[str] = ""
    """The part of the profile that must be there before; "" for none."""

    def check(self, target: str) -> None:
        """Raise `BadValue` for options that cannot be, before anything is read or measured on `target`."""
        named = [getattr(self, name) is not None for name in self.file_options]
        if any(named) != all(named) or all(named) == bool(target):
            files = " and ".join(f"--{name}" for name in self.file_options)
            raise BadValue(f"give either {files}{',' if len(named) > 1 else ''} or --target")

    @abstractmethod
    def procedure(self, setup: Setup) -> Procedure:
        """The procedure that measures a tile."""

    def answers(self, has_load_cell: bool) -> Answers:
        """What the options answer on the procedure's pages, by name."""
        return {}

    @property
    def skips_optional(self) -> bool:
        """Whether the options leave out all that can be skipped."""
        return False

    @abstractmethod
    def from_files(self, floor: Path | None, tile: str) -> FileMeasurement:
        """The measurement in the files that `file_options` name; of `tile`, "" for the only or first one.

        `floor` is the floor's file where one is named. Raises `BadFile` and `BadValue`.
        """
