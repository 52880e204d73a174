"""Magnitude estimation: a number for how strong each stimulus seems (Stevens 1957), free or re a standard's."""

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec.structs import replace

from underfoot.experiments.method import BlockedMethod, StimulusName, StimulusNames
from underfoot.experiments.questions import FreeNumber
from underfoot.experiments.trials import Presentation, Trial
from underfoot.parameters import Count, Parameter, Text, ask


class MagnitudeEstimation(BlockedMethod):
    """Every stimulus once per block, in random order, answered with any number above 0.

    With a standard, each trial has two intervals, of which it is the first; the question says its number, the modulus.
    """

    kind, name = "magnitude-estimation", "Magnitude estimation"
    about = (
        "Each stimulus is given any number above 0, in proportion to how strong it seems; relative magnitudes, and the "
        "exponent of a power law, come of it."
    )
    estimated = StimulusNames((), doc="What is given numbers.", least=2)
    standard = StimulusName(
        "", doc="What comes before each, with a number that the question gives it; none: no modulus."
    )
    blocks = Count(4, 1, 1000, doc="Every stimulus comes once in each.")
    question = Text("", doc="What is asked after each trial; empty: what is usual, with a standard or without.")

    def listed(self) -> Sequence[Trial]:
        trials, standard = self.in_blocks(self.given["estimated"], self.given["blocks"]), self.given["standard"]
        if not standard:
            return trials
        return [
            replace(
                trial,
                intervals=(Presentation(standard), *trial.intervals),
                facts={"comparison": trial.intervals[0].stimulus, **trial.facts},
            )
            for trial in trials
        ]

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        usual = "How strong was it? Twice as strong: twice the number."
        if given["standard"]:
            usual = "The first one is 10. How strong was the second?"
        return (ask("magnitude", FreeNumber(1.0, 1e-6, 1e6, doc=given["question"] or usual)),)
