"""A load is the force on one tile from its beginning to its end; a foot may make several. Their tracks, compared."""

import math

import numpy as np
from msgspec import Struct, field
from numpy.typing import NDArray

from underfoot.floor.shared_loads import BOTH_FEET_S, FORCE, JUMP_S, LOADED_N, PLACE, TIME

LENGTH_M, WIDTH_M = 0.33, 0.13
"""The box into which the centroids of a foot's loads fit: the longest feet are 0.34 m long and 0.12 m wide."""

SWING_S = 0.30
"""Shortest time between the touchdowns of a walker's feet (200 steps per minute)."""

TOES_M, BEHIND_M, TOES_OUTLAST_S = 0.14, 0.03, 0.15
"""Toes come down within `TOES_M` of the foot's centre of pressure, at most `BEHIND_M` behind it, and leave at most
`TOES_OUTLAST_S` after the rest."""

BEFORE_S = 0.10
"""Time before a handover in which both feet may have been on the tile."""

VALLEY_SHARE, RISE_SHARE = 0.25, 0.4
"""Between the peaks of a walker's foot the force stays above `VALLEY_SHARE` of the first. Measured walks at an ordinary
pace have 0.38 to 0.74, and the faster the less. What rises by `RISE_SHARE` after less is another foot."""

DIP_SHARE, DIP_RISE = 0.8, 1.1
"""Between the peaks of a walker's foot the force falls to `DIP_SHARE` of the first, and then rises by `DIP_RISE`."""

KEPT_S = 2.0
"""Length of the track that is kept of a load."""

_CENTRE_S = 0.02
"""Half of the time over which a centre of pressure is averaged, or more if no sample is that near."""
_FIRST_S = 0.1
"""Time after a foot's beginning over which the place from which it rolls is averaged."""
_DIRECTIONS = 256
"""Orientations in which the box is tried, over half a turn: 0.35 degrees off, the longest foot is 2 mm broader."""
_ANGLES = np.arange(_DIRECTIONS) * math.pi / _DIRECTIONS
_TOWARDS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


class Load(Struct, eq=False):
    """Force on one tile from `sample` to `end` (None while it lasts); `foot` is its foot's number, 0 while undecided.

    `tracks` are thinned samples, [sample, column] (see `shared_loads.TIME`). If a load goes over from one foot to
    another it is divided in two: `divided_from` is the earlier one, and `is_split` says whether the force in the time
    of both feet was split between them. `oldest` is the first sample that can still be changed for that. `is_divided`:
    a later load was divided from this one. `is_cut`: its end was not seen.
    """

    token: int
    tile: int
    sample: int
    start_s: float
    divided_from: "Load | None" = None
    end: int | None = None
    end_s: float = math.inf
    foot: int = 0
    is_split: bool = False
    oldest: int = 0
    is_divided: bool = False
    is_cut: bool = False
    tracks: list[NDArray[np.float64]] = field(default_factory=list)

    def rank(self) -> tuple[float, int]:
        """Return the order of decisions: by beginning, but later for a divided load, which may have begun earlier."""
        late_s = 0.0 if self.divided_from is None else BOTH_FEET_S if self.is_split else SWING_S
        return self.start_s + late_s, self.token

    def track(self) -> NDArray[np.float64]:
        """Return the samples of the last two seconds: shape (n, 4)."""
        if len(self.tracks) > 1:
            joined = np.concatenate(self.tracks)
            last_s = joined[-1, TIME] if len(joined) else 0.0
            self.tracks = [joined[np.searchsorted(joined[:, TIME], last_s - KEPT_S) :]]
        return self.tracks[0] if self.tracks else np.zeros((0, 4))


def columns(rows: NDArray[np.void]) -> NDArray[np.float64]:
    """Return `tracker_memory.ROW` rows as columns of a track."""
    return np.column_stack([rows[name] for name in ("time_s", "x_m", "y_m", "force_n")])


def loaded(load: Load, until_s: float) -> NDArray[np.float64]:
    """Return the reliable part of a load's track: above `LOADED_N`, without the time when two feet shared it."""
    track = load.track()
    kept = (track[:, FORCE] >= LOADED_N) & (track[:, TIME] <= until_s)
    if load.divided_from is not None:
        kept &= track[:, TIME] >= load.start_s + JUMP_S
    if load.is_divided:
        kept &= track[:, TIME] <= load.end_s - BEFORE_S
    return track[kept]


def centre_m(track: NDArray[np.float64], time_s: float) -> NDArray[np.float64]:
    """Return the centre of pressure of a track, which may be several loads', around a time."""
    apart_s = np.abs(track[:, TIME] - time_s)
    near = track[apart_s <= max(_CENTRE_S, float(apart_s.min()))]
    force_n = near[:, FORCE, None]
    return np.asarray((near[:, PLACE] * force_n).sum(axis=0) / force_n.sum(axis=0))  # np.average takes thrice as long


def distance_m(first: NDArray[np.float64], track: NDArray[np.float64]) -> float:
    """Return the distance of a sample `first` from the centre of pressure of a track at that time."""
    return float(np.hypot(*(first[PLACE] - centre_m(track, float(first[TIME])))))


def present_distance_m(load: Load, other: Load) -> float:
    """Return the present distance of two loads' centroids; 0 if one has just begun."""
    track, others = load.track(), other.track()
    return math.dist(track[-1, PLACE], others[-1, PLACE]) if len(track) and len(others) else 0.0


def nearest_distance_m(mine: NDArray[np.float64], track: NDArray[np.float64]) -> float:
    """Return the least distance of two tracks at eight times of the first, which may begin far away if it is shared."""
    return min(distance_m(row, track) for row in mine[:: max(1, len(mine) // 8)])


def total(loads: list[Load]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times and the sum of the loads' forces."""
    tracks = np.concatenate([load.track() for load in loads])
    time_s, at = np.unique(tracks[:, TIME], return_inverse=True)
    return time_s, np.asarray(np.bincount(at, tracks[:, FORCE]), np.float64)


def dips(force_n: NDArray[np.float64], begin: int = 0) -> bool:
    """Return whether a force has a dip, from index `begin` on, like that between the two peaks of a step."""
    before, after = np.maximum.accumulate(force_n), np.maximum.accumulate(force_n[::-1])[::-1]
    low = (force_n <= DIP_SHARE * before) & (DIP_RISE * force_n <= after)
    return bool(low[begin:].any())


def bears_twice(loads: list[Load]) -> bool:
    """Return whether the loads' sum falls far and rises again, which that of one foot does not."""
    _, force_n = total(loads)
    if not len(force_n):
        return False
    most_n = np.maximum.accumulate(force_n)
    relieved = force_n < VALLEY_SHARE * most_n
    if not relieved.any():
        return False
    later = force_n[int(relieved.argmax()) :]
    return bool((later - np.minimum.accumulate(later)).max() >= RISE_SHARE * most_n[-1])


def light_load_m(load: Load, parts: list[Load], now_s: float) -> float | None:
    """Return how far a load, too light for other criteria, began from the foot of `parts`; None if not part of it."""
    mine, track = load.track(), np.concatenate([other.track() for other in parts])
    if not len(mine) or not len(track):
        return LENGTH_M
    near, late = distance_m(mine[0], track), load.start_s - min(other.start_s for other in parts) >= SWING_S
    outlasts = late and min(load.end_s, now_s) - max(other.end_s for other in parts) > TOES_OUTLAST_S
    return near if near <= (TOES_M if late else LENGTH_M) and not outlasts else None


def toes_m(mine: NDArray[np.float64], track: NDArray[np.float64], outlasts_s: float) -> float | None:
    """Return how far a load began from a foot with this `track`, if it can be its toes; else None.

    The load outlasts the foot's other loads by `outlasts_s`.
    """
    near = distance_m(mine[0], track)
    if near > TOES_M or outlasts_s > TOES_OUTLAST_S:
        return None
    centre = centre_m(track, float(mine[0, TIME]))
    first = track[track[:, TIME] <= track[0, TIME] + _FIRST_S]
    rolled = centre - np.average(first[:, PLACE], axis=0, weights=first[:, FORCE])
    length_m = float(np.hypot(*rolled))
    behind = length_m >= 2.0 * BEHIND_M and float((mine[0, PLACE] - centre) @ rolled) < -BEHIND_M * length_m
    return None if behind else near


def fits_in_foot(places_m: NDArray[np.float64]) -> bool:
    """Return whether places (n, 2) lie in a foot's box, however it is turned."""
    along = places_m @ _TOWARDS
    extent = along.max(axis=0) - along.min(axis=0)
    half = _DIRECTIONS // 2
    return bool(((extent <= LENGTH_M) & (np.roll(extent, half) <= WIDTH_M)).any())
