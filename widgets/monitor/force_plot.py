"""Force over time of one tile: four corners and their sum."""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.quantities import number
from underfoot.widgets import theme
from underfoot.widgets.plots import Plot, round_top, thinned

CORNERS = ("#e0705a", "#d8bb54", "#a8794a", "#e3a7a0")
"""The corners' colours, in the order of the sensors: neighbours of the amber of force."""

LEAST_TOP_N = 200.0
BELOW = 0.1
"""How far the axis goes below zero, as a share of its top: real corners are pulled up, too."""


class ForcePlot(Plot):
    """The curves of the seconds before now. The vertical axis grows in steps, and shrinks when it has been too large
    for as long as the plot is wide."""

    def __init__(self) -> None:
        super().__init__("Force of the chosen tile")
        self._corners = [self.add_curve(colour, z=1.0) for colour in CORNERS]
        self._sum = self.add_curve(theme.FORCE, z=2.0)
        self._onsets = self.add_line(theme.mixed(theme.EVENTS, theme.GROUND, 0.55))
        self._zero = self.add_line(theme.FAINT)
        self._seconds = 8.0
        self._top_n = 0.0
        self._large_until = -math.inf
        self._set_top(1000.0)

    def set_span(self, seconds: float, ticks: list[tuple[float, str]]) -> None:
        """Show this many seconds before now."""
        self._seconds = seconds
        self.set_axis("bottom", -seconds, 0.0, [(at, "") for at, _ in ticks])
        self._zero.place_y(0.0)

    def show_forces(
        self, time_s: NDArray[np.float64], force_n: NDArray, now_s: float, onsets_s: NDArray[np.float64]
    ) -> None:
        """Draw corner forces (n, 4) at `time_s` (n,), with `now_s` at the right edge, and marks at `onsets_s`."""
        first = int(np.searchsorted(time_s, now_s - self._seconds - 0.1))
        time_s, force_n = time_s[first:], force_n[first:]
        step = self._seconds / max(100.0, self.box.width() / 2.0)
        curves = np.empty((len(force_n), 5), np.float32)
        curves[:, :4] = force_n
        force_n.sum(axis=1, out=curves[:, 4])
        x, y = thinned(time_s, curves, step)
        x = x - now_s
        for curve, points in zip((*self._corners, self._sum), np.ascontiguousarray(y.T), strict=True):
            curve.setData(x, points, connect="finite", skipFiniteCheck=False)
        self._fit(float(np.nanmax(y[:, 4], initial=0.0)), now_s)
        shown = onsets_s[(onsets_s > now_s - self._seconds) & (onsets_s < now_s)]
        self._onsets.place_x(*(shown - now_s))

    def clear_forces(self) -> None:
        """Show nothing."""
        for curve in (*self._corners, self._sum):
            curve.setData([], [])
        self._onsets.place_x()

    def _fit(self, largest_n: float, now_s: float) -> None:
        needed = max(LEAST_TOP_N, round_top(1.05 * largest_n))
        if needed >= self._top_n or now_s < self._large_until - 2.0 * self._seconds:
            self._large_until = now_s + self._seconds
        if needed > self._top_n or now_s > self._large_until:
            self._set_top(needed)

    def _set_top(self, top_n: float) -> None:
        self._top_n = top_n
        first = int(f"{top_n:e}"[0])
        count = {1: 5, 2: 4, 5: 5}[first]
        ticks = [(top_n * i / count, number(top_n * i / count)) for i in range(count)]
        ticks.append((top_n, f"{number(top_n)} N"))
        self.set_axis("left", -BELOW * top_n, top_n, ticks)
        if hasattr(self, "_zero"):
            self._zero.place_y(0.0)
