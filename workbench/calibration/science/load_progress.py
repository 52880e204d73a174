"""Progress of a load on a tile that is raised, held or let go, by a load cell: what is still missing, or None."""

import numpy as np

from underfoot.calibration.procedure import PageProgress
from underfoot.calibration.science.load_checks import COVERED, NEAR, covered_share, latest_rise
from underfoot.kernels import Floats

_STAYS_S, _OTHER_UNIT = 3.0, (0.03, 0.25)
"""Time for which a force does not rise, and shares of the requested load then, that a load cell in kilograms or pounds
gives."""
_HOLD_BAND = 0.12
"""Accepted relative deviation of a hold."""


def rise_progress(time_s: Floats, force_n: Floats, reading: float, full_n: float) -> PageProgress | None:
    """Return what is missing of a rise of a force (n,) from 0 to `full_n`; `reading` is the sensor's present one."""
    rise = latest_rise(force_n, full_n)
    top, covered = float(rise.max(initial=0.0)), covered_share(rise, full_n)
    shown = (("force", float(force_n[-1]), "N"), ("reading", reading, ""), ("covered", 100.0 * covered, "%"))
    if not rise.size:
        return PageProgress("Let go, and raise the force from 0 N.", 0.0, shown)
    if top >= NEAR * full_n and covered >= COVERED:
        return None
    if top >= NEAR * full_n:
        return PageProgress("Too fast: let go, and raise the force more slowly.", covered, shown)
    hint = f"Press harder, up to {full_n:.0f} N."
    stays_s = float(time_s[-1] - time_s[int(np.argmax(force_n))])
    if stays_s > _STAYS_S and _OTHER_UNIT[0] <= top / full_n <= _OTHER_UNIT[1]:
        hint += f" The load cell does not exceed {top:.0f} N: does it count kilograms, or pounds?"
    return PageProgress(hint, min(top / full_n, covered), shown)


def fall_progress(time_s: Floats, force_n: Floats, full_n: float) -> PageProgress | None:
    """Return what is missing until a force (n,) is gone."""
    if force_n[-1] <= 0.02 * full_n and np.ptp(time_s) >= 0.3 and force_n[-20:].mean() <= 0.03 * full_n:
        return None
    gone = 1.0 - float(force_n[-1]) / max(float(force_n.max()), 1e-9)
    return PageProgress("Let go.", max(gone, 0.0), (("force", float(force_n[-1]), "N"),))


def hold_progress(time_s: Floats, force_n: Floats, held_n: float, hold_s: float) -> PageProgress | None:
    """Return what is missing until a force (n,) has been at `held_n` for `hold_s`."""
    inside = np.abs(force_n - held_n) <= _HOLD_BAND * held_n
    outside = np.flatnonzero(~inside)
    since = time_s[outside[-1] + 1 if outside.size else 0] if inside[-1] else time_s[-1]
    kept = float(time_s[-1] - since)
    shown = (("force", float(force_n[-1]), "N"), ("held", kept, "s"))
    if kept >= hold_s:
        return None
    hint = "Hold still." if inside[-1] else "Press harder." if force_n[-1] < held_n else "Press less hard."
    return PageProgress(hint, kept / hold_s, shown)
