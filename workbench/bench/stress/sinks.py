"""Signals that no shaker may receive, fed to every sink and force input, and the resulting output."""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from underfoot.bench.stress.outcome import Effort, Outcome, Progress
from underfoot.bench.stress.valid_files import FLOOR
from underfoot.devices.force_source import ForceSource
from underfoot.devices.replay import Replay
from underfoot.engine.commands import Level, Play
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.safety import RMS_SECONDS, Limits
from underfoot.floor.forces import ForceSeries
from underfoot.nodes import REGISTRY
from underfoot.parameters import Choice
from underfoot.patch.node import Output, Registry, node
from underfoot.patch.patch import Patch

SIGNALS = ("nan", "infinity", "1e300", "dc", "square", "square of 5 Hz", "now and then nan")
FORCES = {"nan": math.nan, "infinity": math.inf, "1e300": 1e300, "-1e300": -1e300}
_RATE, _BLOCK = 48_000, 256
_SETTLED_S = 1.0
_DC_LEFT = 0.05
"""The mean that may be left, of full scale: a pulse to one side that is limited behind the DC block keeps some."""
_RMS_MORE = 1.01


@node("unwanted", "Tests")
class Unwanted:
    """A signal that no shaker may receive."""

    kind = Choice("nan", options=SIGNALS)
    out = Output()
    tail = math.inf

    def run(kind, frame, out):
        for i in range(out.size):
            at = frame + i
            if kind == 0:
                out[i] = math.nan
            elif kind == 1:
                out[i] = math.inf if at % 2 == 0 else -math.inf
            elif kind == 2:
                out[i] = 1e300 if at % 480 < 240 else -1e300
            elif kind == 3:
                out[i] = 1e6
            elif kind == 4:
                out[i] = 1e6 if at % 480 < 240 else -1e6
            elif kind == 5:
                out[i] = 1e6 if at % 9600 < 4800 else -1e6
            else:
                out[i] = math.nan if at % 997 == 0 else 20.0 * math.sin(0.01 * at)


REGISTRY_HERE: Registry = {**REGISTRY, "unwanted": Unwanted}  # type: ignore[dict-item]


def run(effort: Effort, progress: Progress) -> Iterator[Outcome]:
    """Yield results for each signal at each sink, and for each force through a force-driven patch, at full level."""
    seconds = max(effort.length_s(4.0), 2.0 * _SETTLED_S)
    for sink, port in (("tile-output", "acceleration"), ("sound-output", "sound")):
        for signal in SIGNALS:
            patch = Patch().add("unwanted", REGISTRY_HERE, kind=signal).add(sink, REGISTRY_HERE)
            patch = patch.connect("unwanted.out", f"{sink}.{port}", REGISTRY_HERE)
            yield _judged(f"{signal} into {sink}", patch, _forces(100.0), seconds)
    patch = Patch().add("tile-force", REGISTRY).add("gain", REGISTRY).add("tile-output", REGISTRY)
    patch = patch.connect("tile-force.force", "gain.signal", REGISTRY)
    patch = patch.connect("gain.out", "tile-output.acceleration", REGISTRY)
    for name, force in FORCES.items():
        yield _judged(f"a force of {name} on a sensor", patch, _forces(force), seconds)


def played(patch: Patch, source: ForceSource, seconds: float) -> NDArray[np.float32]:
    """Return the output to the card, [frame, channel], full scale, at full level."""
    loop = Loop(patch, REGISTRY_HERE, source, LoopOptions(rate_hz=_RATE, block=_BLOCK))
    for command in (Level(0.0), Play(True)):
        loop.send(command)
    parts = []
    with np.errstate(all="ignore"):
        for _ in range(round(seconds * _RATE) // _BLOCK):
            loop.run(_BLOCK)
            parts.append(loop.out[:_BLOCK].copy())
    return np.concatenate(parts)


def _forces(force_n: float) -> ForceSource:
    """Return a source that repeats one second of 100 N, with a tenth of a second of `force_n` at one sensor in its
    middle.

    It bypasses the reader of force files, which would refuse such values.
    """
    forces = np.full((1000, len(FLOOR.tiles), 4), 100.0)
    forces[500:600, 0, 1] = force_n
    return Replay(ForceSeries(np.arange(1000) / 1000.0, forces, 1000.0), FLOOR, _RATE, repeats=True)


def _judged(what: str, patch: Patch, source: ForceSource, seconds: float) -> Outcome:
    samples = played(patch, source, seconds).astype(np.float64)
    limits = Limits()
    finite = bool(np.isfinite(samples).all())
    settled = samples[round(_SETTLED_S * _RATE) :]
    share = 1.0 - math.exp(-1.0 / (RMS_SECONDS * _RATE))  # the running mean of the limit, by another library
    rms = float(np.sqrt(lfilter([share], [1.0, share - 1.0], samples**2, axis=0).max()))
    whole = len(settled) - len(settled) % _RATE or len(settled)
    peak, mean = float(np.abs(samples).max()), float(np.abs(settled[:whole].mean(axis=0)).max())
    found = f"{'finite' if finite else 'NOT FINITE'}, peak {peak:.3f}, mean {mean:.1e}, RMS {rms:.3f}"
    good = finite and peak <= limits.peak + 1e-6 and mean <= _DC_LEFT and rms <= _RMS_MORE * limits.rms
    return Outcome(what, len(samples) * samples.shape[1], found, good)
