"""Free labels: every stimulus once, in random order, named in the participant's own words (thesis 3.4.2)."""

from collections.abc import Mapping, Sequence
from typing import Any

from underfoot.experiments.method import BlockedMethod, StimulusNames
from underfoot.experiments.trials import Trial
from underfoot.parameters import Count, Parameter, Text, ask


class FreeLabels(BlockedMethod):
    """Words for each stimulus. The experimenter sorts them by hand afterwards, in the table of trials.

    Participants do not see the sorts: they would name what is asked for.
    """

    kind, name = "free-labels", "Free labels"
    about = (
        "Each stimulus is named in the participant's own words; the words are sorted afterwards, and the sorts counted."
    )
    named = StimulusNames((), doc="What is named.")
    repeats = Count(1, 1, 100, doc="How often each one comes.")
    question = Text("What does it remind you of?", doc="What is asked after each one.")
    sorts = Text("", doc="What labels are sorted into afterwards, joined by commas; the first is counted.")

    def listed(self) -> Sequence[Trial]:
        right = {name: self.stimuli[name].correct for name in self.given["named"]}
        return self.in_blocks(self.given["named"], self.given["repeats"], right=right)

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        return (ask("label", Text("", doc=given["question"])),)


def sorts_of(given: Mapping[str, Any]) -> list[str]:
    """Return what labels are sorted into; none, where nothing is said of it.

    >>> sorts_of({"sorts": "impact, hum,"})
    ['impact', 'hum']
    """
    return [part.strip() for part in str(given.get("sorts", "")).split(",") if part.strip()]
