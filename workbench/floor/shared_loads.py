"""Handover of a tile's load from one foot to the next: when it happens, and what each bears while both are down.

Four vertical forces give one force F and one centroid x, also if two feet are on the tile
(docs/models.md#one-foot-or-two):

    F = F_1 + F_2,   F x = F_1 x_1 + F_2 x_2

The first foot is taken to roll on in a straight line, as before the second came; the second one is taken to be on the
line that it follows once it is alone. With both places known, the force of each follows.
"""

import math

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from underfoot.floor.tracking import OFF_SHARE, ON_N
from underfoot.kernels import Floats

JUMP_M, SIDEWAYS_M, SAME_WAY_COSINE, JUMP_S, STAYS_LOADED_S, HEEL_STRIKE_S = 0.10, 0.06, 0.5, 0.15, 0.10, 0.25
"""A load is handed over if its centroid moves `JUMP_M` in `JUMP_S`, or `SIDEWAYS_M` in another direction than that in
which it rolled (cosine below `SAME_WAY_COSINE`), and the tile stays loaded for `STAYS_LOADED_S`. Not in the first
`HEEL_STRIKE_S`, in which the centroid moves from the heel to the whole foot."""

SLOW_JUMP_S, SLOW_STANCE_S = 0.25, (0.8, 1.8)
"""Who walks slowly has both feet down for longer: while a load is of the age `SLOW_STANCE_S`, its centroid may take
`SLOW_JUMP_S`, if it has rolled on by `SIDEWAYS_M` since `HEEL_STRIKE_S` and does not go back. A foot of 0.31 m that
stays for so long rolls at most 0.08 m meanwhile (`gait.roll`). Who stands does not roll on, and sways to and fro."""

APART_M = 0.26
"""Largest distance between the centroids of a foot's parts: from the heel to the middle of the rest, three quarters of
the longest foot."""

STRIKE_S = 0.10
"""In the first `HEEL_STRIKE_S` a load is handed over only if its centroid moves further than `APART_M`; or `JUMP_M` if
it was no heel, which would bear `LOADED_N` within `STRIKE_S`."""

RISE_FACTOR, RISEN_JUMP_M = 1.5, 0.045
"""If the load rises by `RISE_FACTOR` meanwhile, `RISEN_JUMP_M` is enough, unless the centroid moves on in the direction
from where its foot came down."""

HANDOVER_SHARE = 0.65
"""Share of the jump at which the load becomes the next foot's: above a half, because the first foot is still there."""

RELIEVED_SHARE, RELIEVED_MOVE_M = 0.3, 0.05
"""A load is also handed over if its force falls below `RELIEVED_SHARE` of its maximum and rises again, either
`RELIEVED_MOVE_M` away or while a load beside it begins."""

LOADED_N = 50.0
"""Below this force a centroid is too uncertain to be used."""

BOTH_FEET_S, SINGLE_FOOT_S = 0.20, 0.08
"""Both feet are down for at most `BOTH_FEET_S` before and after a handover. The line of each is fitted to
`SINGLE_FOOT_S` of the time when it is alone."""

SECOND_FOOT_SHARE = 0.05
"""Share of the load from which a second foot is certainly down; smaller ones may be errors of the first foot's line."""

LEAST_SHARE = 1e-3
"""Smallest share of a load that a foot can bear."""

_ROUNDS = 4
"""Iterations between the interval in which both feet are down and the lines fitted outside it."""

TIME, PLACE, FORCE = 0, slice(1, 3), 3
"""Columns of a track, float64 [sample, column]: s, then x and y in m, then N."""


class SharedLoad(Struct, frozen=True):
    """Two feet on one tile, from `first_s`, when the second came down, to `last_s`, when the first left.

    `places_m` (2, 2) has the place of the first foot at `first_s` and of the second at `last_s`, `speeds_m_s` (2, 2)
    their speeds.
    """

    first_s: float
    last_s: float
    places_m: Floats
    speeds_m_s: Floats

    def feet_m(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Return the places of the first and the second foot at `time_s` (n,): shape (n, 2) each."""
        first = self.places_m[0] + np.outer(time_s - self.first_s, self.speeds_m_s[0])
        second = self.places_m[1] + np.outer(time_s - self.last_s, self.speeds_m_s[1])
        return first, second

    def shares(self, time_s: Floats, centroid_m: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the second foot's share of the load (n,), and the places of both (n, 2).

        If the centroid is not on the line between them, both places are shifted to it, so that the moments are kept.
        """
        first, second = self.feet_m(time_s)
        way = second - first
        along = ((centroid_m - first) * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-9)
        # Without force a foot would have no place.
        share = np.clip(along, LEAST_SHARE, 1.0 - LEAST_SHARE)
        off = centroid_m - first - share[:, None] * way
        return share, first + off, second + off

    def split(self, rows: NDArray[np.void]) -> tuple[NDArray[np.void], NDArray[np.void], float]:
        """Return the rows of each foot while it is down, and the second foot's force just before that.

        `rows` (n,) are those of the load. At each sample the two forces sum to the load; a foot that is alone bears it
        all. If both were never down together, the load is the second's from where it bears half.
        """
        share, first_m, second_m = self.shares(rows["time_s"], np.column_stack([rows["x_m"], rows["y_m"]]))
        first_n, second_n = (1.0 - share) * rows["force_n"], share * rows["force_n"]
        begins = int(np.argmax(np.append(second_n >= ON_N, True)))
        ends = len(rows) - int(np.argmax(np.append(first_n[::-1] >= OFF_SHARE * ON_N, True)))
        if begins >= ends:
            at = ends + int(np.argmax(np.append(share[ends:begins] >= 0.5, True)))
            return rows[:at].copy(), rows[at:].copy(), 0.0
        first, second = rows.copy(), rows.copy()
        both = slice(begins, ends)
        first["force_n"][both], second["force_n"][both] = first_n[both], second_n[both]
        for column, name in enumerate(("x_m", "y_m")):
            first[name][both], second[name][both] = first_m[both, column], second_m[both, column]
        return first[:ends], second[begins:], float(second_n[begins - 1]) if begins else 0.0


def shared(track: Floats, at_s: float) -> SharedLoad:
    """Return how two feet shared a load that was handed over at `at_s`, from its `track` before and after that."""
    time_s, places_m, force_n = track[:, TIME], track[:, PLACE], track[:, FORCE]
    first_s, last_s = at_s - 0.8 * BOTH_FEET_S, at_s + 0.7 * BOTH_FEET_S  # a first guess
    for _ in range(_ROUNDS):
        found = SharedLoad(
            first_s,
            last_s,
            *np.stack(
                [
                    _line(track, first_s - SINGLE_FOOT_S, first_s, first_s),
                    _line(track, last_s, last_s + SINGLE_FOOT_S, last_s),
                ],
                axis=1,
            ),
        )
        share = found.shares(time_s, places_m)[0]
        least_n = np.maximum(ON_N, SECOND_FOOT_SHARE * force_n)
        before = time_s[(time_s <= at_s) & (time_s >= at_s - BOTH_FEET_S) & (share * force_n < least_n)]
        after = time_s[(time_s >= at_s) & (time_s <= at_s + BOTH_FEET_S) & ((1.0 - share) * force_n < least_n)]
        first_s = float(before[-1]) if len(before) else max(at_s - BOTH_FEET_S, float(time_s[0]))
        last_s = float(after[0]) if len(after) else min(at_s + BOTH_FEET_S, float(time_s[-1]))
    return found


def _line(track: Floats, begin_s: float, end_s: float, at_s: float) -> Floats:
    """Fit a straight line to a track between two times; return its place at `at_s` and its speed: shape (2, 2)."""
    near = track[(track[:, TIME] >= begin_s) & (track[:, TIME] <= end_s)]
    if len(near) < 3:
        near = track[np.argsort(np.abs(track[:, TIME] - 0.5 * (begin_s + end_s)))[:3]]
        return np.stack([np.average(near[:, PLACE], axis=0, weights=near[:, FORCE]), np.zeros(2)])
    weight = near[:, FORCE] / near[:, FORCE].sum()
    middle_s, middle_m = weight @ near[:, TIME], weight @ near[:, PLACE]
    since_s = near[:, TIME] - middle_s
    speed = (weight * since_s) @ (near[:, PLACE] - middle_m) / max(float(weight @ since_s**2), 1e-12)
    if near[-1, TIME] - near[0, TIME] < 0.5 * SINGLE_FOOT_S:
        speed = np.zeros(2)  # too short for a speed
    return np.stack([middle_m + speed * (at_s - middle_s), speed])


def jump_time_s(track: Floats, start_s: float, touchdown_m: Floats, *, passed_on: bool = False) -> float | None:
    """Return when a load's centroid jumped from one foot to the next, in the last samples of its track; else None.

    The load began at `start_s`; its foot came down at `touchdown_m` (2,), perhaps on another tile. A load that began
    with a handover (`passed_on`) is not handed over again in its first `HEEL_STRIKE_S`.
    """
    if track[-1, TIME] - start_s < JUMP_S + STAYS_LOADED_S:
        return None
    time_s = track[:, TIME]
    end_s = time_s[-1] - STAYS_LOADED_S
    begin, slow, end = np.searchsorted(time_s, [end_s - JUMP_S, end_s - SLOW_JUMP_S, end_s])
    if SLOW_STANCE_S[0] <= end_s - start_s <= SLOW_STANCE_S[1] and _walks_on(track, start_s, slow, end):
        begin = slow
    towards = track[end, PLACE] - track[begin, PLACE]
    place_m, length_m = track[begin, PLACE], float(np.hypot(*towards))
    if time_s[begin] < start_s + HEEL_STRIKE_S:
        stays = np.hypot(*(track[end:, PLACE] - track[end, PLACE]).T).max() <= SIDEWAYS_M
        if passed_on or not stays or length_m < (APART_M if _strikes(track, start_s) else JUMP_M):
            return None
    moved = length_m >= JUMP_M or (length_m >= SIDEWAYS_M and _is_aside(place_m - track[0, PLACE], towards))
    risen = length_m >= RISEN_JUMP_M and track[end, FORCE] >= RISE_FACTOR * track[begin, FORCE]
    # The edge of a foot that is mostly on another tile may press this lightly until the next foot comes.
    least_n = ON_N if length_m >= APART_M else LOADED_N
    on_both = length_m >= JUMP_M and track[begin:end, FORCE].min() >= ON_N and track[end:, FORCE].min() >= least_n
    if track[begin:, FORCE].min() < LOADED_N and not on_both:
        return None
    if not (moved or (risen and _is_aside(place_m - touchdown_m, towards))):
        return None
    along = (track[begin : end + 1, PLACE] - track[begin, PLACE]) @ towards
    return float(time_s[begin + int(np.argmax(along >= HANDOVER_SHARE * along[-1]))])


def _walks_on(track: Floats, start_s: float, begin: int, end: int) -> bool:
    """Return whether a load's foot had rolled on until index `begin`, from where its centroid did not go back."""
    rolled = track[begin, PLACE] - track[np.searchsorted(track[:, TIME], start_s + HEEL_STRIKE_S), PLACE]
    towards = track[end, PLACE] - track[begin, PLACE]
    return bool(np.hypot(*rolled) >= SIDEWAYS_M and towards @ rolled >= 0.0)


def _strikes(track: Floats, start_s: float) -> bool:
    """Return whether a load began with a heel strike: with weight within `STRIKE_S`."""
    return bool(track[: np.searchsorted(track[:, TIME], start_s + STRIKE_S), FORCE].max(initial=0.0) >= LOADED_N)


def _is_aside(rolled: Floats, towards: Floats) -> bool:
    """Return whether a centroid that has `rolled` by one vector moves `towards` another direction."""
    least_m = max(float(np.hypot(*rolled)), SIDEWAYS_M)
    return float(towards @ rolled) < SAME_WAY_COSINE * float(np.hypot(*towards)) * least_m


def relief_time_s(track: Floats, begin_s: float) -> tuple[float, bool] | None:
    """Return the time of a minimum between two much larger forces, and whether the centroid moved; None without."""
    force_n = track[:, FORCE]
    begin = int(np.searchsorted(track[:, TIME], begin_s))
    if begin >= len(track):
        return None
    least = begin + int(force_n[begin:].argmin())
    most, risen = float(force_n[:least].max(initial=0.0)), least + int(force_n[least:].argmax())
    if force_n[risen] < force_n[least] + LOADED_N or force_n[least] > RELIEVED_SHARE * most:
        return None
    was = track[:least][force_n[:least] >= max(LOADED_N, RELIEVED_SHARE * most)]
    moved = len(was) > 0 and math.dist(track[risen, PLACE], was[-1, PLACE]) >= RELIEVED_MOVE_M
    return float(track[least, TIME]), moved
