"""Contacts and footsteps in a stream of corner forces, chunk by chunk, for `monitor`, tables and recordings."""

import math
from collections.abc import Iterable, Iterator

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.floor.contacts import Contact, ContactRows, ContactTracker, OngoingContact
from underfoot.floor.footsteps import LEAST_N, Step
from underfoot.floor.layout import Floor
from underfoot.floor.loss_concealment import LossConcealment
from underfoot.floor.tracking import ON_N, ON_SIGMAS
from underfoot.floor.walks import WalkTracker
from underfoot.quantities import counted

CHUNK = 4096
"""Most samples per call."""


class Detections(Struct, frozen=True):
    """Results of a chunk of forces: contacts at each sample, finished footsteps, messages to the user.

    `finished` are the contacts that ended.
    """

    rows: ContactRows
    steps: list[Step]
    messages: tuple[str, ...] = ()
    finished: tuple[Contact, ...] = ()


class StepFinder:
    """Contacts and footsteps from chunks of force samples."""

    def __init__(self, floor: Floor, rate_hz: float) -> None:
        self._floor = floor
        self._tracker = ContactTracker(floor, rate_hz)
        self._counter = WalkTracker(floor)
        self._concealment = LossConcealment(self._tracker, CHUNK)
        self._first_s = math.inf
        self._cut = 0

    def feed(self, time_s: NDArray[np.float64], force_n: NDArray[np.float64]) -> Detections:
        """Process the next samples, at most `CHUNK`: times (n,) and corner forces (n, tiles, 4)."""
        followed = self._concealment.follow(time_s, force_n)
        if len(time_s):
            self._first_s = min(self._first_s, float(time_s[0]))
        self._cut += sum(map(self._is_cut_by_gap, followed.finished))
        now = float(time_s[-1]) if len(time_s) else -math.inf
        return Detections(followed.rows, self._counter.feed(followed.finished, now), finished=followed.finished)

    def ongoing(self) -> tuple[OngoingContact, ...]:
        """Return the contacts at the latest sample, each with its person, if known."""
        person_at = self._counter.person_at
        return tuple(
            replace(contact, person=person_at(contact.start_s, (contact.x_m, contact.y_m)))
            for contact in self._tracker.ongoing()
        )

    @property
    def baseline_n(self) -> NDArray[np.float64]:
        """What each sensor reads unloaded: shape (tiles, 4)."""
        return self._tracker.baseline_n

    def finish(self) -> Detections:
        """End the stream, and return the remaining results."""
        followed = self._tracker.finish()
        steps = self._counter.feed(followed.finished, math.inf) + self._counter.finish()
        return Detections(followed.rows, steps, finished=followed.finished)

    def warnings(self) -> list[str]:
        """Return warnings about the data."""
        began_untared = self._tracker.began_untared
        names = [tile.id for tile, untared in zip(self._floor.tiles, began_untared, strict=True) if untared]
        found = [f"untared, loaded from the first sample on: {', '.join(names)}"] if names else []
        if self._cut:
            found.append(f"{counted(self._cut, 'contact')} cut by gaps in the samples; they give no step")
        begins_n = ON_SIGMAS * self._tracker.noise_n
        noisy = [tile.id for tile, on_n in zip(self._floor.tiles, begins_n, strict=True) if round(on_n) > ON_N]
        if noisy:
            most = f"up to {begins_n.max():.0f} N instead of {ON_N:g} N"
            found.append(f"noisy, so that contacts begin late, at {most}, and end early: {', '.join(noisy)}")
        return found

    def _is_cut_by_gap(self, contact: Contact) -> bool:
        """Return whether a contact that would be a step was cut, and not by the stream's ends or a missing tare."""
        is_tared = not self._tracker.began_untared[list(contact.tiles)].any()
        is_cut = contact.cut and contact.start_s > self._first_s and is_tared
        return bool(is_cut and contact.force_n.max(initial=0.0) >= LEAST_N)


def find_steps(
    pieces: Iterable[tuple[NDArray[np.float64], NDArray[np.float64]]], floor: Floor, rate_hz: float
) -> Iterator[Detections]:
    """Return the results of all pieces of a stream, each times (n,) and corner forces (n, tiles, 4)."""
    finder = StepFinder(floor, rate_hz)
    for time_s, force_n in pieces:
        for at in range(0, len(time_s), CHUNK):
            yield finder.feed(time_s[at : at + CHUNK], force_n[at : at + CHUNK])
    yield finder.finish()
