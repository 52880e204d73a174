"""Feet from loads: loads on neighbouring tiles that belong to one foot are joined, shared loads are divided.

`FootEvidence` says what the loads show. Here that is applied to the rows and events of `tracking.follow`, which wait
until all is decided: up to 0.7 s after a load began. The checks run every 32 ms of the stream, at times that do not
depend on how it is split into chunks.
"""

import bisect
import math
from collections import deque
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.foot_evidence import DECIDED_S, DELIVERY_DELAY_S, FootEvidence
from underfoot.floor.layout import Floor
from underfoot.floor.loads import KEPT_S, SWING_S, Load, columns
from underfoot.floor.shared_loads import BOTH_FEET_S, TIME, shared
from underfoot.floor.tracker_memory import BEGAN, ENDED, EVENT, ROW

MOST_LOADS = 8
"""Most loads that feet make on a tile within `DECIDED_S`. A loose wire makes more; these are joined without checks,
because each check takes longer with every load that is kept."""

CHECK_INTERVAL = 8
"""Thinned samples, about 250 a second, between two checks."""


_LONG_AGO = Load(0, 0, 0, 0.0)
"""What a load was divided from that is compared with no more: else each kept all before it, while somebody stands."""


class FootFinder:
    """Assigns loads to feet. `feed` takes what `tracking.follow` wrote; `take` returns what is decided."""

    def __init__(self, floor: Floor, rate_hz: float, every: int) -> None:
        self._evidence = FootEvidence(floor, rate_hz)
        self._every = every
        self._shared_samples = math.ceil(BOTH_FEET_S * rate_hz)
        self._delay_samples = math.ceil(DELIVERY_DELAY_S * rate_hz)
        self._kept_samples = math.ceil(KEPT_S * rate_hz)
        self._present: dict[int, Load] = {}  # by tile
        self._dropped: list[Load] = []  # not compared any more, with rows or events that `take` has not returned
        self._latest: list[deque[Load]] = [deque(maxlen=MOST_LOADS) for _ in floor.tiles]
        self._renamed: dict[int, int] = {}  # a divided load's token in new rows: that of its last part
        self._foot_of: dict[int, int] = {}  # by token
        self._waiting = _WaitingRows()
        self._events: list[np.void] = []
        self._count, self._feet, self._tokens = 0, 0, 0

    def feed(self, rows: NDArray[np.void], events: NDArray[np.void], time_s: NDArray[np.float64]) -> None:
        """Take the rows and events of the next samples, at `time_s` (n,)."""
        first, count = self._count, self._count + len(time_s)
        if not len(rows) and not len(events) and not self._evidence.loads:
            self._count = count
            return
        rows, events = rows.copy(), events.copy()
        for old, new in self._renamed.items():
            rows["token"][rows["token"] == old] = new
        self._waiting.append(rows)
        tick = CHECK_INTERVAL * self._every
        edges = [*range((first // tick + 1) * tick, count + 1, tick)]
        thin = rows[rows["sample"] % self._every == 0]
        at_event = at_row = 0
        for edge in [*edges, *([count] if not edges or edges[-1] != count else [])]:
            while at_event < len(events) and events[at_event]["sample"] < edge:
                event = events[at_event]
                at_row = self._append_until(int(event["sample"]), thin, at_row)
                self._handle(event)
                at_event += 1
            at_row = self._append_until(edge, thin, at_row)
            self._count = edge
            if edge > first:
                self._evidence.now_s = float(time_s[edge - first - 1])
            if edge % tick == 0 and self._evidence.loads:
                self._check()
                self._drop()

    def finish(self, events: NDArray[np.void]) -> None:
        """Take the events at the end of the stream, and decide what is still open."""
        for event in events.copy():
            self._handle(event)
        for load in [load for load in self._evidence.loads if load.foot == 0]:
            self._decide(load, final=True)

    def take(
        self, *, everything: bool = False
    ) -> tuple[NDArray[np.void], NDArray[np.int64], list[tuple[int, np.void]]]:
        """Return what was decided since the last call, in temporal order: rows, their feet, events with their feet."""
        until = self._count + 1 if everything else self._decided_until()
        ready = int(np.searchsorted(self._waiting.rows["sample"], until))
        if not ready and not (self._events and self._events[0]["sample"] < until):
            return self._waiting.take(0), np.zeros(0, np.int64), []
        rows = self._waiting.take(ready)
        number = bisect.bisect_left(self._events, until, key=lambda event: event["sample"])
        events = [(self._foot_of[int(event["token"])], event) for event in self._events[:number]]
        self._events = self._events[number:]
        tokens, which = np.unique(rows["token"], return_inverse=True)
        feet = np.array([self._foot_of[int(token)] for token in tokens], np.int64)[which]
        for load in [load for load in self._dropped if load.end is not None and load.end < until]:
            self._dropped.remove(load)
            del self._foot_of[load.token]
            self._renamed = {old: new for old, new in self._renamed.items() if new != load.token}
        return rows, feet, events

    def awaited(self) -> set[int]:
        """Return the feet with a load whose beginning was not returned by `take` yet."""
        begun = (int(event["token"]) for event in self._events if event["kind"] == BEGAN)
        return {self._foot_of[token] for token in begun if token in self._foot_of}

    def present_loads(self) -> Iterator[tuple[Load, Load | None]]:
        """Yield the present loads; each undecided one with an earlier load that probably is the same foot's."""
        for load in self._present.values():
            yield load, None if load.foot else self._evidence.provisional_part_of(load)

    def _decided_until(self) -> int:
        """Return the sample until which nothing changes any more."""
        until = self._count + 1 - self._evidence.doubtful
        if self._present:
            # In larger pieces: each one costs.
            until = (self._count - self._delay_samples) // self._evidence.doubtful * self._evidence.doubtful
        return min([until, *(self._oldest(load) for load in self._evidence.loads if load.foot == 0)])

    def _oldest(self, load: Load) -> int:
        """Return the first sample that an undecided load may still change."""
        is_unsplit = load.divided_from is not None and not load.is_split
        return load.sample - (self._shared_samples + 1 if is_unsplit else self._evidence.doubtful)

    def _handle(self, event: np.void) -> None:
        """Begin or end a load. One that begins alone is a new foot at once."""
        self._events.append(event)
        tile = int(event["tile"])
        if event["kind"] == BEGAN:
            load = Load(int(event["token"]), tile, int(event["sample"]), float(event["time_s"]))
            self._evidence.loads.append(load)
            self._present[tile] = load
            latest = self._latest[tile]
            flickers = len(latest) == MOST_LOADS and latest[0].start_s > load.start_s - DECIDED_S
            if flickers and latest[-1].foot and self._evidence.lasted_until(latest[-1], load):
                self._assign(load, latest[-1].foot)
            elif flickers or not self._evidence.candidates(load):
                self._begin_foot(load)
            latest.append(load)
        else:
            load = self._present.pop(tile)
            event["token"] = load.token
            load.end, load.end_s, load.is_cut = int(event["sample"]), float(event["time_s"]), bool(event["cut"])

    def _append_until(self, edge: int, thin: NDArray[np.void], begin: int) -> int:
        """Append thinned rows, from index `begin` up to the sample `edge`, to tracks; return where the rest begins."""
        end = int(np.searchsorted(thin["sample"], edge))
        if end > begin:
            self._append(thin[begin:end])
        return end

    def _append(self, thin: NDArray[np.void]) -> None:
        """Append thinned rows to the tracks of their loads."""
        for load in self._evidence.loads:
            if load.end is None or load.end > thin["sample"][0]:
                mine = thin[(thin["tile"] == load.tile) & (thin["sample"] >= load.sample)]
                mine = mine if load.end is None else mine[mine["sample"] < load.end]
                if len(mine):
                    load.tracks.append(columns(mine))

    def _begin_foot(self, load: Load) -> None:
        self._feet += 1
        self._assign(load, self._feet)

    def _assign(self, load: Load, foot: int) -> None:
        load.foot = foot
        self._foot_of[load.token] = foot

    def _drop(self) -> None:
        """Drop loads that no later load can be compared with, and more of them on a tile than feet make."""
        until = self._decided_until()
        oldest = min([until, *(load.sample for load in self._evidence.loads if load.end is None or load.foot == 0)])
        oldest = max(oldest, self._count - self._kept_samples)  # what stands for good would keep all that end beside it
        live = {load.foot for load in self._evidence.loads if load.foot and (load.end is None or load.end >= oldest)}
        gone = [
            load
            for load in self._evidence.loads
            if load.foot
            and load.end is not None
            and load.end < until
            and (load.foot not in live or load.end_s < self._latest[load.tile][0].start_s)
        ]
        if gone:
            self._evidence.loads = [load for load in self._evidence.loads if load not in gone]
            self._dropped += gone
        for load in gone:
            if load.divided_from is not None:
                load.divided_from = _LONG_AGO

    def _check(self) -> None:
        """Divide the loads that went over to another foot, then decide what can be decided."""
        for load in list(self._present.values()):
            at_s = self._evidence.handover_s(load)
            if at_s is not None:
                self._divide(load, at_s)
        for load in sorted((load for load in self._evidence.loads if load.foot == 0), key=Load.rank):
            self._decide(load)

    def _divide(self, load: Load, at_s: float) -> None:
        """Make the part of a load from `at_s` on a load of its own, which is another foot's.

        Of a stream of more samples a second than was said, the rows before that time may be gone: then it stays whole.
        """
        rows = self._waiting.rows
        mine = rows["token"] == load.token
        later = mine & (rows["time_s"] >= at_s)
        if not (mine & ~later).any():
            return
        self._tokens -= 1
        first = int(rows["sample"][later][0])
        before = rows[mine & ~later][-1]
        rows["token"][later] = self._tokens
        track = load.track()
        other = Load(self._tokens, load.tile, first, float(rows["time_s"][later][0]), divided_from=load)
        # One of the rows that wait stays before the first that may change.
        other.oldest = self._count - self._delay_samples + 1
        place = int(np.searchsorted(track[:, TIME], at_s))
        load.tracks, other.tracks = [track[:place]], [track[place:]]
        load.end, load.end_s, load.is_divided = first, float(before["time_s"]), True
        self._present[load.tile] = other
        self._evidence.loads.append(other)
        self._reopen(load, first)
        self._renamed = {old: self._tokens if new == load.token else new for old, new in self._renamed.items()}
        if load.token >= 0:
            self._renamed[load.token] = self._tokens

    def _reopen(self, load: Load, first: int) -> None:
        """Undo decisions that took two feet for one, because `load` is divided at the sample `first`."""
        loads = self._evidence.loads
        feet = {part.foot for part in loads if self._evidence.are_neighbours(part, load)}
        near = [part for part in loads if part.foot in feet or self._evidence.are_neighbours(part, load)]
        reopened = [part for part in near if part.sample >= first - self._evidence.doubtful]
        # A foot that loses a load may not have got those that were assigned to it later.
        begun = {part.foot: part.rank() for part in sorted(reopened, key=Load.rank, reverse=True)}
        kept_from = self._count - self._delay_samples
        reopened += [
            part
            for part in near
            if part.foot and part.sample > kept_from and part.rank() > begun.get(part.foot, (math.inf, 0))
        ]
        for part in reopened:
            part.foot = 0

    def _split(self, load: Load, other: Load) -> None:
        """Split the force between `load` and the `other` that it was divided from, while both feet were on the tile."""
        load.is_split = True
        feet = shared(np.concatenate([other.track(), load.track()]), load.start_s)
        rows = self._waiting.rows
        mine = (rows["token"] == other.token) | (rows["token"] == load.token)
        mine &= rows["sample"] >= max(load.oldest, load.sample - self._shared_samples)
        places = np.flatnonzero(mine)
        begin, end = np.searchsorted(rows["time_s"][places], [feet.first_s, feet.last_s])
        # These are times of thinned samples.
        mine[places[: max(begin - self._every, 0)]] = mine[places[end + self._every :]] = False
        first, second, lead_n = feet.split(rows[mine])
        first["token"], second["token"] = other.token, load.token
        parted = np.concatenate([rows[~mine], first, second])
        parted = parted[np.argsort(parted["sample"], kind="stable")]
        self._waiting.replace(parted)
        thin_first, thin_second = (columns(part[part["sample"] % self._every == 0]) for part in (first, second))
        was, track = other.track(), load.track()
        other.tracks = [was[was[:, TIME] < first["time_s"][0]] if len(first) else was, thin_first]
        load.tracks = [thin_second, track[track[:, TIME] > second["time_s"][-1]] if len(second) else track]
        begins, ends = parted[parted["token"] == load.token][0], parted[parted["token"] == other.token][-1]
        load.sample, load.start_s = int(begins["sample"]), float(begins["time_s"])
        other.end, other.end_s = int(ends["sample"]) + 1, float(ends["time_s"])
        lead_s = float(parted["time_s"][np.searchsorted(parted["sample"], load.sample) - 1])
        self._add_event(BEGAN, load, load.sample, (lead_s, lead_n))
        self._add_event(ENDED, other, other.end, (other.end_s, math.nan))

    def _add_event(self, kind: int, load: Load, sample: int, before: tuple[float, float]) -> None:
        """Add an event of an earlier sample; `before` is the time and load that it records."""
        event = np.zeros(1, EVENT)
        event["kind"], event["sample"], event["token"], event["tile"] = kind, sample, load.token, load.tile
        event["time_s"], event["load_n"] = before
        bisect.insort(self._events, event[0], key=lambda event: event["sample"])

    def _decide(self, load: Load, *, final: bool = False) -> None:
        """Assign a load to a foot, if that can be decided by now."""
        if load.divided_from is not None and not load.is_split:
            if not final and load.end is None and self._evidence.now_s < load.start_s + SWING_S:
                return
            self._split(load, load.divided_from)
        candidates = self._evidence.candidates(load)
        if not final and any(other.foot == 0 for other in candidates):
            return
        distances_m = {
            foot: self._evidence.distance_from_foot_m(load, foot, final=final)
            for foot in {other.foot for other in candidates if other.foot}
        }
        same = {foot: cost_m for foot, cost_m in distances_m.items() if cost_m is not None}
        if any(math.isnan(cost_m) for cost_m in same.values()):
            return
        if same:
            self._assign(load, min(same, key=lambda foot: same[foot]))
        else:
            self._begin_foot(load)


class _WaitingRows:
    """Rows of `tracker_memory.ROW` that were not returned by `FootFinder.take` yet: appended at one end, and taken from
    the other without being moved.
    """

    def __init__(self) -> None:
        self._held = np.zeros(256, ROW)
        self._begin, self._end = 0, 0

    @property
    def rows(self) -> NDArray[np.void]:
        """The rows; a view that can be written to."""
        return self._held[self._begin : self._end]

    def append(self, rows: NDArray[np.void]) -> None:
        """Append rows."""
        if self._end + len(rows) > len(self._held):
            waiting = self.rows
            held = np.zeros(max(len(self._held), 2 * (len(waiting) + len(rows))), ROW)
            held[: len(waiting)] = waiting
            self._held, self._begin, self._end = held, 0, len(waiting)
        self._held[self._end : self._end + len(rows)] = rows
        self._end += len(rows)

    def take(self, count: int) -> NDArray[np.void]:
        """Remove the first rows, and return a copy of them."""
        taken = self.rows[:count].copy()
        self._begin += count
        return taken

    def replace(self, rows: NDArray[np.void]) -> None:
        """Replace all rows by others."""
        self._held, self._begin, self._end = rows, 0, len(rows)
