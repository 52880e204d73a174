"""Accuracy of tracking: measures of multi-object tracking, and their values for simulated people.

CLEAR MOT (Bernardin and Stiefelhagen 2008): truths and hypotheses are matched frame by frame, a match is kept while it
is within reach, and MOTA = 1 - (misses + false positives + switches) / truths. IDF1 (Ristani and others 2016): the one
assignment of truths to hypotheses, over the whole time, with the most frames in reach; IDF1 is twice these over all
frames of both.
"""

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment

from underfoot.clock import RATE_HZ
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.floor import simulated_loads
from underfoot.floor.contacts import ContactRows
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import Floor
from underfoot.floor.simulated_people import Person
from underfoot.floor.step_finder import StepFinder

MATCH_RADIUS_M = 0.15
"""Largest distance between a contact and its foot: less than to anybody's other foot, more than from a tile's own
centroid to that of a foot that it shares.
"""

EVERY = 10
"""One of this many samples at 1 kHz is evaluated."""

SHORTEST = 10
"""Longest time in frames (0.1 s) for which a foot may be matched to another's contact without counting as split or
joined; two feet on one tile have one load.
"""

LEAST_N = 20.0
"""Least force of a foot that counts; contacts begin above it."""

_CHUNK = 4800


@dataclass(frozen=True)
class Tracks:
    """Objects over time, shape (n,) each: frame number, ascending, id, and position in metres."""

    frame: NDArray[np.int64]
    id: NDArray[np.int64]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]

    @staticmethod
    def of(frame: ArrayLike, id: ArrayLike, x_m: ArrayLike, y_m: ArrayLike) -> "Tracks":
        """Return tracks of plain sequences."""
        return Tracks(np.asarray(frame), np.asarray(id), np.asarray(x_m, float), np.asarray(y_m, float))


@dataclass(frozen=True)
class Identity:
    """Accuracy of hypotheses. `matched[truth][hypothesis]` counts the frames of each pair."""

    truths: int
    misses: int
    false_positives: int
    switches: int
    idf1: float
    matched: Mapping[int, Counter[int]]

    @property
    def mota(self) -> float:
        """1 minus the share of errors; negative if there are more errors than truths."""
        return 1.0 - (self.misses + self.false_positives + self.switches) / max(self.truths, 1)


def identity(truth: Tracks, found: Tracks) -> Identity:
    """Match hypotheses to truths, up to `MATCH_RADIUS_M` apart.

    >>> truth = Tracks.of([0, 1, 2, 3], [7, 7, 7, 7], [0, 0, 0, 0], [0, 0, 0, 0])
    >>> found = Tracks.of([0, 1, 3, 3], [1, 1, 2, 3], [0, 0, 0, 5], [0, 0, 0, 0])
    >>> measured = identity(truth, found)
    >>> measured.misses, measured.false_positives, measured.switches
    (1, 1, 1)
    >>> measured.mota, measured.idf1
    (0.25, 0.5)
    """
    together, matched = defaultdict[int, Counter[int]](Counter), defaultdict[int, Counter[int]](Counter)
    last: dict[int, int] = {}
    misses = false_positives = switches = 0
    for frame in np.union1d(truth.frame, found.frame).tolist():
        mine = np.arange(*np.searchsorted(truth.frame, [frame, frame + 1]))
        theirs = np.arange(*np.searchsorted(found.frame, [frame, frame + 1]))
        pairs = _matches(truth, found, mine, theirs, last, together)
        for one, other in pairs:
            switches += last.get(one, other) != other
            last[one] = other
            matched[one][other] += 1
        misses += len(mine) - len(pairs)
        false_positives += len(theirs) - len(pairs)
    return Identity(
        len(truth.id),
        misses,
        false_positives,
        switches,
        2.0 * _best_assignment(together) / max(len(truth.id) + len(found.id), 1),
        matched,
    )


def _matches(
    truth: Tracks,
    found: Tracks,
    mine: NDArray[np.intp],
    theirs: NDArray[np.intp],
    last: Mapping[int, int],
    together: defaultdict[int, Counter[int]],
) -> list[tuple[int, int]]:
    """Return the matches of one frame; pairs within reach are counted in `together`."""
    if not len(mine) or not len(theirs):
        return []
    far = np.hypot(truth.x_m[mine][:, None] - found.x_m[theirs], truth.y_m[mine][:, None] - found.y_m[theirs])
    is_near = far <= MATCH_RADIUS_M
    cost = np.where(is_near, far, 1e6)
    for i, j in zip(*np.nonzero(is_near), strict=True):
        one, other = int(truth.id[mine[i]]), int(found.id[theirs[j]])
        together[one][other] += 1
        if last.get(one) == other:
            cost[i, j] -= 100.0
    chosen = zip(*linear_sum_assignment(cost), strict=True)
    return [(int(truth.id[mine[i]]), int(found.id[theirs[j]])) for i, j in chosen if is_near[i, j]]


def _best_assignment(together: Mapping[int, Counter[int]]) -> int:
    """Return the most frames in reach over all one-to-one assignments of truths to hypotheses."""
    others = sorted({other for of_one in together.values() for other in of_one})
    if not others:
        return 0
    table = np.zeros((len(together), len(others)))
    for row, of_one in enumerate(together.values()):
        for other, frames in of_one.items():
            table[row, others.index(other)] = frames
    rows, columns = linear_sum_assignment(-table)
    return int(table[rows, columns].sum())


@dataclass(frozen=True)
class WalkAccuracy:
    """Results for simulated people: contacts, steps, and persons.

    `splits` are feet with two contacts, `joins` contacts with two feet, each for more than 0.1 s. `sides_right` refers
    to the steps that have a side. `person_idf1` is of footsteps.
    """

    contacts: Identity
    feet: int
    splits: int
    joins: int
    steps: int
    sided: int
    sides_right: int
    person_idf1: float


def simulate_walk(floor: Floor, people: Sequence[Person], seconds: float) -> WalkAccuracy:
    """Simulate people walking on `floor` (none: the usual walker, around the floor), and evaluate their tracking.

    Each sensor has a tare of 12 N and white noise of 0.3 N.
    """
    source = SimulatedFloor(floor, people=people)
    finder = StepFinder(floor, source.rate_hz)
    draw = np.random.default_rng(1)
    rows: list[ContactRows] = []
    steps: list[Step] = []
    now_s = 0.0
    for end in range(_CHUNK, math.ceil(seconds * RATE_HZ), _CHUNK):
        count = source.pull(end)
        time_s = source.stamps[:count] / RATE_HZ
        force_n = source.forces[:count] + 12.0 + draw.normal(0.0, 0.3, (count, *source.forces.shape[1:]))
        found = finder.feed(time_s, force_n)
        now_s = float(time_s[-1])
        rows.append(found.rows)
        steps += found.steps
    found = finder.finish()
    return _accuracy(source, [*rows, found.rows], steps + found.steps, now_s)


def _accuracy(
    source: SimulatedFloor, rows: Sequence[ContactRows], steps: Sequence[Step], until_s: float
) -> WalkAccuracy:
    times = np.arange(0.0, until_s, EVERY / source.rate_hz)
    down = simulated_loads.feet_down(source.footfalls, source.curves, times, LEAST_N)
    truth = Tracks(np.round(down.time_s / times[1]).astype(int), down.footfall, down.x_m, down.y_m)
    columns = (np.concatenate([getattr(part, name) for part in rows]) for name in ("time_s", "contact", "x_m", "y_m"))
    time_s, contact, x_m, y_m = columns
    sample = np.round(time_s * source.rate_hz).astype(int)
    kept = sample % EVERY == 0
    found = identity(truth, Tracks(sample[kept] // EVERY, contact[kept], x_m[kept], y_m[kept]))
    feet_of = defaultdict[int, dict[int, int]](dict)
    for foot, of_foot in found.matched.items():
        for id, frames in of_foot.items():
            feet_of[id][foot] = frames
    foot_of = {id: max(feet, key=lambda foot: feet[foot]) for id, feet in feet_of.items()}
    stepped = [(step, foot_of[step.contact]) for step in steps if step.contact in foot_of]
    footfalls = source.footfalls
    sides = [(step.side == "left") == bool(footfalls[foot]["left"]) for step, foot in stepped if step.side != "unknown"]
    persons = [(int(footfalls[foot]["person"]), step.person) for step, foot in stepped]
    together = defaultdict[int, Counter[int]](Counter)
    for true, found_id in persons:
        together[true][found_id] += 1
    return WalkAccuracy(
        contacts=found,
        feet=len(found.matched),
        splits=sum(sum(frames > SHORTEST for frames in of_foot.values()) > 1 for of_foot in found.matched.values()),
        joins=sum(sum(frames > SHORTEST for frames in of_contact.values()) > 1 for of_contact in feet_of.values()),
        steps=len(steps),
        sided=len(sides),
        sides_right=sum(sides),
        person_idf1=2.0 * _best_assignment(together) / max(2 * len(persons) + len(steps) - len(stepped), 1),
    )
