"""What all tiles were asked and did in the last two seconds, and which of them does not do what it is told."""

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.tile_response import ResponseMonitor, TileResponse, response_of
from underfoot.widgets.monitor.level_plot import summary_text
from underfoot.widgets.plots.history import History

_KEPT_S, _MIN_S = 2.0, 0.3


class TileLevels:
    """Commanded and measured acceleration, m/s^2, of so many tiles."""

    def __init__(self, tiles: int, rate_hz: float) -> None:
        self._rate_hz = rate_hz
        self._commanded = History(np.float32, int(_KEPT_S * rate_hz), tiles)
        self._measured = History(np.float32, int(_KEPT_S * rate_hz), tiles)
        self._watch = ResponseMonitor(tiles, rate_hz)

    def feed(self, commanded: NDArray[np.float32], measured: NDArray[np.float32]) -> None:
        """The next frames of all tiles, (n, tiles) each."""
        self._commanded.append(commanded)
        self._measured.append(measured)
        self._watch.feed(commanded, measured)

    def deviating(self) -> NDArray[np.bool_]:
        """Which tiles are off their command."""
        return self._watch.deviates()

    def of(self, row: int) -> tuple[TileResponse | None, str]:
        """A tile's response, and its levels in words; None and "" where too little was measured."""
        commanded, measured = self._commanded.latest()[:, row], self._measured.latest()[:, row]
        if len(measured) < _MIN_S * self._rate_hz:
            return None, ""
        response = response_of(commanded, measured, self._rate_hz)
        return response, summary_text(commanded, measured, self._rate_hz, response.unexplained)
