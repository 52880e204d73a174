"""Force over time of one tile: four corners and their sum."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.drawing import Drawing, ReferenceLine, Series
from underfoot.drawing.axes import round_top
from underfoot.drawing.layout import Margins
from underfoot.drawing.look import CORNERS
from underfoot.drawing.thinning import thinned
from underfoot.widgets.plots.plot import Plot

MIN_TOP_N = 200.0
_END_S = 0.1
"""Curves that end no longer before now are as wide as the plot: samples come in batches."""
MAX_LETTERS = 32
"""Most letters of a mark's text; the recording has all of it."""
BELOW_ZERO = 0.1
"""Extent of the axis below zero, as a share of its top: forces of real corners can be negative."""
_WITHOUT_TIMES = Margins(bottom=8.0)

_CURVES = (*CORNERS, "force")
_STEPS_PX = 2.0
"""Width in pixels for which a curve has two points."""


class ForcePlot(Plot):
    """The forces of the seconds before now. The vertical axis grows in steps, and shrinks when it has been too large
    for as long as the plot is wide."""

    def __init__(self) -> None:
        super().__init__("Force of the chosen tile", _WITHOUT_TIMES)
        self._seconds = 8.0
        self._top_n = 1000.0
        self._large_until = -math.inf
        self._level_n: tuple[float, ...] = ()
        """The top of the axis and the forces, if these are the same over the whole width: a picture that stands still
        while its times pass."""
        self.clear_forces()

    def set_duration(self, seconds: float) -> None:
        """Show this many seconds before now."""
        self._seconds = seconds
        self.clear_forces()

    def write_times(self, on: bool) -> None:
        """Write the times below, or leave that to the spectrogram under this plot."""
        self.set_margins(Margins() if on else _WITHOUT_TIMES)

    def show_forces(
        self,
        time_s: NDArray[np.float64],
        force_n: NDArray[np.float32],
        now_s: float,
        onsets_s: NDArray[np.float64],
        marks: Sequence[tuple[float, str]] = (),
    ) -> None:
        """Draw corner forces [n, 4] at `time_s` [n], with `now_s` at the right edge, lines at `onsets_s`, and `marks`:
        when and with which words."""
        first = int(np.searchsorted(time_s, now_s - self._seconds - 0.1))
        time_s, force_n = time_s[first:], force_n[first:]
        curves = np.empty((5, len(force_n)), np.float32)  # each in one piece, which NumPy adds and thins faster
        curves[:4] = force_n.T
        curves[:4].sum(axis=0, out=curves[4])
        step_s = self._seconds / max(100.0, self.frame.area.width / _STEPS_PX)
        x, y = thinned(time_s, curves.T, step_s)
        self._fit(float(np.nanmax(y[:, 4], initial=0.0)), now_s)
        shown = onsets_s[(onsets_s > now_s - self._seconds) & (onsets_s < now_s)]
        lines = [ReferenceLine("x", at_s - now_s, "onset") for at_s in shown.tolist()]
        lines += [
            ReferenceLine("x", at_s - now_s, "events", dashed=True, name=text[:MAX_LETTERS] or "mark")
            for at_s, text in marks
            if now_s - self._seconds < at_s < now_s
        ]
        is_wide = len(x) > 1 and x[0] - now_s <= step_s - self._seconds and x[-1] - now_s >= -_END_S
        is_level = is_wide and not lines and bool((y == y[0]).all())
        level_n = (self._top_n, *y[0].tolist()) if is_level else ()
        if not level_n or level_n != self._level_n:
            self._show(x - now_s, y.astype(np.float64), lines)
        self._level_n = level_n

    @property
    def has_forces(self) -> bool:
        """Whether there are curves."""
        return bool(len(self.drawing.series[-1].x))

    def clear_forces(self) -> None:
        """Show nothing."""
        self._level_n = ()
        self._show(np.zeros(0), np.zeros((0, 5)), [])

    def _show(self, x: NDArray[np.float64], y: NDArray[np.float64], lines: Sequence[ReferenceLine]) -> None:
        curves = zip(_CURVES, y.T, strict=True)
        self.show_drawing(
            Drawing(
                "Force of the chosen tile",
                "time, s",
                "force, N",
                tuple(Series("", x, values, colour=colour) for colour, values in curves),
                x_range=(-self._seconds, 0.0),
                y_range=(-BELOW_ZERO * self._top_n, self._top_n),
                lines=(*lines, ReferenceLine("y", 0.0, "faint")),
            )
        )

    def _fit(self, largest_n: float, now_s: float) -> None:
        needed = max(MIN_TOP_N, round_top(1.05 * largest_n))
        if needed >= self._top_n or now_s < self._large_until - 2.0 * self._seconds:
            self._large_until = now_s + self._seconds
        if needed > self._top_n or now_s > self._large_until:
            self._top_n = needed
