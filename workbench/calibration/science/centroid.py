"""How true the contact centroid is, and what corrects it (section 5.4, figure 5.5).

Loads at known places; sensors' gains or what bends their curves, then a displacement of low order, are learned, and
the choice among them is made on places that were left out. Nothing is extrapolated: outside the places used, the
displacement is held.
"""

from dataclasses import dataclass
from datetime import date
from itertools import pairwise, permutations

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.calibration.files.tables import Presses
from underfoot.errors import BadValue, require
from underfoot.floor.centroid_correction import CentroidCorrection, nonlinear_terms
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Centroid, Profile
from underfoot.models.tile.fsr_curves import rising

Values = NDArray[np.float64]

ALLOWED_M = 0.020
"""What the thesis finds typical on one calibrated tile (section 5.4)."""
SHEAR_SHARE = 0.17
"""Horizontal force over vertical, walking: RMS over 30 measured steps (SCIENCE 13)."""
_SCALE_M = 0.1
_FOLDS = 10
_SIMPLER = 1.03
_WORTH = 0.9
"""A correction that leaves more than this of the error learned the noise of the places it was taught at."""
_COVERED, _CARRIED = 0.25, 0.2
"""Places that span less than this part of the tile say nothing of the rest: only gains are learned there, and only
where each sensor has carried at least this share of a load."""
_MOST_OUT = 0.1
"""More presses than this share that disagree with their force are not slips, but a wrong table."""
_SLIP_M, _SLIP = 0.03, 6.0
"""A place further off than this and than so many times the usual at its load is a slip."""
_NO_BETTER = 0.8
_OTHER_UNIT = 4.0
"""Calibrated sensors feel a load within this factor."""
_DEAD = 0.002
_POWERS = {
    0: (),
    1: ((0, 0), (1, 0), (0, 1)),
    2: ((0, 0), (1, 0), (0, 1), (1, 1)),
    3: ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2)),
    4: ((0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)),
}
_FORMS = (
    ("none", "", 0),
    ("gains", "gains", 0),
    ("affine", "", 1),
    ("gains and affine", "gains", 1),
    ("gains and bilinear", "gains", 2),
    ("gains and quadratic", "gains", 3),
    ("gains and cubic", "gains", 4),
    ("bends and affine", "bends", 1),
    ("bends and quadratic", "bends", 3),
    ("bends and cubic", "bends", 4),
)
"""Name, what is learned of the sensors, and which surface."""
_BENDS = (1.0 / 75.0, 0.1)
"""Where a sensor's curve may bend, in parts of the heaviest load."""
_LEARNED = {"": 0, "gains": 4, "bends": 4 * (2 + len(_BENDS))}
_SPREAD = 0.25
"""How far gains differ from one sensor to the next before anything is learned."""
_STIFF = 0.0075
"""How little a gain or bend may gain by growing: in parts of the way to the sensors, RMS."""
_EDGES_M = (0.0, 0.03, 0.06, 0.10, np.inf)


@dataclass(frozen=True)
class Accuracy:
    """What came of presses on one tile: `at_m` (n, 2) where they were, `before_m` and `after_m` where they seemed to
    be.

    `after_m` of every place comes from a correction that was learned without that place.
    """

    tile: Tile
    at_m: Values
    force_n: Values
    before_m: Values
    after_m: Values
    form: str
    tried: tuple[tuple[str, float], ...]
    correction: CentroidCorrection
    left_out: tuple[str, ...]
    over_time: "Accuracy | None" = None
    """The same presses, with hysteresis and creep taken out of their forces."""
    bound: "Accuracy | None" = None
    """The same presses, by the static curves that would have suited them best in hindsight: `in_hindsight`."""

    @property
    def quantities(self) -> tuple[tuple[str, float, str], ...]:
        """Name, value and unit of all that was measured."""
        after = self.errors_mm(self.after_m)
        found = [("presses", float(len(after)), ""), ("places", float(len(np.unique(self.at_m, axis=0))), "")]
        shown = [("before", self.before_m), ("after", self.after_m)]
        shown += [
            (name, one.after_m)
            for name, one in (("over_time", self.over_time), ("bound", self.bound))
            if one is not None
        ]
        for name, found_m in shown:
            errors = self.errors_mm(found_m)
            found += [
                (f"mean_{name}_mm", float(errors.mean()), "mm"),
                (f"p95_{name}_mm", float(np.quantile(errors, 0.95)), "mm"),
                (f"worst_{name}_mm", float(errors.max()), "mm"),
            ]
        found.append(("shear_mm", 1e3 * SHEAR_SHARE * self.tile.sensor_depth_m, "mm"))
        for load, chosen in loads(self.force_n):
            found.append((f"mean_after_mm_at_{load:.0f}_n", float(after[chosen].mean()), "mm"))
        inset = edge_distance_m(self.tile, self.at_m)
        for low, high in pairwise(_EDGES_M):
            chosen = (inset >= low) & (inset < high)
            if chosen.any():
                name = f"{1e2 * low:.0f}_to_{1e2 * high:.0f}_cm" if np.isfinite(high) else f"over_{1e2 * low:.0f}_cm"
                found.append((f"mean_after_mm_{name}_from_edge", float(after[chosen].mean()), "mm"))
        return tuple(found)

    def errors_mm(self, found_m: Values) -> Values:
        """How far places that were found are from where the presses were, mm."""
        return np.asarray(1e3 * np.hypot(*(found_m - self.at_m).T))

    @property
    def mean_mm(self) -> float:
        """The mean error, corrected, of places left out."""
        return float(self.errors_mm(self.after_m).mean())

    @property
    def good(self) -> bool:
        """Whether a place is as true as the thesis has it."""
        return self.mean_mm <= 1e3 * ALLOWED_M

    @property
    def verdict(self) -> str:
        """In plain words: what places are good for."""
        figures = {name: value for name, value, _ in self.quantities}
        words = (
            f"A place is true to {figures['mean_after_mm']:.1f} mm, {figures['worst_after_mm']:.1f} mm at worst "
            f"(before: {figures['mean_before_mm']:.1f} and {figures['worst_before_mm']:.1f} mm)"
        )
        words += "." if self.good else f", which is worse than the {1e3 * ALLOWED_M:.0f} mm allowed."
        if "mean_over_time_mm" in figures:
            words += (
                f" With hysteresis and creep taken out: {figures['mean_over_time_mm']:.1f} mm, "
                f"{figures['worst_over_time_mm']:.1f} mm at worst."
            )
        if figures["mean_after_mm"] <= 1.1 * figures.get("mean_bound_mm", 0.0):
            words += (
                f" No static curve can do better than about {figures['mean_bound_mm']:.1f} mm and "
                f"{figures['worst_bound_mm']:.1f} mm: the sensors remember."
            )
        if self.form == "none":
            words += " No correction helps on places that it was not learned from; none is made."
        if figures["shear_mm"] > 0.0:
            words += (
                f" Walking adds about {figures['shear_mm']:.1f} mm of shear that vertical sensors "
                f"{1e3 * self.tile.sensor_depth_m:.0f} mm below the surface cannot see."
            )
        return words

    def part(self, reference: str, today: date | None = None) -> Centroid:
        """The profile's part."""
        return Centroid(
            made=(today or date.today()).isoformat(),
            reference=reference,
            error=round(self.mean_mm, 4),
            error_allowed=1e3 * ALLOWED_M,
            error_unit="mm",
            good=self.good,
            verdict=self.verdict,
            figures={name: float(f"{value:.6g}") for name, value, _ in self.quantities},
            sensors_m=tuple((float(x), float(y)) for x, y in self.tile.sensors_m),
            correction=self.correction,
            over_time=None if self.over_time is None else self.over_time.correction,
            least_n=min(20.0, 0.5 * float(self.force_n.min())),
        )


def assessed(presses: Presses, tile: Tile, profile: Profile | None = None) -> Accuracy:
    """How true the centroid of presses on `tile` is, and what corrects it; readings go through the profile's curves.

    `BadValue` for fewer than 6 presses or 4 places, places off the tile, a sensor that is dead or has no curve, sensors
    that look swapped, and a table whose forces or places do not fit its readings.
    """
    if profile is None or not profile.is_calibrated:
        return assessed_forces(presses, presses.readings, tile)
    forces = profile.force(presses.readings)
    share = float(np.median(forces.sum(axis=1) / presses.force_n))
    if np.isfinite(share) and not 1.0 / _OTHER_UNIT < share < _OTHER_UNIT:
        raise BadValue(f"the sensors feel {share:.3g} times force_n; is it in newtons, and is the profile this tile's?")
    return assessed_forces(presses, forces, tile)


def assessed_forces(presses: Presses, forces: Values, tile: Tile) -> Accuracy:
    """As `assessed`, with the corner forces (n, 4) of the presses already known."""
    silent = np.flatnonzero(~np.isfinite(forces).all(axis=0))
    if silent.size:
        raise BadValue(f"sensor {silent[0] + 1} has no curve, so no place can be told; calibrate it first")
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
    _require_alive(forces)
    _require_order(forces, presses.at_m, np.array(tile.sensors_m))
    kept, left_out = _plausible(presses, forces, np.array(tile.sensors_m))
    at_m, load, forces = presses.at_m[kept], presses.force_n[kept], forces[kept]
    places = np.unique(at_m, axis=0, return_inverse=True)[1].ravel()
    require(len(at_m) >= 6, "presses", len(at_m), "at least 6")
    require(places.max() >= 3, "places", int(places.max()) + 1, "at least 4 different")
    sensors = np.array(tile.sensors_m)
    before = centroid(forces, sensors)
    fold = np.random.default_rng(1).permutation(places.max() + 1)[places] % _FOLDS
    tried: list[tuple[str, float]] = []
    held: dict[str, Values] = {}
    bends_n = tuple(share * float(load.max()) for share in _BENDS)
    for name, way, order in _taught(at_m, forces, tile):
        if places.max() + 1 < 2 * len(_POWERS[order]) + _LEARNED[way]:
            continue
        held[name] = np.empty_like(before)
        for one in np.unique(fold):
            out = fold == one
            part = corrected(forces[~out], at_m[~out], sensors, way, order, bends_n)
            held[name][out] = part.position(forces[out], sensors, 0.0)
        tried.append((name, 1e3 * float(np.sqrt(((held[name] - at_m) ** 2).sum(axis=1).mean()))))
    least = min(error for _, error in tried)
    spread = 1e3 * float(np.sqrt(((at_m - at_m.mean(axis=0)) ** 2).sum(axis=1).mean()))
    if least > max(_NO_BETTER * spread, 1e3 * ALLOWED_M):
        raise BadValue(
            f"the readings do not tell the places: {least:.0f} mm off, and a guess would be {spread:.0f} mm off; lines "
            "out of order, or another tile?"
        )
    chosen = next(name for name, error in tried if error <= _SIMPLER * least)
    if least > _WORTH * dict(tried)["none"]:
        chosen = "none"
    _, way, order = next(form for form in _FORMS if form[0] == chosen)
    part = corrected(forces, at_m, sensors, way, order, bends_n)
    return Accuracy(tile, at_m, load, before, held[chosen], chosen, tuple(tried), part, left_out)


def in_hindsight(static_n: Values, true_n: Values) -> Values:
    """Corner forces (n, 4) by the rising curve of each sensor that comes nearest to the true ones, for each load alike.

    What it still gets wrong, no static curve can get right.

    >>> static, true = np.array([[1.0], [2.0], [2.1]]) * np.ones(4), np.array([[10.0], [30.0], [20.0]]) * np.ones(4)
    >>> in_hindsight(static, true)[:, 0].round(1)
    array([10. , 23.1, 23.1])
    """
    found = np.empty_like(static_n)
    light = _BENDS[0] * float(true_n.max())
    for j in range(static_n.shape[1]):
        order = np.argsort(static_n[:, j], kind="stable")
        sought = true_n[order, j]
        found[order, j] = rising(sought, 1.0 / (light + np.maximum(sought, 0.0)) ** 2)
    return found


def centroid(forces_n: Values, sensors_m: Values) -> Values:
    """Plain centroids (n, 2) of corner forces (n, 4): equation 5.3, tared."""
    return np.asarray((forces_n @ sensors_m) / forces_n.sum(axis=-1, keepdims=True))


def corrected(
    forces_n: Values, at_m: Values, sensors_m: Values, way: str, order: int, bends_n: tuple[float, ...] = ()
) -> CentroidCorrection:
    """The correction of one form, by least squares: "gains" whose mean is 1, "bends" besides, or neither (""); then a
    displacement.

    >>> sensors = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
    >>> at = np.array([[0.05, 0.02], [-0.04, 0.06], [-0.07, -0.03], [0.08, -0.08], [0.0, 0.0]])
    >>> true = 25.0 * (1 + 10 * at @ sensors.T * 10 + at.prod(1, keepdims=True) * 100 * sensors.prod(1) * 100)
    >>> part = corrected(true / [1.1, 0.9, 1.0, 1.0], at, sensors, "gains", 0)
    >>> np.round(part.gains, 3)
    array([1.1, 0.9, 1. , 1. ])
    """
    gains: Values = np.ones(4)
    bends: Values = np.empty((0, 0))
    if way == "gains":
        gains = _gains(forces_n, at_m, sensors_m)
    elif way == "bends":
        gains, bends = _bends(forces_n, at_m, sensors_m, bends_n)
    one, two, three, four = (float(gain) for gain in gains)
    sensed = CentroidCorrection(
        gains=(one, two, three, four),
        nonlinearity_scales_n=bends_n if bends.size else (),
        nonlinearity=tuple(tuple(float(bend) for bend in row) for row in bends),
    )
    powers = _POWERS[order]
    if not powers:
        return sensed
    seemed = centroid(sensed.linearised(forces_n), sensors_m)
    rows = np.linalg.lstsq(_terms(seemed, powers), at_m - seemed, rcond=1e-9)[0]
    return replace(
        sensed,
        powers=powers,
        displacement_m=tuple((float(x), float(y)) for x, y in rows),
        scale_m=_SCALE_M,
        area_m=hull(seemed),
    )


def hull(points_m: Values) -> tuple[tuple[float, float], ...]:
    """The corners of the least convex area around points (n, 2), counter-clockwise.

    >>> hull(np.array([[0, 0], [2, 0], [1, 0.5], [2, 2], [0, 2.0]]))
    ((0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0))
    """
    points = sorted({(float(x), float(y)) for x, y in points_m})

    def chain(ordered: list[tuple[float, float]]) -> list[tuple[float, float]]:
        found: list[tuple[float, float]] = []
        for x, y in ordered:
            while len(found) > 1 and _turn(found[-2], found[-1], (x, y)) <= 0.0:
                found.pop()
            found.append((x, y))
        return found[:-1]

    return tuple(chain(points) + chain(points[::-1]))


def _taught(at_m: Values, forces: Values, tile: Tile) -> tuple[tuple[str, str, int], ...]:
    """Forms that the places pressed can teach."""
    if _area(hull(at_m)) >= _COVERED * float(np.prod(tile.size_m)):
        return _FORMS
    shares = forces / forces.sum(axis=1, keepdims=True)
    return _FORMS[: 2 if shares.max(axis=0).min() >= _CARRIED else 1]


def _area(corners_m: tuple[tuple[float, float], ...]) -> float:
    x, y = np.array(corners_m).T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))


def loads(force_n: Values) -> list[tuple[float, NDArray[np.bool_]]]:
    """The loads that were used, each with its presses: forces within a fifth of each other are one load."""
    ordered = np.sort(force_n)
    cuts = ordered[1:][np.diff(np.log(ordered)) > 0.2]
    group = np.searchsorted(cuts, force_n, side="right")
    if cuts.size > 7:
        group = np.minimum((group * 4) // (cuts.size + 1), 3)
    return [(float(np.median(force_n[group == one])), group == one) for one in np.unique(group)]


def edge_distance_m(tile: Tile, at_m: Values) -> Values:
    """How far places (n, 2) of a tile are from its nearest edge."""
    return np.asarray((0.5 * np.array(tile.size_m) - np.abs(at_m)).min(axis=1))


def _gains(forces_n: Values, at_m: Values, sensors_m: Values) -> Values:
    """Gains that bring the centroids to where they should be: as near 1 as what they leave unexplained makes likely."""
    total = forces_n.sum(axis=1)
    pull = forces_n[:, :, None] * (sensors_m - at_m[:, None, :]) / total[:, None, None]
    rows = np.concatenate([pull[:, :, 0], pull[:, :, 1]])
    sought = -pull.sum(axis=1).T.ravel()
    stiff, change = 1e-4, np.zeros(4)
    for _ in range(2):
        terms = np.concatenate([rows, stiff * np.eye(4), np.ones((1, 4))])
        change = np.linalg.lstsq(terms, np.concatenate([sought, np.zeros(5)]), rcond=None)[0]
        stiff = max(1e-4, float(np.sqrt(np.mean((rows @ change - sought) ** 2))) / _SPREAD)
    return np.asarray(np.clip(1.0 + change, 0.2, 5.0))


def _bends(forces_n: Values, at_m: Values, sensors_m: Values, bends_n: tuple[float, ...]) -> tuple[Values, Values]:
    """Gains, and what bends the sensors' curves; with a plane that may displace the places meanwhile.

    The plane keeps misplaced sensors from being taken for bent ones.
    """
    total = forces_n.sum(axis=1)
    learned = np.concatenate([forces_n[:, :, None], nonlinear_terms(forces_n, bends_n)], axis=2)
    arms = (sensors_m - at_m[:, None, :]) / total[:, None, None]
    n, each = len(at_m), learned.shape[2]
    plane = _terms(at_m, _POWERS[1])
    terms, missing = [], []
    for axis in range(2):
        pull = (learned * arms[:, :, axis, None]).reshape(n, 4 * each)
        terms.append(np.hstack([pull, *(plane if axis == other else 0.0 * plane for other in range(2))]))
        missing.append(-(forces_n * arms[:, :, axis]).sum(axis=1))
    count = terms[0].shape[1]
    stiff = _STIFF * float(np.abs(sensors_m - sensors_m.mean(axis=0)).max()) * np.sqrt(n) * np.eye(count)
    stiff[4 * each :] *= 1e-3
    mean = np.zeros((1, count))
    mean[0, : 4 * each : each] = 1.0
    found = np.linalg.lstsq(
        np.concatenate([*terms, stiff, mean]), np.concatenate([*missing, np.zeros(count + 1)]), rcond=None
    )[0]
    weights = found[: 4 * each].reshape(4, each)
    return np.asarray(np.clip(1.0 + weights[:, 0], 0.2, 5.0)), np.asarray(weights[:, 1:])


def _terms(places_m: Values, powers: tuple[tuple[int, int], ...]) -> Values:
    return np.stack([np.prod((places_m / _SCALE_M) ** power, axis=1) for power in powers], axis=1)


def _require_alive(forces: Values) -> None:
    total = float(np.median(forces.sum(axis=1)))
    if total <= 0.0:
        raise BadValue(f"the sensors' forces add up to {total:.3g} N; allowed: forces that press down")
    dead = np.flatnonzero(np.ptp(forces, axis=0) <= _DEAD * np.abs(forces).max())
    if dead.size:
        raise BadValue(f"sensor {dead[0] + 1} gives {forces[0, dead[0]]:.4g} N at every press: dead, or not connected")


def _plausible(presses: Presses, forces: Values, sensors_m: Values) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Presses that fit what was said to press, and where; a slip is left out and named, a table of slips refused."""
    ratio = forces.sum(axis=1) / presses.force_n
    usual = float(np.median(ratio))
    bad = (ratio < 0.6 * usual) | (ratio > 1.6 * usual)
    told = [
        f"press {k + 1}: {presses.force_n[k]:.4g} N given, {forces[k].sum() / usual:.4g} N measured"
        for k in np.flatnonzero(bad)
    ]
    if bad.sum() > max(1.0, _MOST_OUT * bad.size):
        raise BadValue(f"{bad.sum()} of {bad.size} presses do not fit their force; {told[0]}")
    kept = np.flatnonzero(~bad)
    seemed = centroid(forces[kept], sensors_m)
    off = np.hypot(*(seemed - presses.at_m[kept]).T)
    slips = np.zeros(kept.size, dtype=bool)
    for _, chosen in loads(presses.force_n[kept]):
        slips |= chosen & (off > _SLIP_M + _SLIP * np.median(off[chosen]))
    if slips.sum() <= max(1.0, _MOST_OUT * bad.size):
        told += [
            f"press {kept[k] + 1}: ({1e3 * x:.0f}, {1e3 * y:.0f}) mm given, felt {1e3 * off[k]:.0f} mm from there"
            for k in np.flatnonzero(slips)
            for x, y in [presses.at_m[kept[k]]]
        ]
        bad[kept[slips]] = True
    return ~bad, tuple(words.replace(": ", " left out: ", 1) for words in told)


def _require_order(forces: Values, at_m: Values, sensors_m: Values) -> None:
    """Refuse columns that stand in another order than the sensors of the floor."""
    felt = forces.sum(axis=1) > 0.0
    usual = {
        order: float(np.median(np.hypot(*(centroid(forces[felt][:, order], sensors_m) - at_m[felt]).T)))
        for order in permutations(range(4))
    }
    own, best = usual[0, 1, 2, 3], min(usual, key=lambda order: usual[order])
    if own > 0.03 and usual[best] < 0.4 * own:
        wrong = [str(j + 1) for j in range(4) if best[j] != j]
        raise BadValue(f"sensors {' and '.join(wrong)} look swapped: the presses fit the order {[j + 1 for j in best]}")


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
