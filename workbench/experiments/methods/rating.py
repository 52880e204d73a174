"""Rating: every condition once per block, in random order, judged on a slider (thesis 6.3.5)."""

from collections.abc import Mapping, Sequence
from typing import Any

from underfoot.experiments.method import BlockedMethod, StimulusNames
from underfoot.experiments.questions import Scale
from underfoot.experiments.trials import Trial
from underfoot.parameters import Count, Parameter, Text, ask


class Rating(BlockedMethod):
    """A slider from 0, `low`, to 100, `high`."""

    kind, name = "rating", "Rating"
    about = "Each condition is judged on a slider once a block; means, and effects of the factors, come of it."
    rated = StimulusNames((), doc="What is rated.")
    blocks = Count(12, 1, 1000, doc="Every condition comes once in each.")
    question = Text("How strong was it?", doc="What is asked after each trial.")
    low = Text("least", doc="What the slider says at 0.")
    high = Text("most", doc="What the slider says at 100.")

    def listed(self) -> Sequence[Trial]:
        return self.in_blocks(self.given["rated"], self.given["blocks"])

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        return (ask("rating", Scale(50.0, 0.0, 100.0, doc=given["question"], ends=(given["low"], given["high"]))),)
