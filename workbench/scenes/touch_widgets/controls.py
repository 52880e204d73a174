"""Controls for feet: a button, a toggle and a slider, engaged by force with hysteresis (thesis 5.6)."""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass

from underfoot.experiments.seeded_random import SeededRandom
from underfoot.floor.contacts import OngoingContact
from underfoot.scenes.cues import Cue, Say, Strike
from underfoot.scenes.moments import MOMENT_S, Moment
from underfoot.scenes.shapes import Disc, Shape, Text, box

OFF, ON, WORDS = "#2b3644", "#3fc1c9", "#aebac8"
UP_STRENGTH = 0.6
"""Strength of the click at the release, relative to that at the press."""
RELEASE_SHARE = 0.5
"""A control is released below this share of the force that engages it."""
FAST_M_S = 0.5
"""Speed of a slider from which its slips have full strength."""


@dataclass(frozen=True)
class Feel:
    """Feel of the controls: the force that engages one, and the mean distance between a slider's slips."""

    engage_n: float
    grain_m: float


class Control(ABC):
    """A control at a place, with a size. One contact at a time holds it, until that contact ends."""

    def __init__(self, name: str, x_m: float, y_m: float, width_m: float, height_m: float) -> None:
        self.name, self.x_m, self.y_m, self.width_m, self.height_m = name, x_m, y_m, width_m, height_m
        self.held_by = 0
        """The id of the contact that holds it; 0 for none."""
        self._pressed_m = x_m, y_m

    def step(self, moment: Moment, free: set[int], feel: Feel, draws: SeededRandom) -> Iterator[Cue]:
        """Take the next moment; contacts with ids in `free` hold no control yet."""
        holder = next((contact for contact in moment.contacts if contact.id == self.held_by), None)
        if holder is not None:
            self._pressed_m = holder.x_m, holder.y_m
        if self.held_by and (holder is None or holder.force_n < RELEASE_SHARE * feel.engage_n):
            self.held_by = 0
            yield from self.released()
        elif holder is not None:
            yield from self.moved(holder, moment.began_s, feel, draws)
        else:
            for contact in moment.contacts:
                if contact.id in free and contact.force_n >= feel.engage_n and self.has(contact.x_m, contact.y_m):
                    self.held_by, self._pressed_m = contact.id, (contact.x_m, contact.y_m)
                    free.discard(contact.id)
                    yield from self.pressed(contact)
                    break

    def has(self, x_m: float, y_m: float) -> bool:
        """Return whether a place is on it."""
        return abs(x_m - self.x_m) <= 0.5 * self.width_m and abs(y_m - self.y_m) <= 0.5 * self.height_m

    @property
    def place_m(self) -> tuple[float, float]:
        """Place to press it."""
        return self.x_m, self.y_m

    def click(self, strength: float = 1.0) -> Cue:
        """Return a click under the foot that holds it, on the tile of that foot."""
        return Strike("click", *self._pressed_m, strength)

    @abstractmethod
    def pressed(self, contact: OngoingContact) -> Iterator[Cue]:
        """Respond to a contact that engages it."""

    def moved(self, contact: OngoingContact, began_s: float, feel: Feel, draws: SeededRandom) -> Iterator[Cue]:
        """Respond to the motion of its contact since `began_s`."""
        yield from ()

    def released(self) -> Iterator[Cue]:
        """Respond to the release."""
        yield self.click(UP_STRENGTH)

    @abstractmethod
    def shapes(self) -> Iterator[Shape]:
        """Return its present shapes."""

    def _label(self, text: str) -> Text:
        return Text(self.x_m, self.y_m - 0.5 * self.height_m - 0.022, text, 0.016, WORDS)


class Button(Control):
    """A round button: down while it is held."""

    presses = 0

    def has(self, x_m: float, y_m: float) -> bool:
        return math.hypot(x_m - self.x_m, y_m - self.y_m) <= 0.5 * self.width_m

    def pressed(self, contact: OngoingContact) -> Iterator[Cue]:
        self.presses += 1
        yield self.click()
        yield Say(f"{self.name} down, press {self.presses}")

    def released(self) -> Iterator[Cue]:
        yield from super().released()
        yield Say(f"{self.name} up")

    def shapes(self) -> Iterator[Shape]:
        radius = 0.5 * self.width_m
        yield Disc(self.x_m, self.y_m, radius, ON if self.held_by else OFF)
        yield Disc(self.x_m, self.y_m, radius, ON, rim_m=0.006)
        yield self._label(f"{self.name} {self.presses}")


class Toggle(Control):
    """A switch that changes when it is pressed."""

    is_on = False

    def pressed(self, contact: OngoingContact) -> Iterator[Cue]:
        self.is_on = not self.is_on
        yield self.click()
        yield Say(f"{self.name} {'on' if self.is_on else 'off'}")

    def shapes(self) -> Iterator[Shape]:
        radius = 0.5 * self.height_m
        side = 0.5 * self.width_m - radius
        colour = ON if self.is_on else OFF
        yield box(self.x_m, self.y_m, 2.0 * side, self.height_m, colour)
        for way in (-1.0, 1.0):
            yield Disc(self.x_m + way * side, self.y_m, radius, colour)
        knob = radius - (0.012 if self.held_by else 0.008)
        yield Disc(self.x_m + (side if self.is_on else -side), self.y_m, knob, "#f2f5f8")
        yield self._label(f"{self.name} {'on' if self.is_on else 'off'}")


class Slider(Control):
    """A knob on a track that follows the foot, with slips about every `grain_m`, as on a rough surface."""

    value = 0.5

    def __init__(self, name: str, x_m: float, y_m: float, width_m: float, height_m: float) -> None:
        super().__init__(name, x_m, y_m, width_m, height_m)
        self._offset_m = self._left_m = 0.0

    @property
    def knob_m(self) -> float:
        """Position of the knob, along x."""
        return self.x_m + (self.value - 0.5) * self._way_m

    @property
    def place_m(self) -> tuple[float, float]:
        return self.knob_m, self.y_m

    @property
    def _way_m(self) -> float:
        return self.width_m - self.height_m

    def has(self, x_m: float, y_m: float) -> bool:
        return super().has(x_m, y_m) and abs(x_m - self.knob_m) <= self.height_m

    def pressed(self, contact: OngoingContact) -> Iterator[Cue]:
        self._offset_m, self._left_m = self.knob_m - contact.x_m, 0.0
        yield self.click()

    def moved(self, contact: OngoingContact, began_s: float, feel: Feel, draws: SeededRandom) -> Iterator[Cue]:
        before = self.value
        at_m = contact.x_m + self._offset_m
        self.value = min(max((at_m - self.x_m) / self._way_m + 0.5, 0.0), 1.0)
        way_m = abs(self.value - before) * self._way_m
        strength = min(way_m / MOMENT_S / FAST_M_S, 1.0)
        left_m = way_m
        while self._left_m < left_m:
            left_m -= self._left_m
            self._left_m = feel.grain_m * draws.uniform(0.5, 1.5)
            after_s = MOMENT_S * (1.0 - left_m / way_m)
            yield Strike("slip", contact.x_m, contact.y_m, 0.2 + 0.8 * strength, began_s + after_s)
        self._left_m -= left_m

    def released(self) -> Iterator[Cue]:
        yield from super().released()
        yield Say(f"{self.name} at {100.0 * self.value:.0f} %")

    def shapes(self) -> Iterator[Shape]:
        radius = 0.5 * self.height_m
        half = 0.5 * self._way_m
        yield box(self.x_m, self.y_m, 2.0 * half, 0.25 * self.height_m, OFF)
        begin_m = self.x_m - half
        yield box(0.5 * (begin_m + self.knob_m), self.y_m, self.knob_m - begin_m, 0.25 * self.height_m, ON)
        yield Disc(self.knob_m, self.y_m, radius, ON if self.held_by else "#f2f5f8")
        yield self._label(f"{self.name} {100.0 * self.value:.0f} %")
