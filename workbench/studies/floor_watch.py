"""The state of the floor during a study: visits, contacts and crossings of a participant, and the forces."""

import math
import time
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.engine.session_memory import ForceReader
from underfoot.floor.contacts import ContactTracker, OngoingContact
from underfoot.floor.layout import Floor
from underfoot.floor.loss_concealment import LossConcealment

LEFT_S = 0.4
"""Time without a contact after which the floor counts as left; a foot that follows sooner belongs to the same visit."""
SILENT_S = 1.0
"""Time without samples, which come every few milliseconds, after which the floor counts as unplugged."""
_KEPT_S = 60.0
"""Samples older than this are discarded, even if they were never read."""


@dataclass(frozen=True)
class Visit:
    """A visit to the floor, from the first contact's start to the last one's end; `end_s` is inf until then."""

    start_s: float
    end_s: float


class FloorWatch:
    """Follows the force samples of a running session. `read` never blocks; call it about 60 times a second."""

    def __init__(self, forces: ForceReader, floor: Floor, rate_hz: float, force_hz: float) -> None:
        self.floor, self._rate_hz, self.force_hz = floor, rate_hz, force_hz
        self._forces = forces
        self._begin()
        self._kept: deque[tuple[NDArray[np.float64], NDArray[np.float64]]] = deque()
        self._last_on = -math.inf
        self.visits: list[Visit] = []
        """All visits to the floor so far, the current one last."""
        self.now_s = 0.0
        """The time of the latest sample, in seconds of the session."""
        self._read_at = time.perf_counter()

    def read(self) -> NDArray[np.float64]:
        """Read the samples since the last call; return the force of each tile in N, less the tare, [sample, tile]."""
        frames, forces = self._forces.read()
        if not len(frames):
            return np.zeros((0, len(self.floor.tiles)))
        self._read_at = time.perf_counter()
        times = frames / self._rate_hz
        if self._kept and times[0] < self.now_s:  # the engine was restarted
            self._begin()
        rows = self._concealment.follow(times, forces).rows
        self.now_s = float(times[-1])
        self._kept.append((times, forces))
        while self._kept and self._kept[0][0][-1] < self.now_s - _KEPT_S:
            self._kept.popleft()
        for time_s in np.unique(rows.time_s):
            self._is_on(float(time_s))
        if not self._tracker.ongoing() and self.now_s - self._last_on > LEFT_S:
            self._leave()
        return np.asarray((forces - self._tracker.baseline_n).sum(axis=2))

    @property
    def is_silent(self) -> bool:
        """Whether no sample has come for a second: the floor is unplugged, or the engine has stopped."""
        return time.perf_counter() > self._read_at + SILENT_S

    @property
    def is_on(self) -> bool:
        """Whether a person is on the floor, or was a moment ago."""
        return bool(self.visits) and self.visits[-1].end_s == math.inf

    @property
    def is_loaded(self) -> bool:
        """Whether there is a contact at the latest sample; `is_on` follows after contacts are assigned to visits."""
        return self.is_on or bool(self._tracker.ongoing())

    @property
    def contacts(self) -> tuple[OngoingContact, ...]:
        """The contacts at the latest sample."""
        return self._tracker.ongoing()

    @property
    def loads_n(self) -> NDArray[np.float64]:
        """The load of each tile at the latest sample, in N."""
        return self._tracker.loads_n

    def visits_since(self, time_s: float) -> list[Visit]:
        """Return the visits that began at or after `time_s`."""
        return [visit for visit in self.visits if visit.start_s >= time_s]

    def forces_between(self, start_s: float, end_s: float) -> tuple[float, NDArray[np.float64]]:
        """Return the time of the first sample from `start_s` to `end_s`, and forces in N less the tare, [sample, tile,
        corner].
        """
        times = [times for times, _ in self._kept]
        if not times:
            return start_s, np.zeros((0, len(self.floor.tiles), 4))
        time_s = np.concatenate(times)
        inside = (time_s >= start_s) & (time_s <= end_s)
        forces = np.concatenate([forces for _, forces in self._kept])[inside] - self._tracker.baseline_n
        return float(time_s[inside][0]) if inside.any() else start_s, forces

    def _begin(self) -> None:
        self._tracker = ContactTracker(self.floor, self.force_hz)
        self._concealment = LossConcealment(self._tracker, round(self.force_hz))

    def _is_on(self, time_s: float) -> None:
        if self.is_on and time_s - self._last_on > LEFT_S:
            self._leave()
        if not self.is_on:
            self.visits.append(Visit(time_s, math.inf))
        self._last_on = max(self._last_on, time_s)

    def _leave(self) -> None:
        if self.is_on:
            self.visits[-1] = Visit(self.visits[-1].start_s, self._last_on)
