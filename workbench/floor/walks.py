"""Who walks: footsteps of persons, each with its side and how it follows the one before.

A person is known from one footstep to the next, through the swing phase, by where the next step is due and when, and by
what two steps of one person have in common: the mean force, which is the weight borne, and the time on the ground.
Steps of several people that end within 0.4 s are given to them together, so that all suit best. A person who has not
been seen for three seconds is somebody new.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.contacts import Contact
from underfoot.floor.foot_orientation import orientation
from underfoot.floor.footsteps import LEAST_N, LONGEST_S, PATH_N, SHORTEST_S, Step, is_step, measure
from underfoot.floor.layout import Floor

EARLIEST_NEXT_S, LOST_AFTER_S, LONGEST_STEP_M = 0.2, 3.0, 1.1
"""The next step of a person begins this much later at least and, where one or more were not seen, at most; each step is
at most so far from the one before."""

THIRD_FOOT_S = 0.15
"""Two feet of a person may be down at once, never three: the last but one has left by this after the next has come."""

DEFAULT_STEP_S = 0.55
"""The time of a step before a person's own is known: 109 a minute."""

PLACE_SD_M, TURN_PLACE_SD_M, TURN_COST = 0.20, 0.45, 3.0
"""Deviation of a step from where it is due; and, for whoever turns, from the last one, at a cost of `TURN_COST`
besides."""

STEP_TIME_SD, FORCE_SD, STANCE_SD = 0.12, 0.06, 0.08
"""Relative deviations of a person's step time, of the mean force, and of the time on the ground."""

SAME_PERSON_SD, LAST_COMPARED_STEP, MOST_STRAY_STEPS = 2.5, 10, 5.0
"""Somebody who comes where another was lost is the other one if their steps are within `SAME_PERSON_SD` deviations of
each other; asked for their second to `LAST_COMPARED_STEP`th step. The other one's may have seemed to go on for
`MOST_STRAY_STEPS` steps."""

RECENT_STEPS, MEMORY_WEIGHT, SWAP_THRESHOLD = 4, 0.06, 9.0
"""Two persons were taken for each other where the last `RECENT_STEPS` steps of each are like the other's of before, in
which a step counts `MEMORY_WEIGHT`, and so much so: by the sum of squared deviations."""

MOST_PLACE_COST, MOST_LOAD_COST, NEW_PERSON_COST = 12.0, 17.0, 24.0
"""A step that is late, or elsewhere, costs no more than the first, one that is borne otherwise no more than the second:
two feet on a tile make odd steps. Beyond the third it is somebody else's."""

PROGRESS_M, ROLL_M, LEAST_OFFSET_M, FEET_AGREE_RAD = 0.15, 0.05, 0.01, math.radians(35.0)
"""Sides are told from steps that go on by this, feet that roll by this and point the same way within `FEET_AGREE_RAD`,
and offsets to the side of this, at least."""

TOE_OUT_VOTE_M, LEAST_UNEVEN_TURN_RAD, MOST_UNEVEN_TURN_RAD = 0.01, math.radians(10.0), math.radians(45.0)
"""Of who turns by more than that at each step, to one side, toes that point outwards make every other turn larger, by
`LEAST_UNEVEN_TURN_RAD` to `MOST_UNEVEN_TURN_RAD`: a vote of `TOE_OUT_VOTE_M`, which a step that goes on outweighs."""

SIDE_VOTE_DECAY = 0.85
"""How much an older step counts for the side, beside the next."""

SIDE_DECIDED_S, LATE_S = 0.8, 1.0
"""A step waits so long, after its end, for the next one to tell its side; contacts are told of up to `LATE_S` late."""

SIMULTANEOUS_SHARE, SIMULTANEOUS_S, MOST_SIMULTANEOUS = 0.75, 0.4, 5
"""Footfalls that begin and end within this share of the quickest walker's step are of different persons, at most so
long: whose they are is told together, of `MOST_SIMULTANEOUS` at once. One that stays long, or that the stream's end
cuts, ends with the one before it or behind it of the same person, which began a step away."""

LEARNING_RATE, MOST_RATIO = 0.25, 1.25
"""How much a new step counts for what is usual of a person, and by which factor it may differ."""


class WalkTracker:
    """Turns contacts, in the order in which they ended, into numbered steps of persons, with sides.

    A person's steps alternate. Which is which is told by how far each lies to the side of the last, seen along the way
    in which both feet rolled, or else from the step before last. Among several people it is told whose a step is 0.4 s
    after its end, with the others that ended meanwhile. A step is given out as soon as its side is known, or 1.8 s
    after its end, 2.2 s among several people; the result does not depend on how contacts are cut into calls.
    """

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._count = 0
        self._people = 0
        self._walks: list[_Walk] = []
        self._due: deque[_Footfall] = deque()
        self._waiting: deque[_Footfall] = deque()

    def feed(self, contacts: Iterable[Contact], now_s: float) -> list[Step]:
        """The steps known by now: `contacts` ended since the last call, and `now_s` is the latest sample's time."""
        steps: list[Step] = []
        for contact in contacts:
            if (
                contact.end_s - contact.start_s < SHORTEST_S
                or len(contact.force_n) < 3
                or contact.force_n.max() < LEAST_N
            ):
                continue
            self._due.append(_Footfall.of(contact, self._floor))
            steps += self._place_until(contact.end_s)
        return steps + self._place_until(now_s - LATE_S) + self._decided_steps(now_s - LATE_S - self._together_s())

    def finish(self) -> list[Step]:
        """The steps that still waited for their side."""
        return self._place_until(math.inf) + self._decided_steps(math.inf)

    def person_at(self, start_s: float, place_m: tuple[float, float]) -> int:
        """The person whose next step a contact would be that began then and is there now; 0 for nobody known."""
        costs = {walk.person: walk.placement_cost(start_s, np.array(place_m)) for walk in self._walks}
        known = {person: cost for person, cost in costs.items() if cost < NEW_PERSON_COST}
        return min(known, key=lambda person: known[person]) if known else 0

    def _decided_steps(self, now_s: float) -> list[Step]:
        steps = []
        while self._waiting and (self._waiting[0].is_sided or self._waiting[0].end_s + SIDE_DECIDED_S < now_s):
            footfall = self._waiting.popleft()
            self._count += 1
            person = footfall.person or (footfall.walk.person if footfall.walk else 0)
            steps.append(replace(footfall.step, step=self._count, side=footfall.side, person=person))
        return steps

    def _place_until(self, now_s: float) -> list[Step]:
        """Place the footfalls of which all that ended soon after are known; the steps that are known by that."""
        steps = []
        while self._due:
            footfall, near_s = self._due[0], self._together_s()
            until_s = footfall.end_s + near_s
            if until_s > now_s:
                break
            others = (one for one in list(self._due)[1:] if one.end_s < until_s)
            self._place(
                footfall, [footfall, *(other for other in others if abs(other.start_s - footfall.start_s) < near_s)]
            )
            self._due.popleft()
            if footfall.is_whole:
                steps += self._decided_steps(footfall.end_s)
                self._waiting.append(footfall)
        return steps

    def _together_s(self) -> float:
        """Footfalls that end within so long are of different persons."""
        if len(self._walks) < 2:
            return 0.0  # nothing to choose from
        return min(SIMULTANEOUS_SHARE * min(walk.step_s for walk in self._walks), SIMULTANEOUS_S)

    def _place(self, footfall: "_Footfall", together: Sequence["_Footfall"]) -> None:
        """The footfall, the first of those that ended `together`, as the next one of whoever it suits best, with all of
        these, or as the first of somebody new."""
        self._walks = [walk for walk in self._walks if footfall.end_s - walk.last.end_s <= LOST_AFTER_S + LONGEST_S]
        costs = [[walk.cost(one) for walk in self._walks] for one in together[:MOST_SIMULTANEOUS]]
        place = _best_assignment(costs)[1]
        if place >= 0:
            walk = self._walks[place]
        else:
            self._people += 1
            walk = _Walk(self._people)
            self._walks.append(walk)
        walk.take(footfall)
        lost = [other for other in self._walks if other is not walk and walk.may_continue(other)]
        if lost:
            known = min(lost, key=walk.dissimilarity)
            self._walks.remove(known)
            walk.continues(known)
        swap_score = [
            (gain, place)
            for place, other in enumerate(self._walks)
            if (gain := walk.swap_score(other)) > SWAP_THRESHOLD
        ]
        if swap_score:
            # What could be told before stays as it was, whether or not it was asked for.
            for earlier in self._waiting:
                earlier.person = earlier.person or (earlier.walk.person if earlier.walk else 0)
            walk.swap(self._walks[max(swap_score)[1]])


@dataclass(eq=False)
class _Footfall:
    """A footfall in a walk: when and where it was, in metres, how the foot rolled, and the mean force."""

    step: Step
    start_s: float
    end_s: float
    place_m: NDArray[np.float64]
    heel_m: NDArray[np.float64]
    roll_m: NDArray[np.float64]
    force_n: float
    is_whole: bool
    walk: "_Walk | None" = None
    number: int = 0
    person: int = 0

    @classmethod
    def of(cls, contact: Contact, floor: Floor) -> "_Footfall":
        track = np.column_stack([contact.x_m, contact.y_m])
        weight = contact.force_n / contact.force_n.sum()
        loaded = np.flatnonzero(contact.force_n >= min(PATH_N, float(contact.force_n.max())))
        heading, error = orientation(contact, floor)
        step = replace(
            measure(contact, floor), heading_deg=math.degrees(heading), heading_error_deg=math.degrees(error)
        )
        return cls(
            step,
            contact.start_s,
            contact.end_s,
            weight @ track,
            track[loaded[0]],
            track[loaded[-1]] - track[loaded[0]],
            float(contact.force_n.mean()),
            is_step(contact),
        )

    @property
    def stance_s(self) -> float:
        return self.end_s - self.start_s

    @property
    def is_sided(self) -> bool:
        return self.side != "unknown"

    @property
    def side(self) -> str:
        votes = 0.0 if self.walk is None else self.walk.votes_m * (1 if self.number % 2 == 0 else -1)
        return "left" if votes > 0.0 else "right" if votes < 0.0 else "unknown"


@dataclass(eq=False)
class _Walk:
    """Someone who walks: the last three footfalls, what is usual of them, and how far the even ones lie to the left of
    the odd ones, summed. `load_features` are the last steps, and `average_features` is what those before were,
    `remembered_steps` in number."""

    person: int
    steps: deque[_Footfall] = field(default_factory=lambda: deque(maxlen=3))
    votes_m: float = 0.0
    step_s: float = DEFAULT_STEP_S
    force_n: float = math.nan
    stance_s: float = math.nan
    seen: int = 0
    first_s: float = math.inf
    load_features: deque[NDArray[np.float64]] = field(default_factory=lambda: deque(maxlen=RECENT_STEPS))
    average_features: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    remembered_steps: int = 0

    @property
    def last(self) -> _Footfall:
        return self.steps[-1]

    def placement_cost(self, start_s: float, place_m: NDArray[np.float64]) -> float:
        """What it costs to say that the next foot came down then and there; infinite where it cannot be."""
        last = self.last
        later_s = start_s - last.start_s
        missed = self._steps_in(start_s) - 1
        way_m = float(np.hypot(*(place_m - last.place_m)))
        if later_s < EARLIEST_NEXT_S or start_s - last.end_s > LOST_AFTER_S or way_m > LONGEST_STEP_M * (1 + missed):
            return math.inf
        if len(self.steps) > 1 and self.steps[-2].end_s > start_s + THIRD_FOOT_S:
            return math.inf
        uncertain = 3.0 if self.seen < 2 else 1.0
        late = (later_s - (1 + missed) * self.step_s) / (STEP_TIME_SD * uncertain * self.step_s)
        if start_s - last.end_s > -EARLIEST_NEXT_S and not last.is_whole:
            late = 0.0  # whoever stood, sets off when they like
        off_m = float(np.hypot(*(place_m - self._expected_place(1 + missed))))
        place = min((off_m / PLACE_SD_M) ** 2, (way_m / TURN_PLACE_SD_M) ** 2 + TURN_COST)
        return min(late**2, MOST_PLACE_COST) + min(place, MOST_PLACE_COST) + 2.0 * missed

    def cost(self, footfall: _Footfall) -> float:
        """`placement_cost`, and how unlike the person's others the footfall is."""
        total = self.placement_cost(footfall.start_s, footfall.place_m)
        if math.isfinite(total) and footfall.is_whole and self.seen:
            uncertain = 2.0 if self.seen < 3 else 1.0
            force = math.log(footfall.force_n / self.force_n) / (FORCE_SD * uncertain)
            stance = math.log(footfall.stance_s / self.stance_s) / (STANCE_SD * uncertain)
            total += min(force**2 + stance**2, MOST_LOAD_COST)
        return total

    def dissimilarity(self, other: "_Walk") -> float:
        """How far two walks' forces and times are apart, in standard deviations."""
        theirs = other.average_features if other.remembered_steps else _load_features(other.force_n, other.stance_s)
        return float(np.hypot(*(_load_features(self.force_n, self.stance_s) - theirs)))

    def may_continue(self, other: "_Walk") -> bool:
        """Whether this walk began where another was lost sight of, by somebody alike."""
        began_s = self.first_s
        lost = self.last.start_s - other.last.start_s > 1.6 * other.step_s
        return bool(
            lost
            and 2 <= self.seen <= LAST_COMPARED_STEP
            and other.seen >= 2
            and other.first_s < began_s
            and other.last.start_s < began_s + MOST_STRAY_STEPS * other.step_s
            and began_s - other.last.end_s <= LOST_AFTER_S
            and self.dissimilarity(other) <= SAME_PERSON_SD
        )

    def swap_score(self, other: "_Walk") -> float:
        """By how much both are more like each other, lately, than like themselves: squared deviations."""
        if (
            other is self
            or min(len(self.load_features), len(other.load_features)) < RECENT_STEPS
            or min(self.remembered_steps, other.remembered_steps) < 1
        ):
            return 0.0
        mine, theirs = np.median(self.load_features, axis=0), np.median(other.load_features, axis=0)
        kept = ((mine - self.average_features) ** 2).sum() + ((theirs - other.average_features) ** 2).sum()
        return float(
            kept - ((mine - other.average_features) ** 2).sum() - ((theirs - self.average_features) ** 2).sum()
        )

    def swap(self, other: "_Walk") -> None:
        """This is the other's person, and the other is this one's."""
        self.person, other.person = other.person, self.person
        self.first_s, other.first_s = other.first_s, self.first_s
        self.average_features, other.average_features = other.average_features, self.average_features
        self.remembered_steps, other.remembered_steps = other.remembered_steps, self.remembered_steps

    def _remember(self, footfall: _Footfall) -> None:
        """A step among the last ones; the one that no longer is teaches what is usual of the person."""
        if len(self.load_features) == RECENT_STEPS:
            self.remembered_steps += 1
            self.average_features = self.average_features + max(MEMORY_WEIGHT, 1.0 / self.remembered_steps) * (
                self.load_features[0] - self.average_features
            )
        self.load_features.append(_load_features(footfall.force_n, footfall.stance_s))

    def continues(self, other: "_Walk") -> None:
        """This is the person of another walk."""
        self.person, self.first_s = other.person, other.first_s
        self.average_features, self.remembered_steps = other.average_features, other.remembered_steps
        self.seen = max(self.seen, LAST_COMPARED_STEP + 1)

    def take(self, footfall: _Footfall) -> None:
        footfall.walk = self
        self.first_s = min(self.first_s, footfall.start_s)
        if self.steps:
            steps = self._steps_in(footfall.start_s)
            footfall.number = self.last.number + steps
            if steps == 1:
                self._follow(footfall)
        if footfall.is_whole:
            learns = max(LEARNING_RATE, 1.0 / (1 + self.seen))
            if not self.seen:
                self.force_n, self.stance_s = footfall.force_n, footfall.stance_s
            self.force_n *= _limited_ratio(footfall.force_n / self.force_n) ** learns
            self.stance_s *= _limited_ratio(footfall.stance_s / self.stance_s) ** learns
            self.seen += 1
            self._remember(footfall)
        self.steps.append(footfall)

    def _follow(self, footfall: _Footfall) -> None:
        """The figures of a step that came next after the last, and its vote for the sides."""
        last = self.last
        later_s = footfall.start_s - last.start_s
        if last.is_whole:
            self.step_s += (LEARNING_RATE if self.seen > 2 else 0.5) * (min(max(later_s, 0.25), 1.5) - self.step_s)
        along = self._direction(footfall)
        onwards = footfall.place_m - last.place_m
        length_m, aside_m = float(onwards @ along), float(along[0] * onwards[1] - along[1] * onwards[0])
        known = along.any()
        told_m = aside_m if abs(aside_m) >= LEAST_OFFSET_M and abs(length_m) >= PROGRESS_M else 0.0
        told_m = told_m if known else self._toe_out_vote_m(footfall)
        if told_m:
            self.votes_m = SIDE_VOTE_DECAY * self.votes_m + (told_m if footfall.number % 2 == 0 else -told_m)
        same = self.steps[-2] if len(self.steps) > 1 and self.steps[-2].number == footfall.number - 2 else None
        footfall.step = replace(
            footfall.step,
            cadence_per_min=60.0 / later_s,
            step_length_mm=1e3 * abs(length_m) if known else math.nan,
            step_width_mm=1e3 * abs(aside_m) if known else math.nan,
            double_support_ms=1e3 * (last.end_s - footfall.start_s),
            swing_ms=1e3 * (footfall.start_s - same.end_s) if same else math.nan,
        )

    def _direction(self, footfall: _Footfall) -> NDArray[np.float64]:
        """The direction of the walk from the last footfall to this one; 0 where it has no clear one."""
        last = self.last
        if min(float(np.hypot(*one.roll_m)) for one in (last, footfall)) >= ROLL_M:
            if abs(_angle_between(last.roll_m, footfall.roll_m)) > FEET_AGREE_RAD:
                return np.zeros(2)
            # Toes that point outwards point to both sides and cancel.
            along = last.roll_m + footfall.roll_m
        elif len(self.steps) > 1:
            along = footfall.place_m - self.steps[-2].place_m
        else:
            return np.zeros(2)
        length_m = float(np.hypot(*along))
        if length_m == 0.0:
            return np.zeros(2)
        return along / length_m

    def _toe_out_vote_m(self, footfall: _Footfall) -> float:
        """What a steady turn over three footfalls tells of the last one's side: to the left, metres; 0 for nothing."""
        steps = [*self.steps, footfall][-3:]
        rolls = [step.roll_m for step in steps if float(np.hypot(*step.roll_m)) >= ROLL_M]
        if len(rolls) < 3 or steps[0].number != footfall.number - 2:
            return 0.0
        first, second = _angle_between(rolls[0], rolls[1]), _angle_between(rolls[1], rolls[2])
        steady = first * second > 0.0 and min(abs(first), abs(second)) > FEET_AGREE_RAD
        return (
            math.copysign(TOE_OUT_VOTE_M, second - first)
            if steady and LEAST_UNEVEN_TURN_RAD <= abs(second - first) <= MOST_UNEVEN_TURN_RAD
            else 0.0
        )

    def _steps_in(self, start_s: float) -> int:
        """How many steps a foot that comes down then is behind the last: more than one where some were not seen."""
        if not self.last.is_whole or self.seen < 2:
            return 1
        return max(1, round((start_s - self.last.start_s) / self.step_s))

    def _expected_place(self, steps: int) -> NDArray[np.float64]:
        """Where the foot after so many steps is due."""
        places = [step.place_m for step in self.steps]
        if len(places) < 2:
            return places[-1]
        if len(places) < 3 or steps > 1:
            return places[-1] + steps * (places[-1] - places[0]) / (len(places) - 1)
        return places[1] + (places[2] - places[0])


def _best_assignment(costs: list[list[float]], taken: frozenset[int] = frozenset()) -> tuple[float, int]:
    """The least sum where each footfall (a row) goes to a walk of its own (a column), or to somebody new; and the walk
    of the first, -1 for somebody new."""
    if not costs:
        return 0.0, -1
    ways = [(cost, place) for place, cost in enumerate(costs[0]) if cost < NEW_PERSON_COST and place not in taken]
    return min(
        (cost + _best_assignment(costs[1:], taken | {place})[0], place)
        for cost, place in [*ways, (NEW_PERSON_COST, -1)]
    )


def _load_features(force_n: float, stance_s: float) -> NDArray[np.float64]:
    """How a step is borne, as a place in which persons' steps deviate by 1."""
    return np.array([math.log(force_n) / FORCE_SD, math.log(stance_s) / STANCE_SD])


def _limited_ratio(ratio: float) -> float:
    """A ratio, within what a person's steps differ by: odd ones teach little."""
    return min(max(ratio, 1.0 / MOST_RATIO), MOST_RATIO)


def _angle_between(one: NDArray[np.float64], other: NDArray[np.float64]) -> float:
    """The angle from one direction to another, -pi to pi, positive to the left."""
    return math.atan2(float(one[0] * other[1] - one[1] * other[0]), float(one @ other))
