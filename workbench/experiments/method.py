"""A method: a state machine that says which trial comes next, and takes its answer. It knows no screen and no clock.

Each file in `methods/` declares one: a subclass of `Method` whose parameters are declared as those of nodes are. All
that a method does depends on its parameters, the draws that it is given and the answers so far: fed with the same
answers again, it stands where it stood. That is how a session that was interrupted goes on.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

from underfoot.errors import BadValue, require
from underfoot.experiments.declared import TextLine
from underfoot.experiments.questions import FIRST, NO, SECOND, YES
from underfoot.experiments.seeded_random import SeededRandom
from underfoot.experiments.trials import Answers, Trial, is_right
from underfoot.parameters import Parameter

if TYPE_CHECKING:
    from underfoot.experiments.stimuli import Stimulus


@dataclass(frozen=True)
class StimulusNames(TextLine):
    """Names of stimuli of the protocol, at least `least`; none stands for all of them, in their order."""

    least: int = field(default=1, kw_only=True)
    kind: ClassVar[str] = "stimuli"

    @property
    def allowed(self) -> str:
        return "a list of names of stimuli, each once"


@dataclass(frozen=True)
class StimulusName(Parameter):
    """The name of one stimulus of the protocol; "" stands for none."""

    kind: ClassVar[str] = "stimulus"

    @property
    def allowed(self) -> str:
        return "the name of a stimulus"

    def check(self, value: Any) -> str:
        if not isinstance(value, str):
            raise self.refuse(value)
        return value


class Method(ABC):
    """One method at work. `kind` is its name in files; `name`, `about` are for people."""

    kind: ClassVar[str]
    name: ClassVar[str]
    about: ClassVar[str]
    """What is asked and what comes of it, in two or three sentences."""
    uses_stimuli: ClassVar[bool] = True
    """Whether it needs stimuli of the protocol."""
    parameters: ClassVar[dict[str, Parameter]]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        inherited = getattr(cls, "parameters", {})
        cls.parameters = inherited | {name: v for name, v in vars(cls).items() if isinstance(v, Parameter)}

    def __init__(self, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]", draws: SeededRandom) -> None:
        """`given` are checked parameters, as `checked` returns them."""
        self.given, self.stimuli, self.draws = given, stimuli, draws

    @classmethod
    def checked(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> dict[str, Any]:
        """All parameters, those that are not given by default; `BadValue` for what cannot be."""
        known = ", ".join(cls.parameters)
        for name in given:
            require(name in cls.parameters, "parameters", name, f"the parameters of {cls.kind}: {known}")
        values = {name: p.check(given.get(name, p.default)) for name, p in cls.parameters.items()}
        require(bool(stimuli) or not cls.uses_stimuli, "stimuli", {}, f"at least one; {cls.kind} presents them")
        for name, parameter in cls.parameters.items():
            if isinstance(parameter, StimulusNames):
                values[name] = values[name] or tuple(stimuli)
                require(len(values[name]) >= parameter.least, name, values[name], f"at least {parameter.least} stimuli")
            named = values[name] if isinstance(parameter, StimulusNames) else (values[name],)
            if isinstance(parameter, StimulusNames | StimulusName):
                for one in named:
                    have = ", ".join(stimuli)
                    require(one in stimuli or (one == "" == parameter.default), name, one, f"the stimuli: {have}")
        cls.check_together(values)
        return values

    @classmethod  # noqa: B027 - most have nothing to look at
    def check_together(cls, given: Mapping[str, Any]) -> None:
        """Raise `BadValue` for parameters that are good alone and cannot be together."""

    @classmethod
    def names_stimuli(cls, parameter: str) -> bool:
        """Whether a parameter is a list of stimuli."""
        return isinstance(cls.parameters[parameter], StimulusNames)

    @classmethod
    def peak_gains_db(cls, given: Mapping[str, Any]) -> dict[str, float]:
        """How far above its level, in dB, each stimulus can be presented, of those that are."""
        found: dict[str, float] = {}
        for name, parameter in cls.parameters.items():
            named = given[name] if isinstance(parameter, StimulusNames) else (given[name],)
            if isinstance(parameter, StimulusNames | StimulusName):
                found |= dict.fromkeys((one for one in named if one), 0.0)
        return found

    @classmethod
    @abstractmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        """What is asked in each trial, with these checked parameters."""

    @classmethod
    @abstractmethod
    def usual_trials(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> tuple[int, int]:
        """About how many trials there are, and in how many blocks."""

    @classmethod
    def right_answers(cls, given: Mapping[str, Any]) -> tuple[str, ...]:
        """What `correct` of a stimulus can be, "" for none; () for any words, or where it is not looked at."""
        return ()

    @property
    def questions(self) -> tuple[Parameter, ...]:
        """What is asked in each trial."""
        return self.questions_for(self.given)

    @property
    @abstractmethod
    def trial(self) -> Trial | None:
        """The trial that comes next; None when all is done."""

    @abstractmethod
    def answer(self, answers: Answers) -> None:
        """Take the checked answers of `trial`, and go on to the next."""

    @property
    @abstractmethod
    def share(self) -> float:
        """How much is done, 0 to 1; where it depends on the answers, as far as that can be told."""

    def feedback(self, trial: Trial, answers: Answers) -> str:
        """What is shown after an answer where the stage gives feedback; "" where there is no right answer."""
        if trial.correct == "":
            return ""
        if is_right(trial.correct, answers):
            return "Right."
        return "Wrong." if trial.correct in (FIRST, SECOND, YES, NO) else f"It was {trial.correct}."


class ListedMethod(Method):
    """A method whose trials are all known beforehand: a list, one after the other."""

    def __init__(self, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]", draws: SeededRandom) -> None:
        super().__init__(given, stimuli, draws)
        self.trials = tuple(self.listed())
        self._at = 0

    @classmethod
    def usual_trials(cls, given: Mapping[str, Any], stimuli: "Mapping[str, Stimulus]") -> tuple[int, int]:
        trials = cls(given, stimuli, SeededRandom(0)).trials
        return len(trials), trials[-1].block if trials else 0

    @abstractmethod
    def listed(self) -> Sequence[Trial]:
        """All trials in their order."""

    @property
    def trial(self) -> Trial | None:
        """The trial that comes next; None when all is done."""
        return self.trials[self._at] if self._at < len(self.trials) else None

    def answer(self, answers: Answers) -> None:
        """Go on to the next trial."""
        if self.trial is None:
            raise BadValue(f"{self.name}: all trials are answered")
        self._at += 1

    @property
    def share(self) -> float:
        """How much is done, 0 to 1."""
        return self._at / max(len(self.trials), 1)
