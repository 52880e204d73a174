"""Up-down staircases: the level follows the answers, to where a share of them, such as half, are yes (thesis 6.3).

Levitt, Transformed up-down methods in psychoacoustics, J. Acoust. Soc. Am. 49 (1971); steps up of another size than
those down after Kaernbach, Percept. Psychophys. 49 (1991); catch trials and restarts as in the thesis, after Lecluyse
and Meddis (2009).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from underfoot.errors import require
from underfoot.experiments.latin_square import ANYONE, Turn
from underfoot.experiments.method import Method, StimulusName, StimulusNames
from underfoot.experiments.questions import FIRST, SECOND, WHICH_FELT, YES, felt_or_stronger
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.experiments.trials import NOTHING, Answers, Presentation, Trial
from underfoot.parameters import Choice, Count, Number, Numbers, Parameter, Text

if TYPE_CHECKING:
    from underfoot.experiments.stimuli import Stimulus

ABOVE, BELOW = "above", "below"
PAIR, ALL = "pair", "all"
PSE, THRESHOLD = "pse", "threshold"
"""What the level tends to: beside a standard that vibrates the point of subjective equality, else the threshold."""
MOST_RESTARTS = 20
"""Number of restarts of a block after false alarms; afterwards they are ignored."""


@dataclass
class Staircase:
    """One staircase: its level, its direction, and the levels of its reversals."""

    level_db: float
    direction: int = 0
    in_a_row: int = 0
    trials: int = 0
    reversals_db: list[float] = field(default_factory=list)


GUESSED = 0.5
"""Share of right guesses of two intervals."""
_TRIALS_OF_REVERSAL = 1.6
"""Mean number of trials between reversals, over simulated people, with one answer per step."""


class Staircases(Method):
    """Pairs of staircases, one from above and one from below, randomly interleaved; a block is one pair, or one of each
    stimulus. A yes to nothing begins those of the block anew.

    Each stimulus has `pairs` pairs. With a standard, a trial has two intervals, and yes means that the comparison was
    judged greater; if nothing vibrates in the standard, yes means that it was found. Without one, yes means that the
    participant felt the stimulus.
    """

    kind, name = "staircases", "Up-down staircases"
    about = "The level goes down after a yes and up after a no; where it turns tells the threshold or the equal level."
    followed = StimulusNames((), doc="Whose level moves.", moved=True)
    standard = StimulusName("", doc="What it is compared with; none: one interval, yes or no.")
    pairs = Count(1, 1, 20, doc="Pairs of staircases of each stimulus, from above and from below.")
    interleaved = Choice(
        PAIR, options=(PAIR, ALL), doc="What takes turns at random in a block: one pair, or one of all stimuli."
    )
    above_db = Numbers((8.0, 15.0), -60.0, 60.0, doc="From where to where one begins, re the level.", least=2, most=2)
    below_db = Numbers((-15.0, -8.0), -60.0, 60.0, doc="And the other.", least=2, most=2)
    steps_db = Numbers((10.0, 3.0), 0.01, 40.0, doc="How far it goes: first, and after each change.", unit="dB")
    up_steps = Number(1.0, 0.1, 10.0, doc="A step up, in steps down: 3 tends to where 75 % are yes.")
    change_after = Count(2, 1, 50, doc="Reversals until the next step size.")
    down_after = Count(1, 1, 10, doc="Answers of yes in a row until it goes down.")
    up_after = Count(1, 1, 10, doc="Answers of no in a row until it goes up.")
    reversals = Count(12, 2, 100, doc="Reversals of each staircase.")
    last = Count(8, 1, 100, doc="Reversals that count, the last ones.")
    catch_share = Number(0.0, 0.0, 0.5, doc="Share of trials in which there is nothing; without a standard only.")
    empty_every = Count(0, 0, 1000, doc="Every so manyth trial is announced as empty; 0: none. As catch trials.")
    lowest_db = Number(-60.0, -120.0, 0.0, doc="No lower than this.", unit="dB")
    highest_db = Number(24.0, 0.0, 60.0, doc="No higher than this.", unit="dB")
    most_trials = Count(120, 10, 10000, doc="A staircase that has not ended after so many is given up.")
    question = Text("", doc="What is asked after each trial; empty: what is usual, with a standard or without.")

    def __init__(
        self, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]", draws: SeededRandom, turn: Turn = ANYONE
    ) -> None:
        super().__init__(given, stimuli, draws, turn)
        pairs = draws.shuffled([(name,) for name in given["followed"]] * given["pairs"])
        self._blocks = [tuple(given["followed"])] * given["pairs"] if given["interleaved"] == ALL else pairs
        self._block = self._number = self._restarts = 0
        self._staircases: dict[tuple[str, str], Staircase] = {}
        self._trial: Trial | None = None
        self._begin_block()

    @classmethod
    def checked(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> dict[str, Any]:
        values = super().checked(given, stimuli)
        usual = WHICH_FELT if is_silent(values, stimuli) else ""  # in the other one there is nothing
        return values | {"question": values["question"] or usual}

    @classmethod
    def check_together(cls, given: Mapping[str, Any]) -> None:
        require(given["last"] <= given["reversals"], "last", given["last"], f"up to reversals, {given['reversals']}")
        for name in ("above_db", "below_db"):
            low, high = given[name]
            inside = given["lowest_db"] <= low <= high <= given["highest_db"]
            require(inside, name, [low, high], "the lower first, between lowest_db and highest_db")

    @classmethod
    def require_meaning(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> None:
        if not given["standard"]:
            return
        for name in ("catch_share", "empty_every"):
            require(not given[name], name, given[name], "0 with a standard: a trial of nothing has no two intervals")
        allowed = "2 or more, or up_steps above 1, where the standard is no vibration: half of the guesses are right"
        found = is_silent(given, stimuli) and balanced_share(given) <= GUESSED
        require(not found, "down_after", given["down_after"], allowed)

    @classmethod
    def peak_gains_db(cls, given: Mapping[str, Any]) -> dict[str, float]:
        return super().peak_gains_db(given) | dict.fromkeys(given["followed"], given["highest_db"])

    @classmethod
    def moved(cls, given: Mapping[str, Any]) -> Sequence[str]:
        return tuple(given["followed"])

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        return (felt_or_stronger(given["question"], are_two=bool(given["standard"])),)

    @classmethod
    def usual_trials(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> tuple[int, int]:
        pairs = given["pairs"] * len(given["followed"])
        blocks = given["pairs"] if given["interleaved"] == ALL else pairs
        up = given["up_steps"]
        answers = 0.5 * (given["down_after"] + given["up_after"]) * _TRIALS_OF_REVERSAL * (1.0 + up) ** 2 / (4.0 * up)
        moving = (1.0 - given["catch_share"]) * (1.0 - 1.0 / given["empty_every"] if given["empty_every"] else 1.0)
        return round(2 * pairs * given["reversals"] * answers / max(moving, 0.1)), blocks

    @property
    def trial(self) -> Trial | None:
        return self._trial

    @property
    def share(self) -> float:
        if self._trial is None:
            return 1.0
        wanted = len(self._staircases) * self.given["reversals"]
        done = sum(self._progress(staircase) for staircase in self._staircases.values())
        return min((self._block - 1 + done / wanted) / len(self._blocks), 1.0)

    def answer(self, answers: Answers) -> None:
        trial = self._awaited()
        said_yes = is_yes(trial.facts, answers)
        if trial.facts.get("catch"):
            if said_yes and self._restarts < MOST_RESTARTS:
                self._restarts += 1
                self._begin_staircases()
        elif not trial.facts.get("announced"):
            facts = trial.facts
            move(self._staircases[str(facts["comparison"]), str(facts["staircase"])], said_yes, self.given)
        if not self._open():
            self._begin_block()
        else:
            self._trial = self._next()

    def _begin_block(self) -> None:
        """Begin the next block; end the method after the last one."""
        if self._block == len(self._blocks):
            self._trial = None
            return
        self._block, self._restarts = self._block + 1, 0
        self._begin_staircases()
        self._trial = self._next()

    def _begin_staircases(self) -> None:
        """Begin both staircases of each stimulus of the block."""
        starts = {ABOVE: self.given["above_db"], BELOW: self.given["below_db"]}
        self._staircases = {
            (stimulus, which): Staircase(self.draws.uniform(*range_db))
            for stimulus in self._blocks[self._block - 1]
            for which, range_db in starts.items()
        }

    def _next(self) -> Trial:
        """Return a trial of a randomly drawn open staircase, or a catch trial."""
        self._number += 1
        every = self.given["empty_every"]
        if every and self._number % every == 0:
            return Trial(self._number, self._block, (Presentation(NOTHING),), facts={"announced": True})
        if self.draws.happens(self.given["catch_share"]):
            nothing = (Presentation(NOTHING),)
            return Trial(self._number, self._block, nothing, facts={"catch": True, "run": self._restarts})
        stimulus, which = self.draws.one_of(self._open())
        level = round(self._staircases[stimulus, which].level_db, 6)
        comparison = Presentation(stimulus, level)
        facts: dict[str, int | float | str] = {
            "staircase": which,
            "run": self._restarts,
            "comparison": stimulus,
            "level_db": level,
        }
        if not self.given["standard"]:
            return Trial(self._number, self._block, (comparison,), facts=facts)
        first = self.draws.happens(0.5)
        both = (comparison, Presentation(self.given["standard"]))
        facts["comparison_at"] = at = FIRST if first else SECOND
        right = at if is_silent(self.given, self.stimuli) else ""
        return Trial(self._number, self._block, both if first else both[::-1], right, facts)

    def _open(self) -> list[tuple[str, str]]:
        wanted = self.given["reversals"]
        return [key for key, staircase in self._staircases.items() if self._progress(staircase) < wanted]

    def _progress(self, staircase: Staircase) -> int:
        """Return the number of reversals so far; the full number for an abandoned staircase."""
        wanted: int = self.given["reversals"]
        return wanted if staircase.trials >= self.given["most_trials"] else min(len(staircase.reversals_db), wanted)


def move(staircase: Staircase, said_yes: bool, given: Mapping[str, Any]) -> None:
    """Move a staircase by one step after enough equal answers, and store reversals."""
    way = -1 if said_yes else 1
    staircase.trials += 1
    staircase.in_a_row = staircase.in_a_row + way if staircase.in_a_row * way > 0 else way
    if abs(staircase.in_a_row) < (given["down_after"] if said_yes else given["up_after"]):
        return
    staircase.in_a_row = 0
    if staircase.direction == -way:
        staircase.reversals_db.append(staircase.level_db)
    staircase.direction = way
    steps = given["steps_db"]
    step = steps[min(len(staircase.reversals_db) // given["change_after"], len(steps) - 1)]
    step *= 1.0 if said_yes else given["up_steps"]
    staircase.level_db = min(max(staircase.level_db + way * step, given["lowest_db"]), given["highest_db"])


def balanced_share(given: Mapping[str, Any]) -> float:
    """Return the share of yes at which a staircase goes down as far as up: after a run of so many yes, or of no.

    >>> rules = ((1, 1, 1.0), (2, 1, 1.0), (3, 1, 1.0), (1, 1, 3.0))
    >>> [balanced_share(dict(down_after=d, up_after=u, up_steps=s)) for d, u, s in rules]
    [0.5, 0.707107, 0.793701, 0.75]
    """
    low, high = 0.0, 1.0
    for _ in range(50):
        yes = 0.5 * (low + high)
        down = yes ** (given["down_after"] - 1) * (1.0 - (1.0 - yes) ** given["up_after"])
        up = (1.0 - yes) ** (given["up_after"] - 1) * (1.0 - yes ** given["down_after"])
        low, high = (yes, high) if down < up * given["up_steps"] else (low, yes)
    return round(0.5 * (low + high), 6)


def is_silent(given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> bool:
    """Return whether there is a standard, and nothing vibrates in it: which interval had something is guessed."""
    return bool(given.get("standard")) and not stimuli[given["standard"]].patch


def is_yes(facts: Mapping[str, Any], answers: Mapping[str, Any]) -> bool:
    """Return whether the participant felt the stimulus, or judged the comparison as greater."""
    if answers.get("felt"):
        return bool(answers["felt"] == YES)
    return bool(answers.get("interval") and answers["interval"] == facts.get("comparison_at"))
