"""Moments: the contacts in each 10 ms of a stream of force samples, and those that came and went.

Contacts are taken at the moment's last sample. Their assignment to feet is provisional, because the final one takes
later samples. A contact keeps its id while it lasts, also across tile edges. Where no sample comes for `SILENT_S`, one
moment more has nobody on the floor. The same samples give the same moments, but for those that come after that one, as
over TCP: time does not run back, so there are no moments of them.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.floor.contacts import SILENT_S, ContactTracker, OngoingContact
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.floor.loss_concealment import LossConcealment
from underfoot.floor.walks import WalkTracker

MOMENT_S = 0.01
MOST_CONTACTS = 12
"""Most contacts of a moment: those with the largest forces."""


@dataclass(frozen=True)
class Moment:
    """The floor at `time_s` of the session, `MOMENT_S` after the moment before.

    `contacts` are in the order of their forces, the largest first; their ids count from 1. `down` are those that are
    new since the moment before, `up` those that ended, as last seen. `steps` are the footsteps whose person, side and
    measures are known now, 0.7 s or more after their end (docs/contracts.md).
    """

    time_s: float
    contacts: tuple[OngoingContact, ...] = ()
    down: tuple[OngoingContact, ...] = ()
    up: tuple[OngoingContact, ...] = ()
    steps: tuple[Step, ...] = ()

    @property
    def began_s(self) -> float:
        """The beginning of the moment."""
        return self.time_s - MOMENT_S


class Moments:
    """Turns force samples in chunks of any size into moments. There are `rate_hz` session frames per second."""

    def __init__(self, floor: Floor, rate_hz: float, force_hz: float) -> None:
        self.floor = floor
        self._rate_hz, self._force_hz = rate_hz, force_hz
        self._begin()

    def _begin(self) -> None:
        self._tracker = ContactTracker(self.floor, self._force_hz)
        self._concealment = LossConcealment(self._tracker, max(round(2.0 * MOMENT_S * self._force_hz), 1))
        self._counter = WalkTracker(self.floor)
        self._known: dict[int, OngoingContact] = {}
        self._ids = 0
        self._before_s = -math.inf  # last sample of the moment before
        self._told_s = -math.inf  # the last moment
        self._steps: list[Step] = []  # that belong to the next moment
        self._number = -1  # of the incomplete moment, counted from the beginning of the session
        self._times: list[NDArray[np.float64]] = []
        self._forces: list[NDArray[np.float64]] = []

    def feed(self, frames: NDArray[np.float64], force_n: NDArray[np.float64]) -> Iterator[Moment]:
        """Yield the moments completed by samples at session frames (n,), ascending, with corner forces (n, tiles, 4).

        The first sample after a moment completes it. A tile whose samples are NaN keeps its load for 40 ms, as in the
        engine. If frames go back, because the engine was restarted, tracking starts again.
        """
        times = frames / self._rate_hz
        numbers = np.floor(times / MOMENT_S + 1e-6).astype(np.int64)
        edges = [0, *(np.flatnonzero(np.diff(numbers)) + 1).tolist(), len(times)]
        for first, end in pairwise(edges):
            if first == end:
                continue
            if numbers[first] != self._number:
                yield from self.pass_time(float(times[first]))
                yield from self._complete()
                if numbers[first] < self._number:
                    self._begin()
                self._number = int(numbers[first])
            self._times.append(times[first:end])
            self._forces.append(force_n[first:end].copy())  # the caller reuses its array

    def pass_time(self, now_s: float) -> Iterator[Moment]:
        """Yield the moment in which all feet are lifted, once, if no sample came for `SILENT_S` until `now_s`."""
        lifted_s = (float(self._times[-1][-1]) if self._times else self._before_s) + SILENT_S
        if not now_s > lifted_s:
            return
        yield from self._complete()
        if self._known:
            gone, self._known = tuple(self._known.values()), {}
            self._told_s = math.floor(lifted_s / MOMENT_S) * MOMENT_S
            yield Moment(self._told_s, up=gone)

    def _complete(self) -> Iterator[Moment]:
        """Yield the moment of the samples so far, if there are any, and it is not too late for it."""
        if not self._times:
            return
        times, forces = np.concatenate(self._times), np.concatenate(self._forces)
        self._times, self._forces = [], []
        finished = self._concealment.follow(times, forces).finished
        self._steps += self._counter.feed(finished, float(times[-1]))
        time_s = (self._number + 1) * MOMENT_S
        if time_s <= self._told_s:
            self._before_s = float(times[-1])
            return
        self._told_s = time_s
        contacts = self._named(sorted(self._tracker.ongoing(), key=lambda one: -one.force_n)[:MOST_CONTACTS])
        self._before_s = float(times[-1])
        before, self._known = self._known, {contact.id: contact for contact in contacts}
        steps, self._steps = tuple(self._steps), []
        yield Moment(
            time_s,
            contacts,
            tuple(contact for contact in contacts if contact.id not in before),
            tuple(contact for id, contact in before.items() if id not in self._known),
            steps,
        )

    def _named(self, found: Sequence[OngoingContact]) -> tuple[OngoingContact, ...]:
        """Return contacts with the ids of those that were on the same tiles the moment before; others get new ids."""
        left = dict(self._known)
        named = []
        for contact in found:
            heirs = [
                (-len(set(old.tiles) & set(contact.tiles)), math.dist(_place(old), _place(contact)), id)
                for id, old in left.items()
                if set(old.tiles) & set(contact.tiles) and contact.start_s <= self._before_s
            ]
            if heirs:
                id = min(heirs)[2]
                named.append(replace(contact, id=id, start_s=left.pop(id).start_s))
            else:
                self._ids += 1
                named.append(replace(contact, id=self._ids))
        return tuple(named)


def _place(contact: OngoingContact) -> tuple[float, float]:
    return contact.x_m, contact.y_m
