"""Contacts: feet and objects on the floor, tracked sample by sample, each with an id.

Corner forces include the unknown tare of the sensors. A tile in contact has one centroid (thesis 5.3;
docs/models.md#contact-centroid): `x = sum x_i f_i / sum f_i` over its sensors, less their baselines. Nothing is
clipped, because real corner forces can be negative. Tiles that carry one foot are merged (thesis 5.2.1): `x = sum F_k
x_k / sum F_k`.

A sensor's baseline is the median of its tile's quiet samples in the 2 s that ended 0.2 s ago: an approaching walker
bends real plates before the foot is on them (by 1 N per corner), and the tare drifts within minutes. The baseline is
held during a contact, and renewed after 0.5 s of quiet. Three cases have rules of their own:

- The first 50 ms of a stream give the initial baseline. A tile below 20 N, or below 100 N and steady, is empty, and
  its reading is the tare. Any other tile is loaded: its baseline is zero, and it is `untared` until it has been quiet.
- A tile with a negative load (below minus the on-threshold) for 0.1 s was tared while loaded. Its reading becomes the
  baseline.
- A steady residue that would prolong a contact for ever (0.5 s below the on-threshold, or below 100 N on an untared
  tile) is no foot. The contact ended when the load became steady, and the residue becomes the baseline.

40 ms without a sample, of all tiles or of one, are a gap. A contact ends there, and one after it is new; both are
`cut`.
"""

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct, field
from numpy.typing import ArrayLike, NDArray

from underfoot.array_tables import addresses
from underfoot.errors import require
from underfoot.floor import tracking
from underfoot.floor.baselines import bring_up_noise, renew_all
from underfoot.floor.feet import FootFinder
from underfoot.floor.forces import LEAST_HZ, MOST_HZ
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.loads import Load
from underfoot.floor.tracker_memory import BEGAN, tracker_memory

GAP_S = 0.040
"""Longest time between samples that is no gap (docs/contracts.md#forces-contacts-steps)."""

_ROUNDING_S = 1e-6
"""Times that differ by less are equal: samples that are 40 ms apart would be a gap or none, by when they come."""

SILENT_S = 0.5
"""Time without a sample of any tile after which nobody is on the floor any more, for those who look at it while it
runs: scenes, Monitor, other programs."""

OPENING_S, STEADY_N = 0.050, 5.0
"""Time from which the initial baselines are determined, and the range (or five sigma) in which a tare stays for half of
it."""

CURVE_S = 10.0
"""Length of the curve that is kept of a contact. No step is longer, but a person may stand for hours."""

SLAB = 256
"""Samples per call of the kernel: the capacity of its buffers."""


class ContactRows(Struct, frozen=True):
    """One row per contact and sample, in order of time: arrays of length n, and `on_tile` (n, tiles).

    Ids in `contact` count from 1; positions are in the floor's frame. `on_tile` marks the tiles of the contact.
    """

    time_s: NDArray[np.float64]
    contact: NDArray[np.int64]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    force_n: NDArray[np.float64]
    on_tile: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.time_s)

    def select(self, which: slice | NDArray[np.bool_]) -> "ContactRows":
        """Return the rows of a slice or mask."""
        return ContactRows(*(getattr(self, name)[which] for name in self.__struct_fields__))

    def tiles(self, floor: Floor) -> list[str]:
        """Return the tiles of each row as tables name them: "t1", "t1+t2"."""
        kinds, which = np.unique(self.on_tile, axis=0, return_inverse=True)
        names = ["+".join(floor.tiles[k].id for k in np.flatnonzero(kind)) for kind in kinds]
        return [names[i] for i in which.reshape(-1)]


class Contact(Struct, frozen=True):
    """A finished contact. `tiles` are the indices of its tiles in the floor, that with the largest impulse first.

    The curve (`time_s`, `force_n`, `x_m`, `y_m`, each of length n, floor frame) is that of the first ten seconds.
    `lead_s` and `lead_n` are time and load of the sample before the contact, NaN if there was none. It is `cut` if its
    beginning or end was not seen: at the recording's ends, at a gap, or on an untared tile. `spread_m2` has the second
    moments xx, xy and yy of its tiles' centroids about its own, weighted by force, while it was on more than one tile;
    else 0.
    """

    id: int
    start_s: float
    end_s: float
    tiles: tuple[int, ...]
    cut: bool
    lead_s: float
    lead_n: float
    time_s: NDArray[np.float64]
    force_n: NDArray[np.float64]
    x_m: NDArray[np.float64]
    y_m: NDArray[np.float64]
    spread_m2: tuple[float, float, float] = (0.0, 0.0, 0.0)


class OngoingContact(Struct, frozen=True):
    """A present contact, in the floor's frame. `id` is 0 until it is decided that it is a foot of its own.

    `person` is the walker's number if known (`walks.WalkTracker.person_at`), else 0. `loads` are the numbers of its
    tiles' loads, which do not change while these last.
    """

    id: int
    x_m: float
    y_m: float
    force_n: float
    tiles: tuple[int, ...]
    start_s: float = math.nan
    person: int = 0
    loads: tuple[int, ...] = ()


class TrackedContacts(Struct, frozen=True):
    """Results of a chunk of forces: rows, and finished contacts in the order of their ends."""

    rows: ContactRows
    finished: tuple[Contact, ...]


class ContactTracker:
    """Tracks the contacts on a floor in a stream of corner forces at about `rate_hz` (20 to 100,000).

    The results do not depend on how the stream is split into chunks. While somebody stands on the floor they are
    delayed by 0.6 s, and by 0.3 s more while loads are not assigned to feet yet (`feet.py`); nothing is returned in the
    first 50 ms of the stream. Apart from these, `ongoing` and the loads are not delayed.

    >>> from underfoot.floor.layout import default_floor
    >>> tracker = ContactTracker(default_floor(1, 1), rate_hz=1000.0)
    >>> time_s = np.arange(1000) / 1000.0
    >>> force_n = np.full((1000, 1, 4), 12.0)  # the sensors' tare
    >>> force_n[400:900] += 100.0
    >>> followed = tracker.feed(time_s, force_n)
    >>> contact, = followed.finished
    >>> contact.id, contact.start_s, contact.end_s, float(contact.force_n.max()), followed.rows.tiles(tracker.floor)[0]
    (1, 0.4, 0.899, 400.0, 't1')
    """

    def __init__(self, floor: Floor, rate_hz: float) -> None:
        require(LEAST_HZ <= rate_hz <= MOST_HZ, "rate_hz", rate_hz, f"{LEAST_HZ:g} to {MOST_HZ:g} Hz")
        self.floor = floor
        self.memory = tracker_memory(floor, rate_hz, SLAB, max(GAP_S, 2.5 / rate_hz) + _ROUNDING_S)
        """Memory of `tracking.follow`. Callers that have the samples in arrays of their own follow them with these in
        place of its first two."""
        self._where = addresses(self.memory)
        self._tiles = self.memory.tiles
        self._feet = FootFinder(floor, rate_hz, int(self.memory.stream[0]["every"]))
        self._ongoing: dict[int, _Ongoing] = {}
        self._opening: list[tuple[NDArray[np.float64], NDArray[np.float64]]] | None = []
        self._opening_length = max(8, math.ceil(OPENING_S * rate_hz))
        # This loads the kernels now, not at the first footfall.
        self._follow_slab(np.zeros(0), np.zeros((0, len(self._tiles), 4)))
        self._join(self.memory.rows[:0], np.zeros(0, np.int64))
        bring_up_noise(self.memory)
        self.tare()

    def feed(self, time_s: ArrayLike, force_n: ArrayLike) -> TrackedContacts:
        """Process the next samples: `time_s` (n,), ascending, and `force_n` (n, tiles, 4), in newtons.

        NaN is a gap of its tile (`LossConcealment` bridges shorter ones). Raises `BadValue` for other shapes.
        """
        times = np.ascontiguousarray(time_s, dtype=np.float64)
        forces = np.ascontiguousarray(force_n, dtype=np.float64)
        require(times.ndim == 1, "the shape of time_s", times.shape, "(n,)")
        allowed = (len(times), len(self._tiles), 4)
        require(forces.shape == allowed, "the shape of force_n", forces.shape, str(allowed))
        if self._opening is not None:
            self._opening.append((times.copy(), forces.copy()))
            if sum(len(chunk) for chunk, _ in self._opening) < self._opening_length:
                return self._flush()
            times, forces = self._open_stream(self._opening)
        return self._follow(times, forces)

    def finish(self) -> TrackedContacts:
        """End the stream; return the delayed results, and the ongoing contacts as cut ones."""
        opened = [self._follow(*self._open_stream(self._opening))] if self._opening else []
        happened = tracking.end_all(self.memory)
        self._feet.finish(self.memory.events[:happened])
        return joined([*opened, self._flush(everything=True)], len(self._tiles))

    @property
    def opening(self) -> bool:
        """Whether the stream's first 50 ms are still being collected."""
        return self._opening is not None

    def tare(self) -> None:
        """Set all baselines to the readings of the last 0.1 s. Contacts end with the next sample."""
        renew_all(self.memory)

    def ongoing(self) -> tuple[OngoingContact, ...]:
        """Return the contacts at the latest sample; their assignment to feet may be provisional."""
        loads_of: dict[int, list[Load]] = {}
        foot_of: dict[int, int] = {}
        for load, earlier in sorted(self._feet.present_loads(), key=lambda found: found[0].sample):
            foot = load.foot or (foot_of.get(earlier.token, earlier.foot) if earlier else 0) or -1 - load.tile
            foot_of[load.token] = foot
            loads_of.setdefault(foot, []).append(load)
        return tuple(self._ongoing_contact(max(foot, 0), loads) for foot, loads in loads_of.items())

    @property
    def loads_n(self) -> NDArray[np.float64]:
        """The load on each tile at the latest sample, less its baseline: shape (tiles,)."""
        return self._tiles["load_n"].copy()

    @property
    def baseline_n(self) -> NDArray[np.float64]:
        """The reading of each sensor without load: shape (tiles, 4)."""
        return self._tiles["base_n"].copy()

    @property
    def noise_n(self) -> NDArray[np.float64]:
        """The noise of each tile's unloaded sum, 1.4826 times its median absolute deviation: shape (tiles,)."""
        bring_up_noise(self.memory)
        return self._tiles["noise_n"].copy()

    @property
    def untared(self) -> NDArray[np.bool_]:
        """The tiles that were loaded from the first sample on and have not been quiet since: shape (tiles,)."""
        return self._tiles["untared"].copy()

    @property
    def began_untared(self) -> NDArray[np.bool_]:
        """The tiles that were loaded from the first sample on: shape (tiles,)."""
        return self._tiles["began_untared"].copy()

    def _open_stream(
        self, chunks: list[tuple[NDArray[np.float64], NDArray[np.float64]]]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Determine the initial baselines from the first samples `chunks`; return times and forces of these."""
        self._opening = None
        times = np.concatenate([chunk for chunk, _ in chunks])
        forces = np.concatenate([chunk for _, chunk in chunks])
        for k, tile in enumerate(self._tiles):
            corners = forces[: self._opening_length, k]
            corners = corners[np.isfinite(corners).all(axis=1)]
            if not len(corners):
                continue
            sums = corners.sum(axis=1)
            level = np.median(sums[:5])
            # Differences of successive samples: a foot that comes down adds little to them.
            noise = 1.4826 * float(np.median(np.abs(np.diff(sums)))) / math.sqrt(2.0) if len(sums) > 1 else 0.0
            loaded = level >= tracking.ON_N
            leaves = np.abs(sums - level) >= max(STEADY_N if loaded else tracking.ON_N, tracking.ON_SIGMAS * noise)
            quiet = int(leaves.argmax()) if leaves.any() else len(sums)
            untared = level >= tracking.TARE_N or (loaded and quiet < len(sums) / 2)
            tile["untared"] = tile["began_untared"] = untared
            if not untared:
                tile["base_n"] = np.median(corners[: max(quiet, 1)], axis=0)
                tile["noise_n"] = noise
        return times, forces

    def _follow(self, times: NDArray[np.float64], forces: NDArray[np.float64]) -> TrackedContacts:
        slabs = (slice(i, i + SLAB) for i in range(0, len(times), SLAB))
        return joined([self._follow_slab(times[slab], forces[slab]) for slab in slabs], len(self._tiles))

    def _follow_slab(self, times: NDArray[np.float64], forces: NDArray[np.float64]) -> TrackedContacts:
        count = len(times)
        self.memory.time_s[:count], self.memory.force_n[:count] = times, forces
        written, happened = tracking.follow(self.memory, self._where, count)
        self._feet.feed(self.memory.rows[:written], self.memory.events[:happened], times)
        return self._flush()

    def _flush(self, *, everything: bool = False) -> TrackedContacts:
        """Return the results that are decided, or everything."""
        found, feet, events = self._feet.take(everything=everything)
        if not len(found) and not events:
            return TrackedContacts(_no_rows(len(self._tiles)), ())
        rows = self._join(found, feet)
        for foot, event in events:
            if event["kind"] == BEGAN:
                one = self._ongoing.setdefault(foot, _Ongoing(foot, event["cut"], event["time_s"], event["load_n"]))
                one.standing += 1
            else:
                one = self._ongoing[foot]
                one.standing -= 1
                one.end_s = max(one.end_s, float(event["time_s"]))
            one.cut = bool(one.cut or event["cut"])
        for foot, one in self._ongoing.items():
            if len(rows):
                mine = feet == foot
                one.take(rows.select(rows.contact == foot), found[mine])
        left = [one for one in self._ongoing.values() if one.standing == 0]
        awaited = self._feet.awaited() if left else set()
        over = sorted((one for one in left if one.id not in awaited), key=lambda one: one.end_s)
        for one in over:
            del self._ongoing[one.id]
        return TrackedContacts(rows, tuple(one.close() for one in over))

    def _join(self, rows: NDArray[np.void], feet: NDArray[np.int64]) -> ContactRows:
        joined = _no_rows(len(self._tiles), len(rows))
        columns = (getattr(joined, name) for name in joined.__struct_fields__)
        return joined.select(slice(tracking.join(rows, feet, *columns)))

    def _ongoing_contact(self, id: int, loads: Sequence[Load]) -> OngoingContact:
        """Return the contact of these present loads, in the order of their beginnings."""
        tiles = sorted(load.tile for load in loads)
        rows = self._tiles[tiles]
        force_n = float(rows["load_n"].sum())
        share = rows["load_n"] / force_n
        return OngoingContact(
            id,
            float(share @ rows["x_m"]),
            float(share @ rows["y_m"]),
            force_n,
            tuple(tiles),
            loads[0].start_s,
            loads=tuple(load.token for load in loads),
        )


class _Ongoing(Struct):
    """An unfinished contact, at present on `standing` tiles."""

    id: int
    cut: bool
    lead_s: float
    lead_n: float
    standing: int = 0
    end_s: float = -math.inf
    parts: list[ContactRows] = field(default_factory=list)
    loads: list[NDArray[np.void]] = field(default_factory=list)

    def take(self, rows: ContactRows, loads: NDArray[np.void]) -> None:
        """Append rows of the contact, and those of its loads."""
        if len(rows) and (not self.parts or rows.time_s[0] - self.parts[0].time_s[0] <= CURVE_S):
            self.parts.append(rows)
            self.loads.append(loads)

    def close(self) -> Contact:
        curve = {name: np.concatenate([getattr(part, name) for part in self.parts]) for name in _CURVE}
        start_s = float(curve["time_s"][0])
        kept = curve["time_s"] <= min(self.end_s, start_s + CURVE_S)
        # Summed at once: partial sums would depend on how the stream was split.
        loads = np.concatenate(self.loads)
        impulse = np.bincount(loads["tile"], weights=loads["force_n"])
        loaded = np.unique(loads["tile"])
        return Contact(
            id=self.id,
            start_s=start_s,
            end_s=self.end_s,
            tiles=tuple(loaded[np.argsort(-impulse[loaded], kind="stable")].tolist()),
            cut=self.cut,
            lead_s=math.nan if self.cut else self.lead_s,
            lead_n=self.lead_n,
            spread_m2=_spread(loads, curve["x_m"], curve["y_m"]),
            **{name: column[kept] for name, column in curve.items()},
        )


def _spread(loads: NDArray[np.void], x_m: NDArray[np.float64], y_m: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the second moments of loads about their foot's centroid (n,), of its n samples those with several."""
    _, at, count = np.unique(loads["sample"], return_inverse=True, return_counts=True)
    several = count[at] > 1
    if not several.any():
        return 0.0, 0.0, 0.0
    x = (loads["x_m"] - x_m[at])[several]
    y = (loads["y_m"] - y_m[at])[several]
    xx, xy, yy = (float(np.average(product, weights=loads["force_n"][several])) for product in (x * x, x * y, y * y))
    return xx, xy, yy


_CURVE = ("time_s", "force_n", "x_m", "y_m")


def _no_rows(tiles: int, length: int = 0) -> ContactRows:
    def zeros() -> NDArray[np.float64]:
        return np.zeros(length)

    on_tile = np.zeros((length, tiles), np.bool_)
    return ContactRows(zeros(), np.zeros(length, np.int64), zeros(), zeros(), zeros(), on_tile)


def joined(parts: Sequence[TrackedContacts], tiles: int) -> TrackedContacts:
    """Return the results of pieces that follow each other, of a floor with so many tiles."""
    if len(parts) == 1:
        return parts[0]
    rows = [part.rows for part in parts if len(part.rows)] or [_no_rows(tiles)]
    columns = (np.concatenate([getattr(row, name) for row in rows]) for name in ContactRows.__struct_fields__)
    return TrackedContacts(ContactRows(*columns), tuple(contact for part in parts for contact in part.finished))


def load_kernels() -> None:
    """Load or compile all kernels of tracking, including those of a tare."""
    rate_hz = 1000.0
    tracker = ContactTracker(default_floor(1, 2), rate_hz)
    force_n = np.zeros((400, 2, 4))
    force_n[200:300] = 50.0
    tracker.feed(np.arange(400) / rate_hz, force_n)
    tracker.tare()
