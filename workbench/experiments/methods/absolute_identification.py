"""Absolute identification: one stimulus at a time, answered by its number (thesis 3.4)."""

from collections.abc import Mapping, Sequence
from typing import Any

from underfoot.experiments.method import ListedMethod, StimulusNames
from underfoot.experiments.questions import ask
from underfoot.experiments.trials import Presentation, Trial
from underfoot.parameters import Count, Parameter


class AbsoluteIdentification(ListedMethod):
    """Every stimulus `repeats` times in each of `sessions`, in an order of each person's own."""

    kind, name = "absolute-identification", "Absolute identification"
    about = "Stimuli are played one at a time and answered by number; rates, confusions and information come of it."
    identified = StimulusNames((), doc="What is told apart; its number is its place here, from 1.", least=2)
    sessions = Count(6, 1, 100, doc="Each is one block: every stimulus `repeats` times.")
    repeats = Count(2, 1, 100, doc="How often each stimulus comes in a session.")

    def listed(self) -> Sequence[Trial]:
        names = self.given["identified"]
        found: list[Trial] = []
        for session in range(1, self.given["sessions"] + 1):
            for name in self.draws.shuffled([*names] * self.given["repeats"]):
                number = names.index(name) + 1
                found.append(Trial(len(found) + 1, session, (Presentation(name),), number))
        return found

    @classmethod
    def asked(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        most = len(given["identified"])
        return (ask("number", Count(1, 1, most, doc="Which one was it?")),)
