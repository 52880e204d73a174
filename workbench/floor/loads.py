"""What presses on one tile, and where: tracks of loads, and whether they are near enough for one foot's."""

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.shared_loads import BOTH_FEET_S, JUMP_S, LOADED_N

LENGTH_M, WIDTH_M, APART_M = 0.33, 0.13, 0.26
"""The box into which the centroids of a foot's loads fit: the longest feet are 0.34 m, and 0.12 m broad. At one time
they are at most `APART_M` apart, three quarters of such a foot: from the heel to the middle of what the heel is not."""

SWING_S = 0.30
"""A walker's feet come down at least so long apart (200 steps a minute)."""

TOES_M, BEHIND_M, TOES_OUTLAST_S = 0.14, 0.03, 0.15
"""The toes come down within `TOES_M` of the foot's centre of pressure, at most `BEHIND_M` behind it, and leave at most
`TOES_OUTLAST_S` after the rest."""

BEFORE_S = 0.10
"""So long before that two feet may have been on the tile."""

RELIEVED_SHARE = 0.4
"""Between its peaks a walker's foot bears more than this share of the first; and its second is larger than that."""

DIP_SHARE, DIP_RISE = 0.8, 1.1
"""Between its peaks a walker's foot bears at most this share of the first, and then at least so many times as much."""

KEPT_S = 2.0
"""So much of a load's track is looked at."""

_DIRECTIONS = 16
_ANGLES = np.arange(_DIRECTIONS) * math.pi / _DIRECTIONS
_TOWARDS = np.stack([np.cos(_ANGLES), np.sin(_ANGLES)])


@dataclass(eq=False)
class Load:
    """What presses on one tile, from when until when (`end` None while it lasts), and whose foot it is: 0 while open.

    `shared` is the load that it was divided from, and `is_parted` whether it is known since when, and what each bore;
    `oldest` is the first sample that was not given out when it was divided. `tracks` are its thinned samples: time, x,
    y, force.
    """

    token: int
    tile: int
    sample: int
    start_s: float
    shared: "Load | None" = None
    end: int | None = None
    end_s: float = math.inf
    foot: int = 0
    is_parted: bool = False
    oldest: int = 0
    is_divided: bool = False
    is_cut: bool = False
    tracks: list[NDArray[np.float64]] = field(default_factory=list)

    def rank(self) -> tuple[float, int]:
        """Its place in the order of decisions: one that was divided may turn out to have begun earlier, and is late."""
        late_s = 0.0 if self.shared is None else BOTH_FEET_S if self.is_parted else SWING_S
        return self.start_s + late_s, self.token

    def track(self) -> NDArray[np.float64]:
        """Its last two seconds: shape (n, 4)."""
        if len(self.tracks) > 1:
            joined = np.concatenate(self.tracks)
            last_s = joined[-1, 0] if len(joined) else 0.0
            self.tracks = [joined[np.searchsorted(joined[:, 0], last_s - KEPT_S) :]]
        return self.tracks[0] if self.tracks else np.zeros((0, 4))


def columns(rows: NDArray[np.void]) -> NDArray[np.float64]:
    """Rows as a load's track has them."""
    return np.column_stack([rows[name] for name in ("time_s", "x_m", "y_m", "force_n")])


def loaded(load: Load, until_s: float) -> NDArray[np.float64]:
    """A load's track where it says something: above `LOADED_N`, and not while two feet share it."""
    track = load.track()
    kept = (track[:, 3] >= LOADED_N) & (track[:, 0] <= until_s)
    if load.shared is not None:
        kept &= track[:, 0] >= load.start_s + JUMP_S
    if load.is_divided:
        kept &= track[:, 0] <= load.end_s - BEFORE_S
    return track[kept]


def centre_m(track: NDArray[np.float64], time_s: float) -> NDArray[np.float64]:
    """The centre of pressure of several loads' tracks, about a time."""
    near = track[np.abs(track[:, 0] - time_s) <= max(0.02, float(np.abs(track[:, 0] - time_s).min()))]
    return np.asarray(np.average(near[:, 1:3], axis=0, weights=near[:, 3]))


def distance_m(first: NDArray[np.float64], track: NDArray[np.float64]) -> float:
    """How far a sample of a track is from several loads' centre of pressure at that time."""
    return float(np.hypot(*(first[1:3] - centre_m(track, float(first[0])))))


def present_distance_m(load: Load, other: Load) -> float:
    """How far two loads press from each other now; 0 where one has just begun."""
    track, others = load.track(), other.track()
    return math.dist(track[-1, 1:3], others[-1, 1:3]) if len(track) and len(others) else 0.0


def nearest_distance_m(mine: NDArray[np.float64], track: NDArray[np.float64]) -> float:
    """How near two loads come at one time, looked at eight times; one that is shared for a while may begin far away."""
    return min(distance_m(row, track) for row in mine[:: max(1, len(mine) // 8)])


def total(loads: list[Load]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What loads bear together: times and forces."""
    tracks = np.concatenate([load.track() for load in loads])
    time_s, at = np.unique(tracks[:, 0], return_inverse=True)
    return time_s, np.asarray(np.bincount(at, tracks[:, 3]), np.float64)


def dips(force_n: NDArray[np.float64], begin: int = 0) -> bool:
    """Whether a force is, from `begin` on, as small as a walker's foot's between its two peaks."""
    before, after = np.maximum.accumulate(force_n), np.maximum.accumulate(force_n[::-1])[::-1]
    low = (force_n <= DIP_SHARE * before) & (DIP_RISE * force_n <= after)
    return bool(low[begin:].any())


def bears_twice(loads: list[Load]) -> bool:
    """Whether what loads bear together falls far and rises again, as no foot's does."""
    _, force_n = total(loads)
    if not len(force_n):
        return False
    most_n = np.maximum.accumulate(force_n)
    relieved = force_n < RELIEVED_SHARE * most_n
    if not relieved.any():
        return False
    later = force_n[int(relieved.argmax()) :]
    return bool((later - np.minimum.accumulate(later)).max() >= RELIEVED_SHARE * most_n[-1])


def light_load_m(load: Load, parts: list[Load], now_s: float) -> float | None:
    """How far a load, too light to tell anything but where it is, began from a foot of which it is a part; None if it
    is none."""
    mine, track = load.track(), np.concatenate([other.track() for other in parts])
    if not len(mine) or not len(track):
        return LENGTH_M
    near, late = distance_m(mine[0], track), load.start_s - min(other.start_s for other in parts) >= SWING_S
    outlasts = late and min(load.end_s, now_s) - max(other.end_s for other in parts) > TOES_OUTLAST_S
    return near if near <= (TOES_M if late else LENGTH_M) and not outlasts else None


def toes_m(mine: NDArray[np.float64], track: NDArray[np.float64], outlasts_s: float) -> float | None:
    """How far from a foot its toes came down, if a load that outlasts the rest by `outlasts_s` are they; else None."""
    near = distance_m(mine[0], track)
    if near > TOES_M or outlasts_s > TOES_OUTLAST_S:
        return None
    centre = centre_m(track, float(mine[0, 0]))
    first = track[track[:, 0] <= track[0, 0] + 0.1]
    rolled = centre - np.average(first[:, 1:3], axis=0, weights=first[:, 3])
    length_m = float(np.hypot(*rolled))
    behind = length_m >= 2.0 * BEHIND_M and float((mine[0, 1:3] - centre) @ rolled) < -BEHIND_M * length_m
    return None if behind else near


def fits_in_foot(places_m: NDArray[np.float64]) -> bool:
    """Whether places (n, 2) lie in a foot's box, turned to the best of sixteen directions."""
    along = places_m @ _TOWARDS
    extent = along.max(axis=0) - along.min(axis=0)
    half = _DIRECTIONS // 2
    return bool(((extent <= LENGTH_M) & (np.roll(extent, half) <= WIDTH_M)).any())
