"""Declaration of a format of another program: whether it is written or read, and what it preserves."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.arguments import choice
from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import ForceSource
from underfoot.devices.offline import DEFAULT_S, offline_source
from underfoot.engine.loop import LoopOptions
from underfoot.engine.preview import one_step
from underfoot.engine.render import Rendered, render_source
from underfoot.errors import BadFile, BadValue, require
from underfoot.exchange.losses import KEPT
from underfoot.files import head_of
from underfoot.floor.layout import Floor
from underfoot.patch.patch import Patch
from underfoot.records.force_files import read_force_file

QUIET = 1e-3
"""Samples below this share of the largest (-60 dB) are trimmed at both ends of an export."""
MOST_S = 600.0
"""Longest `seconds` of an export, which is analysed as a whole in memory."""


@dataclass(frozen=True)
class Export:
    """An export: a patch, and the force on which it plays.

    `folder` holds its files. Without `force` (a CSV file) and `floor` it plays one step over one tile, like the
    preview; with a floor alone, the seeded walker walks there. `seconds` is its length, by default as long as it
    vibrates, at most 5 s. `tile` is the one to write, "" for all, or, for a format with one channel, for the one that
    moves most. `profiles` is the folder of the tiles' profiles, for formats that include them.
    """

    patch: Patch
    folder: Path | None = None
    seconds: float | None = None
    tile: str = ""
    force: str | None = None
    floor: Floor | None = None
    profiles: Path | None = None

    def __post_init__(self) -> None:
        is_allowed = self.seconds is None or 0.0 < self.seconds <= MOST_S
        require(is_allowed, "seconds", self.seconds, f"above 0, up to {MOST_S:g} s")

    @cached_property
    def rendered(self) -> Rendered:
        """The rendered patch, untrimmed."""
        seconds = DEFAULT_S if self.seconds is None else self.seconds
        source, length_s = self._source(seconds)
        options = LoopOptions(folder=self.folder, measures=True)
        return render_source(self.patch, source, length_s if self.seconds is None else seconds, options)

    @cached_property
    def tiles(self) -> tuple[str, ...]:
        """Ids of the tiles that it plays on, in order."""
        return self._source(1.0)[0].floor.ids

    def _source(self, seconds: float) -> tuple[ForceSource, float]:
        if self.force is None and self.floor is None:
            return one_step(seconds, RATE_HZ)[1], seconds
        forces, floor = None, self.floor
        if self.force not in (None, "none"):
            forces, floor = read_force_file(self.force, floor)
        return offline_source(forces, floor, RATE_HZ, self.patch.seed, walking=self.force is None)

    @cached_property
    def acceleration_by_tile(self) -> dict[str, NDArray[np.float64]]:
        """Return the commanded acceleration of each chosen tile, m/s^2, at `RATE_HZ`, trimmed of silence at both ends.

        Raises `BadValue` if nothing is played.
        """
        whole = self.rendered.tiles["commanded"].astype(np.float64)
        chosen = [self._column()] if self.tile else range(whole.shape[1])
        loud = np.flatnonzero(np.abs(whole[:, chosen]).max(axis=1) > QUIET * np.abs(whole[:, chosen]).max(initial=0.0))
        if not loud.size:
            raise BadValue("the patch plays nothing on this force; give a longer --seconds, or another --force")
        cut = slice(0, None) if self.seconds is not None else slice(loud[0], loud[-1] + 1)
        return {self.tiles[column]: whole[cut, column] for column in chosen}

    @property
    def loudest(self) -> tuple[str, NDArray[np.float64]]:
        """Return the tile that moves most, and its acceleration."""
        return max(self.acceleration_by_tile.items(), key=lambda item: float(np.square(item[1]).sum()))

    @property
    def samples(self) -> NDArray[np.float32]:
        """The drive, relative to full scale: float32 [frame, channel]; only of the chosen tile, if any."""
        whole = self.rendered.samples
        return whole[:, [self._column()]] if self.tile else whole

    def _column(self) -> int:
        choice("--tile", self.tile, self.tiles)
        return self.tiles.index(self.tile)


@dataclass(frozen=True)
class Imported:
    """Result of an import: a checked patch, and descriptions of what of the file it lacks."""

    patch: Patch
    losses: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format, with its functions to write and read.

    `carries` are those of `losses.KEPT` that its files preserve; all others are lost. `write` takes the export and the
    path, and returns the lines of a report. `read` takes the path. `begins` distinguishes its files from others of the
    same suffix.
    """

    name: str
    label: str
    suffixes: tuple[str, ...]
    carries: frozenset[str] = frozenset()
    write: Callable[[Export, Path], tuple[str, ...]] | None = None
    read: Callable[[Path], Imported] | None = None
    begins: tuple[bytes, ...] = ()
    note: str = ""
    """Remark for the user before writing."""

    def __post_init__(self) -> None:
        assert self.carries <= KEPT.keys(), self.carries - KEPT.keys()

    @property
    def suffix(self) -> str:
        """The usual suffix, with its dot; "" for a folder."""
        return self.suffixes[0]

    def matches(self, path: Path) -> bool:
        """Return whether the file begins like a file of this format."""
        head = b"".join((head_of(path, 4096) or b"").split())
        return any(begin in head for begin in self.begins)


def read_foreign_patch(format: Format, path: Path) -> Imported:
    """Read the patch in a file of this format; raise `BadFile` if the file is not one."""
    assert format.read is not None
    try:
        return format.read(path)
    except BadValue as error:
        raise BadFile(f"{path} cannot be made a patch: {error}") from None
