"""Assignment of footsteps to persons, and the side and step measures of each footstep.

A person's next footstep is predicted in place and time, and compared in what two steps of one person have in common:
the mean force, which depends on weight, and the stance time. Steps that end within 0.4 s of each other are assigned to
several persons jointly, at the least total cost. After three seconds without a step a person counts as a new one.
"""

import math
from collections import deque
from collections.abc import Iterable, Sequence

import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.floor.contacts import Contact
from underfoot.floor.foot_orientation import orientation
from underfoot.floor.footsteps import LEAST_N, LONGEST_S, SHORTEST_S, Step, is_step, measure
from underfoot.floor.layout import Floor
from underfoot.floor.shared_loads import LOADED_N
from underfoot.floor.walk_sides import LEAST_OFFSET_M, PROGRESS_M, Sides, toe_out_vote_m, walking_direction

EARLIEST_NEXT_S, LOST_AFTER_S, LONGEST_STEP_M = 0.2, 3.0, 1.1
"""Least and greatest time to the next step of a person, of which some may not have been seen; longest step of who
walks."""

LONGEST_RUNNING_S, LONGEST_RUNNING_STEP_M = 0.5, 2.6
"""Longest time and longest step of who runs, with no weight on either foot in between: joggers make 120 steps a minute
or more, and no sprinter's step is longer."""

THIRD_FOOT_S = 0.15
"""Longest time for which the foot before the last may stay down after the next has come down."""

LONGEST_FLIGHT_S = 0.5
"""Longest time with neither foot down between two steps: the flight of a jump of 0.31 m, g t^2 / 8. If no foot is seen
for longer, one came down where it was not seen, and nothing is known of the step."""

SWING_STEPS, BORE_SHARE = 1.4, 0.5
"""A foot that comes down within so many step times after the foot before the last one bore weight is that one, however
long the last one stood: a swing takes 0.9, and with a step that was not seen 1.9. Weight is a share of the mean force:
an uncalibrated FSR tells the end of a contact up to 0.7 s late, but no such force."""

DEFAULT_STEP_S = 0.55
"""Step time until a person's own is known: 109 steps per minute."""

PLACE_SD_M, TURN_PLACE_SD_M, TURN_COST = 0.20, 0.45, 3.0
"""Standard deviation of a step's place from its prediction or, at an additional `TURN_COST`, from the last step's
place, for a person who turns."""

STEP_TIME_SD, FORCE_SD, STANCE_SD = 0.12, 0.06, 0.08
"""Relative standard deviations of a person's step time, mean force and stance time."""

FEW_WEIGHED_STEPS, FEW_WEIGHED_FACTOR = 3, 2.0
"""Standard deviations of force and stance are multiplied by `FEW_WEIGHED_FACTOR` while fewer than `FEW_WEIGHED_STEPS`
steps of a person are known."""

MISSED_STEP_COST, LOST_STEPS = 2.0, 1.6
"""Cost of each step that was not seen; step times without a step after which a walk counts as lost."""

SAME_PERSON_SD, LAST_COMPARED_STEP, MOST_STRAY_STEPS = 2.5, 10, 5.0
"""A new walk continues one that was lost before if their steps differ by at most `SAME_PERSON_SD` standard deviations.
This is checked from its second to its `LAST_COMPARED_STEP`th step. The lost walk may have got up to `MOST_STRAY_STEPS`
steps that were not its own."""

RECENT_STEPS, SWAP_THRESHOLD = 4, 9.0
"""Two persons were confused if the last `RECENT_STEPS` steps of each are more like the earlier average of the other, by
`SWAP_THRESHOLD` in the sum of squared deviations."""

MOST_PLACE_COST, MOST_LOAD_COST, NEW_PERSON_COST = 12.0, 17.0, 24.0
"""Greatest costs of a wrong time or place, and of a different force or stance; limited, because two feet on one tile
make unusual steps. A step that costs more than `NEW_PERSON_COST` is that of a new person."""

GOES_ON_M = 0.3
"""Who walks on after steps that were not seen comes down as near to where these lead, half a step. How many steps those
who turned or stopped made, nothing tells."""

SIDE_DECIDED_S, LATE_S = 1.8, 1.0
"""Time after its end within which the steps end that give a step its side (of who makes 40 a minute, the next one);
longest delay with which contacts arrive."""

SIMULTANEOUS_SHARE, SIMULTANEOUS_S, MOST_SIMULTANEOUS = 0.75, 0.4, 5
"""Footfalls that begin and end within `SIMULTANEOUS_SHARE` of the shortest step time, at most `SIMULTANEOUS_S`, are of
different persons; up to `MOST_SIMULTANEOUS` are assigned jointly. The beginnings count because a long stance, or the
end of the stream, can let two footfalls of one person end together."""

LEARNING_RATE, MOST_RATIO = 0.25, 1.25
"""Weight of a new step in a person's averages, and the factor to which its deviation is limited."""


class WalkTracker:
    """Turns contacts, in the order of their ends, into numbered steps of persons, with sides.

    A person's steps alternate between left and right. The side follows from the lateral offset of each step from the
    last, across the direction in which both feet rolled or, without one, that from the step before the last. Among
    several people a step is assigned 0.4 s after its end, with the others that ended meanwhile. It is returned when its
    side is known, at the latest 2.8 s after its end, 3.2 s among several people. The result does not depend on how
    contacts are split into calls.
    """

    def __init__(self, floor: Floor) -> None:
        self._floor = floor
        self._count = 0
        self._people = 0
        self._walks: list[_Walk] = []
        self._due: deque[_Footfall] = deque()
        self._waiting: deque[_Footfall] = deque()

    def feed(self, contacts: Iterable[Contact], now_s: float) -> list[Step]:
        """Take `contacts` that ended since the last call; return the steps that are decided at the time `now_s`."""
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
        """Return the remaining steps at the end of the stream."""
        return self._place_until(math.inf) + self._decided_steps(math.inf)

    def person_at(self, start_s: float, place_m: tuple[float, float]) -> int:
        """Return the person whose next step a present contact probably is, from its beginning and place; 0 if
        unknown."""
        costs = {walk.person.number: walk.placement_cost(start_s, np.array(place_m)) for walk in self._walks}
        known = {person: cost for person, cost in costs.items() if cost < NEW_PERSON_COST}
        return min(known, key=lambda person: known[person]) if known else 0

    def _decided_steps(self, now_s: float) -> list[Step]:
        steps = []
        while self._waiting and (self._waiting[0].is_sided or self._waiting[0].end_s + SIDE_DECIDED_S < now_s):
            footfall = self._waiting.popleft()
            self._count += 1
            step = replace(footfall.step, step=self._count, side=footfall.side, person=footfall.person_number)
            steps.append(step)
        return steps

    def _place_until(self, now_s: float) -> list[Step]:
        """Assign the footfalls for which all that ended soon after are known; return the steps decided by that."""
        steps = []
        while self._due:
            footfall, near_s = self._due[0], self._together_s()
            until_s = footfall.end_s + near_s
            if until_s > now_s:
                break
            # Before it is placed, as these might have been returned in an earlier call: it is too late for their side.
            steps += self._decided_steps(footfall.end_s)
            others = (one for one in list(self._due)[1:] if one.end_s < until_s)
            self._place(
                footfall, [footfall, *(other for other in others if abs(other.start_s - footfall.start_s) < near_s)]
            )
            self._due.popleft()
            if footfall.is_whole:
                self._waiting.append(footfall)
        return steps

    def _together_s(self) -> float:
        """Return the time within which the ends of two footfalls are those of different persons."""
        if len(self._walks) < 2:
            return 0.0  # nothing to choose from
        return min(SIMULTANEOUS_SHARE * min(walk.step_s for walk in self._walks), SIMULTANEOUS_S)

    def _place(self, footfall: "_Footfall", together: Sequence["_Footfall"]) -> None:
        """Assign a footfall, the first of those that ended `together`, to a walk or to a new one, by the least total
        cost of all of them."""
        self._walks = [walk for walk in self._walks if footfall.end_s - walk.last.end_s <= LOST_AFTER_S + LONGEST_S]
        costs = [[walk.cost(one) for walk in self._walks] for one in together[:MOST_SIMULTANEOUS]]
        place = _best_assignment(costs)[1]
        if place >= 0:
            walk = self._walks[place]
        else:
            self._people += 1
            walk = _Walk(_Person(self._people))
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
            # Steps that could have been returned before keep their person.
            for earlier in self._waiting:
                earlier.person = earlier.person_number
            walk.swap(self._walks[max(swap_score)[1]])


class _Footfall(Struct, eq=False):
    """A footfall of a walk: time, place, roll of the foot, mean force, and until when it bore weight."""

    step: Step
    start_s: float
    end_s: float
    place_m: NDArray[np.float64]
    roll_m: NDArray[np.float64]
    force_n: float
    bore_until_s: float
    is_whole: bool
    walk: "_Walk | None" = None
    number: int = 0
    sides: Sides | None = None
    person: int = 0
    """The number of the person that it keeps whoever its walk is taken for later; 0 while that of its walk counts."""

    @classmethod
    def of(cls, contact: Contact, floor: Floor) -> "_Footfall":
        track = np.column_stack([contact.x_m, contact.y_m])
        weight = contact.force_n / contact.force_n.sum()
        loaded = np.flatnonzero(contact.force_n >= min(LOADED_N, float(contact.force_n.max())))
        heading, error = orientation(contact, floor)
        step = replace(
            measure(contact, floor), heading_deg=math.degrees(heading), heading_error_deg=math.degrees(error)
        )
        return cls(
            step,
            contact.start_s,
            contact.end_s,
            weight @ track,
            track[loaded[-1]] - track[loaded[0]],
            float(contact.force_n.mean()),
            float(contact.time_s[contact.force_n >= BORE_SHARE * contact.force_n.mean()][-1]),
            is_step(contact),
        )

    @property
    def stance_s(self) -> float:
        return self.end_s - self.start_s

    @property
    def person_number(self) -> int:
        return self.person or (self.walk.person.number if self.walk else 0)

    @property
    def is_sided(self) -> bool:
        return self.sides is not None and self.sides.votes_m != 0.0

    @property
    def side(self) -> str:
        return self.sides.of(self.number) if self.sides else "unknown"


class _Person(Struct, eq=False):
    """What identifies a person, whichever walk is theirs: the number, the first step, and the features of all but the
    last steps, of which `average_features` is the mean.
    """

    number: int
    first_s: float = math.inf
    average_features: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    remembered_steps: int = 0

    def remember(self, features: NDArray[np.float64]) -> None:
        """Add the features of a step to the average."""
        self.remembered_steps += 1
        self.average_features = self.average_features + (features - self.average_features) / self.remembered_steps


class _Walk(Struct, eq=False):
    """A person's walk: the last three footfalls, averages of their measures, and votes for the side.

    `load_features` are those of the last steps. `seen` counts whole steps.
    """

    person: _Person
    steps: deque[_Footfall] = field(default_factory=lambda: deque(maxlen=3))
    sides: Sides = field(default_factory=Sides)
    step_s: float = DEFAULT_STEP_S
    force_n: float = math.nan
    stance_s: float = math.nan
    seen: int = 0
    load_features: deque[NDArray[np.float64]] = field(default_factory=lambda: deque(maxlen=RECENT_STEPS))

    @property
    def last(self) -> _Footfall:
        return self.steps[-1]

    def placement_cost(self, start_s: float, place_m: NDArray[np.float64]) -> float:
        """Return the cost of a next step with this beginning and place; infinite if it is impossible."""
        last = self.last
        later_s = start_s - last.start_s
        missed = self._steps_in(start_s) - 1
        way_m = float(np.hypot(*(place_m - last.place_m)))
        runs = later_s < LONGEST_RUNNING_S and start_s > last.bore_until_s
        longest_m = LONGEST_RUNNING_STEP_M if runs else LONGEST_STEP_M * (1 + missed)
        if later_s < EARLIEST_NEXT_S or start_s - last.end_s > LOST_AFTER_S or way_m > longest_m:
            return math.inf
        if len(self.steps) > 1 and self.steps[-2].end_s > start_s + THIRD_FOOT_S:
            return math.inf
        late = (later_s - (1 + missed) * self.step_s) / (STEP_TIME_SD * self.step_s)
        stood = not last.is_whole and start_s - last.end_s > -EARLIEST_NEXT_S  # and may leave at any time
        if stood or (runs and self.seen < 2):  # the usual step time is that of who walks
            late = 0.0
        off_m = float(np.hypot(*(place_m - self._expected_place(1 + missed))))
        place = min((off_m / PLACE_SD_M) ** 2, (way_m / TURN_PLACE_SD_M) ** 2 + TURN_COST)
        return min(late**2, MOST_PLACE_COST) + min(place, MOST_PLACE_COST) + MISSED_STEP_COST * missed

    def cost(self, footfall: _Footfall) -> float:
        """Return `placement_cost`, plus the cost of the footfall's difference from the person's averages."""
        total = self.placement_cost(footfall.start_s, footfall.place_m)
        if math.isfinite(total) and footfall.is_whole and self.seen:
            uncertain = FEW_WEIGHED_FACTOR if self.seen < FEW_WEIGHED_STEPS else 1.0
            force = math.log(footfall.force_n / self.force_n) / (FORCE_SD * uncertain)
            stance = math.log(footfall.stance_s / self.stance_s) / (STANCE_SD * uncertain)
            total += min(force**2 + stance**2, MOST_LOAD_COST)
        return total

    def dissimilarity(self, other: "_Walk") -> float:
        """Return the difference of two walks' forces and stance times, in standard deviations."""
        known = other.person
        theirs = known.average_features if known.remembered_steps else _load_features(other.force_n, other.stance_s)
        return float(np.hypot(*(_load_features(self.force_n, self.stance_s) - theirs)))

    def may_continue(self, other: "_Walk") -> bool:
        """Return whether this walk can be the continuation of another one that was lost."""
        began_s = self.person.first_s
        lost = self.last.start_s - other.last.start_s > LOST_STEPS * other.step_s
        return bool(
            lost
            and 2 <= self.seen <= LAST_COMPARED_STEP
            and other.seen >= 2
            and other.person.first_s < began_s
            and other.last.start_s < began_s + MOST_STRAY_STEPS * other.step_s
            and began_s - other.last.end_s <= LOST_AFTER_S
            and self.dissimilarity(other) <= SAME_PERSON_SD
        )

    def swap_score(self, other: "_Walk") -> float:
        """Return by how much the squared deviations from the earlier averages would fall if both were exchanged."""
        if (
            other is self
            or min(len(self.load_features), len(other.load_features)) < RECENT_STEPS
            or min(self.person.remembered_steps, other.person.remembered_steps) < 1
        ):
            return 0.0
        recent, others_recent = np.median(self.load_features, axis=0), np.median(other.load_features, axis=0)
        mine, theirs = self.person.average_features, other.person.average_features
        kept = ((recent - mine) ** 2).sum() + ((others_recent - theirs) ** 2).sum()
        return float(kept - ((recent - theirs) ** 2).sum() - ((others_recent - mine) ** 2).sum())

    def swap(self, other: "_Walk") -> None:
        """Exchange the persons of two walks."""
        self.person, other.person = other.person, self.person

    def _remember(self, footfall: _Footfall) -> None:
        """Add a step to the recent ones; the person is remembered by the oldest of these."""
        if len(self.load_features) == RECENT_STEPS:
            self.person.remember(self.load_features[0])
        self.load_features.append(_load_features(footfall.force_n, footfall.stance_s))

    def continues(self, other: "_Walk") -> None:
        """Take over the person of another walk."""
        self.person = other.person
        self.seen = max(self.seen, LAST_COMPARED_STEP + 1)

    def take(self, footfall: _Footfall) -> None:
        """Append a footfall, and update the averages."""
        footfall.walk = self
        self.person.first_s = min(self.person.first_s, footfall.start_s)
        if self.steps:
            steps = self._steps_in(footfall.start_s)
            paused = len(self.steps) > 1 and footfall.start_s - self.steps[-2].bore_until_s < SWING_STEPS * self.step_s
            footfall.number = self.last.number + (1 if paused else steps)
            if steps > 1 and not paused and self._can_be_either_foot(footfall, steps):
                self.sides = self.sides.guessed()
            if steps == 1:
                self._follow(footfall)
        footfall.sides = self.sides
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
        """Compute the measures of a step that follows the last one, if it does, and add its vote for the side."""
        last = self.last
        later_s = footfall.start_s - last.start_s
        if last.is_whole:
            self.step_s += (LEARNING_RATE if self.seen > 2 else 0.5) * (later_s - self.step_s)
        before = self.steps[-2] if len(self.steps) > 1 and self.steps[-2].sides is self.sides else None
        stride_m = footfall.place_m - before.place_m if before else None
        along = walking_direction((last.roll_m, footfall.roll_m), stride_m)
        onwards = footfall.place_m - last.place_m
        length_m, aside_m = float(onwards @ along), float(along[0] * onwards[1] - along[1] * onwards[0])
        known = along.any()
        told_m = aside_m if abs(aside_m) >= LEAST_OFFSET_M and abs(length_m) >= PROGRESS_M else 0.0
        if not known and before and before.number == footfall.number - 2:
            told_m = toe_out_vote_m((before.roll_m, last.roll_m, footfall.roll_m))
        if told_m:
            self.sides.vote(footfall.number, told_m)
        if not _is_next(footfall, last):
            return
        if not last.is_whole:  # when it came down, and where it stood on the whole, was not seen
            later_s = length_m = aside_m = math.nan
        swing_s = math.nan
        if before and before.number == footfall.number - 2 and _is_next(last, before):
            swing_s = footfall.start_s - before.end_s
        footfall.step = replace(
            footfall.step,
            cadence_per_min=60.0 / later_s,
            step_length_mm=1e3 * abs(length_m) if known else math.nan,
            step_width_mm=1e3 * abs(aside_m) if known else math.nan,
            double_support_ms=1e3 * (last.end_s - footfall.start_s),
            swing_ms=1e3 * swing_s,
        )

    def _steps_in(self, start_s: float) -> int:
        """Return the number of steps from the last one to a footfall at `start_s`, including steps that were not
        seen."""
        if not self.last.is_whole or self.seen < 2:
            return 1
        return max(1, round((start_s - self.last.start_s) / self.step_s))

    def _can_be_either_foot(self, footfall: _Footfall, steps: int) -> bool:
        """Return whether a person was out of sight before a footfall, and did not just walk on for so many steps."""
        off_m = float(np.hypot(*(footfall.place_m - self._expected_place(steps))))
        return not _is_next(footfall, self.last) and off_m > GOES_ON_M

    def _expected_place(self, steps: int) -> NDArray[np.float64]:
        """Return the predicted place of the foot after this number of steps."""
        places = [step.place_m for step in self.steps]
        if len(places) < 2:
            return places[-1]
        if len(places) < 3 or steps > 1:
            return places[-1] + steps * (places[-1] - places[0]) / (len(places) - 1)
        return places[1] + (places[2] - places[0])


def _best_assignment(costs: list[list[float]], taken: frozenset[int] = frozenset()) -> tuple[float, int]:
    """Return the least total cost of assigning each footfall (a row) to a walk of its own (a column) or to a new one,
    and the walk of the first footfall, -1 for a new one."""
    if not costs:
        return 0.0, -1
    ways = [(cost, place) for place, cost in enumerate(costs[0]) if cost < NEW_PERSON_COST and place not in taken]
    return min(
        (cost + _best_assignment(costs[1:], taken | {place})[0], place)
        for cost, place in [*ways, (NEW_PERSON_COST, -1)]
    )


def _is_next(footfall: _Footfall, last: _Footfall) -> bool:
    """Return whether no other foot can have come down unseen between the two."""
    return last.end_s - footfall.start_s >= -LONGEST_FLIGHT_S


def _load_features(force_n: float, stance_s: float) -> NDArray[np.float64]:
    """Return logarithms of force and stance time, in units of the standard deviation within a person."""
    return np.array([math.log(force_n) / FORCE_SD, math.log(stance_s) / STANCE_SD])


def _limited_ratio(ratio: float) -> float:
    """Return a ratio limited to `MOST_RATIO`, so that unusual steps have little effect."""
    return min(max(ratio, 1.0 / MOST_RATIO), MOST_RATIO)
