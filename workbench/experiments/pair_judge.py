"""A simulated participant who judges pairs."""

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np

from underfoot.experiments.methods.pairs import DISSIMILARITY, SAME
from underfoot.experiments.observer import Observer
from underfoot.experiments.questions import NO, YES
from underfoot.experiments.trials import Answers, Trial
from underfoot.parameters import Number


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
        return {DISSIMILARITY: float(min(max(place, 0.0), 100.0))}

    def truths(self) -> dict[str, float]:
        name, value = ("d'", "apart") if self.given["judged"] == SAME else (DISSIMILARITY, "dissimilar")
        return {f"{name} {one} {other}": self.truth[value] for one, other in combinations(self.given["paired"], 2)}

    def used(self) -> Sequence[str]:
        is_same = self.given["judged"] == SAME
        return ("apart", "tolerance") if is_same else ("dissimilar", "dissimilar_spread")
