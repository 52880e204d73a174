"""The body weight of a recording's standing phase."""

from bisect import bisect_left
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from underfoot.floor.footsteps import LEAST_N, Step
from underfoot.records.balance import PLACES_S, loaded_times

STILL_S = 2.0
"""Length of a standing phase: sway and heartbeat, of about 1 Hz, are averaged."""
WHY = "standing"
"""Why steps are left out that are feet of a standing phase."""
STILL = 0.02
"""Largest standard deviation of the load while somebody stands still, as a share of it; of who walks it is a tenth."""


class Standing(Struct, frozen=True):
    """The mean load and its standard deviation, N, in `STILL_S` from a second of the recording on; and all seconds,
    ascending, from which on somebody stands as long."""

    begin_s: float
    weight_n: float
    sd_n: float
    all_s: Sequence[float]

    def is_in(self, step: Step) -> bool:
        """Return whether a step that counts is a foot that stands: for up to some seconds that is a step.

        >>> phase = Standing(1.0, 700.0, 2.0, [1.0, 9.0])
        >>> [phase.is_in(Step(1, "t1", "left", 0.5, ms, *[0.0] * 7)) for ms in (3000.0, 600.0)]
        [True, False]
        """
        after = self.all_s[bisect_left(self.all_s, step.start_s - PLACES_S) :][:1]
        return not step.left_out and any(begin_s + STILL_S <= step.end_s + PLACES_S for begin_s in after)

    def __str__(self) -> str:
        return f"standing at {self.begin_s:.1f} to {self.begin_s + STILL_S:.1f} s, ± {self.sd_n:.1f} N"


def standing_phase(balance: bytearray) -> Standing | None:
    """Return the stillest `STILL_S` in which anybody stands, with all that is on the floor then; None if nobody does.

    `balance` is that of a `Survey`.
    """
    width = round(STILL_S / PLACES_S)
    found = [np.zeros((4, 0))]
    for one in loaded_times(balance):
        if len(one.places) >= width:
            load_n = one.places[:, 2]
            sums = np.cumsum([np.append(0.0, load_n), np.append(0.0, load_n**2)], axis=1)
            mean_n, square = (sums[:, width:] - sums[:, :-width]) / width
            sd_n = np.sqrt(np.maximum(square - mean_n**2, 0.0))
            windows = np.array([one.begin_s + PLACES_S * np.arange(len(mean_n)), mean_n, sd_n, sd_n / mean_n])
            found.append(windows[:, (mean_n >= LEAST_N) & (windows[3] <= STILL)])
    begin_s, mean_n, sd_n, share = np.concatenate(found, axis=1)
    if not len(begin_s):
        return None
    at = int(np.argmin(share))
    return Standing(float(begin_s[at]), float(mean_n[at]), float(sd_n[at]), begin_s.tolist())
