"""Footsteps: the figures of gait in a contact, and which foot it was.

A contact is a step if its beginning and end were both seen, it lasted 0.08 to 5 s and it reached 50 N. A person who
stands is a contact and no step; nor is one that the recording's beginning or end, a gap or an untared tile has cut,
because its figures would be of a part. All figures are of the contact's force and of its centroid in the floor's
frame.
"""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import require
from underfoot.floor.contacts import Contact
from underfoot.floor.layout import Floor

SHORTEST_S, LONGEST_S, LEAST_N = 0.08, 5.0, 50.0
"""A step lasts longer than the touch of a toe and shorter than standing, and bears weight."""

SPIKE_S = 0.030
"""Where 80 % of the first peak are reached within this of the onset, the loading rate is the impact's: a spike."""

PATH_N, PATH_S = 50.0, 0.025
"""The centroid's path is measured above this force, on its force-weighted mean over this time: noise is no path."""

INTERVAL_S, REACH_M = (0.2, 1.5), 1.0
"""The next step of a walker begins this much later, and no further away."""

PROGRESS_M, ROLL_M, ASIDE_M = 0.2, 0.05, 0.01
"""Sides are told from steps that go on by this, feet that roll by this, and offsets to the side of this, at least."""

WAIT_S, LATE_S = 0.8, 1.0
"""A step waits so long, after its end, for the next one to tell its side; contacts are told of up to `LATE_S` late."""


@dataclass(frozen=True)
class Step:
    """One footstep. The first twelve fields are the columns of the step table (docs/contracts.md#files); a figure
    that there is not is NaN.

    `tile` took most of the impulse; `side` is left, right or unknown. `contact_ms` is from the first sample at or
    above the on-threshold to the last at or above the off-threshold. `peak1_n` and `peak2_n` are the largest forces
    in the first and the second half of the contact, `valley_n` the least between them, `loading_kn_s` the rise from
    20 to 80 % of the first peak, interpolated between samples and not guarded: `spike` says that it is the impact's.
    `path_mm` is how far the centroid went above 50 N, `net_mm` how far it got. `cadence_per_min` is from the walker's
    last step to this one, and `contact` its contact's id.
    """

    step: int
    tile: str
    side: str
    start_s: float
    contact_ms: float
    peak1_n: float
    valley_n: float
    peak2_n: float
    impulse_ns: float
    loading_kn_s: float
    path_mm: float
    net_mm: float
    spike: bool = False
    cadence_per_min: float = math.nan
    contact: int = 0


def is_step(contact: Contact) -> bool:
    """Whether a contact is a step."""
    lasted = SHORTEST_S <= contact.end_s - contact.start_s <= LONGEST_S
    return bool(lasted and not contact.cut and len(contact.force_n) >= 3 and contact.force_n.max() >= LEAST_N)


def measure(contact: Contact, floor: Floor) -> Step:
    """The figures of a contact as step 0, of unknown side. Raises `BadValue` for a curve of fewer than three samples.

    >>> from underfoot.floor.layout import default_floor
    >>> time_s = np.linspace(0.0, 0.6, 601)
    >>> force_n = 700.0 * np.sin(np.pi * time_s / 0.6) + 300.0 * np.sin(3.0 * np.pi * time_s / 0.6) + 20.0
    >>> along_m = 0.2 + 0.2 * time_s
    >>> contact = Contact(1, 0.0, 0.6, (0,), False, -0.001, 0.0, time_s, force_n, along_m, 0.0 * time_s)
    >>> step = measure(contact, default_floor())
    >>> [round(value, 1) for value in (step.contact_ms, step.peak1_n, step.valley_n, step.peak2_n, step.impulse_ns)]
    [600.0, 731.1, 420.0, 731.1, 317.6]
    >>> round(step.loading_kn_s, 1), round(step.path_mm, 1), round(step.net_mm, 1), step.spike
    (6.9, 118.4, 118.4, False)
    """
    time_s, force_n = contact.time_s, contact.force_n
    require(len(time_s) >= 3, "the length of a contact's curve", len(time_s), "3 or more")
    later = int(np.searchsorted(time_s, 0.5 * (time_s[0] + time_s[-1]), side="right"))
    peak1 = int(force_n[:later].argmax())
    peak2 = later + int(force_n[later:].argmax())
    loading_kn_s, loaded_s = _loading(contact, peak1)
    path_m, net_m = _path(contact)
    return Step(
        step=0,
        tile=floor.tiles[contact.tiles[0]].id,
        side="unknown",
        start_s=contact.start_s,
        contact_ms=1e3 * (contact.end_s - contact.start_s),
        peak1_n=float(force_n[peak1]),
        valley_n=float(force_n[peak1 : peak2 + 1].min()),
        peak2_n=float(force_n[peak2]),
        impulse_ns=float(np.trapezoid(force_n, time_s)),
        loading_kn_s=loading_kn_s,
        path_mm=1e3 * path_m,
        net_mm=1e3 * net_m,
        spike=bool(loaded_s - time_s[0] < SPIKE_S),
        contact=contact.id,
    )


class StepCounter:
    """Turns contacts, in the order in which they ended, into numbered steps with sides.

    A walker's steps alternate. Which is which is told by how far each lies to the side of the last, seen along the
    walk: the way from the step before last, or, while there are only two, the way on which both feet rolled. A step
    is given out as soon as its side is known, or 1.8 s after its end; the result does not depend on how contacts are
    cut into calls.
    """

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._count = 0
        self._walkers: list[_Walk] = []
        self._waiting: deque[_WalkedStep] = deque()

    def feed(self, contacts: Iterable[Contact], now_s: float) -> list[Step]:
        """The steps known by now: `contacts` ended since the last call, and `now_s` is the latest sample's time."""
        steps: list[Step] = []
        for contact in contacts:
            if is_step(contact):
                steps += self._ready(contact.end_s)
                self._waiting.append(self._place(contact))
        return steps + self._ready(now_s - LATE_S)

    def finish(self) -> list[Step]:
        """The steps that still waited for their side."""
        return self._ready(math.inf)

    def _ready(self, now_s: float) -> list[Step]:
        steps = []
        while self._waiting and (self._waiting[0].is_sided or self._waiting[0].end_s + WAIT_S < now_s):
            footfall = self._waiting.popleft()
            self._count += 1
            steps.append(replace(footfall.step, step=self._count, side=footfall.side))
        return steps

    def _place(self, contact: Contact) -> "_WalkedStep":
        """The contact as the next step of the walker who is nearest, or as the first of a new one."""
        footfall = _WalkedStep.of(contact, self._floor)
        self._walkers = [w for w in self._walkers if footfall.end_s - w.steps[-1].end_s <= 2.0 * LONGEST_S]
        near = [walker for walker in self._walkers if walker.may_take(footfall)]
        if near:
            min(near, key=lambda walker: walker.steps[-1].distance_m(footfall)).take(footfall)
        else:
            walker = _Walk()
            walker.take(footfall)
            self._walkers.append(walker)
        return footfall


@dataclass(eq=False)
class _WalkedStep:
    """A step in its walker's walk: where it lies, and how the foot rolled on it, in metres."""

    step: Step
    end_s: float
    place_m: NDArray[np.float64]
    roll_m: NDArray[np.float64]
    walker: "_Walk | None" = None
    number: int = 0

    @classmethod
    def of(cls, contact: Contact, floor: Floor) -> "_WalkedStep":
        track = np.column_stack([contact.x_m, contact.y_m])
        weight = contact.force_n / contact.force_n.sum()
        loaded = np.flatnonzero(contact.force_n >= PATH_N)
        return cls(measure(contact, floor), contact.end_s, weight @ track, track[loaded[-1]] - track[loaded[0]])

    def distance_m(self, other: "_WalkedStep") -> float:
        return float(np.hypot(*(other.place_m - self.place_m)))

    @property
    def is_sided(self) -> bool:
        return self.side != "unknown"

    @property
    def side(self) -> str:
        votes = 0.0 if self.walker is None else self.walker.votes_m * (1 if self.number % 2 == 0 else -1)
        return "left" if votes > 0.0 else "right" if votes < 0.0 else "unknown"


@dataclass(eq=False)
class _Walk:
    """Someone who walks: the last three steps, and how far the even ones lie to the left of the odd ones, summed."""

    steps: deque[_WalkedStep] = field(default_factory=lambda: deque(maxlen=3))
    count: int = 0
    votes_m: float = 0.0

    def may_take(self, footfall: _WalkedStep) -> bool:
        last = self.steps[-1]
        later_s = footfall.step.start_s - last.step.start_s
        return INTERVAL_S[0] <= later_s <= INTERVAL_S[1] and last.distance_m(footfall) <= REACH_M

    def take(self, footfall: _WalkedStep) -> None:
        footfall.walker, footfall.number = self, self.count
        if self.steps:
            later_s = footfall.step.start_s - self.steps[-1].step.start_s
            footfall.step = replace(footfall.step, cadence_per_min=60.0 / later_s)
        self.steps.append(footfall)
        self.count += 1
        aside_m = self._aside()
        if abs(aside_m) >= ASIDE_M:
            self.votes_m += aside_m if footfall.number % 2 == 0 else -aside_m

    def _aside(self) -> float:
        """How far the last step lies to the left of the one before, in metres; 0 where the walk has no clear way."""
        if len(self.steps) < 2:
            return 0.0
        before, last = self.steps[-2], self.steps[-1]
        onwards = last.place_m - before.place_m
        along = last.place_m - self.steps[0].place_m
        if len(self.steps) < 3 or float(np.hypot(*along)) < PROGRESS_M:
            along = _rolled(before, last)
        length_m = float(np.hypot(*along))
        if length_m == 0.0 or onwards @ along < PROGRESS_M * length_m:
            return 0.0
        return float(along[0] * onwards[1] - along[1] * onwards[0]) / length_m


def _rolled(first: _WalkedStep, second: _WalkedStep) -> NDArray[np.float64]:
    """The way on which two feet rolled from heel to toe; toes that point outwards point to both sides and cancel."""
    if min(float(np.hypot(*footfall.roll_m)) for footfall in (first, second)) < ROLL_M:
        return np.zeros(2)
    return first.roll_m + second.roll_m


def _loading(contact: Contact, peak: int) -> tuple[float, float]:
    """From 20 to 80 % of the first peak, in kN/s, and when 80 % were reached."""
    time_s = np.concatenate([[contact.lead_s], contact.time_s[: peak + 1]])
    force_n = np.concatenate([[contact.lead_n], contact.force_n[: peak + 1]])
    low_n, high_n = 0.2 * force_n[-1], 0.8 * force_n[-1]
    loaded_s = _reached(time_s, force_n, high_n)
    rise_s = loaded_s - _reached(time_s, force_n, low_n)
    return 1e-3 * float(high_n - low_n) / rise_s if rise_s > 0.0 else math.nan, loaded_s


def _reached(time_s: NDArray[np.float64], force_n: NDArray[np.float64], level_n: float) -> float:
    """When a force first reached a level, between the samples about it; NaN if it was there before the first."""
    after = 1 + int(np.argmax(force_n[1:] >= level_n))
    before = after - 1
    if not force_n[before] < level_n:
        return math.nan
    share = (level_n - force_n[before]) / (force_n[after] - force_n[before])
    return float(time_s[before] + share * (time_s[after] - time_s[before]))


def _path(contact: Contact) -> tuple[float, float]:
    """How far the centroid went, and how far it got, in metres."""
    loaded = contact.force_n >= PATH_N
    if not loaded.any():
        return math.nan, math.nan
    force_n = contact.force_n[loaded]
    reach = round(0.5 * PATH_S / float(np.median(np.diff(contact.time_s))))
    place = np.arange(len(force_n))
    # The mean reaches equally far to both sides, so that it begins and ends where the centroid does.
    reach_of = np.minimum(reach, np.minimum(place, place[::-1]))
    weight = _moving_sum(force_n, place, reach_of)
    smooth = np.column_stack(
        [_moving_sum(force_n * along[loaded], place, reach_of) / weight for along in (contact.x_m, contact.y_m)]
    )
    return float(np.hypot(*np.diff(smooth, axis=0).T).sum()), float(np.hypot(*(smooth[-1] - smooth[0])))


def _moving_sum(values: NDArray[np.float64], place: NDArray[np.intp], reach: NDArray[np.intp]) -> NDArray[np.float64]:
    sums = np.concatenate([[0.0], np.cumsum(values)])
    return sums[place + reach + 1] - sums[place - reach]
