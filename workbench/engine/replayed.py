"""A recorded session, played again: the same patch, forces and commands at the same frames, and so the same bytes."""

import json
from pathlib import Path

import msgspec
import numpy as np

from underfoot.devices.force_source import MAX_SAMPLES, sample_buffers
from underfoot.engine.loop import InTurn, Loop
from underfoot.engine.messages import Correct, Swap
from underfoot.engine.recorder import from_text
from underfoot.engine.render import Rendered
from underfoot.errors import BadFile
from underfoot.floor.layout import Floor
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch
from underfoot.records.recording import Recording


class RecordedForce:
    """The force samples of a recording, each handed over in the frame in which it came."""

    def __init__(self, rows: np.ndarray, floor: Floor, rate_hz: float) -> None:
        self.floor, self.rate_hz = floor, rate_hz
        self.stamps, self.arrivals, self.forces = sample_buffers(floor)
        self._rows = rows
        self._next = 0

    def pull(self, end: int) -> int:
        """The samples that came before session frame `end`."""
        count = 0
        while count < MAX_SAMPLES and self._next < len(self._rows) and self._rows[self._next, 1] < end:
            row = self._rows[self._next]
            self.stamps[count], self.arrivals[count] = row[0], row[1]
            self.forces[count] = row[2:].reshape(-1, 4)
            self._next += 1
            count += 1
        return count


def is_recording(path: Path) -> bool:
    """Whether a file is an SQLite file, as recordings are."""
    try:
        with path.open("rb") as file:
            return file.read(15) == b"SQLite format 3"
    except OSError:
        return False


def replay(path: Path, registry: Registry, block: int = 1024) -> Rendered:
    """Play the recording again from its first frame to its last."""
    with Recording(path) as recording:
        about = recording.about
        floor = Floor.loads(about["floor"], str(path))
        patch = Patch.loads(about["patch"], registry, str(path))
        rate = float(about["rate"])
        first, played = recording.vibration()
        gaps = recording.gaps()
        if first != 0 or gaps:
            raise BadFile(f"{path} cannot be replayed: it does not begin with its session, or has gaps")
        rows = recording.forces()
        commands = [(frame, from_text(kind, body)) for frame, kind, body in recording.commands()]
        force_rate = float(about["force_rate"])
        folder = Path(about["folder"]) if about.get("folder") else None
        channels = json.loads(about.get("channels", "null"))
        corrections = msgspec.json.decode(about.get("corrections", "[]"), type=tuple[Correct, ...])
    source = RecordedForce(rows, floor, force_rate)
    loop = Loop(
        patch,
        registry,
        source,
        rate=rate,
        block=block,
        folder=folder,
        channels=channels,
        corrections=corrections,
    )
    for frame, command in commands:
        if isinstance(command, Swap):
            program = loop.build(Patch.loads(command.patch, registry, str(path)), command.scopes)
            loop.send(program if command.together else InTurn(program), frame)
        else:
            loop.send(command, frame)
    samples = np.empty((len(played), loop.out.shape[1]), np.float32)
    at = 0
    while at < len(samples):
        n = min(block, len(samples) - at)
        loop.run(n)
        samples[at : at + n] = loop.out[:n]
        at += n
    report = loop.program.report()
    return Rendered(samples, rate, loop.spent_s, report["run"], report["asleep"], report["left_out"])
