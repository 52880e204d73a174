"""Commanded and measured vibration of all tiles in the last two seconds, and tiles whose response deviates."""

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.tile_response import ResponseMonitor, TileResponse, response_of
from underfoot.widgets.monitor.level_plot import summary_text
from underfoot.widgets.plots.history import History

_KEPT_S, _MIN_S = 2.0, 0.3


class TileLevels:
    """Commanded and measured acceleration of `tiles` tiles, m/s^2."""

    def __init__(self, tiles: int, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._commanded = History(np.float32, int(_KEPT_S * rate_hz), tiles)
        self._measured = History(np.float32, int(_KEPT_S * rate_hz), tiles)
        self._watch = ResponseMonitor(tiles, rate_hz)

    def feed(self, commanded: NDArray[np.float32], measured: NDArray[np.float32]) -> None:
        """Add the next frames of all tiles, (n, tiles) each."""
        self._commanded.append(commanded)
        self._measured.append(measured)
        self._watch.feed(commanded, measured)

    def deviating(self) -> NDArray[np.bool_]:
        """Return which tiles deviate from their command."""
        return self._watch.deviates()

    def of(self, row: int) -> tuple[TileResponse | None, str]:
        """Return a tile's response, and its levels as text; None and "" if there is too little data."""
        commanded, measured = self._commanded.latest()[:, row], self._measured.latest()[:, row]
        if len(measured) < _MIN_S * self._rate_hz:
            return None, ""
        response = response_of(commanded, measured, self._rate_hz)
        return response, summary_text(commanded, measured, self._rate_hz, response.unexplained)
