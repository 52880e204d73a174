"""Tiles that are silent while others send."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from underfoot.devices.recurrence import LAST, Recurrence

_SILENT_S, _PAUSE_S = 1.0, 0.3  # of a tile while others send, and of all


class SilentTiles:
    """The tiles with these `ids` of which nothing has come since `since_s`, in seconds.

    Tiles that send only what changes are not named each time.

    >>> silence = SilentTiles(("t1", "t2"), 0.0)
    >>> silence.take_notices(np.array([100, 100]), 1.0)
    []
    >>> silence.take_notices(np.array([300, 100]), 2.5)
    ['nothing comes from t2, while others send']
    >>> silence.take_notices(np.array([400, 101]), 3.5)
    ['frames come from t2 now']
    >>> silence.words
    ''
    """

    def __init__(self, ids: Sequence[str], since_s: float) -> None:
        self._ids = np.array(ids)
        self._heard = np.zeros(len(ids), np.int64)
        self._heard_s = np.full(len(ids), since_s)
        self._told = np.zeros(len(ids), bool)
        self._recurrences = [Recurrence() for _ in ids]
        self.words = ""
        """The tiles that are silent now, also where they are not named any more; "" for none."""

    def take_notices(self, heard: NDArray[np.int64], now_s: float) -> list[str]:
        """Return a line with the tiles that are silent now, and one with those that send again.

        `heard`: the number of frames of each tile until `now_s`.
        """
        self._heard_s[heard != self._heard] = now_s
        self._heard = heard
        if now_s - self._heard_s.max() > _PAUSE_S:  # all pause: nobody's silence grows
            self._heard_s += now_s - self._heard_s.max()
            return []
        silent = now_s - self._heard_s > _SILENT_S
        self.words = f"nothing comes from {', '.join(self._ids[silent])}" if silent.any() else ""
        rows, risen = np.flatnonzero(silent & ~self._told), self._told & ~silent
        fallen = [row for row in rows.tolist() if self._recurrences[row].says(now_s)]
        self._told &= silent
        self._told[fallen] = True
        lines = list[str]()
        if fallen:
            often = ", ".join(self._ids[row] for row in fallen if self._recurrences[row].is_last)
            last = f"; {often} {LAST}" if often else ""
            lines.append(f"nothing comes from {', '.join(self._ids[fallen])}, while others send{last}")
        return lines + ([f"frames come from {', '.join(self._ids[risen])} now"] if risen.any() else [])
