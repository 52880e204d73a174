"""Offline rendering of the engine's program, as fast as possible."""

import math
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.force_source import ForceSource
from underfoot.drawing import Drawing, series
from underfoot.drawing.picture import Picture
from underfoot.drawing.thinning import extremes
from underfoot.engine.commands import Command, Play
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.errors import BadValue, require
from underfoot.models import sole
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.records.wav import require_wav, wav_file, wav_samples, write_wav

_POINTS = 600
"""Points across a plot."""
LONGEST_S = 24 * 3600.0
"""Longest rendering in seconds."""
Files = Mapping[str, Path]
"""Sound files that a rendering is written to, by the names of `Loop.outputs`, as it is played."""
NO_FILES: Files = MappingProxyType({})
_COLOURS = ("vibration", "force", "events", "contact", "corner 1", "corner 2")


@dataclass(frozen=True, repr=False, eq=False)
class Rendered:
    """Result of a rendering: float32 [frame, channel], at most 1; ids of nodes that ran, slept, or were left out.

    `tiles` has the `commanded` and the measured acceleration of simulated plates, as in `Loop.play_all`. `spent_s` is
    the time from the first block to the last, from force samples to full scale and into files; `program_s` is the share
    of the patch's nodes.
    """

    samples: NDArray[np.float32]
    tiles: dict[str, NDArray[np.float32]]
    rate_hz: float
    spent_s: float
    program_s: float
    run: list[str]
    asleep: list[str]
    left_out: list[str]

    def __repr__(self) -> str:
        frames, channels = self.samples.shape
        peak = _peak(self.samples)
        return f"<Rendered: {frames} frames of {channels} channels at {self.rate_hz:.6g} Hz, peak {peak:.4f}>"

    def save(self, path: str | Path) -> None:
        """Write a WAV file of float samples, one channel per tile; raise `BadFile` if that fails."""
        require_wav(path)
        write_wav(path, self.samples, self.rate_hz)

    def plot(self) -> Picture:
        """Plot the channels that are not silent, and the accelerations of simulated plates."""
        drawings = [self._curves("Rendered", "full scale", self.samples)]
        drawings += [
            self._curves(plate_output.capitalize(), "m/s^2", done) for plate_output, done in self.tiles.items()
        ]
        return Picture(tuple(drawings))

    def _curves(self, title: str, unit: str, samples: NDArray[np.float32]) -> Drawing:
        time_s = np.arange(len(samples)) / self.rate_hz
        x, y, _ = extremes(time_s, samples, max(len(samples) / self.rate_hz / _POINTS, 1.0 / self.rate_hz))
        peaks = np.abs(samples).max(axis=0)
        shown = [k for k in np.argsort(-peaks, kind="stable") if peaks[k] > 0.0]  # the softest on top
        lines = [series(f"{k + 1}", x, y[:, k], colour=_COLOURS[k % len(_COLOURS)]) for k in shown]
        return Drawing(title, "time, s", f"channel, {unit}", tuple(lines), note="" if lines else "silence")

    @staticmethod
    def of(loop: Loop, frames: int, files: Files, *, finite: bool = False) -> "Rendered":
        """Return the first `frames` frames that a loop plays; those of `files` are there, and not in memory.

        With `finite`, raise `BadValue` if a node makes a value that is not finite; the files then stay as they were.
        """
        channels = {name: out.shape[1] for name, out in loop.outputs.items()}
        with ExitStack() as stack:
            takes = {
                name: stack.enter_context(wav_file(path, frames, channels[name], loop.rate_hz))
                for name, path in files.items()
            }
            began = time.perf_counter()
            played = loop.play_all(frames, takes)
            spent_s = time.perf_counter() - began
            if finite:
                _require_finite(loop)
        for name, path in files.items():
            played[name] = wav_samples(path, frames, channels[name], loop.rate_hz)
        samples = played.pop("")
        return Rendered(samples, played, loop.rate_hz, spent_s, loop.programs.spent_s, **loop.program.report())

    def summary(self) -> dict[str, object]:
        """Return the figures that `render --json` prints.

        `peak` and `rms` are in full scale. Each acceleration of `tiles` has its own, in m/s^2, under its name; and of
        the tile that moves most the peak by the rule of table 6.1 (`models.sole.windowed_peak`), the share of energy
        from 50 to 750 Hz, the levels in dB above the threshold of a sole, barefoot and in a shoe, and the chance that
        it is noticed.
        """
        seconds = len(self.samples) / self.rate_hz
        return {
            **_levels(self.samples, ""),
            **{name: _levels(samples, "_m_s2") | _felt(samples, self.rate_hz) for name, samples in self.tiles.items()},
            "seconds": seconds,
            "times_real_time": seconds / self.spent_s,
            "program_times_real_time": seconds / self.program_s,
            "nodes": {"run": self.run, "asleep": self.asleep, "left_out": self.left_out},
        }


def _peak(samples: NDArray[np.float32]) -> float:
    """Return the peak of all channels; without a copy, as an hour of a floor takes gigabytes."""
    return max(float(samples.max(initial=0.0)), -float(samples.min(initial=0.0)))


def _levels(samples: NDArray[np.float32], unit: str) -> dict[str, float]:
    """Return the peak, and the RMS over all channels."""
    energy = float(np.einsum("ij,ij->", samples, samples, dtype=np.float64))  # without a copy, too
    return {f"peak{unit}": _peak(samples), f"rms{unit}": math.sqrt(energy / samples.size) if samples.size else 0.0}


def _felt(samples: NDArray[np.float32], rate_hz: float) -> dict[str, object]:
    """Return figures of the tile that moves most: its peak, energy share in 50 to 750 Hz, and level at the sole."""
    most = samples[:, int(np.abs(samples).max(axis=0).argmax())]
    return {
        "windowed_peak_m_s2": sole.windowed_peak(most, rate_hz),
        "share_50_to_750_hz": sole.share_in_band(most, rate_hz),
        **sole.felt(most, rate_hz).summary(),
    }


def render_source(
    patch: Patch,
    source: ForceSource,
    seconds: float,
    options: LoopOptions | None = None,
    *,
    commands: tuple[tuple[int, Command], ...] = ((0, Play(True)),),
    files: Files = NO_FILES,
) -> Rendered:
    """Run `patch` on the force of `source`. `commands` (frame, command) take effect as in a live session.

    Raises `BadValue` for an invalid length, block or rate, or if a node makes a value that is not finite.

    >>> from underfoot.devices.simulated_floor import SimulatedFloor
    >>> from underfoot.floor.layout import default_floor
    >>> patch = Patch().add("tone", REGISTRY).add("tile-output", REGISTRY)
    >>> patch = patch.connect("tone.out", "tile-output.acceleration", REGISTRY)
    >>> render_source(patch, SimulatedFloor(default_floor()), 0.5, LoopOptions(block=64)).samples.shape
    (24000, 4)
    """
    options = options or LoopOptions()
    require(0.0 < seconds <= LONGEST_S, "seconds", seconds, "above 0, up to a day")
    require(1 <= options.block <= 65536, "block", options.block, "1 to 65536 frames")
    require(8000.0 <= options.rate_hz <= 192_000.0, "rate", options.rate_hz, "8000 to 192000 Hz")
    frames = round(seconds * options.rate_hz)
    require(frames > 0, "seconds", seconds, f"one frame or more, {1.0 / options.rate_hz:.2g} s")
    loop = Loop(patch, REGISTRY, source, options)
    for frame, command in commands:
        loop.send(command, frame)
    return Rendered.of(loop, frames, files, finite=True)


def _require_finite(loop: Loop) -> None:
    for node, tile, frame in loop.program.faults()[:1]:
        raise BadValue(f"node {node} made a value that is not finite, on tile {tile} at frame {frame}; its output is 0")
