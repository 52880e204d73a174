"""The whole bench in one run."""

import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from underfoot.bench import accuracy, latency, reach, scale, stability
from underfoot.bench.report import Bench
from underfoot.nodes import REGISTRY
from underfoot.patch import library
from underfoot.patch.patch import Patch


def run(quick: bool = False, seed: int = 1, tell: Callable[[str], None] = lambda line: None) -> Bench:
    """Scale, reach, accuracy and stability, and the latency of a session. Quick takes about two minutes.

    In full: some minutes for the first three; then at most ten for each node, every corner and point, random patches,
    and an hour of sound, which takes several hours.
    """
    files = library.patches()
    patches = {name: Patch.load(path, REGISTRY) for name, path in files.items() if "gravel" in name}
    costs = scale.run(patches, REGISTRY, repeats=5 if quick else 20, tell=tell)
    reaches = [*reach.run(costs, quick, tell), *latency.reaches(quick, tell)]
    comparisons = accuracy.run(quick, tell)
    with tempfile.TemporaryDirectory() as folder:
        sound = Path(folder, "sound.wav")
        _write_sound(sound)
        if quick:
            stable = stability.run(
                REGISTRY, sound, corners=8, points=60, patches=60, seconds=20.0, budget_s=1.0, seed=seed, tell=tell
            )
        else:
            stable = stability.run(REGISTRY, sound, seed=seed, tell=tell)
    return Bench(reaches, comparisons, costs, stable)


def _write_sound(path: Path) -> None:
    """A short sound at a rate of its own, for nodes that play one."""
    import soundfile

    soundfile.write(path, np.sin(np.arange(2000) * 0.05), 22_050)
