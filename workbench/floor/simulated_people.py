"""People who walk on a simulated floor: their bodies, their paths, and their footfalls.

They avoid each other: nobody steps to within `CLEARANCE_M` of another person. A person whose way is blocked steps on
the spot, and after a while chooses another destination.
"""

import heapq
import math
from collections.abc import Iterator, Sequence

import msgspec
import numpy as np
from msgspec import Struct, field
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.arguments import choice, integer
from underfoot.errors import BadValue, require
from underfoot.floor.layout import Floor, Point
from underfoot.models import gait
from underfoot.models.signals.random import stream_key, uniform

PATHS = ("straight", "turn", "in-place", "random", "crossing")
"""Along the floor and back; round and round; on the spot; to random places; through the middle of the floor and back,
with a direction for each person."""

MOST_PEOPLE = 8

CLEARANCE_M = 0.45
"""Least distance between the centres of two people: shoulder breadth."""

PATIENCE = 3
"""Steps on the spot after which a person chooses another destination."""

TURN_RAD = math.radians(60.0)
"""Largest turn of a body in one step."""

NEAR_M = 0.05
"""Distance at which a destination is reached."""

BREADTH = 0.15
"""Width over which heel and ball of drawn people press, as a share of the foot's length: about 2 cm to each side."""

_INSET_M = 0.2
"""Distance of paths from the floor's edges."""


class Person(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A walker, and one of `PATHS`; `BadValue` for any other path.

    >>> Person(path="sideways")
    Traceback (most recent call last):
    underfoot.errors.BadValue: path is 'sideways'; allowed: straight, turn, in-place, random, crossing
    """

    walker: gait.Walker = gait.Walker()
    path: str = "random"

    def __post_init__(self) -> None:
        choice("path", self.path, PATHS)


def drawn_people(count: int, path: str, seed: int = 1) -> tuple[Person, ...]:
    """Return 1 to 8 different people on paths of one kind: the first is the default walker, the others are drawn.

    They range from a child of 300 N with feet of 0.18 m to an adult of 1000 N with feet of 0.31 m; smaller people walk
    at a higher cadence.

    >>> [round(person.walker.weight_n) for person in drawn_people(3, "random")]
    [700, 388, 866]
    """
    count = integer("people", count, 1, MOST_PEOPLE, f"1 to {MOST_PEOPLE}")
    key = stream_key(seed, "people")
    usual = gait.Walker()
    people = [Person(replace(usual, foot_breadth_m=BREADTH * usual.foot_length_m), path)]
    for one in range(1, count):
        # A low-discrepancy draw: two people are never alike.
        size = (0.5 + one * 0.6180339887 + 0.08 * uniform(key, 2 * one)) % 1.0
        foot_m = 0.18 + 0.13 * size
        walker = gait.Walker(
            weight_n=300.0 + 700.0 * size,
            cadence_per_min=round(128.0 - 26.0 * size + 8.0 * uniform(key, 2 * one + 1), 1),
            foot_length_m=foot_m,
            foot_breadth_m=BREADTH * foot_m,
            step_length_m=2.5 * foot_m,
            step_width_m=0.08 + 0.04 * size,
        )
        people.append(Person(walker, path))
    return tuple(people)


def people_of(text: str) -> tuple[Person, ...]:
    """Parse the people of a target, "people=2,path=crossing"; `BadValue` for anything else.

    >>> [person.path for person in people_of("people=2,path=crossing")]
    ['crossing', 'crossing']
    >>> people_of("people=2,path=up")
    Traceback (most recent call last):
    underfoot.errors.BadValue: path is 'up'; allowed: straight, turn, in-place, random, crossing
    """
    given = {"people": "1", "path": "random", "seed": "1"}
    for part in text.split(","):
        name, _, value = part.partition("=")
        require(name in given, "simulator option", part, "people=1 to 8, path=" + " | ".join(PATHS) + ", seed=NUMBER")
        given[name] = value
    for name in ("people", "seed"):
        if not given[name].isdecimal():
            raise BadValue(f"{name} is {given[name]!r}; allowed: a whole number")
    return drawn_people(int(given["people"]), given["path"], int(given["seed"]))


def people_footfalls(
    people: Sequence[Person], floor: Floor, seconds: float, seed: int = 1
) -> list[list[gait.Footfall]]:
    """Return the footfalls of each of `people` that begin before `seconds`, in order of time, the first at 0.2 s.

    They depend on the other people, who are avoided. The same seed gives the same walk, and a longer walk begins with
    it.
    """
    require(1 <= len(people) <= MOST_PEOPLE, "people", len(people), f"1 to {MOST_PEOPLE}")
    walks = [_Walk.of(person, number, len(people), floor, seed) for number, person in enumerate(people)]
    due = [(0.2 + 0.13 * number, number) for number in range(len(walks))]
    heapq.heapify(due)
    while due[0][0] < seconds:
        now_s, number = heapq.heappop(due)
        walk = walks[number]
        walk.step(now_s, [other.place_m for other in walks if other is not walk])
        heapq.heappush(due, (now_s + walk.walker.step_s, number))
    return [
        [step for step in sorted(walk.steps, key=lambda step: step.start_s) if step.start_s < seconds] for walk in walks
    ]


def walk_round(
    floor: Floor, seconds: float, seed: int, walker: gait.Walker, path_m: Sequence[Point]
) -> list[gait.Footfall]:
    """Return the footfalls of a single walker along a path, in the floor's frame, the first at 0.2 s.

    Without a path it is a rectangle halfway between the floor's middle and its edges, walked round and round, and steps
    are short where the floor is: on 2 x 2 tiles each foot lands on the next tile.
    """
    if not path_m:
        low, high = floor.bounds_m()
        middle, half = (low + high) / 2.0, (high - low) / 4.0
        turns = [middle + half * turn for turn in ((-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1))]
        path_m = [(float(x), float(y)) for x, y in turns]
        short = min(walker.step_length_m, float(half.sum()))
        walker = replace(walker, step_length_m=short)
    return gait.footfalls(walker, path_m, seconds, seed)


class _Walk(Struct):
    """A person who walks: position and heading of the body, and the destinations."""

    walker: gait.Walker
    places: Iterator[NDArray[np.float64]]
    place_m: NDArray[np.float64]
    goal_m: NDArray[np.float64]
    heading_rad: float
    key: np.uint64
    waited: int = 0
    steps: list[gait.Footfall] = field(default_factory=list)

    @classmethod
    def of(cls, person: Person, number: int, count: int, floor: Floor, seed: int) -> "_Walk":
        key = stream_key(seed, "person", number)
        places = _places(person.path, number, count, floor.bounds_m(), key)
        start, goal = next(places), next(places)
        heading = math.atan2(*(goal - start)[::-1]) if (goal != start).any() else 0.25 * number
        return cls(person.walker, places, start, goal, heading, key)

    def step(self, now_s: float, others_m: Sequence[NDArray[np.float64]]) -> None:
        """Take the next step, if the way is free; else put the foot beside the other one."""
        way = self.goal_m - self.place_m
        if float(np.hypot(*way)) <= NEAR_M:
            self.goal_m = next(self.places)
            way = self.goal_m - self.place_m
        turn = 0.0
        stride = np.zeros(2)
        length_m = float(np.hypot(*way))
        if length_m > NEAR_M:
            wanted = (math.atan2(way[1], way[0]) - self.heading_rad + math.pi) % (2.0 * math.pi) - math.pi
            turn = min(max(wanted, -TURN_RAD), TURN_RAD)
            self.heading_rad += turn
            if turn == wanted:
                stride = way * min(1.0, self.walker.step_length_m / length_m)
        if not self.steps or not self._is_free(stride, others_m):
            stride = np.zeros(2)
        self.place_m = self.place_m + stride
        # Feet that turn on the spot are set further apart, or one would come down on the other.
        wide = self.walker.step_width_m + 0.8 * self.walker.foot_length_m * abs(math.sin(turn)) * (not stride.any())
        walker = replace(self.walker, step_width_m=min(wide, 0.5))
        place = (float(self.place_m[0]), float(self.place_m[1]), self.heading_rad)
        (vary,) = gait.variations(walker, self.key, len(self.steps), 1)
        self.steps.append(gait.footfall_at(walker, place, len(self.steps), vary, now_s))

    def _is_free(self, stride: NDArray[np.float64], others_m: Sequence[NDArray[np.float64]]) -> bool:
        """Return whether the way is free; a person who has waited for `PATIENCE` steps gets another destination."""
        for other in others_m:
            now, then = (float(np.hypot(*(other - place))) for place in (self.place_m, self.place_m + stride))
            if then < min(now, CLEARANCE_M):
                self.waited += 1
                if self.waited > PATIENCE:
                    self.waited, self.goal_m = 0, next(self.places)
                return False
        self.waited = 0
        return True


def _places(
    path: str, number: int, count: int, bounds_m: NDArray[np.float64], key: np.uint64
) -> Iterator[NDArray[np.float64]]:
    """Yield a person's destinations on a floor within these `Floor.bounds_m`."""
    low, high = bounds_m[0] + _INSET_M, bounds_m[1] - _INSET_M
    middle, half = (low + high) / 2.0, np.maximum((high - low) / 2.0, 0.0)
    share = (number + 0.5) / count
    turn = np.array([math.cos(0.35 + math.pi * number / count), math.sin(0.35 + math.pi * number / count)])
    across = turn * float((half / np.maximum(np.abs(turn), 1e-9)).min())
    rounds = middle + (0.6 + 0.4 * share) * half * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
    line = low + (high - low) * np.array([[0.0, share], [1.0, share]])
    spot = middle + (0.6 * half * turn * (-1) ** number if count > 1 else 0.0)
    routes = {
        "straight": line,
        "turn": np.roll(rounds, number, axis=0),
        "crossing": np.array([middle - across, middle + across]),
    }
    drawn = 0
    while True:
        if path == "in-place":
            yield spot
        elif path == "random":
            yield low + (high - low) * np.array([uniform(key, 1_000_000 + 2 * drawn + axis) for axis in range(2)])
        else:
            yield routes[path][drawn % len(routes[path])]
        drawn += 1
