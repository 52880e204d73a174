"""Conversion of live readings of a floor to newtons: curve, hysteresis, creep and centroid correction.

A centroid calibration corrects positions. Here the corrected position is expressed by corner forces: with the same sum,
and with their centroid at that position, so that the forces are all that later stages need.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from underfoot.floor.centroid_correction import CentroidCorrection, CorrectionArrays, centroid, linearise
from underfoot.floor.curves import Curve
from underfoot.floor.layout import Floor, Tile
from underfoot.floor.profile import Centroid, Profile
from underfoot.kernels import Floats, kernel
from underfoot.models.tile import fsr_hysteresis
from underfoot.models.tile.fsr_hysteresis import LAGS_S, MOST_PLAYS

COUNTS = 0x10000
"""Number of possible readings: 0 to 65535."""
NOMINAL = 0
"""Index of the curve for uncalibrated sensors."""

Whole = NDArray[np.int64]


PLACING = np.dtype(
    [
        ("least_n", np.float64),
        ("sensors_m", np.float64, (4, 2)),
        ("floor_sensors_m", np.float64, (4, 2)),
        ("gains", np.float64, (4,)),
        ("scale_m", np.float64),
        ("corners", np.int64),
        ("per_moment", np.float64, (4, 2)),
    ],
    align=True,
)
"""Centroid correction of a tile, apart from the arrays of `ConversionTables`. It applies from `least_n` on, which is
infinite for a tile without a correction. `sensors_m` are those that it was fitted with, `floor_sensors_m` those of the
floor. `per_moment` are corner forces of sum 0 with a moment of 1 N m along x, and along y."""


class ConversionTables(NamedTuple):
    """Calibrations of a floor's sensors; the first axis of most arrays is the tile, the second the sensor."""

    curve: Whole  # (tiles, 4): which of `curves` a sensor has; `NOMINAL` for one without
    curves: Floats  # (curves, COUNTS): newtons of every reading, before compensation
    corrected: NDArray[np.bool_]  # (tiles,): whether there is more than curves
    compensated: NDArray[np.bool_]  # (tiles, 4): whether hysteresis and creep are known
    models: NDArray[np.void]  # (tiles, 4) of `fsr_hysteresis.MODEL`
    states: NDArray[np.void]  # (tiles, 4) of `fsr_hysteresis.STATE`
    limits_n: Floats  # (tiles, 4, 2): the least and the most force of a compensated sensor
    placings: NDArray[np.void]  # (tiles,) of `PLACING`
    nonlinearity_scales_n: Floats  # (tiles, scales): 1 where there are fewer
    nonlinearity: Floats  # (tiles, 4, 1 + scales): 0 where there are fewer
    powers: Whole  # (tiles, terms, 2)
    displacement_m: Floats  # (tiles, terms, 2): 0 where there are fewer
    area_m: Floats  # (tiles, corners, 2)
    apparent_n: Floats  # (1,): to work in, as all that follow
    time_s: Floats  # (1,)
    steps: Floats  # (lags,)
    terms: Floats  # (1, 1 + plays)
    linear_n: Floats  # (4,)


def uncalibrated(floor: Floor, profiles: Mapping[str, Profile], instead: str) -> tuple[str, ...]:
    """Return a line that names the tiles without curves, and what is done `instead`; none if all have curves.

    >>> from underfoot.floor.layout import default_floor
    >>> uncalibrated(default_floor(3, 3), {}, "a guess")
    ('uncalibrated: t1, t2, t3, t4, t5, ..., t9 (a guess)',)
    """
    bare = [tile.id for tile in floor.tiles if tile.id not in profiles or not profiles[tile.id].is_calibrated]
    some = bare if len(bare) <= 6 else [*bare[:5], "...", bare[-1]]
    return (f"uncalibrated: {', '.join(some)} ({instead})",) if bare else ()


def conversion_tables(floor: Floor, profiles: Mapping[str, Profile], nominal: Floats) -> ConversionTables:
    """Return the tables of a floor with these `profiles` by tile; `nominal` (COUNTS,) is the curve of other sensors."""
    tiles = len(floor.tiles)
    known = [profiles.get(tile.id, Profile(tile=tile.id)) for tile in floor.tiles]
    corrections = [_correction(profile) for profile in known]
    scales, terms, corners = (
        max((len(getattr(correction, name)) for correction in corrections if correction is not None), default=0)
        for name in ("nonlinearity_scales_n", "powers", "area_m")
    )
    curves = [nominal]
    tables = ConversionTables(
        curve=np.full((tiles, 4), NOMINAL, np.int64),
        curves=nominal[None],
        corrected=np.zeros(tiles, np.bool_),
        compensated=np.zeros((tiles, 4), np.bool_),
        models=np.zeros((tiles, 4), fsr_hysteresis.MODEL),
        states=np.zeros((tiles, 4), fsr_hysteresis.STATE),
        limits_n=np.zeros((tiles, 4, 2)),
        placings=np.zeros(tiles, PLACING),
        nonlinearity_scales_n=np.ones((tiles, scales)),
        nonlinearity=np.zeros((tiles, 4, scales + 1)),
        powers=np.zeros((tiles, terms, 2), np.int64),
        displacement_m=np.zeros((tiles, terms, 2)),
        area_m=np.zeros((tiles, corners, 2)),
        apparent_n=np.zeros(1),
        time_s=np.zeros(1),
        steps=np.zeros(LAGS_S.size),
        terms=np.zeros((1, 1 + MOST_PLAYS)),
        linear_n=np.zeros(4),
    )
    tables.placings["least_n"] = np.inf
    for k, (tile, profile, correction) in enumerate(zip(floor.tiles, known, corrections, strict=True)):
        for j, curve in enumerate(profile.fsr.sensors if profile.fsr is not None else ()):
            if not curve.uncalibrated:  # else the profile says so
                tables.curve[k, j] = len(curves)
                curves.append(_set_sensor(tables, k, j, curve))
        if correction is not None and profile.centroid is not None:
            _set_placing(tables, k, tile, profile.centroid, correction.arrays())
    tables.corrected[:] = tables.compensated.any(axis=1) | np.isfinite(tables.placings["least_n"])
    return tables._replace(curves=np.array(curves))


def _correction(profile: Profile) -> CentroidCorrection | None:
    """Return the centroid correction for the newtons that the profile's curves give live."""
    part = profile.centroid
    if part is None:
        return None
    compensated = profile.fsr is not None and any(curve.compensation is not None for curve in profile.fsr.sensors)
    return part.over_time if compensated and part.over_time is not None else part.correction


def _set_sensor(tables: ConversionTables, k: int, j: int, curve: Curve) -> Floats:
    """Store the compensation of a sensor in the tables; return the newtons of every reading, (COUNTS,)."""
    every = np.arange(COUNTS, dtype=np.float64)
    tables.limits_n[k, j] = curve.limits_n
    if curve.compensation is None:
        return curve.force(every)
    tables.compensated[k, j] = True
    tables.models[k, j] = curve.compensation.model().record()
    return curve.apparent(every)


def _set_placing(tables: ConversionTables, k: int, tile: Tile, part: Centroid, c: CorrectionArrays) -> None:
    placing = tables.placings[k]
    placing["least_n"], placing["gains"], placing["scale_m"] = part.least_n, c.gains, c.scale_m
    placing["sensors_m"], placing["floor_sensors_m"] = part.sensors_m, tile.sensors_m
    placing["corners"] = len(c.area_m)
    levers = np.vstack([np.ones(4), np.array(tile.sensors_m).T])
    placing["per_moment"] = np.linalg.pinv(levers)[:, 1:]
    scales = c.nonlinearity_scales_n.size
    tables.nonlinearity_scales_n[k, :scales] = c.nonlinearity_scales_n
    if c.nonlinearity.size:
        tables.nonlinearity[k, :, : scales + 1] = c.nonlinearity
    tables.powers[k, : len(c.powers)], tables.displacement_m[k, : len(c.powers)] = c.powers, c.displacement_m
    tables.area_m[k, : len(c.area_m)] = c.area_m


@kernel
def correct_all(tables: ConversionTables, rows: Whole, time_s: Floats, newtons: Floats) -> None:
    """Correct newtons (n, 4) from the curves, each of the tile in `rows` (n,) at `time_s` (n,), in this order."""
    for i in range(len(rows)):
        if tables.corrected[rows[i]]:
            _correct(tables, rows[i], time_s[i], newtons[i])


@kernel
def correct_floor(tables: ConversionTables, first: int, count: int, period_s: float, newtons: Floats) -> None:
    """Correct newtons (n, tiles, 4) from the curves: `count` samples from the absolute number `first` on."""
    for k in range(len(tables.corrected)):
        if tables.corrected[k]:
            for i in range(count):
                _correct(tables, k, (first + i) * period_s, newtons[i, k])


@kernel
def reset_sensors(tables: ConversionTables, k: int) -> None:
    """Reset the sensors of a tile to rest: without hysteresis or creep of earlier loads."""
    for j in range(4):
        fsr_hysteresis.reset(tables.states[k, j])


@kernel
def _correct(tables: ConversionTables, k: int, time_s: float, newtons: Floats) -> None:
    """Compensate hysteresis and creep of a tile's sensors and correct its centroid. Allocates nothing.

    If time goes back, no time counts as passed.
    """
    for j in range(4):
        if tables.compensated[k, j]:
            apparent_n, model = tables.apparent_n, tables.models[k, j]
            apparent_n[0], tables.time_s[0] = newtons[j], time_s
            fsr_hysteresis.play_operators(
                apparent_n, tables.time_s, model, tables.states[k, j], tables.steps, tables.terms
            )
            fsr_hysteresis.weighted_sum(tables.terms, model, apparent_n)
            newtons[j] = min(max(apparent_n[0], tables.limits_n[k, j, 0]), tables.limits_n[k, j, 1])
    total = newtons[0] + newtons[1] + newtons[2] + newtons[3]
    if total > 0.0 and math.isfinite(tables.placings[k].least_n):
        _correct_centroid(tables, k, total, newtons)


@kernel
def _correct_centroid(tables: ConversionTables, k: int, total_n: float, newtons: Floats) -> None:
    placing = tables.placings[k]
    correction = CorrectionArrays(
        placing.gains,
        tables.nonlinearity_scales_n[k],
        tables.nonlinearity[k],
        tables.powers[k],
        tables.displacement_m[k],
        placing.scale_m,
        tables.area_m[k, : placing.corners],
    )
    linearise(newtons, correction, tables.linear_n)
    x, y = centroid(tables.linear_n, placing.sensors_m, placing.least_n, correction)
    if math.isfinite(x):
        for j in range(4):
            x -= newtons[j] * placing.floor_sensors_m[j, 0] / total_n
            y -= newtons[j] * placing.floor_sensors_m[j, 1] / total_n
        for j in range(4):
            newtons[j] += total_n * (placing.per_moment[j, 0] * x + placing.per_moment[j, 1] * y)
