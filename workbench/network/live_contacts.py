"""Contacts without delay for other programs: persistent ids, positions from 0 to 1, and motion.

`ContactTracker` needs up to 0.7 s to decide which loads belong to one foot, which is too long for interaction. Here
contacts are provisional. A contact keeps its id while any of its loads lasts: a foot that rolls over a seam stays one
contact. If one contact turns out to be two feet, the older one keeps the id; if two turn out to be one foot, the
younger id ends.
"""

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor

_KEPT = 256  # number of decided contacts whose sent ids are kept


@dataclass(frozen=True)
class LiveContact:
    """A contact as it is sent.

    `x` and `y` are relative to the floor's bounding box, from 0 to 1: x along the floor's x axis, y against its y axis,
    as on a screen that lies on the floor. Velocities are in boxes per second, `acceleration` is the change of speed in
    boxes per second squared. `x_m` and `y_m` are in the floor's frame. `person` is 0 if unknown.
    """

    id: int
    x: float
    y: float
    x_m: float
    y_m: float
    force_n: float
    person: int = 0
    x_velocity: float = 0.0
    y_velocity: float = 0.0
    acceleration: float = 0.0
    force_rate_n_s: float = 0.0


class LiveContacts:
    """Gives contacts persistent ids, update by update.

    >>> from underfoot.floor.layout import default_floor
    >>> live = LiveContacts(default_floor(1, 1))
    >>> live.update(0.1, [OngoingContact(0, 0.1525, 0.1525, 300.0, (0,), loads=(0,))])[0].id
    1
    >>> moved, = live.update(0.2, [OngoingContact(7, 0.2135, 0.1525, 300.0, (0,), loads=(0,))])
    >>> moved.id, round(moved.x_velocity, 9)
    (1, 2.0)
    >>> live.sent_id(7)
    1
    """

    def __init__(self, floor: Floor, after_id: int = 0) -> None:
        """The first id is `after_id` + 1."""
        low, high = floor.bounds_m()
        self._low = low.tolist()
        self.size_m: tuple[float, float] = tuple((high - low).tolist())
        """Width and depth of the bounding box."""
        self._owner: dict[int, int] = {}
        self._before: dict[int, LiveContact] = {}
        self._time_s = -math.inf
        self.last_id = after_id
        self._sent_ids: dict[int, int] = {}
        self._decided: deque[int] = deque()

    def update(self, time_s: float, contacts: Sequence[OngoingContact]) -> tuple[LiveContact, ...]:
        """Return the contacts of the sample at `time_s`, in the order of their ids."""
        if time_s < self._time_s:  # the engine was restarted
            self._owner.clear()
        taken: dict[int, OngoingContact] = {}
        for contact in sorted(contacts, key=lambda one: (one.start_s, one.tiles)):
            known = sorted({self._owner[load] for load in contact.loads if load in self._owner} - taken.keys())
            if not known:
                self.last_id += 1
            taken[known[0] if known else self.last_id] = contact
        self._owner = {load: id for id, contact in taken.items() for load in contact.loads}
        for id, contact in taken.items():
            self._remember(contact.id, id)
        passed_s = time_s - self._time_s
        live = {id: self._live(id, taken[id], passed_s) for id in sorted(taken)}
        self._before, self._time_s = live, time_s
        return tuple(live.values())

    def sent_id(self, contact: int) -> int:
        """Return the id under which a contact of the tracker was last sent; 0 if it was not."""
        return self._sent_ids.get(contact, 0)

    def _remember(self, contact: int, id: int) -> None:
        if contact and contact not in self._sent_ids:
            self._decided.append(contact)
            if len(self._decided) > _KEPT:
                del self._sent_ids[self._decided.popleft()]
        if contact:
            self._sent_ids[contact] = id

    def _live(self, id: int, now: OngoingContact, passed_s: float) -> LiveContact:
        """Return a contact with its motion since the last update, by the times of the samples."""
        x = min(max((now.x_m - self._low[0]) / self.size_m[0], 0.0), 1.0)
        y = 1.0 - min(max((now.y_m - self._low[1]) / self.size_m[1], 0.0), 1.0)
        before = self._before.get(id)
        motion = (0.0, 0.0, 0.0, 0.0)
        if before is not None and passed_s > 0.0:
            vx, vy = (x - before.x) / passed_s, (y - before.y) / passed_s
            faster = math.hypot(vx, vy) - math.hypot(before.x_velocity, before.y_velocity)
            motion = (vx, vy, faster / passed_s, (now.force_n - before.force_n) / passed_s)
        elif before is not None:
            motion = (before.x_velocity, before.y_velocity, before.acceleration, before.force_rate_n_s)
        return LiveContact(id, x, y, now.x_m, now.y_m, now.force_n, now.person, *motion)
