"""The body weight of a recording's standing phase."""

import math
from bisect import bisect_left
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from underfoot.floor.footsteps import LEAST_N, Step
from underfoot.records.survey import PLACES_S, ContactSpan

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


def standing_phase(contacts: Sequence[ContactSpan]) -> Standing | None:
    """Return the stillest `STILL_S` in which anybody stands, with all that is on the floor then; None if nobody does.

    >>> span = ContactSpan(1, 0.5, 6.5, (0,), ((0.0, 0.0, 698.0), (0.0, 0.0, 702.0)) * 120)
    >>> str(standing_phase([span]))
    'standing at 0.5 to 2.5 s, ± 2.0 N'
    """
    places = max((round(one.start_s / PLACES_S) + len(one.places) for one in contacts), default=0)
    load_n, width = np.zeros(places), round(STILL_S / PLACES_S)
    for one in contacts:
        first = round(one.start_s / PLACES_S)
        load_n[first : first + len(one.places)] += [force_n for _, _, force_n in one.places]
    if places < width:
        return None
    sums = np.cumsum([np.append(0.0, load_n), np.append(0.0, load_n**2)], axis=1)
    mean_n, square = (sums[:, width:] - sums[:, :-width]) / width
    sd_n = np.sqrt(np.maximum(square - mean_n**2, 0.0))
    share = np.where(mean_n >= LEAST_N, sd_n / np.maximum(mean_n, LEAST_N), math.inf)
    at, all_s = int(np.argmin(share)), PLACES_S * np.flatnonzero(share <= STILL)
    return Standing(at * PLACES_S, float(mean_n[at]), float(sd_n[at]), all_s.tolist()) if len(all_s) else None
