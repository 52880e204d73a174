"""The level of a patch: its peak acceleration on the plate under a footstep, as in table 6.1 of the thesis."""

from collections.abc import Callable

import msgspec
import numpy as np

from underfoot.clock import RATE_HZ
from underfoot.engine.commands import Level, Play
from underfoot.engine.levels import SECONDS, headroom_db
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.engine.preview import one_step
from underfoot.errors import BadMeasurement
from underfoot.models.sole import windowed_peak
from underfoot.patch.node import installed_nodes
from underfoot.patch.patch import Patch

_DRAWS = 25
"""Number of draws. The peak of the thesis's textures varies between draws with a standard deviation of 1.2 to 2.3 dB;
the median over these draws has a third to a half of that.
"""
_QUIET_DB = -20.0
"""Level at which a patch is measured that is limited at its own level; the result is scaled back."""


def measured_peak_m_s2(patch: Patch, is_stopped: Callable[[], bool] = lambda: False) -> float:
    """Return the peak acceleration on the simulated plate under an adult's step, as the median over draws, in m/s^2.

    The first draw uses the patch's own seed, the others the following seeds. Raises `BadMeasurement` for silence, and
    when `is_stopped` returns True, which is checked before each step.
    """
    peaks = []
    for seed in range(patch.seed, patch.seed + _DRAWS):
        if is_stopped():
            raise BadMeasurement("the measurement of the level was stopped")
        peaks.append(_peak_m_s2(msgspec.structs.replace(patch, seed=seed)))
    found = float(np.median(peaks))
    if found == 0.0:
        raise BadMeasurement("the patch is silent under a footstep; its level cannot be measured")
    return found


def _peak_m_s2(patch: Patch, level_db: float = 0.0) -> float:
    force_n, source = one_step(SECONDS, RATE_HZ)
    loop = Loop(patch, installed_nodes(), source, LoopOptions(block=1024, plates=("accelerometer",)))
    for command in (Level(level_db), Play(True)):
        loop.send(command, 0)
    played = loop.play_all(len(force_n))
    if level_db > _QUIET_DB and headroom_db(float(np.abs(played[""]).max(initial=0.0))) < 0.1:
        return _peak_m_s2(patch, _QUIET_DB)
    return windowed_peak(played["accelerometer"][:, 0], RATE_HZ) / 10.0 ** (level_db / 20.0)
