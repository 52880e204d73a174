"""Live readings of a whole floor to newtons: each sensor's curve, what it remembers, and where the load really stands.

What a centroid calibration corrects is a place; here it is given back as corner forces: of the same sum, and with the
centroid where it should be, so that whoever has the forces has the place.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.centroid_correction import place, weigh
from underfoot.floor.curves import MOST_PLAYS, Correction
from underfoot.floor.layout import Floor
from underfoot.floor.profile import Profile
from underfoot.kernels import kernel
from underfoot.models.tile import fsr_hysteresis

COUNTS = 0x10000
"""How many readings there are: 0 to 65535."""
NOMINAL = 0
"""The curve of a sensor that nobody calibrated."""

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]


class Tables(NamedTuple):
    """What is known of a floor's sensors; the first axis of most is the tile, the second the sensor."""

    curve: Whole  # (tiles, 4): which of `curves` a sensor has; `NOMINAL` for one without
    curves: Floats  # (curves, COUNTS): newtons of every reading, before what is remembered is taken out
    learned: Whole  # (tiles,): whether there is more than curves
    plays: Whole  # (tiles, 4): of a sensor's memory; -1 without one
    creep: Floats
    relative: Whole
    widths: Floats  # (tiles, 4, plays)
    weights: Floats  # (tiles, 4, 1 + plays)
    limits_n: Floats  # (tiles, 4, 2)
    memory: Floats  # (tiles, 4, state)
    least_n: Floats  # (tiles,): the least load that is put in its place; infinite without a correction
    sensors_m: Floats  # (tiles, 4, 2): those that it was learned with
    gains: Floats  # (tiles, 4)
    bends_n: Floats  # (tiles, bends): 1 where there are fewer
    bends: Floats  # (tiles, 4, 1 + bends): 0 where there are fewer
    powers: Whole  # (tiles, terms, 2)
    displacement_m: Floats  # (tiles, terms, 2): 0 where there are fewer
    scale_m: Floats  # (tiles,)
    corners: Whole  # (tiles,): of the area
    area_m: Floats  # (tiles, corners, 2)
    pushes: Floats  # (tiles, 4, 2): corner forces of sum 0 that move a load of 1 N by a metre along x, and along y
    place_m: Floats  # (tiles, 4, 2): the floor's own sensors
    work: Floats  # (4, ...): to work in


def uncalibrated(floor: Floor, profiles: Mapping[str, Profile], instead: str) -> tuple[str, ...]:
    """A line that names the tiles without curves, and what is done `instead`; none where all have some.

    >>> from underfoot.floor.layout import default_floor
    >>> uncalibrated(default_floor(3, 3), {}, "a guess")
    ('uncalibrated: t1, t2, t3, t4, t5, ..., t9 (a guess)',)
    """
    bare = [tile.id for tile in floor.tiles if tile.id not in profiles or not profiles[tile.id].is_calibrated]
    some = bare if len(bare) <= 6 else [*bare[:5], "...", bare[-1]]
    return (f"uncalibrated: {', '.join(some)} ({instead})",) if bare else ()


def tables_of(floor: Floor, profiles: Mapping[str, Profile], nominal: Floats) -> Tables:
    """The tables of a floor whose tiles have these `profiles`, by id; `nominal` (COUNTS,) reads all other sensors."""
    tiles = len(floor.tiles)
    known = [profiles.get(tile.id, Profile(tile=tile.id)) for tile in floor.tiles]
    learned = [_correction(profile) for profile in known]
    bends, terms, corners = (
        max((len(getattr(one, name)) for one in learned if one is not None), default=0)
        for name in ("bends_n", "powers", "area_m")
    )
    curves = [nominal]
    p = Tables(
        curve=np.full((tiles, 4), NOMINAL, np.int64),
        curves=nominal[None],
        learned=np.zeros(tiles, np.int64),
        plays=np.full((tiles, 4), -1, np.int64),
        creep=np.zeros((tiles, 4)),
        relative=np.zeros((tiles, 4), np.int64),
        widths=np.zeros((tiles, 4, MOST_PLAYS)),
        weights=np.zeros((tiles, 4, MOST_PLAYS + 1)),
        limits_n=np.zeros((tiles, 4, 2)),
        memory=np.zeros((tiles, 4, fsr_hysteresis.state_size())),
        least_n=np.full(tiles, np.inf),
        sensors_m=np.zeros((tiles, 4, 2)),
        gains=np.ones((tiles, 4)),
        bends_n=np.ones((tiles, bends)),
        bends=np.zeros((tiles, 4, bends + 1)),
        powers=np.zeros((tiles, terms, 2), np.int64),
        displacement_m=np.zeros((tiles, terms, 2)),
        scale_m=np.ones(tiles),
        corners=np.zeros(tiles, np.int64),
        area_m=np.zeros((tiles, corners, 2)),
        pushes=np.zeros((tiles, 4, 2)),
        place_m=np.array([tile.sensors_m for tile in floor.tiles]),
        work=np.zeros((4, max(MOST_PLAYS + 1, fsr_hysteresis.LAGS_S.size))),
    )
    for k, (profile, correction) in enumerate(zip(known, learned, strict=True)):
        for j, curve in enumerate(profile.fsr.sensors if profile.fsr is not None else ()):
            if not curve.uncalibrated:  # else the profile says so
                p.curve[k, j] = len(curves)
                every = np.arange(COUNTS, dtype=np.float64)
                curves.append(curve.force(every) if curve.memory is None else curve.apparent(every))
                p.limits_n[k, j] = curve.limits_n
                if curve.memory is not None:
                    p.plays[k, j] = plays = len(curve.memory.widths)
                    p.creep[k, j], p.relative[k, j] = curve.memory.creep, curve.memory.relative
                    p.widths[k, j, :plays], p.weights[k, j, : plays + 1] = curve.memory.widths, curve.memory.weights
        if correction is not None and profile.centroid is not None:
            p.least_n[k] = profile.centroid.least_n
            p.sensors_m[k] = profile.centroid.sensors_m
            _set_correction(p, k, correction)
    p.learned[:] = (p.plays >= 0).any(axis=1) | np.isfinite(p.least_n)
    return p._replace(curves=np.array(curves))


def _correction(profile: Profile) -> Correction | None:
    """What was learned for the newtons that the profile's curves give live."""
    part = profile.centroid
    if part is None:
        return None
    remembers = profile.fsr is not None and any(curve.memory is not None for curve in profile.fsr.sensors)
    return part.over_time if remembers and part.over_time is not None else part.correction


def _set_correction(p: Tables, k: int, correction: Correction) -> None:
    gains, bends_n, bends = correction.weights()
    powers, displacement, p.scale_m[k], area = correction.terms()
    p.gains[k], p.bends_n[k, : bends_n.size] = gains, bends_n
    if bends.size:
        p.bends[k, :, : bends_n.size + 1] = bends
    p.powers[k, : len(powers)], p.displacement_m[k, : len(powers)] = powers, displacement
    p.corners[k], p.area_m[k, : len(area)] = len(area), area
    levers = np.vstack([np.ones(4), p.place_m[k].T])
    p.pushes[k] = np.linalg.pinv(levers)[:, 1:]


@kernel
def correct_all(p, rows, time_s, newtons):
    """Correct newtons (n, 4) that the curves gave, each of the tile in `rows` (n,) at `time_s` (n,), in that order."""
    for i in range(len(rows)):
        if p.learned[rows[i]] != 0:
            _correct(p, rows[i], time_s[i], newtons[i])


@kernel
def correct_floor(p, first, count, period_s, newtons):
    """Correct newtons (n, tiles, 4) that the curves gave: `count` samples from the absolute number `first` on."""
    for k in range(len(p.learned)):
        if p.learned[k] != 0:
            for i in range(count):
                _correct(p, k, (first + i) * period_s, newtons[i, k])


@kernel
def _correct(p, k, time_s, newtons):
    """Take out what the sensors of a tile remember, and put the centroid in its place. Allocates nothing.

    Time that runs back is none.
    """
    for j in range(4):
        plays = p.plays[k, j]
        if plays >= 0:
            u, t, share, terms = p.work[0, :1], p.work[1, :1], p.work[2, : fsr_hysteresis.LAGS_S.size], p.work[3:]
            u[0], t[0] = newtons[j], time_s
            widths, weights = p.widths[k, j, :plays], p.weights[k, j, : plays + 1]
            fsr_hysteresis.remember(u, t, p.creep[k, j], p.relative[k, j] != 0, widths, p.memory[k, j], share, terms)
            fsr_hysteresis.weigh(terms, weights, u)
            newtons[j] = min(max(u[0], p.limits_n[k, j, 0]), p.limits_n[k, j, 1])
    total = newtons[0] + newtons[1] + newtons[2] + newtons[3]
    if total > 0.0 and math.isfinite(p.least_n[k]):
        weighed = p.work[0, :4]
        weigh(newtons, p.gains[k], p.bends_n[k], p.bends[k], weighed)
        area_m = p.area_m[k, : p.corners[k]]
        x, y = place(weighed, p.sensors_m[k], p.least_n[k], p.powers[k], p.displacement_m[k], p.scale_m[k], area_m)
        if math.isfinite(x):
            for j in range(4):
                x -= newtons[j] * p.place_m[k, j, 0] / total
                y -= newtons[j] * p.place_m[k, j, 1] / total
            for j in range(4):
                newtons[j] += total * (p.pushes[k, j, 0] * x + p.pushes[k, j, 1] * y)
