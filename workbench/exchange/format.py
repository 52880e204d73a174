"""What a format of another program is: whether it is written or read, and what it can carry."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import ForceSource
from underfoot.devices.offline import DEFAULT_S, offline_source
from underfoot.engine.loop import LoopOptions
from underfoot.engine.preview import one_step
from underfoot.engine.render import Rendered, render
from underfoot.errors import BadFile, BadValue
from underfoot.exchange.losses import KEPT
from underfoot.floor.layout import Floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.records.force_files import read_force_file

QUIET = 1e-3
"""What is softer than this share of the largest (-60 dB) is cut off before and behind what is written."""


@dataclass(frozen=True)
class Export:
    """What is to be written: a patch, and on which force it plays.

    `folder` is where its files lie. Without `force` (a CSV file) and `floor` it plays one step over one tile, as the
    preview does; with a floor alone, the seeded walker walks there. `seconds` is its length, by default as long as
    something vibrates, at most 5 s. `tile` is the one that is written, "" for all, or, where a format has one channel,
    for the one that moves most. `profiles` is the folder of the tiles' profiles, for formats that take them along.
    """

    patch: Patch
    folder: Path | None = None
    seconds: float | None = None
    tile: str = ""
    force: str | None = None
    floor: Floor | None = None
    profiles: Path | None = None

    @cached_property
    def rendered(self) -> Rendered:
        """The patch as it plays, whole."""
        seconds = DEFAULT_S if self.seconds is None else self.seconds
        source, length_s = self._source(seconds)
        options = LoopOptions(folder=self.folder, measures=True)
        return render(self.patch, REGISTRY, source, length_s if self.seconds is None else seconds, options)

    @cached_property
    def tiles(self) -> tuple[str, ...]:
        """The ids of the tiles that it plays on, in order."""
        return self._source(1.0)[0].floor.ids

    def _source(self, seconds: float) -> tuple[ForceSource, float]:
        if self.force is None and self.floor is None:
            return one_step("t1", seconds, RATE_HZ)[1], seconds
        forces, floor = None, self.floor
        if self.force not in (None, "none"):
            forces, floor = read_force_file(self.force, floor)
        return offline_source(forces, floor, RATE_HZ, self.patch.seed, walking=self.force is None)

    @cached_property
    def played(self) -> dict[str, NDArray[np.float64]]:
        """What each tile that is meant does, m/s^2, at `RATE_HZ`, without the silence before and behind.

        `BadValue` where nothing is played.
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
        """The tile that moves most, and what it does."""
        return max(self.played.items(), key=lambda item: float(np.square(item[1]).sum()))

    @property
    def samples(self) -> NDArray[np.float32]:
        """What the card is sent, of full scale: float32 [frame, channel]; of the chosen tile alone where one is."""
        whole = self.rendered.samples
        return whole[:, [self._column()]] if self.tile else whole

    def _column(self) -> int:
        if self.tile not in self.tiles:
            raise BadValue(f"--tile is {self.tile!r}; allowed: {', '.join(self.tiles)}")
        return self.tiles.index(self.tile)


@dataclass(frozen=True)
class Imported:
    """What came out of a file: a patch that was checked, and what of the file is not in it, in words."""

    patch: Patch
    losses: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format, and how a patch gets into it and out of it.

    `carries` are those of `losses.KEPT` that a file of it keeps; all others are its losses. `write` takes what is to
    be written and the path, and returns what is to be said of the result, line by line. `read` takes the path.
    `begins` is what tells its files from others of the same suffix.
    """

    name: str
    label: str
    suffixes: tuple[str, ...]
    carries: frozenset[str] = frozenset()
    write: Callable[[Export, Path], tuple[str, ...]] | None = None
    read: Callable[[Path], Imported] | None = None
    begins: tuple[bytes, ...] = ()
    note: str = ""
    """What else a person should know before writing."""

    def __post_init__(self) -> None:
        assert self.carries <= KEPT.keys(), self.carries - KEPT.keys()

    @property
    def suffix(self) -> str:
        """The usual suffix, with its dot; "" for a folder."""
        return self.suffixes[0]

    def knows(self, path: Path) -> bool:
        """Whether the file begins as files of this format do."""
        try:
            with path.open("rb") as file:
                head = b"".join(file.read(4096).split())
        except OSError:
            return False
        return any(begin in head for begin in self.begins)


def read_through(format: Format, path: Path) -> Imported:
    """The patch in a file of this format; `BadFile` in one line for a file that is none."""
    assert format.read is not None
    try:
        return format.read(path)
    except BadValue as error:
        raise BadFile(f"{path} cannot be made a patch: {error}") from None
