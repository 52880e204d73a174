"""Thumbnails of presets: the response of a patch to one step, computed once and cached."""

import hashlib
import os
from contextlib import suppress
from pathlib import Path

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.array_cache import ArrayCache
from underfoot.clock import RATE_HZ
from underfoot.engine.commands import Play, Strike
from underfoot.engine.levels import SECONDS, Level
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.preview import one_step
from underfoot.engine.simulated_step import STEP_S
from underfoot.files import read_file
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.version import __version__

BINS = 96
"""Columns of the picture's envelope."""
_CACHE = ArrayCache("preset-pictures", in_memory=1000, on_disk=1000)


class PresetPicture(Struct, frozen=True):
    """Response of a patch to an adult's step on a simulated tile.

    `envelope` (BINS,) is the magnitude of the commanded acceleration over the step, relative to its peak; `peak_m_s2`
    is that peak as in table 6.1; `felt_db` is the level above what a sole in a hard shoe feels, measured on the plate;
    None for silence.
    """

    envelope: NDArray[np.float64]
    peak_m_s2: float
    felt_db: float | None


def picture_of(path: Path) -> PresetPicture:
    """Return the picture of the preset in a file; raise `BadFile` if it cannot be played.

    >>> from underfoot.patch import preset_files
    >>> found = picture_of(preset_files.patches()["stimulus-wc"])
    >>> found.envelope.shape, found.peak_m_s2 > 1.0
    ((96,), True)
    """
    text = read_file(path)
    return _picture(
        _CACHE.get(_name(path, text), lambda: _computed(Patch.loads(text, REGISTRY, str(path)), path.parent))
    )


def kept_picture(path: Path) -> PresetPicture | None:
    """Return the picture of the preset in a file if it was computed before."""
    numbers = _CACHE.kept(_name(path, read_file(path)))
    return None if numbers is None else _picture(numbers)


def picture_in_background(path: Path) -> PresetPicture:
    """Do as `picture_of`, in a process of its own, which gets the lowest priority."""
    with suppress(OSError, AttributeError):
        os.nice(19 - os.nice(0))
    return picture_of(path)


def _name(path: Path, text: bytes) -> str:
    return hashlib.sha256(__version__.encode() + bytes(path.parent) + text).hexdigest()[:32]


def _picture(numbers: NDArray[np.float64]) -> PresetPicture:
    peak, felt_db = float(numbers[0]), float(numbers[1])
    return PresetPicture(numbers[2:], peak, felt_db if np.isfinite(felt_db) else None)


def _computed(patch: Patch, folder: Path) -> NDArray[np.float64]:
    force_n, source = one_step(SECONDS, RATE_HZ)
    loop = Loop(patch, REGISTRY, source, LoopOptions(folder=folder, plates=("accelerometer",)))
    loop.send(Play(True), 0)
    loop.send(Strike("", "t1"), round(STEP_S * RATE_HZ))
    tiles = loop.play_all(len(force_n))
    commanded = Level.of(tiles["commanded"][:, 0], RATE_HZ)
    measured = Level.of(tiles["accelerometer"][:, 0], RATE_HZ)
    magnitude = np.abs(tiles["commanded"][: len(force_n) // BINS * BINS, 0].astype(float)).reshape(BINS, -1).max(axis=1)
    level_db = np.nan if measured.level_db is None else measured.level_db
    return np.concatenate([[commanded.peak_m_s2, level_db], magnitude / max(float(magnitude.max()), 1e-12)])
