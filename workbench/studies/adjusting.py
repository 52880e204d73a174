"""A number that a participant moves while it is felt, until it is what the question asks for."""

from collections.abc import Callable

from underfoot.experiments.questions import Adjusted, unmoved
from underfoot.experiments.trials import Answers
from underfoot.patch.patch import Patch


class Adjusting:
    """The value that is felt now, from the question's default on, or the standard. Each change is presented at once."""

    def __init__(
        self,
        question: Adjusted,
        patch_at: Callable[[float], Patch],
        present: Callable[[Patch], object],
        standard: Patch | None = None,
    ) -> None:
        """Begin at the question's default; `patch_at` returns what is felt at a value, and `present` plays it."""
        self.question, self._patch_at, self._present, self.standard = question, patch_at, present, standard
        self.is_at_standard = False
        """Whether the standard is felt now."""
        self.standard_plays = 0
        self.value: float = question.default
        self.changes = 0
        """How many steps have changed the value."""
        self.is_held = False
        """Whether the last step would have led beyond the range."""

    @property
    def patch(self) -> Patch:
        """What is to be felt now."""
        if self.standard is not None and self.is_at_standard:
            return self.standard
        return self._patch_at(self.value)

    def move(self, way: int, *, is_fine: bool) -> None:
        """Move the value by a step up (`way` 1) or down (-1), as far as its range goes; it is felt from then on."""
        self.is_at_standard = False
        before, self.value = self.value, self.question.moved(self.value, way, is_fine=is_fine)
        self.is_held = before == self.value
        self.changes += not self.is_held
        self.play()

    def switch(self) -> None:
        """Present the standard, or what is moved after it; without a standard what is moved once more."""
        self.is_at_standard = self.standard is not None and not self.is_at_standard
        self.standard_plays += self.is_at_standard
        self.is_held = False
        self.play()

    def play(self) -> None:
        """Present what is to be felt now."""
        self._present(self.patch)

    @property
    def answers(self) -> Answers:
        """The answer to the question; raise `BadValue` before anything was moved: its default is no answer."""
        if not self.changes:
            raise unmoved(self.question)
        return {self.question.name: self.value}
