"""Constant stimuli: fixed levels, each presented many times, in one interval or in two (thesis 6.3.6)."""

from collections.abc import Mapping, Sequence
from typing import Any

from msgspec.structs import replace

from underfoot.experiments.method import BlockedMethod, StimulusName, StimulusNames
from underfoot.experiments.questions import FIRST, NO, SECOND, YES, felt_or_stronger
from underfoot.experiments.trials import Presentation, Trial
from underfoot.parameters import Choice, Count, Parameter, Text

COMPARISON, STANDARD = "comparison", "standard"


class ConstantStimuli(BlockedMethod):
    """Every comparison once per block, in random order.

    With a standard, a trial has two intervals. The standard comes first in half of the blocks of each comparison (one
    more or less if their number is odd). Without a standard, a trial has one interval, and the answer is yes or no.
    """

    kind, name = "constant-stimuli", "Constant stimuli"
    about = (
        "Each comparison is presented many times, beside a standard (two intervals) or alone (yes or no); a "
        "psychometric curve comes of it, or, where no factor is a number, the share that is judged more."
    )
    comparisons = StimulusNames((), doc="What is judged.")
    standard = StimulusName("", doc="What each comparison is compared with; none: one interval, yes or no.")
    blocks = Count(20, 1, 1000, doc="Every comparison comes once in each.")
    question = Text("", doc="What is asked after each trial; empty: what is usual, with a standard or without.")
    judged_more = Choice(
        "chosen",
        options=("chosen", "not chosen"),
        doc="Which interval the answer says has more of what the factors count; "
        '"which was more compliant?" names the one that is less stiff: "not chosen".',
    )

    def listed(self) -> Sequence[Trial]:
        names, blocks = self.given["comparisons"], self.given["blocks"]
        standard = self.given["standard"]
        orders = {name: self._standard_first(blocks) for name in names} if standard else {}
        found: list[Trial] = []
        for trial in self.in_blocks(names, blocks):
            intervals, name = trial.intervals, trial.intervals[0].stimulus
            facts = {"comparison": name, **trial.facts}
            right = self.stimuli[name].correct
            if standard:
                first = orders[name][trial.block - 1]
                both = (Presentation(standard), *intervals)
                intervals = both if first else both[::-1]
                places = {COMPARISON: SECOND if first else FIRST, STANDARD: FIRST if first else SECOND, "": ""}
                facts |= {"comparison_at": places[COMPARISON], "judged_more": self.given["judged_more"]}
                right = places[right]
            found.append(replace(trial, intervals=intervals, correct=right, facts=facts))
        return found

    def _standard_first(self, blocks: int) -> list[bool]:
        """Return, for each block, whether the standard comes first; this holds for half of them."""
        odd = [self.draws.happens(0.5)] * (blocks % 2)
        return self.draws.shuffled([True] * (blocks // 2) + [False] * (blocks // 2) + odd)

    @classmethod
    def right_answers(cls, given: Mapping[str, Any]) -> tuple[str, ...]:
        """Return yes and no, or, for two intervals, the comparison and the standard."""
        return ("", COMPARISON, STANDARD) if given["standard"] else ("", YES, NO)

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        return (felt_or_stronger(given["question"], are_two=bool(given["standard"])),)
