"""Pairs: each stimulus beside each other one, judged by how different both are, or as the same or different."""

from collections.abc import Mapping, Sequence
from itertools import combinations, permutations
from typing import Any

from underfoot.experiments.method import ListedMethod, StimulusNames
from underfoot.experiments.questions import NO, YES, Scale, yes_or_no
from underfoot.experiments.trials import Presentation, Trial
from underfoot.parameters import Choice, Count, Parameter, Text, ask

DISSIMILARITY, SAME = "dissimilarity", "same"


class Pairs(ListedMethod):
    """Every pair once a block. On the slider, the order of its two changes from block to block. Same or different, it
    comes in both orders, and so does, as often, each of its two beside itself.
    """

    kind, name = "pairs", "Pairs"
    about = (
        "Each stimulus is felt beside each other one. How different both are, on a slider, draws a map of them; "
        "whether they are the same, as in half of the trials, tells how well they are told apart."
    )
    paired = StimulusNames((), doc="What is felt in pairs.", least=2)
    judged = Choice(
        DISSIMILARITY, options=(DISSIMILARITY, SAME), doc="How different both are, or whether they are the same."
    )
    blocks = Count(2, 1, 1000, doc="Every pair comes once in each; to tell the same, in both orders.")
    question = Text("", doc="What is asked after each trial; empty: what is usual.")

    def listed(self) -> Sequence[Trial]:
        names, found = self.given["paired"], list[Trial]()
        is_turned = {pair: self.draws.happens(0.5) for pair in combinations(names, 2)}
        for block in range(1, self.given["blocks"] + 1):
            if self.given["judged"] == SAME:
                pairs = [*permutations(names, 2), *((name, name) for name in names for _ in names[1:])]
            else:
                pairs = [pair[::-1] if turned else pair for pair, turned in is_turned.items()]
                is_turned = {pair: not turned for pair, turned in is_turned.items()}
            for one, other in self.draws.shuffled(pairs):
                right = "" if self.given["judged"] != SAME else YES if one == other else NO
                found.append(Trial(len(found) + 1, block, (Presentation(one), Presentation(other)), right))
        return found

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        if given["judged"] == SAME:
            return (yes_or_no(SAME, given["question"] or "Were both the same?"),)
        words, ends = given["question"] or "How different were they?", ("the same", "very different")
        return (ask(DISSIMILARITY, Scale(50.0, 0.0, 100.0, doc=words, ends=ends)),)
