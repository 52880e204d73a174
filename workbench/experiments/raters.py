"""Simulated participants who put sliders, and judge pairs."""

import math
from collections.abc import Sequence
from contextlib import suppress
from functools import cached_property
from itertools import combinations

import numpy as np

from underfoot.errors import BadMeasurement
from underfoot.experiments.analysis.constant import axis_and_condition
from underfoot.experiments.methods.pairs import DISSIMILARITY, SAME
from underfoot.experiments.observer import Observer
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import NO, YES
from underfoot.experiments.table import LEVEL, Row
from underfoot.experiments.trials import Answers, Trial
from underfoot.parameters import Number


class Rater(Observer):
    """Sets the slider to a value that increases with the logarithm of the level, with a spread.

    Where all have one level, as on plates of several stiffnesses, it increases with that of the number which differs.
    """

    methods = ("rating",)
    without = Number(25.0, 0.0, 100.0, doc="Where a plate that does not vibrate is put.")
    doubling = Number(
        8.0, -50.0, 50.0, doc="How much more for twice the level, from 1 m/s^2 on; of one level, twice the number."
    )
    rating_spread = Number(10.0, 0.0, 50.0, doc="Standard deviation from trial to trial.")

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        place = self._places[trial.intervals[0].stimulus] + self.truth["rating_spread"] * random.standard_normal()
        return {"rating": _on_slider(place)}

    def truths(self) -> dict[str, float]:
        return {f"rating {name}": place for name, place in self._places.items()}

    @cached_property
    def _places(self) -> dict[str, float]:
        rows = rows_of_stimuli(self.protocol, self.given["rated"])
        ratios = ratios_of(rows) or {row["stimulus"]: 1.0 + row.get(LEVEL, 0.0) for row in rows}
        without, doubling = self.truth["without"], self.truth["doubling"]
        return {name: without + doubling * math.log2(ratio) for name, ratio in ratios.items()}


class PairJudge(Observer):
    """Feels each stimulus with a normally distributed error, and calls a pair the same whose two are near each other.

    Any two stimuli are equally far apart.
    """

    methods = ("pairs",)
    apart = Number(1.5, 0.0, 10.0, doc="How far apart two stimuli are, in standard deviations of one: d'.")
    tolerance = Number(1.5, 0.0, 10.0, doc="Pairs that are nearer than this are called the same, in the same unit.")
    dissimilar = Number(60.0, 0.0, 100.0, doc="Where the slider is put.")
    dissimilar_spread = Number(10.0, 0.0, 50.0, doc="Standard deviation of its place from trial to trial.")

    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        error = random.standard_normal()
        if self.given["judged"] == SAME:
            one, other = trial.intervals
            far = self.truth["apart"] * (one != other) + math.sqrt(2.0) * error
            return {SAME: YES if abs(far) < self.truth["tolerance"] else NO}
        place = self.truth["dissimilar"] + self.truth["dissimilar_spread"] * error
        return {DISSIMILARITY: _on_slider(place)}

    def truths(self) -> dict[str, float]:
        name, value = ("d'", "apart") if self.given["judged"] == SAME else (DISSIMILARITY, "dissimilar")
        return {f"{name} {one} {other}": self.truth[value] for one, other in combinations(self.given["paired"], 2)}

    def used(self) -> Sequence[str]:
        is_same = self.given["judged"] == SAME
        return ("apart", "tolerance") if is_same else ("dissimilar", "dissimilar_spread")


def rows_of_stimuli(protocol: Protocol, names: Sequence[str]) -> list[Row]:
    """Return a row of each stimulus, as in the table of trials, without answers."""
    stimuli = {name: protocol.stimuli[name] for name in names}
    levels = {name: {} if (peak := one.peak_m_s2()) is None else {LEVEL: peak} for name, one in stimuli.items()}
    return [{"stimulus": name, **one.factors, **levels[name]} for name, one in stimuli.items()]


def ratios_of(rows: Sequence[Row]) -> dict[str, float]:
    """Return the number in which stimuli of one level differ, such as stiffness, re its least value, by their names.

    It is the one that the analysis draws along; {} without one above 0, or where levels differ.

    >>> ratios_of([{"stimulus": f"k{k}", "stiffness_n_mm": k} for k in (60.0, 120.0)])
    {'k60.0': 1.0, 'k120.0': 2.0}
    """
    with suppress(BadMeasurement):  # no factor is a number
        axis, _ = axis_and_condition(rows)
        numbers = {row["stimulus"]: float(row.get(axis, 0.0)) for row in rows}
        least = min(numbers.values())
        if least > 0.0 and len({row.get(LEVEL) for row in rows}) == 1:
            return {name: number / least for name, number in numbers.items()}
    return {}


def _on_slider(place: float) -> float:
    return float(min(max(place, 0.0), 100.0))
