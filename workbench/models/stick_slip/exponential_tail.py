"""Exponential tail of long slips: once the hazard rate is constant, the first-passage density is exponential."""

import math

import numpy as np

from underfoot.models.stick_slip.boundary_integral import Grid
from underfoot.models.stick_slip.oscillator import BlockOnBelt
from underfoot.models.stick_slip.panel_buffer import PanelBuffer
from underfoot.models.stick_slip.panels import GAUSS_NODES, GAUSS_WEIGHTS, NODES_PER_PANEL


def constant_hazard(buffer: PanelBuffer, block: BlockOnBelt, time: float, t_end: float, error: float) -> float:
    """Return the hazard rate, 1/s, if it was constant for two relaxation times before `time` s; else 0.

    Its means over each of the two, tapered to cancel its oscillation, must agree well enough for the time when most
    slips have ended; and the remaining oscillation must not matter within one period.
    """
    relaxation = relaxation_time(block)
    if time < 2.0 * relaxation or buffer.count == 0:
        return 0.0
    table = buffer.panels().table
    first = max(0, int(np.searchsorted(table["start"], time - 2.0 * relaxation, side="right")) - 1)
    starts, lengths = table["start"][first:, None], table["length"][first:, None]
    if lengths.sum() < 1.99 * relaxation:  # nothing ended for a while
        return 0.0
    hazards = buffer.hazards()[first:]
    ago = (time - starts - 0.5 * lengths * (1.0 + GAUSS_NODES)) / relaxation
    taper = np.sin(math.pi * ago) ** 2 * lengths * GAUSS_WEIGHTS
    rate, earlier = (np.average(hazards, weights=taper * part) for part in (ago < 1.0, ago >= 1.0))
    drift = abs(rate - earlier)
    oscillation = np.ptp((hazards @ GAUSS_WEIGHTS)[lengths.cumsum() > 0.5 * lengths.sum()])
    allowed = 0.25 * error / (1.0 - buffer.ended)
    if rate <= 0.0 or drift > 0.05 * rate or 0.5 * oscillation > allowed * block.w0:
        return 0.0
    return float(rate) if drift * min(math.exp(-1.0) / rate, t_end - time) <= allowed else 0.0


def append_exponential(buffer: PanelBuffer, time: float, t_end: float, rate: float) -> None:
    """Append panels from `time` to `t_end` s whose density in x is that of the last node and falls at `rate` 1/s."""
    panels = buffer.panels()
    last = panels.table[-1]
    density = panels.weights[last["offset"] :].reshape(NODES_PER_PANEL, last["components"])[-1]
    shape = density / density.sum()
    first = last["first"] + 0.5 * last["length"] * (1.0 + GAUSS_NODES[-1]) * last["speed"]
    grid = Grid(float(first), float(last["spacing"]), float(last["width"]), shape.size, 0.0)
    while time < t_end * (1.0 - 1e-12) and 1.0 - buffer.ended > buffer.negligible:
        length = min(1.5 / rate, t_end - time)
        rates = rate * (1.0 - buffer.ended) * np.exp(-0.5 * rate * length * (1.0 + GAUSS_NODES))
        buffer.append(time, length, grid, np.outer(rates, shape))
        time += length


def relaxation_time(block: BlockOnBelt) -> float:
    """Return the memory of the free motion, s: a period, or the slowest decay time; inf without damping.

    >>> round(relaxation_time(BlockOnBelt(1.0, 0.1, 0.4, 1.0, 0.0, 0.0)), 1)
    20.0
    """
    half, w0 = 0.5 * block.zeta, block.w0
    slowest = half if half <= w0 else w0 * w0 / (half + math.sqrt(half * half - w0 * w0))
    return max(2.0 * math.pi / w0, 1.0 / slowest) if slowest > 0.0 else math.inf
