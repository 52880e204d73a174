"""Absolute identification: one stimulus at a time, answered with its number (thesis 3.4), or one of several words."""

from collections.abc import Mapping, Sequence
from typing import Any

from underfoot.errors import require
from underfoot.experiments.declared import TextLine
from underfoot.experiments.method import BlockedMethod, StimulusNames
from underfoot.experiments.trials import Trial
from underfoot.parameters import Choice, Count, Parameter, Text, ask


class AbsoluteIdentification(BlockedMethod):
    """Every stimulus `repeats` times in each of `sessions`, in an order drawn for each participant.

    With `answers`, the participant chooses one of these words, and the right one is the stimulus's `correct`; several
    stimuli can share a right answer. Without `answers`, the right answer is the number of the stimulus.
    """

    kind, name = "absolute-identification", "Absolute identification"
    about = (
        "Stimuli are played one at a time and answered by number, or by one of some words; rates, confusions and "
        "information come of it."
    )
    identified = StimulusNames((), doc="What is told apart; its number is its place here, from 1.", least=2)
    answers = TextLine((), doc="Words to choose from; each stimulus has its right answer. None: the stimulus's number.")
    question = Text("Which one was it?", doc="What is asked after each trial.")
    sessions = Count(6, 1, 100, doc="Each is one block, with every stimulus as often as repeats says.")
    repeats = Count(2, 1, 100, doc="How often each stimulus comes in a session.")

    def listed(self) -> Sequence[Trial]:
        names, has_words = self.given["identified"], bool(self.given["answers"])
        right = {name: self.stimuli[name].correct if has_words else place for place, name in enumerate(names, 1)}
        return self.in_blocks(names, self.given["sessions"], self.given["repeats"], right)

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        question, labels = given["question"], given["answers"]
        if labels:
            return (ask("answer", Choice(labels[0], options=labels, doc=question)),)
        return (ask("number", Count(1, 1, len(given["identified"]), doc=question)),)

    @classmethod
    def check_together(cls, given: Mapping[str, Any]) -> None:
        """Raise `BadValue` for a single answer, which leaves no choice."""
        require(len(given["answers"]) != 1, "answers", list(given["answers"]), "two or more, or none")

    @classmethod
    def right_answers(cls, given: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the words; every stimulus needs one, because rates are shares of right answers."""
        return tuple(given["answers"])
