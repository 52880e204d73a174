"""Target selection: round buttons on the floor, pressed with a foot before they vanish (thesis 5.6.1)."""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

from underfoot.experiments.method import ASKED, LEFT, RIGHT, ListedMethod
from underfoot.experiments.questions import yes_or_no
from underfoot.experiments.trials import Trial
from underfoot.parameters import Choice, Count, Number, Numbers, Parameter, ask


class TargetSelection(ListedMethod):
    """Every width at every distance and bearing, `repeats` times in random order, in sessions of equal length."""

    kind, name = "target-selection", "Target selection"
    about = "Round buttons appear on the floor and are pressed with a foot; rates and times of selection come of it."
    uses_stimuli = False
    side = "preferred_foot"
    widths_m = Numbers((0.045, 0.075, 0.105, 0.135, 0.165), 0.005, 1.0, doc="Diameters of the buttons.", unit="m")
    distances_m = Numbers((0.15, 0.25, 0.35, 0.45), 0.0, 5.0, doc="From between the feet to the middle.", unit="m")
    bearings_deg = Numbers((0.0, 45.0), -180.0, 180.0, doc="From straight ahead, away from the preferred foot.")
    repeats = Count(6, 1, 1000, doc="How often each button comes.")
    sessions = Count(2, 1, 100, doc="Into how many blocks the trials are divided.")
    force_n = Number(35.0, 1.0, 1000.0, doc="A press has at least this force, with its centroid inside.", unit="N")
    visible_s = Number(2.0, 0.1, 60.0, doc="How long a button can be pressed.", unit="s")
    pause_s = Number(3.0, 0.0, 60.0, doc="From its end to the next one.", unit="s")
    origin_m = Numbers((0.0, 0.0), -100.0, 100.0, doc="Between the feet, in the floor's frame.", least=2, most=2)
    preferred_foot = Choice(
        RIGHT, options=(RIGHT, LEFT, ASKED), doc="Bearings count away from it; asked: by the question foot."
    )

    def listed(self) -> Sequence[Trial]:
        buttons = list(product(self.given["widths_m"], self.given["distances_m"], self.given["bearings_deg"]))
        drawn = self.draws.shuffled(buttons * self.given["repeats"])
        away = 1.0 if self.given["preferred_foot"] == LEFT else -1.0
        found = []
        for k, (width, distance, bearing) in enumerate(drawn):
            angle = math.radians(bearing)
            facts = {
                "width_m": width,
                "distance_m": distance,
                "bearing_rad": angle,
                "x_m": away * distance * math.sin(angle),
                "y_m": distance * math.cos(angle),
            }
            block = 1 + k * self.given["sessions"] // len(drawn)
            found.append(Trial(k + 1, block, facts=facts))
        return found

    @classmethod
    def questions_for(cls, given: Mapping[str, Any]) -> tuple[Parameter, ...]:
        longest = given["visible_s"]
        time = Number(longest, 0.0, longest, doc="From its appearance to the press.", unit="s")
        return (yes_or_no("selected", "Was it pressed in time?"), ask("time_s", time))
