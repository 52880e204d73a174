"""Method of adjustment: the participant moves what is felt until it is right (Gescheider 1997, chapter 3).

It gives a threshold or, beside a standard, a point of subjective equality (Kingdom and Prins 2016, chapter 3).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from msgspec import structs

from underfoot.errors import require
from underfoot.experiments.method import BlockedMethod, StimulusName, StimulusNames
from underfoot.experiments.methods.staircases import is_silent
from underfoot.experiments.questions import Adjusted
from underfoot.experiments.trials import Presentation, Trial
from underfoot.parameters import Count, Numbers, Parameter, Text, ask

if TYPE_CHECKING:
    from underfoot.experiments.stimuli import Stimulus

ASCENDING, DESCENDING = "ascending", "descending"
"""Series that begin below what is sought, and above."""
LEVEL_DB, SET_TO = "level_db", "set_to"
"""The answer: a level in dB re the stimulus's, or the value of another number in its own unit."""
_RANGE_DB = (-120.0, 60.0)


class Adjustment(BlockedMethod):
    """Every stimulus twice per block, once from above and once from below, in random order.

    With a standard, the participant can feel it in between as often as they like.
    """

    kind, name = "adjustment", "Method of adjustment"
    about = (
        "The participant moves the level, or another number of the patch, until it is just felt, or feels like a "
        "standard; the threshold or equal value, its spread, and what the start does to it come of that."
    )
    followed = StimulusNames((), doc="What is moved.", moved=True)
    standard = StimulusName("", doc="What it is to feel like; none: until it is just felt.")
    parameter = Text(
        "", doc="What moves: a number of the patch, as node.parameter; empty: the level.", label="Instead of level"
    )
    blocks = Count(5, 1, 1000, doc="Every stimulus comes twice in each: from above, and from below.")
    above = Numbers(
        (8.0, 15.0), -1e6, 1e6, doc="Where one begins, in dB re the level, or in the unit of a number.", least=2, most=2
    )
    below = Numbers((-15.0, -8.0), -1e6, 1e6, doc="And the other.", least=2, most=2)
    reach = Numbers((-40.0, 20.0), -1e6, 1e6, doc="The lowest and the highest that can be set.", least=2, most=2)
    steps = Numbers((2.0, 0.5), 1e-6, 1e6, doc="A large step, and a small one.", least=2, most=2)
    question = Text("", doc="What is asked in each trial; empty: what is usual, with a standard or without.")

    @classmethod
    def check_together(cls, given: Mapping[str, Any]) -> None:
        low, high = given["reach"]
        require(low < high, "reach", [low, high], "the lower first")
        if not given["parameter"]:
            lowest, highest = _RANGE_DB
            require(lowest <= low and high <= highest, "reach", [low, high], f"{lowest:g} to {highest:g} dB")
        for name in ("below", "above"):
            first, last = given[name]
            require(low <= first <= last <= high, name, [first, last], "the lower first, within reach")
        large, small = given["steps"]
        require(small <= large <= high - low, "steps", [large, small], "the large one first, within reach")

    @classmethod
    def require_meaning(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> None:
        standard = given["standard"]
        require(not is_silent(given, stimuli), "standard", standard, "a stimulus that vibrates, or none")
        plates = {stimuli[name].stiffness_n_mm for name in (*given["followed"], standard) if name}
        alike = not standard or len(plates) == 1
        require(alike, "standard", standard, "one on the same plate: both are felt without stepping off")
        places = {name: place_of_standard(name, given, stimuli) for name in given["followed"]} if standard else {}
        below, above = given["below"][1], given["above"][0]
        for name, at in places.items():
            allowed = f"above it: the standard is at {at} on the scale of {name}"
            require(at is None or at <= above, "above", list(given["above"]), allowed)
            require(at is None or below <= at, "below", list(given["below"]), allowed.replace("above", "below", 1))

    @classmethod
    def peak_gains_db(cls, given: Mapping[str, Any]) -> dict[str, float]:
        return super().peak_gains_db(given) | dict.fromkeys(cls.moved(given), given["reach"][1])

    @classmethod
    def moved(cls, given: Mapping[str, Any]) -> Sequence[str]:
        return () if given["parameter"] else tuple(given["followed"])

    @classmethod
    def settings_reached(cls, given: Mapping[str, Any]) -> Sequence[tuple[str, str, float]]:
        ends = given["reach"] if given["parameter"] else ()
        return [(name, given["parameter"], end) for name in given["followed"] for end in ends]

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        low, high = given["reach"]
        name, unit = (SET_TO, "") if given["parameter"] else (LEVEL_DB, "dB")
        moved = {"unit": unit, "steps": given["steps"], "moves": given["parameter"]}
        usual = "Set it to feel like the other one." if given["standard"] else "Set it to where you only just feel it."
        return (ask(name, Adjusted(0.5 * (low + high), low, high, doc=given["question"] or usual, **moved)),)

    @property
    def questions(self) -> tuple[Parameter, ...]:
        """The question of the trial, whose default is where it starts."""
        (question,) = self.questions_for(self.given)
        if self.trial is None:
            return (question,)
        return (ask(question.name, replace(question, default=self.trial.facts["start_at"])),)

    def listed(self) -> Sequence[Trial]:
        trials = self.in_blocks(self.given["followed"], self.given["blocks"], repeats=2)
        series: dict[tuple[int, str], list[str]] = {}
        found = []
        for trial in trials:
            key = trial.block, trial.intervals[0].stimulus
            left = series.setdefault(key, self.draws.shuffled([ASCENDING, DESCENDING]))
            found.append(self._begun(trial, left.pop()))
        return found

    def _begun(self, trial: Trial, series: str) -> Trial:
        """Return a trial of one stimulus with its start, and the standard behind it."""
        name, standard = trial.intervals[0].stimulus, self.given["standard"]
        start = float(f"{self.draws.uniform(*self.given['below' if series == ASCENDING else 'above']):.6g}")
        gain_db = 0.0 if self.given["parameter"] else start
        facts: dict[str, int | float | str | bool] = {"comparison": name, "series": series, "start_at": start}
        if standard and (at := place_of_standard(name, self.given, self.stimuli)) is not None:
            facts["standard_at"] = at
        intervals = (Presentation(name, gain_db), *([Presentation(standard)] if standard else []))
        return structs.replace(trial, intervals=intervals, facts={**facts, **trial.facts})


def place_of_standard(name: str, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> float | None:
    """Return where the standard is on the scale on which a stimulus is moved; None if the protocol does not say it."""
    standard = stimuli[given["standard"]]
    if given["parameter"]:
        value = standard.settings.get(given["parameter"])
        return float(value) if isinstance(value, int | float) else None
    peak, level = standard.peak_m_s2(), stimuli[name].level_m_s2
    return round(20.0 * math.log10(peak / level), 6) if peak and level else None
