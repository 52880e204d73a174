"""Simulated participants who put sliders, and judge pairs."""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from underfoot.experiments.methods.pairs import DISSIMILARITY, SAME
from underfoot.experiments.observer import Observer
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import NO, YES
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
        place = self._place(trial.intervals[0].stimulus) + self.truth["rating_spread"] * random.standard_normal()
        return {"rating": _on_slider(place)}

    def truths(self) -> dict[str, float]:
        return {f"rating {name}": self._place(name) for name in self.given["rated"]}

    def _place(self, stimulus: str) -> float:
        level = self.protocol.stimuli[stimulus].peak_m_s2() or 0.0
        ratio = ratios_of(self.protocol, self.given["rated"]).get(stimulus, 1.0 + level)
        return float(self.truth["without"] + self.truth["doubling"] * math.log2(ratio))


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


def ratios_of(protocol: Protocol, names: Sequence[str]) -> dict[str, float]:
    """Return the factor by which stimuli of one level differ, such as stiffness, re its least value, by their names.

    It is the one with most values, all of them numbers above 0; {} without one, or where levels differ.

    >>> from underfoot.experiments.stimuli import Stimulus
    >>> stimuli = {f"k{k}": Stimulus(stiffness_n_mm=k, factors={"stiffness_n_mm": k}) for k in (60.0, 120.0)}
    >>> ratios_of(Protocol(stimuli=stimuli), ["k60.0", "k120.0"])
    {'k60.0': 1.0, 'k120.0': 2.0}
    """
    several = [protocol.stimuli[name] for name in names]
    if len({one.peak_m_s2() for one in several}) > 1:
        return {}
    cells = [[one.factors.get(factor) for one in several] for factor in protocol.factors]
    numbers = [[float(one) for one in found if isinstance(one, int | float) and one > 0] for found in cells]
    whole = [found for found in numbers if len(found) == len(several)]
    most = max(whole, key=lambda found: len(set(found)), default=[])
    return {name: value / min(most) for name, value in zip(names, most, strict=False)}


def _on_slider(place: float) -> float:
    return float(min(max(place, 0.0), 100.0))
