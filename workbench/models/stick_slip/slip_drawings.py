"""Distributions of stick-slip as pictures: slip duration, slip distance, and period of the cycle (8.12 to 8.16)."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, Series
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.slip_distribution import SlipDistribution
from underfoot.models.stick_slip.tabulated import Distribution
from underfoot.models.stick_slip.upcrossings import Upcrossings, white_upcrossings

_PERIODS, _TIMES = 12.0, 600
_STEP = 0.002
"""Step of the thesis, 1/w0, over which its white noise is averaged."""
_SHOWN = 0.995
"""Quantile of the observed values at which pictures end."""
_FIRST = 0.0005
"""Quantile at which they begin if it is below 0, as distances may be."""


def block_of(values: Mapping[str, Any]) -> BlockOnBelt:
    """Return the block of a node with these `values`; velocities are at least 0.1 mm/s.

    >>> block_of({"frequency": 100.0, "damping": 40, "noise": 30, "start": 150, "velocity": 0.1}).zeta.__round__(1)
    251.3
    """
    w0, v = 2.0 * math.pi * values["frequency"], max(values["velocity"], 1e-4)
    share = {name: 0.01 * values[name] for name in ("damping", "noise", "start")}
    return BlockOnBelt(w0, share["damping"] * w0, share["noise"] * w0 * v * v, v, share["start"] * v / w0, 0.0)


def slip_drawings(values: Mapping[str, Any]) -> tuple[Drawing, ...]:
    """Return duration, distance and period of a node's slips, exact to its requested error, and the thesis's
    approximation.

    The approximation takes upcrossings of the belt velocity as independent (8.12, 8.14); errors of its equations are
    corrected.

    >>> node = {"frequency": 40.0, "velocity": 0.1, "damping": 40.0, "noise": 50.0, "start": 200.0, "error": "0.01"}
    >>> [drawing.title for drawing in slip_drawings(node)]
    ['How long a slip lasts', 'How far it goes', 'Slip and stick']
    """
    block = block_of(values)
    t_end = _PERIODS * 2.0 * math.pi / block.w0
    exact = SlipDistribution.solve(block, t_end, max(float(values["error"]), 1e-3))
    near = white_upcrossings(block, np.linspace(t_end / _TIMES, t_end, _TIMES), _STEP / block.w0)
    return (
        _density_drawing("How long a slip lasts", "duration, ms", exact.duration, near, "durations"),
        _density_drawing(
            "How far it goes", f"distance at {block.belt_velocity:g} m/s, mm", exact.distance, near, "distances"
        ),
        _density_drawing("Slip and stick", "period, ms", exact.period, near, "periods"),
    )


def _density_drawing(title: str, label: str, exact: Distribution, near: Upcrossings, name: str) -> Drawing:
    """Return a drawing of one density in ms or mm, exact and approximated; negligible ends are cut off."""
    cdf = exact.cdf / exact.cdf[-1]
    seen = ((exact.points >= 0.0) | (cdf >= _FIRST)) & (cdf <= _SHOWN)
    points: NDArray[np.float64] = exact.points[seen]
    lines = [Series("exact", 1e3 * points, exact.density[seen] / 1e3)]
    if name == "durations":
        at, rough = near.t, near.durations()
    else:
        at = np.linspace(float(points[0]), float(points[-1]), 120)
        rough = near.distances(at) if name == "distances" else near.periods(at)
    inside = at <= points[-1]
    lines.append(Series("upcrossings (thesis)", 1e3 * at[inside], rough[inside] / 1e3, "dashed", "force"))
    unit = label.split(", ")[1]
    none = f"; {100.0 * exact.unobserved:.2g} % have none" if exact.unobserved > 1e-3 else ""
    return Drawing(title, f"{label}{none}", f"density, 1/{unit}", tuple(lines))
