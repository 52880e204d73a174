"""A button on the floor: where it is, until when it can be pressed, and whether a foot has pressed it."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from underfoot.errors import BadValue
from underfoot.experiments.methods.target_selection import TargetSelection
from underfoot.experiments.protocol import Protocol
from underfoot.experiments.questions import NO, YES
from underfoot.experiments.study import method_of
from underfoot.experiments.trials import Answers, Trial
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.layout import Floor, Tile

SELECTED_M, SELECTED_S = 0.2, 1.0
"""A button that was pressed in time gives way to a white disc so wide (thesis 5.6.1), for so long."""
FOOT_M, FEET_APART_M = (0.11, 0.29), 0.24
"""Between trials both feet stand on white rectangles of this width and length, so far apart, toes at the origin."""


@dataclass(frozen=True)
class StandingPlace:
    """Where a participant stands to select targets: `origin_m` is between the toes, buttons reach `reach_m` at most."""

    origin_m: tuple[float, float]
    reach_m: float

    @staticmethod
    def of(protocol: Protocol) -> "StandingPlace":
        """Of the first stage in which targets are selected; around (0, 0) where there is none."""
        for stage in protocol.stages:
            if stage.method is not None and stage.method.kind == TargetSelection.kind:
                given = TargetSelection.checked(stage.method.parameters, protocol.stimuli)
                x_m, y_m = given["origin_m"]
                return StandingPlace((float(x_m), float(y_m)), max(given["distances_m"]) + 0.5 * max(given["widths_m"]))
        return StandingPlace((0.0, 0.0), 1.0)


@dataclass(frozen=True)
class FloorTarget:
    """A round button of `width_m` around a place in the floor's frame, shown at `shown_s` of the session.

    `until` is on the clock of who asks: it ends there, whether or not forces come.
    """

    x_m: float
    y_m: float
    width_m: float
    force_n: float
    visible_s: float
    pause_s: float
    shown_s: float
    until: float

    @staticmethod
    def of(trial: Trial, given: Mapping[str, Any], shown_s: float, now: float) -> "FloorTarget":
        """The button of a trial of target selection with these parameters, shown now."""
        x_m, y_m = given["origin_m"]
        return FloorTarget(
            x_m + float(trial.facts["x_m"]),
            y_m + float(trial.facts["y_m"]),
            float(trial.facts["width_m"]),
            given["force_n"],
            given["visible_s"],
            given["pause_s"],
            shown_s,
            now + given["visible_s"],
        )

    def judged(self, contacts: Iterable[OngoingContact], now_s: float, now: float) -> Answers | None:
        """The answers of its trial once it is pressed or over; None as long as it can be pressed.

        >>> button = FloorTarget(0.0, 0.3, 0.1, 35.0, 2.0, 3.0, 10.0, 12.0)
        >>> button.judged([OngoingContact(1, 0.02, 0.32, 80.0, (0,))], 10.8, 10.8)
        {'selected': 'yes', 'time_s': 0.8}
        >>> button.judged([OngoingContact(1, 0.2, 0.32, 80.0, (0,))], 10.8, 10.8) is None
        True
        """
        taken_s = max(now_s - self.shown_s, 0.0)
        for contact in contacts:
            inside = math.hypot(contact.x_m - self.x_m, contact.y_m - self.y_m) <= 0.5 * self.width_m
            if inside and contact.force_n >= self.force_n and taken_s <= self.visible_s:
                return {"selected": YES, "time_s": round(taken_s, 4)}
        if now >= self.until:
            return {"selected": NO, "time_s": self.visible_s}
        return None


def require_on_floor(protocol: Protocol, floor: Floor) -> None:
    """Raise `BadValue` for a study whose buttons are not all on the floor's tiles."""
    for stage in protocol.stages:
        if stage.method is None or stage.method.kind != TargetSelection.kind:
            continue
        method = method_of(protocol, stage, "anybody")
        if not isinstance(method, TargetSelection):
            continue
        x_m, y_m = method.given["origin_m"]
        for trial in method.trials:
            place = (x_m + float(trial.facts["x_m"]), y_m + float(trial.facts["y_m"]))
            if tile_under(*place, floor) is None:
                raise BadValue(
                    f"stage {stage.id!r} has a button at x {place[0]:.2f}, y {place[1]:.2f} m, which is not on the "
                    "floor; take a larger floor, or another origin_m"
                )


def tile_under(x_m: float, y_m: float, floor: Floor) -> Tile | None:
    """The tile at a place in the floor's frame; None beside all of them."""
    for tile in floor.tiles:
        aside_m, ahead_m = tile.to_tile((x_m, y_m))
        if abs(aside_m) <= 0.5 * tile.size_m[0] and abs(ahead_m) <= 0.5 * tile.size_m[1]:
            return tile
    return None
