"""Gait of each person from the footsteps: means, and asymmetry of left and right."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from underfoot.floor.footsteps import Step
from underfoot.quantities import counted

LEAST_STEPS = 4
"""Fewest steps of a person for a summary: two of each foot."""


@dataclass(frozen=True)
class PersonGait:
    """Means over a person's steps; NaN if not known.

    An asymmetry is the symmetry index of Robinson and others (1987), in percent: the difference of left and right over
    their mean; 0 where they are alike.
    """

    person: int
    steps: int
    cadence_per_min: float
    step_length_mm: float
    step_width_mm: float
    stance_ms: float
    swing_ms: float
    double_support_ms: float
    stance_asymmetry_percent: float
    length_asymmetry_percent: float

    def line(self) -> str:
        """Return a readable line."""
        feet = "both feet" if self.double_support_ms >= 0.0 else "neither foot"
        figures = (
            (self.cadence_per_min, "{:.0f} steps a minute"),
            (self.step_length_mm, "length {:.0f} mm"),
            (self.step_width_mm, "width {:.0f} mm"),
            (self.stance_ms, "stance {:.0f} ms"),
            (self.swing_ms, "swing {:.0f} ms"),
            (abs(self.double_support_ms), feet + " {:.0f} ms"),
            (self.stance_asymmetry_percent, "stance {:.0f} % asymmetric"),
            (self.length_asymmetry_percent, "length {:.0f} %"),
        )
        said = ", ".join(form.format(value) for value, form in figures if math.isfinite(value))
        return f"person {self.person}: {counted(self.steps, 'step')}, {said}"


def gait_of(steps: Iterable[Step]) -> list[PersonGait]:
    """Return the gait of each person with at least four of `steps`, in the order of their numbers.

    >>> one = dict(tile="t1", start_s=0.0, contact_ms=600.0, peak1_n=700.0, valley_n=500.0, peak2_n=700.0)
    >>> one |= dict(impulse_ns=300.0, loading_kn_s=8.0, path_mm=200.0, net_mm=200.0, person=1, step_width_mm=100.0)
    >>> sides = ("left", "right", "left", "right")
    >>> steps = [Step(i, side=side, step_length_mm=600.0 + 60.0 * (i % 2), **one) for i, side in enumerate(sides)]
    >>> gait, = gait_of(steps)
    >>> gait.steps, gait.step_length_mm, gait.stance_asymmetry_percent, round(gait.length_asymmetry_percent, 1)
    (4, 630.0, 0.0, 9.5)
    """
    of_person: dict[int, list[Step]] = {}
    for step in steps:
        of_person.setdefault(step.person, []).append(step)
    return [_gait(person, mine) for person, mine in sorted(of_person.items()) if person and len(mine) >= LEAST_STEPS]


def _gait(person: int, steps: Sequence[Step]) -> PersonGait:
    return PersonGait(
        person=person,
        steps=len(steps),
        cadence_per_min=_mean(steps, lambda step: step.cadence_per_min),
        step_length_mm=_mean(steps, lambda step: step.step_length_mm),
        step_width_mm=_mean(steps, lambda step: step.step_width_mm),
        stance_ms=_mean(steps, lambda step: step.contact_ms),
        swing_ms=_mean(steps, lambda step: step.swing_ms),
        double_support_ms=_mean(steps, lambda step: step.double_support_ms),
        stance_asymmetry_percent=_asymmetry(steps, lambda step: step.contact_ms),
        length_asymmetry_percent=_asymmetry(steps, lambda step: step.step_length_mm),
    )


def _mean(steps: Iterable[Step], figure: Callable[[Step], float]) -> float:
    values = [figure(step) for step in steps if math.isfinite(figure(step))]
    return math.fsum(values) / len(values) if values else math.nan


def _asymmetry(steps: Sequence[Step], figure: Callable[[Step], float]) -> float:
    left, right = (_mean((step for step in steps if step.side == side), figure) for side in ("left", "right"))
    return 200.0 * abs(left - right) / (left + right) if left + right > 0.0 else math.nan
