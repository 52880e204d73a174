"""Declaration of a kind of calibration, for the command line, the window and the report.

Each file in `procedures/` declares one: a frozen dataclass that inherits from `Calibration`. Class attributes name and
describe it; fields are the options of its command (`underfoot.options`); methods make its procedure and read
measurements from files. To add a calibration, add such a file; `procedures.CALIBRATIONS` finds it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from underfoot.calibration.procedure import Answers, Page, Procedure
from underfoot.calibration.result import Result
from underfoot.clock import RATE_HZ
from underfoot.errors import BadValue

if TYPE_CHECKING:
    from underfoot.floor.layout import Tile
    from underfoot.floor.profile import Profile

PRESSING, SHAKING, STEPPING = "pressing", "shaking", "stepping"
"""Rigs: one that presses the tile and reads it, one that plays the shaker and records an accelerometer, and one that
steps on a variable stiffness plate and moves it."""


@dataclass(frozen=True)
class MeasurementSetup:
    """Context of a procedure: a tile and its present profile.

    `seed` is that of random draws in the procedure; `rate_hz` the sample rate of the sounds that it plays, `block` the
    frames in a block of the sound device; `full_scale_m_s2` that of the accelerometer's input, None if unknown;
    `has_load_cell` whether there is a load cell to compare the tile with. `sensors` are what it and a displacement
    sensor are called in a report, with the scales that they were given.
    """

    tile: "Tile"
    profile: "Profile"
    seed: int = 1
    rate_hz: int = RATE_HZ
    block: int = 128
    full_scale_m_s2: float | None = None
    has_load_cell: bool = True
    sensors: tuple[str, str] = ("load cell", "")


@dataclass(frozen=True)
class FileMeasurement:
    """Measurement in files: the id of its tile, and its analysis with the tile's profile.

    `analyse` raises `BadFile` and `BadMeasurement`.
    """

    tile: str
    analyse: Callable[["Profile"], Result]


def named_tile(floor: Path | None, tile: str) -> str:
    """Return the id of a tile in a floor file, or on the default floor; "" is the first one.

    >>> named_tile(None, "")
    't1'
    """
    from underfoot.floor.layout import Floor, default_floor

    layout = default_floor() if floor is None else Floor.load(floor)
    return layout.tiles[layout.index(tile) if tile else 0].id


class Calibration(ABC):
    """Kind of calibration; an instance has the options of its command."""

    kind: ClassVar[str]
    """Part of a profile that it makes."""
    name: ClassVar[str]
    """Label of its button in one word; in small letters the name of its command."""
    title: ClassVar[str]
    """Heading: the name, and what it converts to what."""
    about: ClassVar[str]
    """What is done and what results, in two or three sentences."""
    summary: ClassVar[str]
    """First line of its command's help."""
    rig: ClassVar[str]
    """Rig that it needs: `PRESSING`, `SHAKING` or `STEPPING`."""
    file_options: ClassVar[tuple[str, ...]]
    """Options that name files with a measurement: either all of them, or none if a target is measured."""
    requires: ClassVar[str] = ""
    """Part of the profile that must exist before; "" for none."""

    @classmethod
    def command(cls) -> str:
        """Return the name of its command."""
        return cls.name.lower()

    def check(self, target: str) -> None:
        """Raise `BadValue` for invalid options, before anything is read or measured on `target`."""
        named = [getattr(self, name) is not None for name in self.file_options]
        if any(named) != all(named) or all(named) == bool(target):
            files = " and ".join(f"--{name}" for name in self.file_options)
            raise BadValue(f"give either {files}{',' if len(named) > 1 else ''} or --target")

    @abstractmethod
    def procedure(self, setup: MeasurementSetup) -> Procedure:
        """Return the procedure that measures a tile."""

    def answers(self, has_load_cell: bool) -> Answers:
        """Return the options' answers to the procedure's pages, by name."""
        return {}

    def skips(self, page: Page) -> bool:
        """Return whether the options leave out an optional page."""
        return False

    @abstractmethod
    def from_files(self, floor: Path | None, tile: str) -> FileMeasurement:
        """Return the measurement in the files named by `file_options`; of `tile`, "" for the only or first one.

        `floor` is the floor file, if one is named. Raises `BadFile` and `BadValue`.
        """
