"""What the loads on neighbouring tiles show: when a load went over to another foot, and to which foot a load belongs.

Four vertical forces give a tile's load one centroid. Where a foot lies over a seam or a corner, two to four tiles have
a load each; where two feet share a tile, they have one load. Four rules tell them apart
(docs/models.md#one-foot-or-two):

- *A foot fits into a foot's box.* All centroids of its loads, above 50 N, lie in a rectangle of 0.33 x 0.13 m, in any
  orientation, and come within 0.26 m of where the others press.
- *A walker's next foot comes down late.* A load that begins within 0.3 s of a foot's first load, or within 0.5 s where
  another foot was still on the tile, belongs to that foot, if it fits. A later load is the foot's toes, if it begins
  beside where the foot presses, not behind it, and does not outlast the rest of the foot. Otherwise it is another foot.
- *A foot bears weight once.* A load is not part of a foot if their sum would fall far and rise again. A load has gone
  over to another foot if the sum dips twice: within one step it dips once, between the two peaks.
- *A foot rolls, it does not jump.* A load has gone over to the next foot if its centroid moves 0.1 m within 0.15 s, or
  0.06 m sideways or back; or if it falls to a third and rises again, elsewhere on the tile or while another load begins
  beside it. This is not checked on plates that are large enough to stand on with both feet.
"""

import math

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.layout import Floor
from underfoot.floor.loads import (
    BEFORE_S,
    LENGTH_M,
    SWING_S,
    WIDTH_M,
    Load,
    bears_twice,
    dips,
    distance_m,
    fits_in_foot,
    light_load_m,
    loaded,
    nearest_distance_m,
    present_distance_m,
    toes_m,
    total,
)
from underfoot.floor.shared_loads import (
    APART_M,
    BOTH_FEET_S,
    FORCE,
    HEEL_STRIKE_S,
    JUMP_M,
    JUMP_S,
    LOADED_N,
    PLACE,
    STAYS_LOADED_S,
    TIME,
    jump_time_s,
    relief_time_s,
)

GAP_M = 0.030
"""Tiles with a gap of at most this are neighbours: a foot across it presses on both."""

DECIDED_S, FIT_DECIDED_S = 0.70, 0.40
"""Age of a load at which its foot is decided: loads that began together and within `WIDTH_M`, and fit into a box, at
`FIT_DECIDED_S`, all others at `DECIDED_S`."""

DELIVERY_DELAY_S = 0.60
"""Delay with which loads are delivered while somebody stands on the floor: until then they can be divided."""

LARGEST_TILE_DIAGONAL_M = 0.5
"""Tiles with a longer diagonal have room for both feet of a person who shifts weight: their loads are not divided."""

SETTLED_S = JUMP_S + STAYS_LOADED_S + 0.04
"""Time after a sample at which it is known that the load was not divided there."""

GAP_ROLL_SPEED_M_S = 0.5
"""Lowest speed of a foot that rolls over the gap between two tiles, where it may press on neither."""

TWO_STEPS_S, LONGEST_STANCE_S = 0.7, 1.2
"""Range of a load's age in which two dips show a handover: shortest time of two steps, longest stance of a walker."""

SHORTEST_TOUCH_S = 0.08
"""Shortest contact of a foot. A shorter load is a heel; the foot continues on another tile, up to `BEFORE_S` later."""

OVERLAP_S = 0.05
"""Longest time for which the toes of a foot that leaves may outlast the rest, on the next tile."""


class FootEvidence:
    """The loads of the last seconds, and what they show. It changes no load.

    `now_s` is the time of the latest sample. `doubtful` is the number of samples before a load in which two feet may
    already have shared the tile.
    """

    def __init__(self, floor: Floor, rate_hz: float) -> None:
        gaps_m = floor.gaps_m()
        self.loads: list[Load] = []
        self.now_s = -math.inf
        self.doubtful = math.ceil(BEFORE_S * rate_hz)
        self._are_neighbours = gaps_m <= GAP_M
        self._is_small = [math.hypot(*tile.size_m) <= LARGEST_TILE_DIAGONAL_M for tile in floor.tiles]
        self._gap_samples = np.ceil(gaps_m / GAP_ROLL_SPEED_M_S * rate_hz).astype(int)

    def are_neighbours(self, load: Load, other: Load) -> bool:
        """Return whether two loads are on neighbouring tiles, or on one tile."""
        return bool(self._are_neighbours[load.tile, other.tile])

    def handover_s(self, load: Load) -> float | None:
        """Return the time at which a load went over from one foot to another; None if that does not show."""
        track = load.track()
        if not self._is_small[load.tile] or not len(track) or track[-1, TIME] < self.now_s - STAYS_LOADED_S:
            return None
        passed_on = load.divided_from is not None
        at_s = jump_time_s(track, load.start_s, self._touchdown_m(load), passed_on=passed_on)
        at_s = self._relief_s(load) if at_s is None else at_s
        return self._second_dip_s(load) if at_s is None else at_s

    def candidates(self, load: Load) -> list[Load]:
        """Return the loads whose foot a load may be a part of: on neighbouring tiles, and present when it began.

        These are earlier loads and decided ones. A divided load ranks after those that began a little later.
        """
        excluded = {one.foot for one in self.loads if one is load.divided_from or one.divided_from is load} - {0}
        return [
            other
            for other in self.loads
            if (other.foot or other.rank() < load.rank())
            and self.are_neighbours(other, load)
            and self.lasted_until(other, load)
            and (load.end is None or load.end > other.sample)
            and other.foot not in excluded
        ]

    def lasted_until(self, load: Load, later: Load) -> bool:
        """Return whether `load` was present when `later` began, allowing for a foot that rolls over a gap."""
        if load.end is None:
            return True
        if load.is_cut:
            return load.end > later.sample
        track = load.track()
        touched = load.end_s - load.start_s < SHORTEST_TOUCH_S or not len(track) or track[:, FORCE].max() < LOADED_N
        gap = self.doubtful if load.is_divided or touched else int(self._gap_samples[load.tile, later.tile])
        return load.end + gap > later.sample

    def provisional_part_of(self, load: Load) -> Load | None:
        """Return an earlier load that probably belongs to the same foot, for display before the decision.

        A load that comes a swing later, or presses further away than a foot reaches, counts as another foot until it
        is decided.
        """
        for other in self.candidates(load):
            if other.end is None:
                cost_m = self.distance_from_foot_m(load, other.foot, final=False) if other.foot else math.nan
                at_once = load.start_s - other.start_s < SWING_S and present_distance_m(load, other) <= APART_M
                if cost_m is not None and (at_once or not math.isnan(cost_m)):
                    return other
        return None

    def distance_from_foot_m(self, load: Load, foot: int, *, final: bool) -> float | None:
        """Return how far a load began from a foot that it is a part of; None if it is not, NaN if that is still open.

        `final`: no further samples will come.
        """
        age_s = self.now_s - load.start_s
        if age_s < SETTLED_S and not final:
            return math.nan
        is_due = final or age_s >= DECIDED_S or load.end is not None
        parts = [other for other in self.loads if other.foot == foot and other is not load]
        until_s = math.inf if final else self.now_s - SETTLED_S  # newer samples may still be divided
        mine = self._own_track(load, until_s)
        track = np.concatenate([self._own_track(other, until_s) for other in parts])
        if not len(mine) or not len(track):
            return light_load_m(load, parts, self.now_s) if is_due else math.nan
        if not fits_in_foot(np.concatenate([mine, track])[:, PLACE]):
            return None
        if nearest_distance_m(mine, track) > APART_M:  # they may still come nearer
            return None if is_due else math.nan
        rest_ends_s = max(other.end_s for other in parts)
        began_m: float | None
        # Of a divided load the foot may have come down before, while the other one was still on the tile.
        late_s = load.start_s - min(other.start_s for other in parts)
        if late_s < SWING_S + (0.0 if load.divided_from is None else BOTH_FEET_S):  # too early for another foot
            began_m = distance_m(mine[0], track)
            is_sure = is_due or age_s >= FIT_DECIDED_S or rest_ends_s < math.inf
            if began_m > WIDTH_M:  # two feet that came down together, side by side, fit until they have rolled
                is_sure = final or age_s >= DECIDED_S
        else:  # the foot's toes, or another foot
            is_sure = is_due
            began_m = toes_m(mine, track, min(load.end_s, self.now_s) - rest_ends_s)
        if began_m is None:
            return None
        if not is_sure:
            return math.nan
        return None if bears_twice([*parts, load]) and not bears_twice(parts) else began_m

    def _own_track(self, load: Load, until_s: float) -> NDArray[np.float64]:
        """Return the `loaded` track, without the toes of another foot that left soon after the load began."""
        track = loaded(load, until_s)
        left_s = [
            other.end_s
            for other in self.loads
            if other.foot != load.foot
            and self.are_neighbours(other, load)
            and load.start_s < other.end_s <= load.start_s + BOTH_FEET_S
        ]
        at = int(np.searchsorted(track[:, TIME], max(left_s, default=-math.inf) + OVERLAP_S))
        if at == 0:  # nothing is in doubt
            return track
        elsewhere_m = np.hypot(*(track[:at, PLACE] - track[at % len(track), PLACE]).T).max()
        return track[at:] if elsewhere_m >= JUMP_M else track

    def _parts_of_foot(self, load: Load) -> list[Load]:
        """Return the loads of the same foot that have a track; of an undecided load, itself."""
        return [one for one in self.loads if one.foot == load.foot and len(one.track())] if load.foot else [load]

    def _touchdown_m(self, load: Load) -> NDArray[np.float64]:
        """Return where the load's foot came down, as far as known; a foot rolls from there to the load."""
        return min(self._parts_of_foot(load) or [load], key=lambda one: one.start_s).track()[0, PLACE]

    def _near(self, load: Load) -> list[Load]:
        """Return the loads on neighbouring tiles that may belong to the same feet."""
        track = load.track()
        places = track[track[:, TIME] >= self.now_s - SETTLED_S][:, PLACE]
        return [
            other
            for other in self.loads
            if self.are_neighbours(other, load)
            and other.tile != load.tile
            and len(other.track())
            and float(np.hypot(*(places - other.track()[-1, PLACE]).T).min()) <= LENGTH_M
        ]

    @property
    def _earliest_handover_s(self) -> float:
        """The earliest time at which a load can still be divided: rows of the time of both feet must be waiting."""
        return self.now_s - DELIVERY_DELAY_S + 1.5 * BEFORE_S

    def _relief_s(self, load: Load) -> float | None:
        """Return when one foot left and another came on, elsewhere on the tile or with a load beside it; or None."""
        begin_s = max(self._earliest_handover_s, load.start_s + HEEL_STRIKE_S)
        track = load.track()
        if load.divided_from is not None:  # its first force is what remained of the foot before
            track = track[track[:, TIME] >= load.start_s + JUMP_S]
        found = relief_time_s(track, begin_s)
        if found is None:
            return None
        least_s, moved = found
        begins = any(abs(other.start_s - least_s) <= 2.0 * BEFORE_S for other in self._near(load))
        return least_s if moved or begins else None

    def _second_dip_s(self, load: Load) -> float | None:
        """Return when a load beside it began or ended, if the sum dipped before and after, each as in one step."""
        parts = self._parts_of_foot(load)
        first_s = min(one.start_s for one in parts)
        if not TWO_STEPS_S <= self.now_s - first_s <= LONGEST_STANCE_S + DELIVERY_DELAY_S:
            return None
        begin_s = max(self._earliest_handover_s, first_s + SWING_S, load.start_s + BEFORE_S)
        near = self._near(load)
        times_s = [one.start_s for one in near] + [one.end_s for one in parts if one is not load]
        for at_s in sorted(at for at in times_s if begin_s <= at <= self.now_s - BOTH_FEET_S):
            later = [one for one in near if one not in parts and one.start_s >= at_s - BEFORE_S]
            time_s, force_n = total([*parts, *later])
            at, alone = np.searchsorted(time_s, [at_s, at_s + BOTH_FEET_S])
            if dips(force_n[:at]) and dips(force_n[at:], int(alone - at)):
                return at_s
        return None
