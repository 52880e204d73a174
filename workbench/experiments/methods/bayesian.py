"""Adaptive Bayesian method: QUEST+ selects the most informative level (Watson, J. Vision 17, 2017).

The package questplus, which PsychoPy uses as well, computes it: `pip install "underfoot[adaptive]"`.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from underfoot.errors import BadValue, require
from underfoot.experiments.latin_square import ANYONE, Turn
from underfoot.experiments.method import Method, StimulusName
from underfoot.experiments.questions import FIRST, SECOND, WHICH_FELT, YES, felt_or_stronger
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.experiments.trials import NOTHING, Answers, Presentation, Trial
from underfoot.parameters import Choice, Count, Number, Numbers, Parameter, Text

if TYPE_CHECKING:
    from questplus import QuestPlus

    from underfoot.experiments.stimuli import Stimulus

_SD_DB = tuple(0.5 * 2.0 ** (k / 3.0) for k in range(13))
"""Spreads that are thought of: 0.5 to 8 dB, three to a doubling."""
_LAPSES = (0.0, 0.02, 0.05)


class Bayesian(Method):
    """A fixed number of trials of one stimulus, each at the level with the highest expected information.

    With one interval, the answer is yes or no. With two, one interval has the stimulus and the other nothing; chance is
    0.5.
    """

    kind, name = "bayesian", "Adaptive, Bayesian (QUEST+)"
    about = "Each level is chosen from all answers so far; threshold and slope come of few trials."
    followed = StimulusName("", doc="Whose level moves; the protocol's first one unless named.")
    intervals = Choice("one", options=("one", "two"), doc="One: yes or no. Two: in which of both it was.")
    range_db = Numbers(
        (-24.0, 24.0), -60.0, 60.0, doc="Levels and thresholds, re the stimulus's level.", least=2, most=2
    )
    step_db = Number(1.0, 0.25, 6.0, doc="From one level to the next.", unit="dB")
    trials = Count(40, 5, 1000, doc="How many there are.")
    guesses = Number(0.02, 0.0, 0.5, doc="Share of yes to nothing; with two intervals it is a half.")
    catch_share = Number(0.0, 0.0, 0.5, doc="Share of trials in which there is nothing; one interval only.")
    question = Text("", doc="What is asked after each trial; empty: what is usual, of one interval or two.")

    def __init__(
        self, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]", draws: SeededRandom, turn: Turn = ANYONE
    ) -> None:
        super().__init__(given, stimuli, draws, turn)
        self._stimulus = given["followed"]
        self._quest = quest_of(given)
        self._number = 0
        self._trial: Trial | None = self._next()

    @classmethod
    def check_together(cls, given: Mapping[str, Any]) -> None:
        low, high = given["range_db"]
        apart = 2.0 * given["step_db"]
        require(low + apart <= high, "range_db", [low, high], f"the lower first, {apart:g} dB or more apart")
        require(given["intervals"] == "one" or given["catch_share"] == 0.0, "catch_share", given["catch_share"], "0")

    @classmethod
    def checked(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> dict[str, Any]:
        values = super().checked(given, stimuli)
        return values | {"followed": values["followed"] or next(iter(stimuli))}

    @classmethod
    def peak_gains_db(cls, given: Mapping[str, Any]) -> dict[str, float]:
        return {given["followed"]: given["range_db"][1]}

    @classmethod
    def moved(cls, given: Mapping[str, Any]) -> Sequence[str]:
        return (given["followed"],)

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        are_two = given["intervals"] == "two"
        usual = WHICH_FELT if are_two else ""  # in the other one there is nothing
        return (felt_or_stronger(given["question"] or usual, are_two=are_two),)

    @classmethod
    def usual_trials(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> tuple[int, int]:
        return given["trials"], 1

    @property
    def trial(self) -> Trial | None:
        return self._trial

    @property
    def share(self) -> float:
        done: int = self._number - 1 if self._trial is not None else self._number
        return float(done / self.given["trials"])

    def answer(self, answers: Answers) -> None:
        trial = self._awaited()
        if not trial.facts.get("catch"):
            good = answers["felt"] == YES if "felt" in answers else answers["interval"] == trial.facts["comparison_at"]
            level = {"intensity": float(trial.facts["level_db"])}
            self._quest.update(stim=level, outcome={"response": "Yes" if good else "No"})
        self._trial = self._next() if self._number < self.given["trials"] else None

    def _next(self) -> Trial:
        self._number += 1
        if self.draws.happens(self.given["catch_share"]):
            return Trial(self._number, 1, (Presentation(NOTHING),), facts={"catch": True})
        level = float(self._quest.next_stim["intensity"])
        facts: dict[str, float | str] = {"comparison": self._stimulus, "level_db": level}
        there = (Presentation(self._stimulus, level),)
        if self.given["intervals"] == "one":
            return Trial(self._number, 1, there, facts=facts)
        first = self.draws.happens(0.5)
        facts["comparison_at"] = FIRST if first else SECOND
        nothing = (Presentation(NOTHING),)
        return Trial(self._number, 1, there + nothing if first else nothing + there, FIRST if first else SECOND, facts)


def levels_of(given: Mapping[str, Any]) -> NDArray[np.floating]:
    """Return the levels in dB that are played, and considered as thresholds."""
    low, high = given["range_db"]
    return np.round(np.arange(low, high + 1e-6, given["step_db"]), 6) + 0.0  # and no -0


def quest_of(given: Mapping[str, Any]) -> "QuestPlus":
    """Return QUEST+ with these parameters, before any answer; raise `BadValue` if the package is not installed."""
    try:
        from questplus import QuestPlus
    except ModuleNotFoundError:
        raise BadValue(
            'method is bayesian; it needs the package questplus: pip install "underfoot[adaptive]"'
        ) from None
    levels = levels_of(given)
    guesses = 0.5 if given["intervals"] == "two" else given["guesses"]
    return QuestPlus(
        stim_domain={"intensity": levels},
        param_domain={
            "mean": levels,
            "sd": np.array(_SD_DB),
            "lower_asymptote": np.array([guesses]),
            "lapse_rate": np.array(_LAPSES),
        },
        outcome_domain={"response": ["Yes", "No"]},
        func="norm_cdf",
        stim_scale="linear",
        stim_selection_method="min_entropy",
        param_estimation_method="mean",
    )
