"""Base classes of methods: state machines that select the next trial and take its answer.

Each file in `methods/` declares one subclass of `Method`, with parameters declared as those of nodes. A method has no
access to a window or clock. Its state depends only on its parameters, the random draws and the answers so far. An
interrupted session therefore resumes by replaying its answers.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

from underfoot.errors import BadValue, require
from underfoot.experiments.declared import TextLine
from underfoot.experiments.latin_square import ANYONE, Turn, row_of, rows_of
from underfoot.experiments.questions import FIRST, NO, SECOND, YES
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.experiments.trials import Answers, Presentation, Trial, is_right
from underfoot.parameters import Choice, Parameter, declared_in
from underfoot.phrases import Phrase

if TYPE_CHECKING:
    from underfoot.experiments.stimuli import Stimulus

DRAWN, COUNTERBALANCED = "drawn", "counterbalanced"
FOOT, RIGHT, LEFT, ASKED = "foot", "right", "left", "asked"
"""The question which foot somebody prefers, its answers, and the choice of the foot that was answered."""
BLOCK_ROW = "block_row"
"""The fact of a trial that is the row of its block in a Latin square, from 1."""


@dataclass(frozen=True)
class StimulusNames(TextLine):
    """Names of stimuli of the protocol, at least `least`; an empty list means all stimuli, in their order.

    Of stimuli that are `moved`, it means all that vibrate: what is nothing, as in catch trials, cannot be moved.
    """

    least: int = field(default=1, kw_only=True)
    moved: bool = field(default=False, kw_only=True)
    kind: ClassVar[str] = "stimuli"

    @property
    def allowed(self) -> str:
        return "a list of names of stimuli, each once"


@dataclass(frozen=True)
class StimulusName(Parameter):
    """The name of one stimulus of the protocol; "" means none."""

    kind: ClassVar[str] = "stimulus"

    @property
    def allowed(self) -> str:
        return "the name of a stimulus"

    def check(self, value: object) -> str:
        if not isinstance(value, str):
            raise self.refuse(value)
        return value


class Method(ABC):
    """A running method. `kind` is its name in files; `name` and `about` are shown to people."""

    kind: ClassVar[str]
    name: ClassVar[str]
    about: ClassVar[str]
    """What is asked and what comes of it, in two or three sentences."""
    uses_stimuli: ClassVar[bool] = True
    """Whether it needs stimuli of the protocol."""
    side: ClassVar[str] = ""
    """The parameter that says for which foot it is, where the rows of trials are alike for either: else ""."""
    parameters: ClassVar[dict[str, Parameter]]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        inherited = getattr(cls, "parameters", {})
        own = declared_in(cls)
        cls.parameters = own | {name: v for name, v in inherited.items() if name not in own}

    def __init__(
        self, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]", draws: SeededRandom, turn: Turn = ANYONE
    ) -> None:
        """Store `given`, checked parameters as `checked` returns them, and begin at the first trial.

        `turn` is the participant's, by which orders are counterbalanced.
        """
        self.given, self.stimuli, self.draws, self.turn = given, stimuli, draws, turn

    @classmethod
    def checked(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> dict[str, Any]:
        """Return all parameters, with defaults for those not in `given`; raise `BadValue` for an invalid value."""
        known = ", ".join(cls.parameters)
        for name in given:
            require(name in cls.parameters, "parameters", name, f"the parameters of {cls.kind}: {known}")
        values = {name: p.check(given.get(name, p.default)) for name, p in cls.parameters.items()}
        require(bool(stimuli) or not cls.uses_stimuli, "stimuli", {}, f"at least one; {cls.kind} presents them")
        for name, parameter in cls.parameters.items():
            if isinstance(parameter, StimulusNames):
                those = [one for one in stimuli if stimuli[one].patch] if parameter.moved else []
                values[name] = values[name] or tuple(those or stimuli)
                require(len(values[name]) >= parameter.least, name, values[name], f"at least {parameter.least} stimuli")
        for name, one in cls._stimuli_in(values):
            is_none = one == "" == cls.parameters[name].default
            require(one in stimuli or is_none, name, one, f"the stimuli: {', '.join(stimuli)}")
        cls.check_together(values)
        return values

    @classmethod  # noqa: B027 - most methods have no such rule
    def check_together(cls, given: Mapping[str, Any]) -> None:
        """Raise `BadValue` for parameters that are valid alone but not in combination."""

    @classmethod  # noqa: B027 - most methods have no such rule
    def require_meaning(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> None:
        """Raise `BadValue` for checked parameters with which answers would say nothing."""

    @classmethod
    def listed_stimuli(cls, given: Mapping[str, Any]) -> Sequence[str]:
        """Return the stimuli in the first of these parameters that lists some; none without one."""
        return next((given[name] for name, one in cls.parameters.items() if isinstance(one, StimulusNames)), ())

    @classmethod
    def peak_gains_db(cls, given: Mapping[str, Any]) -> dict[str, float]:
        """Return the largest gain in dB re its level with which each presented stimulus can occur, by name."""
        return {one: 0.0 for _, one in cls._stimuli_in(given) if one}

    @classmethod
    def _stimuli_in(cls, given: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
        """Yield each parameter that names stimuli, with each name; "" for none."""
        for name, parameter in cls.parameters.items():
            if isinstance(parameter, StimulusNames):
                yield from ((name, one) for one in given[name])
            elif isinstance(parameter, StimulusName):
                yield name, given[name]

    @classmethod
    def moved(cls, given: Mapping[str, Any]) -> Sequence[str]:
        """Return the stimuli whose level the method moves; these need one."""
        return ()

    @classmethod
    def settings_reached(cls, given: Mapping[str, Any]) -> Sequence[tuple[str, str, float]]:
        """Return the ends to which other numbers than levels are moved: stimulus, "node.parameter", value."""
        return ()

    @classmethod
    @abstractmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        """Return the questions of each trial, for these checked parameters."""

    @classmethod
    @abstractmethod
    def usual_trials(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> tuple[int, int]:
        """Return the approximate numbers of trials and of blocks."""

    @classmethod
    def right_answers(cls, given: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the allowed values of a stimulus's `correct`, "" for none; () if any text is allowed, or it is not
        used.
        """
        return ()

    @property
    def questions(self) -> tuple[Parameter, ...]:
        """The questions of each trial."""
        return self.questions_for(self.given)

    @property
    @abstractmethod
    def trial(self) -> Trial | None:
        """The next trial; None after the last."""

    def _awaited(self) -> Trial:
        """Return the trial that awaits its answer; raise `BadValue` after the last."""
        if self.trial is None:
            raise BadValue(f"{self.name}: all trials are answered")
        return self.trial

    @abstractmethod
    def answer(self, answers: Answers) -> None:
        """Store the checked answers to `trial`, and advance to the next."""

    @property
    @abstractmethod
    def share(self) -> float:
        """The completed share of the trials, 0 to 1; an estimate for adaptive methods."""

    def feedback(self, trial: Trial, answers: Answers) -> str:
        """Return the text shown after an answer if the stage gives feedback; "" if there is no right answer."""
        if trial.correct == "":
            return ""
        if is_right(trial.correct, answers):
            return "The last one: right."
        if trial.correct in (FIRST, SECOND, YES, NO):
            return "The last one: wrong."
        return Phrase("The last one: it was {answer}.", answer=trial.correct)


class ListedMethod(Method):
    """A method whose list of trials is known in advance."""

    def __init__(
        self, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]", draws: SeededRandom, turn: Turn = ANYONE
    ) -> None:
        super().__init__(given, stimuli, draws, turn)
        self.trials = tuple(self.listed())
        self._at = 0

    @classmethod
    def usual_trials(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> tuple[int, int]:
        trials = cls(given, stimuli, SeededRandom(0)).trials
        return len(trials), trials[-1].block if trials else 0

    @abstractmethod
    def listed(self) -> Sequence[Trial]:
        """Return all trials in their order."""

    @property
    def trial(self) -> Trial | None:
        """The next trial; None after the last."""
        return self.trials[self._at] if self._at < len(self.trials) else None

    def answer(self, answers: Answers) -> None:
        """Advance to the next trial."""
        self._awaited()
        self._at += 1

    @property
    def share(self) -> float:
        """The completed share of the trials, 0 to 1."""
        return self._at / max(len(self.trials), 1)


class BlockedMethod(ListedMethod):
    """A method of blocks, in each of which every stimulus comes equally often, in an order of its own."""

    order = Choice(
        DRAWN,
        options=(DRAWN, COUNTERBALANCED),
        doc="In each block: drawn for each participant, or rows of Williams's Latin square, by the number in the id.",
    )

    def in_blocks(
        self, names: Sequence[str], blocks: int, repeats: int = 1, right: Mapping[str, int | str] = MappingProxyType({})
    ) -> list[Trial]:
        """Return trials of one stimulus: each of these names `repeats` times per block; `right` has right answers."""
        drawn = [(block, *one) for block in range(1, blocks + 1) for one in self._block(names, block, repeats)]
        return [
            Trial(number, block, (Presentation(name),), right.get(name, ""), facts)
            for number, (block, name, facts) in enumerate(drawn, 1)
        ]

    def _block(self, names: Sequence[str], block: int, repeats: int) -> list[tuple[str, dict[str, int]]]:
        if self.given["order"] == DRAWN:
            return [(name, {}) for name in self.draws.shuffled([*names] * repeats)]
        own = self.turn.row(len(names)) + (block - 1) * repeats
        rows = [1 + (own - 1 + k) % rows_of(len(names)) for k in range(repeats)]
        return [(names[k], {BLOCK_ROW: row}) for row in rows for k in row_of(len(names), row)]
