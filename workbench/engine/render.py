"""The same program offline: as fast as it goes, to a file."""

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import ForceSource
from underfoot.engine.loop import Loop
from underfoot.engine.messages import Command, Correct, Play
from underfoot.errors import BadFile, BadValue, require
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

_PEAK_CHUNK = 0x1050  # SFC_SET_ADD_PEAK_CHUNK: it would carry a time stamp, and two renders would differ


@dataclass(frozen=True)
class Rendered:
    """What came out: float32 [frame, channel], at most 1; ids of nodes that ran, slept throughout, were left out."""

    samples: np.ndarray
    rate_hz: float
    spent_s: float
    run: list[str]
    asleep: list[str]
    left_out: list[str]

    def summary(self) -> dict[str, object]:
        """The figures that `render --json` prints."""
        seconds = len(self.samples) / self.rate_hz
        return {
            "peak": float(np.abs(self.samples).max(initial=0.0)),
            "rms": float(np.sqrt(np.mean(np.square(self.samples, dtype=np.float64)))) if self.samples.size else 0.0,
            "seconds": seconds,
            "times_real_time": seconds / self.spent_s if self.spent_s > 0.0 else 0.0,
            "nodes": {"run": self.run, "asleep": self.asleep, "left_out": self.left_out},
        }


def render(
    patch: Patch,
    registry: Registry,
    source: ForceSource,
    seconds: float,
    *,
    rate: float = RATE_HZ,
    block: int = 1024,
    seed: int | None = None,
    folder: Path | None = None,
    commands: tuple[tuple[int, Command], ...] = ((0, Play(True)),),
    corrections: Sequence[Correct] = (),
) -> Rendered:
    """Run `patch` on the force of `source`. `commands` (frame, command) take effect as in a live session.

    `corrections` are those of the tiles' profiles.
    """
    require(0.0 < seconds <= 24 * 3600.0, "seconds", seconds, "above 0, up to a day")
    require(1 <= block <= 65536, "block", block, "1 to 65536 frames")
    require(8000.0 <= rate <= 192_000.0, "rate", rate, "8000 to 192000 Hz")
    loop = Loop(patch, registry, source, rate=rate, block=block, seed=seed, folder=folder, corrections=corrections)
    for frame, command in commands:
        loop.send(command, frame)
    frames = round(seconds * rate)
    samples = np.empty((frames, loop.out.shape[1]), np.float32)
    at = 0
    while at < frames:
        n = min(block, frames - at)
        loop.run(n)
        samples[at : at + n] = loop.out[:n]
        at += n
    fault = loop.program.fault()
    if fault is not None:
        node, tile, frame = fault
        raise BadValue(f"node {node} made a value that is not finite, on tile {tile} at frame {frame}; its output is 0")
    report = loop.program.report()
    return Rendered(samples, rate, loop.spent_s, report["run"], report["asleep"], report["left_out"])


def write_wav(path: str | Path, samples: np.ndarray, rate: float) -> None:
    """Write float32 [frame, channel] as a float WAV, beside `path` and moved into place: same samples, same bytes."""
    import soundfile

    path = Path(path)
    beside = ""
    try:
        handle, beside = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".wav", dir=path.parent)
        os.close(handle)
        with soundfile.SoundFile(beside, "w", round(rate), samples.shape[1], subtype="FLOAT", format="WAV") as file:
            soundfile._snd.sf_command(file._file, _PEAK_CHUNK, soundfile._ffi.NULL, 0)
            file.write(samples)
        Path(beside).chmod(0o644)
        Path(beside).replace(path)
    except (OSError, soundfile.LibsndfileError) as error:
        Path(beside).unlink(missing_ok=True) if beside else None
        raise BadFile(f"{path} cannot be written: {getattr(error, 'strerror', None) or error}") from None
