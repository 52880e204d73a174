"""Target selection as a stage (thesis 5.6.1): round buttons to be pressed with a foot before they vanish."""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from underfoot.experiments.method import LEFT, RIGHT
from underfoot.experiments.methods.target_selection import TargetSelection as Method
from underfoot.experiments.questions import YES
from underfoot.experiments.trials import Trial
from underfoot.floor.layout import Floor
from underfoot.parameters import Count, Number
from underfoot.scenes.cues import Cue, Say, Strike
from underfoot.scenes.moments import Moment
from underfoot.scenes.scene import Scene
from underfoot.scenes.shapes import Disc, Shape, Text, box
from underfoot.studies.target import SELECTED_M, FloorTarget

TARGET, HIT, FEET, WORDS = "#f0a63c", "#ffffff", "#8d99a8", "#aebac8"
FOOT_M = (0.09, 0.24)
FEET_APART_M = 0.16
SEAM_M = 0.005
"""Largest distance from a tile at which a place counts as on the floor, for the gaps between tiles."""


class TargetSelection(Scene):
    """The method's buttons, one after the other; shows hits, misses and times."""

    title = "Target selection"
    doc = (
        "Round buttons of several widths, distances and bearings appear one after the other, as in the study; each is "
        "pressed with a foot before it vanishes. Hits, misses and times are shown; to keep them, run the study."
    )
    widths_m = replace(Method.widths_m, label="Widths, m")
    distances_m = replace(Method.distances_m, label="Distances, m")
    bearings_deg = replace(Method.bearings_deg, label="Bearings, °")
    preferred_foot = replace(Method.preferred_foot, options=(RIGHT, LEFT), doc="Bearings count away from it.")
    force_n = replace(Method.force_n, label="Force")
    visible_s = replace(Method.visible_s, label="Visible for")
    pause_s = Number(1.0, 0.0, 60.0, unit="s", label="Pause", doc="from a button's end to the next one")
    repeats = Count(1, 1, 100, doc="how often each button comes; this and those above from the next start on")

    def __init__(self, floor: Floor, given: Mapping[str, Any] | None = None, seed: int = 1) -> None:
        super().__init__(floor, given, seed)
        low, high = floor.bounds_m()
        self.origin_m = (float(0.5 * (low[0] + high[0])), float(low[1]) + 0.5 * FOOT_M[1])
        """The place between the feet: the middle of the floor's near edge."""
        of_method = {name: self.given[name] for name in Method.parameters if name in self.given}
        self._method = Method.checked({**of_method, "origin_m": self.origin_m}, {})
        trials = Method(self._method, {}, self.draws).listed()
        self.left = deque(trial for trial in trials if self._is_on_floor(trial))
        """The remaining buttons: those of the method that are on the floor."""
        self.left_out = len(trials) - len(self.left)
        self.times_s: list[float] = []
        """Times of the buttons that were hit."""
        self.missed = 0
        self.target: FloorTarget | None = None
        """The button that is shown now."""
        self._next_s = math.nan
        self._hit: FloorTarget | None = None

    def step(self, moment: Moment) -> Iterable[Cue]:
        now = moment.time_s
        if math.isnan(self._next_s):
            self._next_s = now + self.given["pause_s"]
            if self.left_out:
                yield Say(f"{self.left_out} of the buttons do not lie on this floor and are left out")
        if self.target is None:
            if now >= self._next_s:
                self._hit = None
                if self.left:
                    timing = {name: self.given[name] for name in ("force_n", "visible_s", "pause_s")}
                    self.target = FloorTarget.of(self.left.popleft(), self._method | timing, now, now, moment.contacts)
            return
        answers = self.target.judged(moment.contacts, now, now)
        if answers is None:
            return
        target, self.target = self.target, None
        self._next_s = now + self.given["pause_s"]
        text = f"width {100.0 * target.width_m:.1f} cm"
        if answers["selected"] == YES:
            self._hit = target
            self.times_s.append(float(answers["time_s"]))
            yield Strike("click", target.x_m, target.y_m)
            yield Say(f"hit after {answers['time_s']:.2f} s, {text}")
        else:
            self.missed += 1
            yield Say(f"missed, {text}")
        if not self.left:
            yield Say(f"done: {self.state}")

    def shapes(self) -> Iterable[Shape]:
        x, y = self.origin_m
        for side in (-0.5, 0.5):
            yield box(x + side * FEET_APART_M, y, *FOOT_M, FEET, 0.5)
        if self.target is not None:
            yield Disc(self.target.x_m, self.target.y_m, 0.5 * self.target.width_m, TARGET)
        elif self._hit is not None:
            yield Disc(self._hit.x_m, self._hit.y_m, 0.5 * SELECTED_M, HIT)
            yield Text(self._hit.x_m, self._hit.y_m, f"{self.times_s[-1]:.2f} s", 0.03, "#000000")
        elif not self.left and not math.isnan(self._next_s):
            yield Text(x, y + 0.3, "Done", 0.04, WORDS)

    @property
    def state(self) -> str:
        hits = len(self.times_s)
        mean = f", mean {sum(self.times_s) / hits:.2f} s" if hits else ""
        return f"{hits} hit, {self.missed} missed{mean}, {len(self.left)} to come"

    def _is_on_floor(self, trial: Trial) -> bool:
        place = (self.origin_m[0] + float(trial.facts["x_m"]), self.origin_m[1] + float(trial.facts["y_m"]))
        return any(float(tile.distance_m(place)) <= SEAM_M for tile in self.floor.tiles)
