"""A button on the floor: its place and time limit, and the detection of a press."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

from underfoot.errors import BadValue
from underfoot.experiments.method import ASKED
from underfoot.experiments.methods.target_selection import TargetSelection
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import NO, YES
from underfoot.experiments.study import method_of
from underfoot.experiments.trials import Answers, Trial
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor

SELECTED_M, SELECTED_S = 0.2, 1.0
"""Diameter and duration of the white disc that replaces a button pressed in time (thesis 5.6.1)."""
FOOT_M, FEET_APART_M = (0.11, 0.29), 0.24
"""Width and length of the white rectangles on which both feet stand between trials, and their distance; toes are at the
origin."""


@dataclass(frozen=True)
class StandingPlace:
    """The participant's position in target selection: `origin_m` is between the toes, `reach_m` the farthest button."""

    origin_m: tuple[float, float]
    reach_m: float

    @staticmethod
    def of(protocol: Protocol) -> "StandingPlace":
        """Return the place of the first stage with target selection; (0, 0) without such a stage."""
        for stage in protocol.stages:
            if stage.method is not None and stage.method.kind == TargetSelection.kind:
                given = TargetSelection.checked(stage.method.parameters, protocol.stimuli)
                x_m, y_m = given["origin_m"]
                return StandingPlace((float(x_m), float(y_m)), max(given["distances_m"]) + 0.5 * max(given["widths_m"]))
        return StandingPlace((0.0, 0.0), 1.0)


@dataclass(frozen=True)
class FloorTarget:
    """A round button of `width_m` in the floor's frame, shown at `shown_s` of the session.

    `until` is on the caller's clock: the target ends then, even if no force samples arrive.
    """

    x_m: float
    y_m: float
    width_m: float
    force_n: float
    visible_s: float
    shown_s: float
    until: float
    stood_on: frozenset[int] = frozenset()
    """The loads of feet that stood on it as it appeared: none of these has pressed it, also once it has left a tile."""

    @staticmethod
    def of(
        trial: Trial, given: Mapping[str, Any], shown_s: float, now: float, contacts: Iterable[OngoingContact]
    ) -> "FloorTarget":
        """Return the button of a trial of target selection, shown now to who stands there with these contacts."""
        x_m, y_m = given["origin_m"]
        button = FloorTarget(
            x_m + float(trial.facts["x_m"]),
            y_m + float(trial.facts["y_m"]),
            float(trial.facts["width_m"]),
            given["force_n"],
            given["visible_s"],
            shown_s,
            now + given["visible_s"],
        )
        return replace(button, stood_on=frozenset(n for one in contacts if button._is_under(one) for n in one.loads))

    def judged(self, contacts: Iterable[OngoingContact], now_s: float, now: float) -> Answers | None:
        """Return the trial's answers once the button is pressed or has expired, else None.

        >>> button = FloorTarget(0.0, 0.3, 0.1, 35.0, 2.0, 10.0, 12.0)
        >>> button.judged([OngoingContact(1, 0.02, 0.32, 80.0, (0,))], 10.8, 10.8)
        {'selected': 'yes', 'time_s': 0.8}
        >>> button.judged([OngoingContact(1, 0.2, 0.32, 80.0, (0,))], 10.8, 10.8) is None
        True
        """
        taken_s = max(now_s - self.shown_s, 0.0)
        for contact in contacts:
            is_press = self._is_under(contact) and self.stood_on.isdisjoint(contact.loads)
            if is_press and taken_s <= self.visible_s:
                return {"selected": YES, "time_s": round(taken_s, 4)}
        if now >= self.until:
            return {"selected": NO, "time_s": self.visible_s}
        return None

    def _is_under(self, contact: OngoingContact) -> bool:
        """Return whether a contact's centroid is inside, with enough force."""
        inside = math.hypot(contact.x_m - self.x_m, contact.y_m - self.y_m) <= 0.5 * self.width_m
        return inside and contact.force_n >= self.force_n


def require_on_floor(protocol: Protocol, floor: Floor) -> None:
    """Raise `BadValue` if a button of the study is outside the floor's tiles."""
    for stage in protocol.stages:
        if stage.method is None or stage.method.kind != TargetSelection.kind:
            continue
        method = method_of(protocol, stage, "anybody")
        if not isinstance(method, TargetSelection):
            continue
        x_m, y_m = method.given["origin_m"]
        asks = stage.method.given(protocol.stimuli)["preferred_foot"] == ASKED
        sides = (1.0, -1.0) if asks else (1.0,)  # who prefers the left foot has them on the other side
        for trial, side in product(method.trials, sides):
            place = (x_m + side * float(trial.facts["x_m"]), y_m + float(trial.facts["y_m"]))
            if floor.tile_at(place) is None:
                raise BadValue(
                    f"stage {stage.id!r} has a button at x {place[0]:.2f}, y {place[1]:.2f} m, which is not on the "
                    "floor; take a larger floor, or another origin_m"
                )
