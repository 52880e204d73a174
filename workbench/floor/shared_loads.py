"""A tile's load that passes from one foot to the next: when it does, and what each foot bears while both are down.

Four vertical forces give a tile one force F and one centroid x, also under two feet (docs/models.md#one-foot-or-two):

    F = F_1 + F_2,   F x = F_1 x_1 + F_2 x_2

A foot that is about to leave rolls on as it did before the other came, and the other one is, as it comes down, where it
goes on from once it is alone. With both places known, the force of each follows.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.tracking import OFF_SHARE, ON_N

JUMP_M, SIDEWAYS_M, SAME_WAY_COSINE, JUMP_S, STAYS_LOADED_S, HEEL_STRIKE_S = 0.10, 0.06, 0.5, 0.15, 0.10, 0.25
"""A load passes from foot to foot where its centroid goes `JUMP_M` in `JUMP_S`, or `SIDEWAYS_M` in a direction that is
not the one in which it rolled (cosine below `SAME_WAY_COSINE`), and stays loaded for `STAYS_LOADED_S`; not in the first
`HEEL_STRIKE_S`, when a heel that strikes becomes a foot."""

FAR_JUMP_M, STRIKE_S = 0.26, 0.10
"""In those a load passes on only if its centroid goes `FAR_JUMP_M`, further than from a heel to the middle of the
rest; or `JUMP_M` if it was no heel: a heel that strikes bears `LOADED_N` within `STRIKE_S`."""

RISE_FACTOR, RISEN_JUMP_M = 1.5, 0.045
"""Where the load meanwhile becomes so many times as large, `RISEN_JUMP_M` will do, if it is not the way from where its
foot came down: somebody has stepped on."""

HANDOVER_SHARE = 0.65
"""It is the next foot's from this share of its way on: later than half, for the first foot is still on it."""

RELIEVED_SHARE, RELIEVED_MOVE_M = 0.3, 0.05
"""A load passes on as well where its force falls below this share of what it was and rises again: elsewhere, by so
much, or while a load beside it begins."""

LOADED_N = 50.0
"""Below this a centroid is too uncertain to tell anything."""

BOTH_FEET_S, SINGLE_FOOT_S = 0.20, 0.08
"""Both feet are down for at most so long before and after a load has passed on; where a foot is and how it rolls is
seen from so much of the time when it is alone."""

SECOND_FOOT_SHARE = 0.05
"""A second foot surely is down from this share of the load on: a way that is continued is off by some."""

LEAST_SHARE = 1e-3
"""No foot that shares a load bears less of it."""

_ROUNDS = 4

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SharedLoad:
    """Two feet on a tile, from `first_s`, when the second came down, to `last_s`, when the first left.

    `places_m` (2, 2) is where the first is at `first_s` and the second at `last_s`; `speeds_m_s` (2, 2) how they roll.
    """

    first_s: float
    last_s: float
    places_m: Floats
    speeds_m_s: Floats

    def feet_m(self, time_s: Floats) -> tuple[Floats, Floats]:
        """Where the first and the second foot are at `time_s` (n,): shape (n, 2) each."""
        first = self.places_m[0] + np.outer(time_s - self.first_s, self.speeds_m_s[0])
        second = self.places_m[1] + np.outer(time_s - self.last_s, self.speeds_m_s[1])
        return first, second

    def shares(self, time_s: Floats, centroid_m: Floats) -> tuple[Floats, Floats, Floats]:
        """The share of the load that the second foot bears (n,), and the places of both (n, 2).

        The places are moved alike by what the centroid lies off their line, so that both moments stay.
        """
        first, second = self.feet_m(time_s)
        way = second - first
        along = ((centroid_m - first) * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-9)
        # A foot that is down bears something: a place needs a force.
        share = np.clip(along, LEAST_SHARE, 1.0 - LEAST_SHARE)
        off = centroid_m - first - share[:, None] * way
        return share, first + off, second + off

    def part(self, rows: NDArray[np.void]) -> tuple[NDArray[np.void], NDArray[np.void], float]:
        """The rows (n,) of a load as those of its two feet, while each is down, and what the second bore just before.

        At each sample the two sum to the load; where one is not down, the other bears it all. If they were not down
        together, it is the second's from where that bears half.
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
    """How the two feet of a load that passed on at `at_s` shared it. `track` (n, 4) is time, x, y and force, seconds,
    metres and newtons, of both; it begins before `at_s` and ends behind it."""
    time_s, places_m, force_n = track[:, 0], track[:, 1:3], track[:, 3]
    first_s, last_s = at_s - 0.8 * BOTH_FEET_S, at_s + 0.7 * BOTH_FEET_S
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
    """Place and speed (2, 2) at `at_s` of the straight way that suits a stretch of a track best."""
    near = track[(track[:, 0] >= begin_s) & (track[:, 0] <= end_s)]
    if len(near) < 3:
        near = track[np.argsort(np.abs(track[:, 0] - 0.5 * (begin_s + end_s)))[:3]]
        return np.stack([np.average(near[:, 1:3], axis=0, weights=near[:, 3]), np.zeros(2)])
    weight = near[:, 3] / near[:, 3].sum()
    middle_s, middle_m = weight @ near[:, 0], weight @ near[:, 1:3]
    since_s = near[:, 0] - middle_s
    speed = (weight * since_s) @ (near[:, 1:3] - middle_m) / max(float(weight @ since_s**2), 1e-12)
    if near[-1, 0] - near[0, 0] < 0.5 * SINGLE_FOOT_S:
        speed = np.zeros(2)  # no way yet
    return np.stack([middle_m + speed * (at_s - middle_s), speed])


def jump_time_s(track: Floats, start_s: float, touchdown_m: Floats, passed_on: bool = False) -> float | None:
    """When the centroid of a load that began at `start_s` lately went from one foot to the next.

    `touchdown_m` (2,) is where its foot came down, maybe on another tile. A load that began because it was `passed_on`
    is not soon passed on again.
    """
    if track[-1, 0] - start_s < JUMP_S + STAYS_LOADED_S:
        return None
    time_s = track[:, 0]
    begin, end = (
        np.searchsorted(time_s, time_s[-1] - STAYS_LOADED_S - JUMP_S),
        np.searchsorted(time_s, time_s[-1] - STAYS_LOADED_S),
    )
    towards = track[end, 1:3] - track[begin, 1:3]
    place_m, length_m = track[begin, 1:3], float(np.hypot(*towards))
    if time_s[begin] < start_s + HEEL_STRIKE_S:
        stays = np.hypot(*(track[end:, 1:3] - track[end, 1:3]).T).max() <= SIDEWAYS_M
        if passed_on or not stays or length_m < (FAR_JUMP_M if _strikes(track, start_s) else JUMP_M):
            return None
    moved = length_m >= JUMP_M or (length_m >= SIDEWAYS_M and _is_aside(place_m - track[0, 1:3], towards))
    risen = length_m >= RISEN_JUMP_M and track[end, 3] >= RISE_FACTOR * track[begin, 3]
    # Part of a foot that lies beside a tile may press on it so lightly until another foot comes.
    least_n = ON_N if length_m >= FAR_JUMP_M else LOADED_N
    on_both = length_m >= JUMP_M and track[begin:end, 3].min() >= ON_N and track[end:, 3].min() >= least_n
    if track[begin:, 3].min() < LOADED_N and not on_both:
        return None
    if not (moved or (risen and _is_aside(place_m - touchdown_m, towards))):
        return None
    along = (track[begin : end + 1, 1:3] - track[begin, 1:3]) @ towards
    return float(time_s[begin + int(np.argmax(along >= HANDOVER_SHARE * along[-1]))])


def _strikes(track: Floats, start_s: float) -> bool:
    """Whether a load began as a heel that strikes: soon it bears weight."""
    return bool(track[: np.searchsorted(track[:, 0], start_s + STRIKE_S), 3].max(initial=0.0) >= LOADED_N)


def _is_aside(rolled: Floats, towards: Floats) -> bool:
    """Whether a centroid that rolled so far, and then goes `towards`, goes another way."""
    least_m = max(float(np.hypot(*rolled)), SIDEWAYS_M)
    return float(towards @ rolled) < SAME_WAY_COSINE * float(np.hypot(*towards)) * least_m


def relief_time_s(track: Floats, begin_s: float) -> tuple[float, bool] | None:
    """When, from `begin_s` on, a load was least between two that were much more, and whether it is elsewhere since."""
    force_n = track[:, 3]
    begin = int(np.searchsorted(track[:, 0], begin_s))
    if begin >= len(track):
        return None
    least = begin + int(force_n[begin:].argmin())
    most, risen = float(force_n[:least].max(initial=0.0)), least + int(force_n[least:].argmax())
    if force_n[risen] < force_n[least] + LOADED_N or force_n[least] > RELIEVED_SHARE * most:
        return None
    was = track[:least][force_n[:least] >= max(LOADED_N, RELIEVED_SHARE * most)]
    moved = len(was) > 0 and math.dist(track[risen, 1:3], was[-1, 1:3]) >= RELIEVED_MOVE_M
    return float(track[least, 0]), moved
