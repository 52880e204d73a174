"""Accuracy of a tile's contact centroid, and its correction (section 5.4, figure 5.5).

Loads are applied at known positions. Gains of the sensors, or bends of their curves, and a displacement of low order
are fitted; the model is chosen by the error at positions left out of the fit. Nothing is extrapolated: outside the area
of the positions used, the displacement is held constant.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.files.measurements import Presses
from underfoot.calibration.science.centroid_fit import (
    BENDS,
    FORMS,
    centroid,
    convex_hull,
    fit_correction,
    parameter_count,
)
from underfoot.calibration.science.press_plausibility import plausible_presses, require_alive, require_order
from underfoot.errors import BadValue, require
from underfoot.floor.centroid_correction import CentroidCorrection
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Profile
from underfoot.kernels import Floats
from underfoot.models.tile.fsr_curves import rising

ALLOWED_M = 0.020
"""Allowed mean error: what the thesis finds typical on one calibrated tile (section 5.4)."""
SHEAR_SHARE = 0.17
"""Horizontal over vertical force while walking: RMS over 30 measured steps."""
_FOLDS = 10
_SIMPLER = 1.03
"""Largest factor in error by which a simpler model may exceed the best one and still be taken."""
_LEAST_GAIN = 0.9
"""A correction that leaves more than this share of the error has fitted the noise of its positions."""
_COVERED, _CARRIED = 0.25, 0.2
"""Smallest share of the tile's area that positions must span; below it only gains are fitted, and only if each sensor
has carried at least the second share of a load."""
_NO_BETTER = 0.8
"""Readings that leave more than this share of the error of a guess do not depend on the position."""
_OTHER_UNIT = 4.0
"""Calibrated sensors measure a load within this factor."""


@dataclass(frozen=True)
class CentroidAccuracy:
    """Contact centroids of presses on one tile: `at_m` (n, 2) are the true positions, `force_n` (n,) the loads.

    `before_m` (n, 2) are the plain centroids, `after_m` (n, 2) the corrected ones, each by a correction fitted without
    its position. `form` is the model of the correction, `tried` the RMS error of every model at left-out positions, mm,
    and `left_out` a line on each unused press.
    """

    tile: Tile
    at_m: Floats
    force_n: Floats
    before_m: Floats
    after_m: Floats
    form: str
    tried: tuple[tuple[str, float], ...]
    correction: CentroidCorrection
    left_out: tuple[str, ...]
    reference_mm: float | None = None
    """How far presses may be off their places by themselves (95 %); None where that was not given."""
    over_time: "CentroidAccuracy | None" = None
    """Same presses, with hysteresis and creep compensated in their forces."""
    bound: "CentroidAccuracy | None" = None
    """Same presses, with the best possible static curves: `best_static_forces`."""

    def errors_mm(self, found_m: Floats) -> Floats:
        """Return the distance (n,) of centroids (n, 2) from the true positions, mm."""
        return np.asarray(1e3 * np.hypot(*(found_m - self.at_m).T))

    @property
    def used(self) -> "CentroidAccuracy":
        """The accuracy of the forces that a session uses."""
        return self if self.over_time is None else self.over_time

    @property
    def mean_mm(self) -> float:
        """Mean error of the corrected centroids, mm."""
        return float(self.errors_mm(self.after_m).mean())

    @property
    def expanded_mm(self) -> float:
        """Radius around a contact that has its true position with 95 %, of the forces that a session uses, mm.

        Of presses that were left out of the fit, 95 % were nearer; what they may be off by themselves is added as an
        independent square, as all of them may be off alike.
        """
        errors_mm = self.used.errors_mm(self.used.after_m)
        return float(np.hypot(np.quantile(errors_mm, 0.95), self.reference_mm or 0.0))

    @property
    def good(self) -> bool:
        """Whether the mean error, of the forces that a session uses, is within the allowed one."""
        return self.used.mean_mm <= 1e3 * ALLOWED_M


def assess(presses: Presses, tile: Tile, profile: Profile | None = None) -> CentroidAccuracy:
    """Return the centroid's accuracy for presses on `tile`, and its correction.

    By the sensors' newtons where they are known, also with hysteresis compensated; else by the profile's curves.
    `BadValue` for fewer than 6 presses or 4 positions, positions off the tile, a sensor that is dead or has no curve,
    sensors that look swapped, a table whose forces or positions do not fit its readings, and another tile's profile.
    """
    if profile is not None:
        require(profile.tile == presses.tile, "the profile's tile", profile.tile, f"{presses.tile}, which was pressed")
    if presses.newtons is not None:
        found, compensated = assess_forces(presses, presses.static_n, tile), presses.newtons[:, 4:]
        return found if compensated.size == 0 else _with_bounds(found, presses, compensated)
    if profile is None or not profile.is_calibrated:
        return assess_forces(presses, presses.readings, tile)
    forces = profile.force(presses.readings)
    share = float(np.median(forces.sum(axis=1) / presses.force_n))
    if np.isfinite(share) and not 1.0 / _OTHER_UNIT < share < _OTHER_UNIT:
        raise BadValue(
            f"the sensors measure {share:.3g} times force_n; is it in newtons, and is the profile this tile's?"
        )
    return assess_forces(presses, forces, tile)


def assess_forces(presses: Presses, forces: Floats, tile: Tile) -> CentroidAccuracy:
    """Assess presses as `assess` does, from corner forces (n, 4); which are left out, the forces of a session tell."""
    silent = np.flatnonzero(~np.isfinite(forces).all(axis=0))
    if silent.size:
        raise BadValue(f"sensor {silent[0] + 1} has no curve, so there is no centroid; calibrate its forces first")
    off = (np.abs(presses.at_m) > 0.5 * np.array(tile.size_m) + 1e-3).any(axis=1)
    if off.any():
        x, y = presses.at_m[np.argmax(off)]
        raise BadValue(
            f"a press is at ({x:g}, {y:g}) m; allowed: on tile {tile.id}, {tile.size_m[0]:g} x "
            f"{tile.size_m[1]:g} m, from its centre"
        )
    require(len(forces) >= 6, "presses", len(forces), "at least 6")
    different = len(np.unique(presses.at_m, axis=0))
    require(different >= 4, "places", different, "at least 4 different")
    used = forces
    if presses.newtons is not None:  # a press of which static curves feel nothing has no place by them
        used = np.where(presses.static_n.sum(axis=1, keepdims=True) > 0.0, presses.newtons[:, -4:], 0.0)
    sensors = np.array(tile.sensors_m)
    require_alive(used)
    require_order(used, presses.at_m, sensors)
    kept, left_out = plausible_presses(presses, used, sensors)
    at_m, load, forces = presses.at_m[kept], presses.force_n[kept], forces[kept]
    places = np.unique(at_m, axis=0, return_inverse=True)[1].ravel()
    require(len(at_m) >= 6, "presses", len(at_m), "at least 6")
    require(places.max() >= 3, "places", int(places.max()) + 1, "at least 4 different")
    before = centroid(forces, sensors)
    fold = np.random.default_rng(1).permutation(places.max() + 1)[places] % _FOLDS
    bends_n = tuple(share * float(load.max()) for share in BENDS)
    held = {
        name: _held_out(forces, at_m, sensors, fold, (sensed, order, bends_n))
        for name, sensed, order in _fittable_forms(at_m, forces, tile)
        if places.max() + 1 >= parameter_count(sensed, order)
    }
    tried = [(name, 1e3 * float(np.sqrt(((found - at_m) ** 2).sum(axis=1).mean()))) for name, found in held.items()]
    least = min(error for _, error in tried)
    spread = 1e3 * float(np.sqrt(((at_m - at_m.mean(axis=0)) ** 2).sum(axis=1).mean()))
    if least > max(_NO_BETTER * spread, 1e3 * ALLOWED_M):
        raise BadValue(
            f"the readings do not depend on the places: the error is {least:.0f} mm, that of a guess {spread:.0f} mm; "
            "lines out of order, or another tile?"
        )
    chosen = next(name for name, error in tried if error <= _SIMPLER * least)
    if least > _LEAST_GAIN * dict(tried)["none"]:
        chosen = "none"
    _, sensed, order = next(form for form in FORMS if form[0] == chosen)
    correction = fit_correction(forces, at_m, sensors, sensed, order, bends_n)
    return CentroidAccuracy(tile, at_m, load, before, held[chosen], chosen, tuple(tried), correction, left_out)


def _with_bounds(found: CentroidAccuracy, presses: Presses, compensated: Floats) -> CentroidAccuracy:
    """Add the accuracy with compensated forces (n, 4), and the best of any static curves."""
    over_time = assess_forces(presses, compensated, found.tile)
    found = replace(found, over_time=over_time)
    truest = over_time.correction.linearised(compensated)
    bound = assess_forces(presses, best_static_forces(presses.static_n, truest), found.tile)
    has_bound = bound.mean_mm <= found.mean_mm  # of too few presses it can be worse than what was found
    return replace(found, bound=bound) if has_bound else found


def best_static_forces(static_n: Floats, true_n: Floats) -> Floats:
    """Return corner forces (n, 4) by the rising curve of each sensor that comes nearest to the true ones (n, 4).

    Light and heavy loads count alike. No static curve has a smaller error.

    >>> static, true = np.array([[1.0], [2.0], [2.1]]) * np.ones(4), np.array([[10.0], [30.0], [20.0]]) * np.ones(4)
    >>> best_static_forces(static, true)[:, 0].round(1)
    array([10. , 23.1, 23.1])
    """
    found = np.empty_like(static_n)
    light = BENDS[0] * float(true_n.max())
    for j in range(static_n.shape[1]):
        order = np.argsort(static_n[:, j], kind="stable")
        sought = true_n[order, j]
        found[order, j] = rising(sought, 1.0 / (light + np.maximum(sought, 0.0)) ** 2)
    return found


def _held_out(
    forces: Floats, at_m: Floats, sensors_m: Floats, fold: NDArray[np.intp], form: tuple[str, int, tuple[float, ...]]
) -> Floats:
    """Return corrected centroids (n, 2), each by a correction fitted to the other folds (n,)."""
    found = np.empty_like(at_m)
    for one in np.unique(fold):
        out = fold == one
        correction = fit_correction(forces[~out], at_m[~out], sensors_m, *form)
        found[out] = correction.position(forces[out], sensors_m, 0.0)
    return found


def edge_distance_m(tile: Tile, at_m: Floats) -> Floats:
    """Return the distance (n,) of positions (n, 2) on a tile from its nearest edge."""
    return np.asarray((0.5 * np.array(tile.size_m) - np.abs(at_m)).min(axis=1))


def _fittable_forms(at_m: Floats, forces: Floats, tile: Tile) -> tuple[tuple[str, str, int], ...]:
    """Return the models that can be fitted to these positions."""
    if _area(convex_hull(at_m)) >= _COVERED * float(np.prod(tile.size_m)):
        return FORMS
    shares = forces / forces.sum(axis=1, keepdims=True)
    return FORMS[: 2 if shares.max(axis=0).min() >= _CARRIED else 1]


def _area(corners_m: tuple[tuple[float, float], ...]) -> float:
    """Return the area of a polygon, m^2."""
    x, y = np.array(corners_m).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
