"""Base class of simulated participants: observers that answer the trials of some methods.

Parameters are declared as those of methods. All random numbers come from one generator.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from underfoot.errors import BadValue
from underfoot.experiments.protocol import Protocol, Stage
from underfoot.experiments.trials import Answers, Trial
from underfoot.parameters import Parameter, declared_in


class Observer(ABC):
    """A simulated participant for the trials of one stage."""

    methods: ClassVar[tuple[str, ...]]
    parameters: ClassVar[dict[str, Parameter]]

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls.parameters = getattr(cls, "parameters", {}) | declared_in(cls)

    def __init__(self, truth: Mapping[str, float], protocol: Protocol, stage: Stage, place: float = 0.0) -> None:
        """Set the observer's parameters from `truth`; names of other observers' parameters are ignored.

        `place` is this person's distance from the mean over people, in standard deviations.
        """
        self.truth = {name: p.check(truth.get(name, p.default)) for name, p in self.parameters.items()}
        self.protocol, self.place = protocol, place
        use = stage.method
        if use is None:
            raise BadValue(f"stage {stage.id!r} has no trials to answer")
        self.given: dict[str, Any] = use.given(protocol.stimuli)

    @abstractmethod
    def answer(self, trial: Trial, random: np.random.Generator) -> Answers:
        """Return the answers to a trial, drawn from `random`."""

    @abstractmethod
    def truths(self) -> dict[str, float]:
        """Return the expected values of the estimates, by the analysis's names."""

    def used(self) -> Sequence[str]:
        """Return the names of the parameters that these answers depend on, of those of all protocols."""
        return tuple(self.parameters)
