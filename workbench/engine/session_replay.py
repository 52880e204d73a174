"""Replay of a recorded session: the same patch, forces and commands at the same frames, hence the same bytes."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from underfoot.devices.force_source import MAX_SAMPLES, sample_buffers
from underfoot.engine.commands import Swap, TileEqualiser, from_text
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.render import LONGEST_S, NO_FILES, Files, Rendered
from underfoot.errors import BadFile, in_one_line
from underfoot.floor.layout import Floor
from underfoot.floor.simulated_plates import PlateOutput
from underfoot.floor.tile_parameters import TileParameters
from underfoot.nodes import REGISTRY
from underfoot.patch.custom_nodes import run_needed
from underfoot.patch.patch import Patch
from underfoot.records.recording import Recording


class RecordedForce:
    """The force samples of a recording, in successive `parts`, each delivered in the frame in which it arrived."""

    def __init__(self, parts: Iterable[NDArray[np.float64]], floor: Floor, rate_hz: float) -> None:
        self.floor, self.rate_hz = floor, rate_hz
        self.stamps, self.arrivals, self.forces = sample_buffers(floor)
        self._rows = (row for part in parts for row in part)
        self._next = next(self._rows, None)

    def pull(self, end: int) -> int:
        """Read the samples that arrived before session frame `end`."""
        count = 0
        while count < MAX_SAMPLES and self._next is not None and self._next[1] < end:
            self.stamps[count], self.arrivals[count] = self._next[:2]
            self.forces[count] = self._next[2:].reshape(-1, 4)
            self._next = next(self._rows, None)
            count += 1
        return count


@dataclass(frozen=True)
class ReplayJob:
    """A recording to replay, as data for another process; `plates` as in `LoopOptions`."""

    path: Path
    block: int = 1024
    plates: tuple[PlateOutput, ...] = ()

    def run(self, files: Files = NO_FILES) -> Rendered:
        """Replay it from its first frame to its last, to `files` as it is played.

        Raises `BadFile` for a recording that begins after its session, has gaps, lasts for over a day, or has a patch
        that cannot be played.
        """
        path = self.path
        with Recording(path) as recording:
            first, end = recording.ends("vibration")
            if end is None:
                raise BadFile(f"{path} cannot be replayed: it was ended before the first frame")
            if first != 0 or recording.gaps():
                raise BadFile(f"{path} cannot be replayed: it does not begin with its session, or has gaps")
            if (length_s := end / recording.rate_hz) > LONGEST_S:  # which a damaged file may say
                days = length_s / LONGEST_S
                raise BadFile(f"{path} cannot be replayed: it lasts {days:.1f} days; allowed: up to a day")
            loop = _loop_of(recording, self.block, self.plates)
            for frame, kind, body in recording.commands():
                with _readable(path, f"command {kind[:60]!r}"):
                    command = from_text(kind, body)
                if isinstance(command, Swap):
                    _run_nodes(recording, command.patch)
                    Patch.loads(command.patch, REGISTRY, str(path))  # for its error, which names the recording
                loop.send(command, frame)
            return Rendered.of(loop, end, files)


def _loop_of(recording: Recording, block: int, plates: tuple[PlateOutput, ...]) -> Loop:
    """Return the loop of the recorded session, as it was before its first frame."""
    about = recording.about
    _run_nodes(recording, about["patch"])
    floor, parts = recording.floor, (rows for _, rows in recording.blocks("force"))
    source = RecordedForce(parts, floor, recording.force_rate_hz)
    with _readable(recording.path, "channels"):
        channels = msgspec.json.decode(about.get("channels", "null"), type=tuple[int, ...] | None)
    with _readable(recording.path, "corrections"):
        equalisers = msgspec.json.decode(about.get("corrections", "[]"), type=tuple[TileEqualiser, ...])
    options = LoopOptions(
        rate_hz=recording.rate_hz,
        block=block,
        equalisers=equalisers,
        channels=channels,
        folder=Path(about["folder"]) if about.get("folder") else None,
        plates=plates,
        simulation=TileParameters.loads(about["simulation"]) if about.get("simulation") else None,
    )
    return Loop(Patch.loads(about["patch"], REGISTRY, str(recording.path)), REGISTRY, source, options)


def _run_nodes(recording: Recording, patch: bytes | str) -> None:
    """Load the custom nodes of a recorded patch, if the user has agreed to run them."""
    folder = recording.about.get("folder")
    if folder:
        used = Patch.unchecked(patch, str(recording.path)).types.values()
        run_needed(used, Path(folder, recording.path.name))


@contextmanager
def _readable(path: Path, what: str) -> Iterator[None]:
    """Turn errors of damaged data into a `BadFile` of one line."""
    try:
        yield
    except (msgspec.MsgspecError, ValueError, TypeError, RecursionError) as error:
        raise BadFile(f"{path}: {what} cannot be read: {in_one_line(error)}") from None
