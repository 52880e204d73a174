"""Commanded and measured vibration in the last two seconds, and tiles whose response deviates."""

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.tile_response import ResponseMonitor, TileResponse, response_of
from underfoot.widgets.monitor.level_plot import summary_text
from underfoot.widgets.monitor.vibration_history import MOST_TILES
from underfoot.widgets.plots.history import History

_KEPT_S, _MIN_S = 2.0, 0.3


class TileLevels:
    """Commanded and measured acceleration of `tiles` tiles, m/s^2; of more than `MOST_TILES`, of the chosen one."""

    def __init__(self, tiles: int, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._row = 0
        self._keeps_all = tiles <= MOST_TILES
        kept = tiles if self._keeps_all else 1
        self._commanded = History(np.float32, int(_KEPT_S * rate_hz), kept)
        self._measured = History(np.float32, int(_KEPT_S * rate_hz), kept)
        self._watch = ResponseMonitor(tiles, rate_hz)

    def choose(self, row: int) -> None:
        """Choose the tile that `levels` describes; on a large floor, its data begin now."""
        if row != self._row and not self._keeps_all:
            self._commanded.clear()
            self._measured.clear()
        self._row = row

    def feed(self, commanded: NDArray[np.float32], measured: NDArray[np.float32]) -> None:
        """Add the next frames of all tiles, (n, tiles) each."""
        kept = slice(None) if self._keeps_all else slice(self._row, self._row + 1)
        self._commanded.append(commanded[:, kept])
        self._measured.append(measured[:, kept])
        self._watch.feed(commanded, measured)

    def deviating(self) -> NDArray[np.bool_]:
        """Return which tiles deviate from their command."""
        return self._watch.deviates()

    def levels(self) -> tuple[TileResponse | None, str]:
        """Return the chosen tile's response, and its levels as text; None and "" if there is too little data."""
        column = self._row if self._keeps_all else 0
        commanded, measured = self._commanded.latest()[:, column], self._measured.latest()[:, column]
        if len(measured) < _MIN_S * self._rate_hz:
            return None, ""
        response = response_of(commanded, measured, self._rate_hz)
        return response, summary_text(commanded, measured, self._rate_hz, response.unexplained)
