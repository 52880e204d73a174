"""Levels of a patch on a simulated tile under one step: commanded, measured, and felt."""

import math
from pathlib import Path

import numpy as np
from msgspec import Struct
from msgspec.structs import asdict, replace
from numpy.typing import NDArray

from underfoot.clock import RATE_HZ
from underfoot.engine.commands import Play, equalisers_of
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.preview import ONE_TILE, one_step
from underfoot.engine.safety import Limits
from underfoot.floor.profile import Profile
from underfoot.floor.tile_parameters import TileParameters
from underfoot.models import sole
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch

SECONDS = 1.2
"""Length of the rendering in seconds: a step lasts two thirds of a second, and its ringing decays."""
RMS_S = 0.12
"""Length in seconds of the stretch whose RMS is taken. Table 6.1 does not give it; this one comes closest to its nine
ratios of RMS to peak."""


class Level(Struct, frozen=True):
    """A signal's level in m/s^2: the stable peak of table 6.1, and the RMS of its loudest `RMS_S`.

    `share_in_band` is the share of its energy within 50 to 750 Hz; `level_db` is the level above what a sole in a hard
    shoe feels, None for silence; `noticed` is the probability that a person in such shoes notices it.
    """

    peak_m_s2: float
    rms_m_s2: float
    share_in_band: float
    level_db: float | None
    noticed: float

    @staticmethod
    def of(samples: NDArray[np.float32], rate_hz: float) -> "Level":
        """Return the level of samples (n,)."""
        signal = samples.astype(np.float64)
        size = round(RMS_S * rate_hz)
        squares = np.cumsum(np.append(0.0, signal**2))
        rms = float(np.sqrt(max(float((squares[size:] - squares[:-size]).max()), 0.0) / size))
        found = sole.felt(signal, rate_hz).summary()
        return Level(
            sole.windowed_peak(signal, rate_hz),
            rms,
            sole.share_in_band(signal, rate_hz),
            found["level_shoe_db"],
            found["noticed"] or 0.0,
        )


class PatchLevels(Struct, frozen=True):
    """Levels of a patch under one adult step: commanded, measured by the accelerometer, and under the foot.

    `headroom_db` is the distance of the drive from the limiter's peak; below 0.1 it was limited. `feels_like_n_mm` is
    the stiffness that a plate of 90 N/mm feels like with it, None where the thesis does not say (table 6.3).
    """

    title: str
    commanded: Level
    measured: Level
    under_foot: Level
    headroom_db: float
    feels_like_n_mm: float | None = None

    def data(self) -> dict[str, object]:
        """Return all figures, as a command prints them."""
        return {name: asdict(one) if isinstance(one, Level) else one for name, one in asdict(self).items()}


def levels_of(
    patch: Patch,
    folder: Path | None = None,
    profile: Profile | None = None,
    simulation: TileParameters | None = None,
) -> PatchLevels:
    """Measure a patch under one adult step on a tile of this kind, at full level, driven by `profile`.

    >>> from underfoot.patch import preset_files
    >>> found = levels_of(Patch.load(preset_files.patches()["stimulus-wc"], REGISTRY))
    >>> found.commanded.peak_m_s2 > 1.0
    True
    """
    tile = replace(ONE_TILE, id=profile.tile) if profile else ONE_TILE
    force_n, source = one_step(SECONDS, RATE_HZ, tile)
    options = LoopOptions(
        folder=folder,
        equalisers=equalisers_of({tile.id: profile}) if profile else (),
        plates=("accelerometer", "foot"),
        simulation=simulation,
    )
    loop = Loop(patch, REGISTRY, source, options)
    loop.send(Play(True), 0)
    played = loop.play_all(len(force_n))
    peak = float(np.abs(played[""]).max(initial=0.0))
    commanded, measured, under_foot = (
        Level.of(played[name][:, 0], RATE_HZ) for name in ("commanded", "accelerometer", "foot")
    )
    stiffness = sole.felt_stiffness_n_mm(measured.peak_m_s2)
    return PatchLevels(patch.title, commanded, measured, under_foot, headroom_db(peak), stiffness)


def headroom_db(drive_peak: float) -> float:
    """Return the distance in dB of a drive of this peak (full scale) from the limiter; below 0.1 it is limited.

    >>> round(headroom_db(0.5), 1)
    5.6
    """
    return 20.0 * math.log10(Limits().peak / max(drive_peak, 1e-9))
