"""Contacts and footsteps out of a stream of forces, also where samples of single tiles are missing."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import ContactRows, ContactTracker, OngoingContact
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.floor.loss_concealment import LossConcealment
from underfoot.floor.walks import StepCounter

CHUNK = 4096
"""Samples that are fed at once, at most."""


@dataclass(frozen=True)
class Found:
    """What a chunk of forces brought: contacts at their samples, footsteps that are over, and news for the person."""

    rows: ContactRows
    steps: list[Step]
    news: tuple[str, ...] = ()


class StepFinder:
    """Contacts and footsteps from chunks of force samples, at most `CHUNK` each."""

    def __init__(self, floor: Floor, rate_hz: float) -> None:
        self._floor = floor
        self._tracker = ContactTracker(floor, rate_hz)
        self._counter = StepCounter(floor)
        self._concealment = LossConcealment(self._tracker, CHUNK)
        self._untared = np.zeros(len(floor.tiles), bool)

    def feed(self, time_s: NDArray[np.float64], force_n: NDArray[np.float64]) -> Found:
        """Follow samples at `time_s` (n,), ascending: `force_n` (n, tiles, 4), NaN for a tile of which none came."""
        if not np.isfinite(force_n).all():
            force_n = force_n.copy()
            self._concealment.fill(time_s, force_n, len(time_s))
        followed = self._tracker.feed(time_s, force_n)
        self._untared |= self._tracker.untared
        now = float(time_s[-1]) if len(time_s) else -math.inf
        return Found(followed.rows, self._counter.feed(followed.finished, now))

    def ongoing(self) -> tuple[OngoingContact, ...]:
        """The contacts at the latest sample, each with the person who stands there, if that is known."""
        person_at = self._counter.person_at
        return tuple(
            replace(contact, person=person_at(contact.start_s, (contact.x_m, contact.y_m)))
            for contact in self._tracker.ongoing()
        )

    @property
    def baseline_n(self) -> NDArray[np.float64]:
        """What each sensor reads unloaded: shape (tiles, 4)."""
        return self._tracker.baseline_n

    def finish(self) -> Found:
        """What was held back, once the stream has ended."""
        followed = self._tracker.finish()
        return Found(followed.rows, self._counter.feed(followed.finished, math.inf) + self._counter.finish())

    def warnings(self) -> list[str]:
        """What the person should know of the data."""
        names = [tile.id for tile, untared in zip(self._floor.tiles, self._untared, strict=True) if untared]
        return [f"untared, loaded from the first sample on: {', '.join(names)}"] if names else []
