"""Plausibility of presses at known positions: dead sensors, sensors in another order, and misplaced presses."""

from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.files.measurements import Presses
from underfoot.calibration.science.centroid_fit import centroid
from underfoot.errors import BadValue
from underfoot.kernels import Floats

_MOST_OUT = 0.1
"""Share of presses that disagree with their force above which the table is wrong, not single presses."""
_SLIP_M, _SLIP_FACTOR = 0.03, 6.0
"""A press further off than this distance, and than this many times the median at its load, is misplaced."""
_DEAD = 0.002
"""A sensor whose force varies by less than this share of the largest is dead."""


def require_alive(forces: Floats) -> None:
    """Raise `BadValue` for corner forces (n, 4) that pull, and for a sensor with the same value at every press."""
    total = float(np.median(forces.sum(axis=1)))
    if total <= 0.0:
        raise BadValue(f"the sensors' forces add up to {total:.3g} N; allowed: forces that press down")
    dead = np.flatnonzero(np.ptp(forces, axis=0) <= _DEAD * np.abs(forces).max())
    if dead.size:
        raise BadValue(
            f"sensor {dead[0] + 1} gives {forces[0, dead[0]]:.4g} N at every press: is it dead, or not connected?"
        )


def require_order(forces: Floats, at_m: Floats, sensors_m: Floats) -> None:
    """Raise `BadValue` for columns of forces (n, 4) in another order than the sensors of the floor."""
    loaded = forces.sum(axis=1) > 0.0
    usual = {
        order: float(np.median(np.hypot(*(centroid(forces[loaded][:, order], sensors_m) - at_m[loaded]).T)))
        for order in permutations(range(4))
    }
    own, best = usual[0, 1, 2, 3], min(usual, key=lambda order: usual[order])
    if own > 0.03 and usual[best] < 0.4 * own:
        wrong = [str(j + 1) for j in range(4) if best[j] != j]
        raise BadValue(f"sensors {' and '.join(wrong)} look swapped: the presses fit the order {[j + 1 for j in best]}")


def plausible_presses(presses: Presses, forces: Floats, sensors_m: Floats) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Return a mask (n,) of presses that agree with their force and position, and a line on each rejected one."""
    ratio = forces.sum(axis=1) / presses.force_n
    usual = float(np.median(ratio))
    bad = (ratio < 0.6 * usual) | (ratio > 1.6 * usual)
    lines = [
        f"press {k + 1}: {presses.force_n[k]:.4g} N given, {forces[k].sum() / usual:.4g} N measured"
        for k in np.flatnonzero(bad)
    ]
    if bad.sum() > max(1.0, _MOST_OUT * bad.size):
        raise BadValue(f"{bad.sum()} of {bad.size} presses do not fit their force; {lines[0]}")
    kept = np.flatnonzero(~bad)
    seemed = centroid(forces[kept], sensors_m)
    off = np.hypot(*(seemed - presses.at_m[kept]).T)
    slips = np.zeros(kept.size, dtype=bool)
    for _, chosen in load_groups(presses.force_n[kept]):
        slips |= chosen & (off > _SLIP_M + _SLIP_FACTOR * np.median(off[chosen]))
    if slips.sum() <= max(1.0, _MOST_OUT * bad.size):
        lines += [
            f"press {kept[k] + 1}: ({1e3 * x:.0f}, {1e3 * y:.0f}) mm given, measured {1e3 * off[k]:.0f} mm from there"
            for k in np.flatnonzero(slips)
            for x, y in [presses.at_m[kept[k]]]
        ]
        bad[kept[slips]] = True
    return ~bad, tuple(line.replace(": ", " left out: ", 1) for line in lines)


def load_groups(force_n: Floats) -> list[tuple[float, NDArray[np.bool_]]]:
    """Return the loads used, newtons, each with its presses: forces within a fifth of each other are one load."""
    ordered = np.sort(force_n)
    cuts = ordered[1:][np.diff(np.log(ordered)) > 0.2]
    group = np.searchsorted(cuts, force_n, side="right")
    if cuts.size > 7:
        group = np.minimum((group * 4) // (cuts.size + 1), 3)
    return [(float(np.median(force_n[group == one])), group == one) for one in np.unique(group)]
