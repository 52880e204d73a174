"""Gait of each person from the footsteps: means, and asymmetry of left and right."""

import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from msgspec import structs
from numpy.typing import ArrayLike

from underfoot.floor.footsteps import Step, walking_speed_m_s
from underfoot.quantities import counted

LEAST_STEPS = 4
"""Fewest steps of a person for a summary: two of each foot."""

LEAST_STRIDE_M = 0.15
"""Length of two steps below which they are on the spot, where lengths near 0 differ by any factor: simulated people
who step or turn there make at most 0.09 m."""

LEAST_STRIDES = 30
"""Fewest strides of which the variation is stated: the standard deviation of 30 is off by a sixth, sqrt(3 / 4 n), as
each shares steps with its neighbours."""

LEAST_LENGTHS = 5
"""Fewest lengths of each foot of which the asymmetry is stated: up to two odd ones, as in a bend, do not move the
median of five far."""

LEAST_ON_WAY = 0.25
"""Least share of steps on the way, of those with a length, of which alone its mean is taken: to and fro on 1.8 m it is
a third, and on a floor where people turn at each step a tenth. A least number would depend on how long they walked."""

KEPT_STEPS = 1000
"""Steps of a person of which medians are taken: as many as ten minutes have."""

MOST_LINES = 8
"""Most persons with a line each; more are summed up in one."""

_OF_STEP = tuple(one.name for one in structs.fields(Step) if one.type is float and one.name != "start_s")
_FROM_LAST = ("cadence_per_min", "step_length_mm", "step_width_mm", "double_support_ms")
_OF_NEIGHBOURS = (_FROM_LAST, ("swing_ms",))
"""Measures of the person's next step, and of the one after it, that are from a step or between it and them."""

_OF_WAY = ("step_length_mm", "step_width_mm")
"""Measures that are along and across the way."""

_GONE_S = 60.0
"""A person who has not stepped for this long has left, or counts as another: longer than a walk can be lost."""


@dataclass(frozen=True)
class PersonGait:
    """Means over a person's steps; NaN if not known. The cadence is one over the mean step time: steps by the minute.
    Length and width are those of steps `on_the_way`.

    An asymmetry is the symmetry index of Robinson and others (1987), in percent: the difference of left and right over
    their mean; 0 where they are alike. It is of the medians of the latest `KEPT_STEPS`: of means, one foot that paused
    for some seconds would make a limp. That of the length is of steps between two others of known length: beside the
    turns at the ends of a walkway they are short, and often of the same foot. It leaves out steps on the spot, which
    with one beside them lead less than `LEAST_STRIDE_M`, as it divides by the length, and is known from `LEAST_LENGTHS`
    of each foot on. The variation of the stride time, two steps, is its coefficient of variation (standard deviation
    over mean), known from `LEAST_STRIDES` on.
    """

    person: int
    steps: int
    cadence_per_min: float
    step_length_mm: float
    step_width_mm: float
    stance_ms: float
    swing_ms: float
    double_support_ms: float
    stance_asymmetry_percent: float = math.nan
    length_asymmetry_percent: float = math.nan
    stride_variation_percent: float = math.nan

    def line(self) -> str:
        """Return a readable line."""
        return f"person {self.person}: {self.figures()}"

    def figures(self) -> str:
        """Return the number of steps, and what is known of them, in words."""
        feet = "both feet" if self.double_support_ms >= 0.0 else "neither foot"
        figures = (
            (self.cadence_per_min, "{:.0f} steps a minute"),
            (self.step_length_mm, "length {:.0f} mm"),
            (self.step_width_mm, "width {:.0f} mm"),
            (walking_speed_m_s(self.step_length_mm, self.cadence_per_min), "{:.2f} m/s"),
            (self.stance_ms, "stance {:.0f} ms"),
            (self.swing_ms, "swing {:.0f} ms"),
            (abs(self.double_support_ms), feet + " {:.0f} ms"),
            (self.stance_asymmetry_percent, "stance {:.0f} % asymmetric"),
            (self.length_asymmetry_percent, "length {:.0f} %"),
            (self.stride_variation_percent, "stride time varies by {:.1f} %"),
        )
        said = ", ".join(form.format(value) for value, form in figures if math.isfinite(value))
        return f"{counted(self.steps, 'step')}, {said}"


def counting(steps: Iterable[Step], since: dict[int, int] | None = None) -> Iterator[Step]:
    """Yield the steps with NaN for measures that do not count: all of a step that is left out, and those that the
    person's next two steps have from it. Each keeps its place: steps beside it are not neighbours of each other.

    `since` has, of steps that come piece by piece, how many a person made since one that was left out, while it counts.

    >>> steps = [Step(k, "t1", "left", k, 600.0, *[1.0] * 7, person=1, cadence_per_min=100.0) for k in range(3)]
    >>> [step.cadence_per_min for step in counting([structs.replace(steps[0], left_out="stumbled"), *steps[1:]])]
    [nan, nan, 100.0]
    """
    since = {} if since is None else since
    last = len(_OF_NEIGHBOURS)
    for step in steps:
        after = since.pop(step.person, last)
        if step.left_out or after + 1 < last:
            since[step.person] = 0 if step.left_out else after + 1
        gone = _OF_STEP if step.left_out else _OF_NEIGHBOURS[after] if after < last else ()
        yield structs.replace(step, **dict.fromkeys(gone, math.nan)) if gone else step


def on_the_way(steps: Iterable[Step]) -> list[Step]:
    """Return the steps, each with NaN for length and width unless the person turns neither at the one before nor at the
    next: at the ends of a walkway feet are put beside one another. So they are where somebody stops, as may be at the
    last step. The steps of a person of whom fewer than `LEAST_ON_WAY` are left, as on a small floor, keep theirs.

    >>> steps = [Step(k, "t1", "left", k, 600.0, *[1.0] * 7, person=1, cadence_per_min=100.0) for k in range(6)]
    >>> told_mm = (650.0, 90.0, math.nan, 640.0, 660.0, 330.0)
    >>> steps = [structs.replace(one, step_length_mm=mm) for one, mm in zip(steps, told_mm, strict=True)]
    >>> [step.step_length_mm for step in on_the_way(steps)]
    [650.0, nan, nan, nan, 660.0, nan]
    """
    found = list(steps)
    of_person: dict[int, list[int]] = {}
    for number, step in enumerate(found):
        of_person.setdefault(step.person, []).append(number)
    unknown = dict.fromkeys(_OF_WAY, math.nan)
    for numbers in of_person.values():
        turns = np.array([_turns(found[number]) for number in numbers])
        beside = np.append(turns[1:], True) | np.append(False, turns[:-1])
        known = np.isfinite([found[number].step_length_mm for number in numbers])
        if (known & ~beside).sum() >= LEAST_ON_WAY * known.sum():
            for number in np.array(numbers)[beside].tolist():
                found[number] = structs.replace(found[number], **unknown)
    return found


def _turns(step: Step) -> bool:
    """Return whether a step follows another one, and in what direction is not clear."""
    return math.isfinite(step.cadence_per_min) and not math.isfinite(step.step_length_mm)


def gait_of(steps: Iterable[Step]) -> list[PersonGait]:
    """Return the gait of each person with at least four of `steps` that count, in the order of their numbers.

    >>> one = dict(tile="t1", start_s=0.0, contact_ms=600.0, peak1_n=700.0, valley_n=500.0, peak2_n=700.0)
    >>> one |= dict(impulse_ns=300.0, loading_kn_s=8.0, path_mm=200.0, net_mm=200.0, person=1, step_width_mm=100.0)
    >>> sides = (*("left", "right") * 6, "left")
    >>> steps = [Step(i, side=side, step_length_mm=600.0 + 60.0 * (i % 2), **one) for i, side in enumerate(sides)]
    >>> gait, = gait_of(steps)
    >>> gait.steps, gait.step_length_mm, gait.stance_asymmetry_percent, round(gait.length_asymmetry_percent, 1)
    (13, 630.0, 0.0, 9.5)
    """
    known = sorted(_added({}, counting(steps)).items())
    return [sums.gait(person) for person, sums in known if sums.steps >= LEAST_STEPS]


def cadence_of(steps: Iterable[Step]) -> float:
    """Return the cadence of these steps of one person, steps by the minute; NaN if it is not known."""
    sums = _Sums()
    for step in steps:
        sums.add(step)
    return sums.mean_gait().cadence_per_min


class GaitTotals:
    """Gait of all who walk in a stream, in sums: what is kept does not grow with the stream."""

    def __init__(self) -> None:
        self._present: dict[int, _Sums] = {}
        self._since_left_out: dict[int, int] = {}
        self._gone: list[PersonGait] = []  # the first `MOST_LINES` of them
        self._sum_gone, self._count_gone = _Sums(), 0

    def add(self, steps: Iterable[Step]) -> None:
        """Take further steps of the stream."""
        _added(self._present, counting(steps, self._since_left_out))
        now_s = max((sums.last_s for sums in self._present.values()), default=0.0)
        for person in [one for one, sums in self._present.items() if sums.last_s < now_s - _GONE_S]:
            sums = self._present.pop(person)
            if sums.steps >= LEAST_STEPS:
                self._count_gone += 1
                self._sum_gone.merge(sums)
                self._gone += [sums.gait(person)] if len(self._gone) < MOST_LINES else []

    def lines(self) -> list[str]:
        """Return a line for each person with at least four steps or, if they are many, one for all."""
        known = {person: sums for person, sums in self._present.items() if sums.steps >= LEAST_STEPS}
        persons = self._count_gone + len(known)
        if persons <= MOST_LINES:
            gaits = [*self._gone, *(sums.gait(person) for person, sums in known.items())]
            return [gait.line() for gait in sorted(gaits, key=lambda gait: gait.person)]
        everyone = _Sums()
        for sums in (self._sum_gone, *known.values()):
            everyone.merge(sums)
        return [f"{persons} persons of {LEAST_STEPS} steps or more: {everyone.mean_gait().figures()}"]


class _Sums:
    """Sums of the figures of some steps, and how many of each are known."""

    def __init__(self) -> None:
        self.steps = 0
        self.last_s = -math.inf
        self._last_step_s = math.nan
        self._latest: deque[Step] = deque(maxlen=KEPT_STEPS)
        self._strides = np.zeros(3)  # sums of the stride times to the powers 0, 1 and 2
        self._sum = np.zeros(8)  # length and width of all steps, and last of those on the way
        self._known = np.zeros(8)
        self._turned = False
        self._waiting = np.full(2, math.nan)  # of the last step, which is on the way if the next one does not turn

    def add(self, step: Step) -> None:
        """Take a step."""
        turned, self._turned = self._turned, _turns(step)
        lengths = np.array([step.step_length_mm, step.step_width_mm])
        unknown = np.full(2, math.nan)
        of_way, self._waiting = unknown if self._turned else self._waiting, unknown if turned else lengths
        self._latest.append(step)
        step_s = 60.0 / step.cadence_per_min
        figures = np.array([step_s, *lengths, step.contact_ms, step.swing_ms, step.double_support_ms, *of_way])
        known = np.isfinite(figures)
        self._sum[known] += figures[known]
        self._known += known
        self.steps += not step.left_out
        self.last_s = max(self.last_s, step.start_s)
        stride_s = self._last_step_s + step_s
        if math.isfinite(stride_s):
            self._strides += stride_s ** np.arange(3)
        self._last_step_s = step_s

    def merge(self, other: "_Sums") -> None:
        """Take the steps of `other`."""
        self.steps += other.steps
        self._sum += other._sum
        self._known += other._known

    def mean_gait(self) -> PersonGait:
        """Return the means, as those of person 0, and no asymmetry: that of several persons means nothing."""
        means = self._sum / np.where(self._known, self._known, math.nan)
        if self._known[6] >= LEAST_ON_WAY * self._known[1]:
            means[1:3] = means[6:]
        step_s, *means = means[:6].tolist()
        return PersonGait(0, self.steps, 60.0 / step_s, *means)

    def gait(self, person: int) -> PersonGait:
        """Return the means and asymmetries, as those of `person`."""
        length_mm = np.array([step.step_length_mm for step in self._latest])
        leads_on = length_mm[:-1] + length_mm[1:] >= 1e3 * LEAST_STRIDE_M
        length_mm[~(np.append(False, leads_on) & np.append(leads_on, False))] = math.nan
        return replace(
            self.mean_gait(),
            person=person,
            stance_asymmetry_percent=self._asymmetry_percent([step.contact_ms for step in self._latest]),
            length_asymmetry_percent=self._asymmetry_percent(length_mm, LEAST_LENGTHS),
            stride_variation_percent=self._stride_variation_percent(),
        )

    def _asymmetry_percent(self, of_latest: ArrayLike, least: int = 1) -> float:
        sides, values = np.array([step.side for step in self._latest]), np.asarray(of_latest, np.float64)
        known = [values[(sides == side) & np.isfinite(values)] for side in ("left", "right")]
        left, right = (float(np.median(one)) if len(one) >= least else math.nan for one in known)
        return 200.0 * abs(left - right) / (left + right) if left + right > 0.0 else math.nan

    def _stride_variation_percent(self) -> float:
        count, total, squares = self._strides.tolist()
        if count < LEAST_STRIDES:
            return math.nan
        spread = math.sqrt(max(squares - total**2 / count, 0.0) / (count - 1.0))
        return 100.0 * spread * count / total


def _added(of_person: dict[int, _Sums], steps: Iterable[Step]) -> dict[int, _Sums]:
    """Take the steps of those who are known into the sums of each."""
    for step in steps:
        if step.person:
            of_person.setdefault(step.person, _Sums()).add(step)
    return of_person
