"""Which loads are one foot's: loads on touching tiles are put together, and one that two feet share is divided.

Four vertical forces give a tile's load one centroid. Where a foot lies over a seam or a corner, two to four tiles have
a load each; where two feet meet on a tile, it has one for both. What tells them apart
(docs/models.md#one-foot-or-two):

- *A foot fits into a foot's box.* All places where the centroids of its loads have been, above 50 N, lie in a rectangle
  of 0.33 x 0.13 m, whichever way it is turned, and comes within 0.26 m of where the others press.
- *A walker's next foot comes down late.* A load that begins within 0.3 s of a foot's first is the same foot's, if it
  fits. A later one is the foot's toes, if it begins beside where the foot presses, not behind it, and does not outlast
  the rest of the foot; else it is another foot.
- *A foot bears weight once.* A load is none of a foot's if what both bear would fall far and rise again. One has passed
  on if what a foot bears dips twice, as it does once between its peaks.
- *A foot rolls, it does not jump.* A load has passed from one foot to the next if its centroid goes 0.1 m within
  0.15 s, or 0.06 m to the side or back; or if it falls to a third and rises again, elsewhere on the tile or while
  another load begins beside it. On plates on which people stand with both feet this is not asked.

Each question is open for at most 0.7 s. It is looked at every 32 ms of the stream, at times that no cut of the stream
into chunks moves.
"""

import bisect
import math
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from underfoot.floor import tracking
from underfoot.floor.layout import Floor
from underfoot.floor.loads import (
    APART_M,
    BEFORE_S,
    LENGTH_M,
    SWING_S,
    Load,
    bears_twice,
    columns,
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
    BOTH_FEET_S,
    HEEL_STRIKE_S,
    JUMP_M,
    JUMP_S,
    LOADED_N,
    STAYS_LOADED_S,
    jump_time_s,
    relief_time_s,
    shared,
)

GAP_M = 0.030
"""Tiles at most so far apart touch: a foot that lies over both presses on both."""

DECIDED_S, FIT_DECIDED_S = 0.70, 0.40
"""What began together is one foot if it fits into a box after `FIT_DECIDED_S`; all is decided after `DECIDED_S`."""

LARGEST_TILE_DIAGONAL_M = 0.5
"""On a plate of a longer diagonal people stand with both feet and shift their weight: its load stays one contact."""

SETTLED_S = JUMP_S + STAYS_LOADED_S + 0.04
"""So long after a sample it is known that its load is not divided there."""

GAP_ROLL_SPEED_M_S = 0.5
"""A foot that rolls over a gap between tiles so fast presses on neither meanwhile."""

TWO_STEPS_S, LONGEST_STANCE_S = 0.7, 1.2
"""A load that lasts so long may have been passed on although its centroid stayed; a walker's foot stays no longer."""

SHORTEST_TOUCH_S = 0.08
"""No foot leaves so soon: what does is its heel, and the rest comes down on another tile up to `BEFORE_S` later."""

OVERLAP_S = 0.05
"""So much longer than the rest of a foot that leaves may its toes be on the next tile."""

MOST_LOADS = 8
"""A loose wire may, but no feet make so many loads on a tile within `DECIDED_S`: they are taken for one foot's unasked,
since every question costs more the more loads there are."""

TICK = 8
"""Looked at every so many of the samples that are kept, about 250 a second."""

HELD_S = 0.60
"""Loads are given out so late, because they may still be divided."""


class FootFinder:
    """Puts loads together to feet. Feed it what `tracking.follow` wrote; it gives out what is decided."""

    def __init__(self, floor: Floor, rate_hz: float, every: int) -> None:
        self._touches = floor.gaps_m() <= GAP_M
        self._is_small = [math.hypot(*tile.size_m) <= LARGEST_TILE_DIAGONAL_M for tile in floor.tiles]
        self._every = every
        self._doubtful = math.ceil(BEFORE_S * rate_hz)
        self._together = math.ceil(BOTH_FEET_S * rate_hz)
        self._bridged = np.ceil(floor.gaps_m() / GAP_ROLL_SPEED_M_S * rate_hz).astype(int)
        self._longest_bridge = int(self._bridged[self._touches].max())
        self._held_samples = math.ceil(HELD_S * rate_hz)
        self._on: dict[int, Load] = {}
        self._loads: list[Load] = []
        self._latest: list[deque[Load]] = [deque(maxlen=MOST_LOADS) for _ in floor.tiles]
        self._renamed: dict[int, int] = {}
        self._foot_of: dict[int, int] = {}
        self._held = np.zeros(256, tracking.ROW)
        self._begin, self._end = 0, 0
        self._events: list[np.void] = []
        self._count, self._feet, self._tokens = 0, 0, 0
        self._now_s = -math.inf

    def feed(self, rows: NDArray[np.void], events: NDArray[np.void], time_s: NDArray[np.float64]) -> None:
        """What the next samples, at `time_s` (n,), brought."""
        first, count = self._count, self._count + len(time_s)
        if not len(rows) and not len(events) and not self._loads:
            self._count = count
            return
        rows, events = rows.copy(), events.copy()
        for old, new in self._renamed.items():
            rows["token"][rows["token"] == old] = new
        self._hold(rows)
        tick = TICK * self._every
        edges = [*range((first // tick + 1) * tick, count + 1, tick)]
        thin = rows[rows["sample"] % self._every == 0]
        at_event = at_row = 0
        for edge in [*edges, *([count] if not edges or edges[-1] != count else [])]:
            while at_event < len(events) and events[at_event]["sample"] < edge:
                self._note(events[at_event])
                at_event += 1
            until = int(np.searchsorted(thin["sample"], edge))
            if until > at_row:
                self._append(thin[at_row:until])
                at_row = until
            self._count = edge
            if edge > first:
                self._now_s = float(time_s[edge - first - 1])
            if edge % tick == 0 and self._loads:
                self._look(edge)

    def finish(self, events: NDArray[np.void]) -> None:
        """The stream has ended, with these events: decide what is still open, as it stands."""
        for event in events.copy():
            self._note(event)
        for load in [load for load in self._loads if load.foot == 0]:
            self._decide(load, final=True)

    def take(self, everything: bool = False) -> tuple[NDArray[np.void], NDArray[np.int64], list[tuple[int, np.void]]]:
        """What is decided and was not given out yet: rows, their feet, and events with their foot, in order of time."""
        until = self._count + 1
        if not everything:
            until -= self._longest_bridge
            if self._on:
                # A few at a time: each piece costs.
                until = (self._count - self._held_samples) // self._doubtful * self._doubtful
            until = min([until, *(self._oldest(load) for load in self._loads if load.foot == 0)])
        ready = int(np.searchsorted(self._rows["sample"], until))
        if not ready and not (self._events and self._events[0]["sample"] < until):
            return self._held[:0], np.zeros(0, np.int64), []
        rows = self._rows[:ready].copy()
        self._begin += ready
        number = bisect.bisect_left(self._events, until, key=lambda event: event["sample"])
        events = [(self._foot_of[int(event["token"])], event) for event in self._events[:number]]
        self._events = self._events[number:]
        tokens, which = np.unique(rows["token"], return_inverse=True)
        feet = np.array([self._foot_of[int(token)] for token in tokens], np.int64)[which]
        self._forget(until)
        return rows, feet, events

    def awaited(self) -> set[int]:
        """The feet of which a load began that was not given out yet."""
        begun = (int(event["token"]) for event in self._events if event["kind"] == tracking.BEGAN)
        return {self._foot_of[token] for token in begun if token in self._foot_of}

    def standing(self) -> Iterator[tuple[Load, "Load | None"]]:
        """The loads of now, each with an earlier one of the foot that it may be a part of."""
        for load in self._on.values():
            yield load, None if load.foot else self._provisional(load)

    @property
    def _rows(self) -> NDArray[np.void]:
        """The rows that were not given out yet, to look at and to write to."""
        return self._held[self._begin : self._end]

    def _hold(self, rows: NDArray[np.void]) -> None:
        """Keep rows behind those that wait."""
        if self._end + len(rows) > len(self._held):
            waiting = self._rows
            held = np.zeros(max(len(self._held), 2 * (len(waiting) + len(rows))), tracking.ROW)
            held[: len(waiting)] = waiting
            self._held, self._begin, self._end = held, 0, len(waiting)
        self._held[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def _oldest(self, load: Load) -> int:
        """The first sample that a load which is open may still change."""
        return load.sample - (self._doubtful if load.shared is None or load.is_parted else self._together + 1)

    # --- what happens ---

    def _note(self, event: np.void) -> None:
        self._events.append(event)
        tile = int(event["tile"])
        if event["kind"] == tracking.BEGAN:
            load = Load(int(event["token"]), tile, int(event["sample"]), float(event["time_s"]))
            self._loads.append(load)
            self._on[tile] = load
            latest = self._latest[tile]
            flickers = len(latest) == MOST_LOADS and latest[0].start_s > load.start_s - DECIDED_S
            if flickers and latest[-1].foot and self._lasted(latest[-1], load):
                self._join(load, latest[-1].foot)
            elif flickers or not self._candidates(load):
                self._found(load)
            latest.append(load)
        else:
            load = self._on.pop(tile)
            event["token"] = load.token
            load.end, load.end_s, load.is_cut = int(event["sample"]), float(event["time_s"]), bool(event["cut"])

    def _append(self, thin: NDArray[np.void]) -> None:
        for load in self._loads:
            if load.end is None or load.end > thin["sample"][0]:
                mine = thin[(thin["tile"] == load.tile) & (thin["sample"] >= load.sample)]
                mine = mine if load.end is None else mine[mine["sample"] < load.end]
                if len(mine):
                    load.tracks.append(columns(mine))

    def _found(self, load: Load) -> None:
        self._feet += 1
        self._join(load, self._feet)

    def _join(self, load: Load, foot: int) -> None:
        load.foot = foot
        self._foot_of[load.token] = foot

    def _forget(self, until: int) -> None:
        """Let go of loads that nothing can be compared with any more, and of more on a tile than feet make."""
        oldest = min([until, *(load.sample for load in self._loads if load.end is None or load.foot == 0)])
        live = {load.foot for load in self._loads if load.foot and (load.end is None or load.end >= oldest)}
        gone = [
            load
            for load in self._loads
            if load.foot
            and load.end is not None
            and load.end < until
            and (load.foot not in live or load.end_s < self._latest[load.tile][0].start_s)
        ]
        if gone:
            self._loads = [load for load in self._loads if load not in gone]
            for load in gone:
                del self._foot_of[load.token]
                self._renamed = {old: new for old, new in self._renamed.items() if new != load.token}

    # --- decisions ---

    def _look(self, now: int) -> None:
        for load in list(self._on.values()):
            if self._is_small[load.tile] and len(load.track()) and load.track()[-1, 0] >= self._now_s - STAYS_LOADED_S:
                at_s = jump_time_s(load.track(), load.start_s, self._touchdown_m(load), load.shared is not None)
                at_s = self._relief_s(load) if at_s is None else at_s
                at_s = self._second_dip_s(load) if at_s is None else at_s
                if at_s is not None:
                    self._divide(load, at_s)
        for load in sorted((load for load in self._loads if load.foot == 0), key=Load.rank):
            self._decide(load)

    def _near(self, load: Load) -> list[Load]:
        """The loads on touching tiles that may be of the same feet."""
        track = load.track()
        places = track[track[:, 0] >= self._now_s - SETTLED_S][:, 1:3]
        return [
            other
            for other in self._loads
            if self._touches[other.tile, load.tile]
            and other.tile != load.tile
            and len(other.track())
            and float(np.hypot(*(places - other.track()[-1, 1:3]).T).min()) <= LENGTH_M
        ]

    def _relief_s(self, load: Load) -> float | None:
        """When one foot had left a load, and another came on: elsewhere on the tile, or with a load beside it."""
        begin_s = max(self._now_s - HELD_S + 1.5 * BEFORE_S, load.start_s + HEEL_STRIKE_S)
        track = load.track()
        if load.shared is not None:  # what the first foot bore as it left is no relief of the second
            track = track[track[:, 0] >= load.start_s + JUMP_S]
        found = relief_time_s(track, begin_s)
        if found is None:
            return None
        least_s, moved = found
        begins = any(abs(other.start_s - least_s) <= 2.0 * BEFORE_S for other in self._near(load))
        return least_s if moved or begins else None

    def _second_dip_s(self, load: Load) -> float | None:
        """When a load passed on: one beside it began or ended, and the sum dips before and after, as once in a step."""
        parts = [one for one in self._loads if one.foot == load.foot and len(one.track())] if load.foot else [load]
        first_s = min(one.start_s for one in parts)
        if not TWO_STEPS_S <= self._now_s - first_s <= LONGEST_STANCE_S + HELD_S:
            return None
        begin_s = max(self._now_s - HELD_S + 1.5 * BEFORE_S, first_s + SWING_S, load.start_s + BEFORE_S)
        near = self._near(load)
        times_s = [one.start_s for one in near] + [one.end_s for one in parts if one is not load]
        for at_s in sorted(at for at in times_s if begin_s <= at <= self._now_s - BOTH_FEET_S):
            later = [one for one in near if one not in parts and one.start_s >= at_s - BEFORE_S]
            time_s, force_n = total([*parts, *later])
            at, alone = np.searchsorted(time_s, [at_s, at_s + BOTH_FEET_S])
            if dips(force_n[:at]) and dips(force_n[at:], int(alone - at)):
                return at_s
        return None

    def _touchdown_m(self, load: Load) -> NDArray[np.float64]:
        """Where the foot of a load came down, as far as is known: from there to the load it rolls."""
        parts = [one for one in self._loads if one.foot == load.foot and len(one.track())] if load.foot else [load]
        return min(parts or [load], key=lambda one: one.start_s).track()[0, 1:3]

    def _divide(self, load: Load, at_s: float) -> None:
        """From `at_s` on a load is another foot's: a load of its own."""
        self._tokens -= 1
        mine = self._rows["token"] == load.token
        later = mine & (self._rows["time_s"] >= at_s)
        first = int(self._rows["sample"][later][0])
        before = self._rows[mine & ~later][-1]
        self._rows["token"][later] = self._tokens
        track = load.track()
        other = Load(self._tokens, load.tile, first, float(self._rows["time_s"][later][0]), shared=load)
        # Of what was not given out by now, one row stays before the first that may change.
        other.oldest = self._count - self._held_samples + 1
        place = int(np.searchsorted(track[:, 0], at_s))
        load.tracks, other.tracks = [track[:place]], [track[place:]]
        load.end, load.end_s, load.is_divided = first, float(before["time_s"]), True
        self._on[load.tile] = other
        self._loads.append(other)
        # What was decided meanwhile took two feet for one.
        feet = {part.foot for part in self._loads if self._touches[part.tile, load.tile]}
        near = [part for part in self._loads if part.foot in feet or self._touches[part.tile, load.tile]]
        wrong = [part for part in near if part.sample >= first - self._doubtful]
        # Without one of its loads, a foot may not have got those that were put to it later.
        begun = {part.foot: part.rank() for part in sorted(wrong, key=Load.rank, reverse=True)}
        kept_from = self._count - self._held_samples
        wrong += [
            part
            for part in near
            if part.foot and part.sample > kept_from and part.rank() > begun.get(part.foot, (math.inf, 0))
        ]
        for part in wrong:
            part.foot = 0
        self._renamed = {old: self._tokens if new == load.token else new for old, new in self._renamed.items()}
        if load.token >= 0:
            self._renamed[load.token] = self._tokens

    def _part(self, load: Load, other: Load) -> None:
        """Say what a load, and the one that it was divided from, bore while both feet were on the tile."""
        load.is_parted = True
        feet = shared(np.concatenate([other.track(), load.track()]), load.start_s)
        rows = self._rows
        mine = (rows["token"] == other.token) | (rows["token"] == load.token)
        mine &= rows["sample"] >= max(load.oldest, load.sample - self._together)
        places = np.flatnonzero(mine)
        begin, end = np.searchsorted(rows["time_s"][places], [feet.first_s, feet.last_s])
        # The times are those of samples that are kept.
        mine[places[: max(begin - self._every, 0)]] = mine[places[end + self._every :]] = False
        first, second, lead_n = feet.part(rows[mine])
        first["token"], second["token"] = other.token, load.token
        parted = np.concatenate([rows[~mine], first, second])
        parted = parted[np.argsort(parted["sample"], kind="stable")]
        self._held, self._begin, self._end = parted, 0, len(parted)
        thin_first, thin_second = (columns(part[part["sample"] % self._every == 0]) for part in (first, second))
        was, track = other.track(), load.track()
        other.tracks = [was[was[:, 0] < first["time_s"][0]] if len(first) else was, thin_first]
        load.tracks = [thin_second, track[track[:, 0] > second["time_s"][-1]] if len(second) else track]
        begins, ends = parted[parted["token"] == load.token][0], parted[parted["token"] == other.token][-1]
        load.sample, load.start_s = int(begins["sample"]), float(begins["time_s"])
        other.end, other.end_s = int(ends["sample"]) + 1, float(ends["time_s"])
        lead_s = float(parted["time_s"][np.searchsorted(parted["sample"], load.sample) - 1])
        self._log(tracking.BEGAN, load, load.sample, (lead_s, lead_n))
        self._log(tracking.ENDED, other, other.end, (other.end_s, math.nan))

    def _log(self, kind: int, load: Load, sample: int, before: tuple[float, float]) -> None:
        """Note what only now is known to have happened; `before` is the event's time and load."""
        event = np.zeros(1, tracking.EVENT)
        event["kind"], event["sample"], event["token"], event["tile"] = kind, sample, load.token, load.tile
        event["time_s"], event["load_n"] = before
        bisect.insort(self._events, event[0], key=lambda event: event["sample"])

    def _decide(self, load: Load, final: bool = False) -> None:
        """Say whose foot a load is, if that can be said by now."""
        if load.shared is not None and not load.is_parted:
            if not final and load.end is None and self._now_s < load.start_s + SWING_S:
                return
            self._part(load, load.shared)
        candidates = self._candidates(load)
        if not final and any(other.foot == 0 for other in candidates):
            return
        verdicts = {
            foot: self._distance_from_foot(load, foot, final)
            for foot in {other.foot for other in candidates if other.foot}
        }
        same = {foot: cost for foot, cost in verdicts.items() if cost is not None}
        if any(math.isnan(cost) for cost in same.values()):
            return
        if same:
            self._join(load, min(same, key=lambda foot: same[foot]))
        else:
            self._found(load)

    def _candidates(self, load: Load) -> list[Load]:
        """The loads on touching tiles that lasted together with it, and of whose foot it may be a part.

        These are earlier ones and decided ones; one that was divided comes behind those that began a little later.
        """
        others = {one.foot for one in self._loads if one is load.shared or one.shared is load} - {0}
        return [
            other
            for other in self._loads
            if (other.foot or other.rank() < load.rank())
            and self._touches[other.tile, load.tile]
            and self._lasted(other, load)
            and (load.end is None or load.end > other.sample)
            and other.foot not in others
        ]

    def _lasted(self, load: Load, later: Load) -> bool:
        """Whether a load was there until a later one began, as nearly as can be said: a foot may roll over a gap."""
        if load.end is None:
            return True
        if load.is_cut:
            return load.end > later.sample
        touched = (
            load.end_s - load.start_s < SHORTEST_TOUCH_S or not len(load.track()) or load.track()[:, 3].max() < LOADED_N
        )
        bridged = self._doubtful if load.is_divided or touched else int(self._bridged[load.tile, later.tile])
        return load.end + bridged > later.sample

    def _provisional(self, load: Load) -> Load | None:
        """An earlier load of the same foot, as far as can be said at once.

        What comes a swing later, or presses further away now than a foot reaches, is another foot until it is decided.
        """
        for other in self._candidates(load):
            if other.end is None:
                cost = self._distance_from_foot(load, other.foot, False) if other.foot else math.nan
                at_once = load.start_s - other.start_s < SWING_S and present_distance_m(load, other) <= APART_M
                if cost is not None and (at_once or not math.isnan(cost)):
                    return other
        return None

    def _distance_from_foot(self, load: Load, foot: int, final: bool) -> float | None:
        """How far a load's beginning is from a foot of which it is a part, metres; None if it is none, NaN if open."""
        parts = [other for other in self._loads if other.foot == foot and other is not load]
        now_s = self._now_s
        age_s = now_s - load.start_s
        if age_s < SETTLED_S and not final:
            return math.nan
        # What is newer may still be divided.
        until_s = math.inf if final else now_s - SETTLED_S
        mine, track = (
            self._own_track(load, until_s),
            np.concatenate([self._own_track(other, until_s) for other in parts]),
        )
        lag_s = load.start_s - min(other.start_s for other in parts)
        over = load.end is not None
        rest_s = max(other.end_s for other in parts)
        ripe = final or age_s >= DECIDED_S
        if not len(mine) or not len(track):
            return light_load_m(load, parts, now_s) if ripe or over else math.nan
        near = distance_m(mine[0], track)
        if not fits_in_foot(np.concatenate([mine, track])[:, 1:3]):
            return None
        if nearest_distance_m(mine, track) > APART_M:
            return None if ripe or over else math.nan
        if lag_s < SWING_S:
            sure = ripe or age_s >= FIT_DECIDED_S or over or rest_s < math.inf
            cost: float | None = near if sure else math.nan
        else:
            cost = toes_m(mine, track, min(load.end_s, now_s) - rest_s)
            cost = cost if cost is None or over or ripe else math.nan
        is_sure = cost is not None and not math.isnan(cost)
        return None if is_sure and bears_twice([*parts, load]) and not bears_twice(parts) else cost

    def _own_track(self, load: Load, until_s: float) -> NDArray[np.float64]:
        """`loaded`, less what is elsewhere than the rest: the toes of a foot that left soon after it began."""
        track = loaded(load, until_s)
        left_s = [
            other.end_s
            for other in self._loads
            if other.foot != load.foot
            and self._touches[other.tile, load.tile]
            and load.start_s < other.end_s <= load.start_s + BOTH_FEET_S
        ]
        at = int(np.searchsorted(track[:, 0], max(left_s, default=-math.inf) + OVERLAP_S))
        if at == 0:  # nothing is in doubt
            return track
        elsewhere_m = np.hypot(*(track[:at, 1:3] - track[at % len(track), 1:3]).T).max()
        return track[at:] if elsewhere_m >= JUMP_M else track
