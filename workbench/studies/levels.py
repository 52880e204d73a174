"""How strong a patch is: the peak acceleration of the plate under a footstep, by the thesis's rule (table 6.1)."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.commands import Level, Play
from underfoot.engine.loop import Loop, LoopOptions
from underfoot.errors import BadMeasurement
from underfoot.floor.layout import default_floor
from underfoot.patch.node import Registry
from underfoot.patch.patch import Patch

WINDOW_S = 0.01
_SILENT = 1e-3
"""Windows below this share of the largest RMS do not sound."""
_SECONDS = 12
_QUIET_DB = -20.0
"""At this level nothing is limited; what is measured is scaled back."""
_STRONG, _OF_PERCENT = 0.7, 95.0
"""Windows are of the stretch of highest amplitude from this share on of the RMS that 95 % of the windows that sound do
not reach. The thesis does not say how it chose; this changes by some 5 % from one draw of the noise to the next."""


def strongest_peak_m_s2(acceleration_m_s2: NDArray[np.floating], rate_hz: float) -> float:
    """The median of the largest values in 10 ms windows over the stretch of highest amplitude (thesis 6.3.5).

    `acceleration_m_s2` is [frame] or [frame, tile]; windows of all tiles count alike.

    >>> time = np.arange(48000) / 48000.0
    >>> round(strongest_peak_m_s2(3.7 * np.sin(2.0 * np.pi * 300.0 * time), 48000.0), 2)
    3.7
    """
    length = round(WINDOW_S * rate_hz)
    signal = np.asarray(acceleration_m_s2, np.float64).reshape(len(acceleration_m_s2), -1)
    count = len(signal) // length
    windows = signal[: count * length].T.reshape(-1, length)
    rms = np.sqrt(np.mean(windows**2, axis=1))
    sounding = rms > _SILENT * rms.max(initial=0.0)
    if not sounding.any():
        raise BadMeasurement("the patch is silent under a footstep; its level cannot be measured")
    strong = rms >= _STRONG * np.percentile(rms[sounding], _OF_PERCENT)
    return float(np.median(np.abs(windows[strong]).max(axis=1)))


def measured_peak_m_s2(patch: Patch, registry: Registry, is_stopped: Callable[[], bool] = lambda: False) -> float:
    """The peak on simulated plates under the simulated walker, on the default floor.

    `BadMeasurement` for silence, and where it `is_stopped`, which is asked after each second of the walk.
    """
    source = SimulatedFloor(default_floor(), seed=patch.seed)
    loop = Loop(patch, registry, source, LoopOptions(block=1024, plates=("accelerometer",)))
    for command in (Level(_QUIET_DB), Play(True)):
        loop.send(command, 0)
    parts = []
    for _ in range(_SECONDS):
        if is_stopped():
            raise BadMeasurement("the measurement of the level was stopped")
        parts.append(loop.play_all(round(loop.rate_hz))[1]["accelerometer"])
    measured = np.concatenate(parts).astype(np.float64) / 10.0 ** (_QUIET_DB / 20.0)
    return strongest_peak_m_s2(measured, loop.rate_hz)
