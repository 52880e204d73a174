"""Results of presses at known positions: figures, verdict, the profile's part, and pictures of the errors."""

from datetime import date
from itertools import pairwise

import numpy as np

from underfoot.calibration.files.measurements import Presses
from underfoot.calibration.result import Result
from underfoot.calibration.results.labels import title_of
from underfoot.calibration.science.centroid import ALLOWED_M, SHEAR_SHARE, CentroidAccuracy, edge_distance_m
from underfoot.calibration.science.press_plausibility import load_groups
from underfoot.drawing import Drawing, Series, series
from underfoot.floor.layout import Tile
from underfoot.floor.profile import Centroid, Fsr
from underfoot.kernels import Floats

METHOD = (
    "Errors are distances from the pressed place, of presses that rise on a rested tile: what sensors have crept "
    "from press to press is taken off. Every corrected place comes from a correction that was fitted without that "
    "place (ten folds by place). Outside the convex area of the places used, the displacement is held. Hysteresis "
    "and creep compensated: the same presses, with both taken out of the sensors' forces; a session does so, too. "
    "By the forces that a session uses presses are left out that do not fit, and the mean error is judged. The "
    "uncertainty is the radius within which 95 % of the left-out places were found, by the same forces, and, as an "
    "independent square, what presses may be off their marks (95 %). "
    "Best static curves: the same presses, with the rising curve of each sensor that comes nearest to those. Shear "
    f"is computed: {SHEAR_SHARE:g} of the vertical force, at the depth of the sensors."
)
_PLACES_HEADER = "x_m,y_m,force_n,before_x_m,before_y_m,after_x_m,after_y_m"
_COMPENSATED_OFF, _STATIC_OFF, _LIGHT_N = 0.1, 0.2, 50.0
"""Shares by which forces of a good calibration, compensated or by weights, are not off the reference's; and a load
below which it is as many newtons as there.
"""
_OFF_MM, _OFF_TIMES = 20.0, 3.0
"""Millimetres, beyond this many times the median error, by which a place is off where another one was pressed."""
_EDGES_M = (0.0, 0.03, 0.06, 0.10, np.inf)


def result_of(
    found: CentroidAccuracy, presses: Presses, falling: Presses | None = None, forces: Fsr | None = None
) -> Result:
    """Return the result of presses with rising loads, and the mean error of those with `falling` ones, if any.

    `forces` is the calibration by which their readings became newtons, which the reference names.
    """
    reference = "presses at known places"
    if found.reference_mm is not None:
        reference += f", uncertain by {found.reference_mm:g} mm (95 %)"
    reference += f"; forces calibrated {forces.identity}" if forces is not None else ""
    quantities = quantities_of(found)
    if falling is not None and falling.force_n.size:
        place = found.correction.position(falling.static_n, np.array(found.tile.sensors_m), 0.0)
        error_mm = float(1e3 * np.hypot(*(place - falling.at_m).T).mean())
        quantities += (("mean_after_mm_falling", error_mm, "mm"),)
    places = np.column_stack([found.at_m, found.force_n, found.before_m, found.after_m])
    return Result(
        kind="centroid",
        title=title_of("centroid", found.tile.id),
        quantities=quantities,
        verdict=verdict_of(found),
        good=found.good,
        warnings=(*found.left_out, *_misplaced(found.used), *_shifted(found, forces), *_disagreement(presses)),
        drawings=drawings_of(found),
        raw=(*_raw(presses, falling), ("places", _PLACES_HEADER, places)),
        part=part_of(found, reference),
        tile=found.tile.id,
        method=METHOD,
    )


def _misplaced(found: CentroidAccuracy) -> tuple[str, ...]:
    """Return a line on each place that is found far off with most of its loads, where others are not."""
    errors_mm, lines = found.errors_mm(found.after_m), []
    usual_mm = float(np.median(errors_mm))
    for place in np.unique(found.at_m, axis=0):
        off_mm = float(np.median(errors_mm[(found.at_m == place).all(axis=1)]))
        if off_mm > _OFF_MM + _OFF_TIMES * usual_mm:
            x, y = 1e3 * place + 0.0
            lines.append(
                f"the place at x {x:.0f} mm, y {y:.0f} mm is found {off_mm:.0f} mm off, half of all within "
                f"{usual_mm:.0f} mm: was another one pressed? Press it again, or skip it"
            )
    return tuple(lines)


def _shifted(found: CentroidAccuracy, forces: Fsr | None) -> tuple[str, ...]:
    """Return a line where places are off alike by more than marks and calibrated forces are uncertain by.

    A force of all sensors that is uncertain by a share moves a centroid by that share of their distance, at most.
    """
    expanded_percent = None if forces is None else forces.figures.get("foot_expanded_percent")
    if found.over_time is None or expanded_percent is None:
        return ()
    x_mm, y_mm = 1e3 * (found.over_time.before_m - found.over_time.at_m).mean(axis=0).round(3) + 0.0
    reach_mm = 1e3 * float(np.sqrt(np.mean(np.square(found.tile.sensors_m))))
    allowed_mm = float(np.hypot(0.01 * expanded_percent * reach_mm, found.reference_mm or 0.0))
    if np.hypot(x_mm, y_mm) <= allowed_mm:
        return ()
    return (
        f"all places are found off alike, by x {x_mm:+.0f} mm, y {y_mm:+.0f} mm, and forces and marks are uncertain by "
        f"{allowed_mm:.0f} mm: are the marks shifted, are the sensors where the floor says, or has one changed since "
        "forces were calibrated? The correction takes the marks to be right",
    )


def _disagreement(presses: Presses) -> tuple[str, ...]:
    """Return a line where calibrated sensors and the reference differ by more than the calibration of forces allows."""
    if presses.newtons is None:
        return ()
    ratio, is_compensated = presses.newtons[:, -4:].sum(axis=1) / presses.force_n, presses.newtons.shape[1] == 8
    # Static curves read light loads as less, of good tiles by 19 %.
    loads = load_groups(presses.force_n) if is_compensated else [(float(np.median(presses.force_n)), ratio > -np.inf)]
    every = [(float(np.median(ratio[chosen])), load_n) for load_n, chosen in loads]
    off, times, load_n = max((abs(times - 1.0) * min(load_n / _LIGHT_N, 1.0), times, load_n) for times, load_n in every)
    if off <= (_COMPENSATED_OFF if is_compensated else _STATIC_OFF):
        return ()
    return (
        f"the sensors add up to {times:.2g} times what the load cell gives (median of {load_n:.0f} N): is its "
        "scale right, was it when forces were calibrated, and do all sensors feel light loads? Forces are not as good "
        "as was said, and unless it is the scale, places that were not pressed neither",
    )


def inconclusive(presses: Presses, falling: Presses, reason: str, drawings: tuple[Drawing, ...]) -> Result:
    """Return the presses alone, which led to no accuracy for this reason."""
    raw = _raw(presses, falling)
    return Result("centroid", title_of("centroid", presses.tile), (), reason, good=False, drawings=drawings, raw=raw)


def _raw(presses: Presses, falling: Presses | None) -> tuple[tuple[str, str, Floats], ...]:
    tables = {"presses": presses, "falling-presses": falling}
    return tuple((name, one.header, one.rows()) for name, one in tables.items() if one is not None and one.force_n.size)


def quantities_of(found: CentroidAccuracy) -> tuple[tuple[str, float, str], ...]:
    """Return name, value and unit of all measured quantities."""
    after = found.errors_mm(found.after_m)
    several = [("presses", float(len(after)), ""), ("places", float(len(np.unique(found.at_m, axis=0))), "")]
    shown = [("before", found.before_m), ("after", found.after_m)]
    others = {"over_time": found.over_time, "bound": found.bound}
    shown += [(name, one.after_m) for name, one in others.items() if one is not None]
    for name, found_m in shown:
        errors = found.errors_mm(found_m)
        several += [
            (f"mean_{name}_mm", float(errors.mean()), "mm"),
            (f"p95_{name}_mm", float(np.quantile(errors, 0.95)), "mm"),
            (f"worst_{name}_mm", float(errors.max()), "mm"),
        ]
    if found.reference_mm is not None:
        several += [("expanded_mm", found.expanded_mm, "mm"), ("reference_mm", found.reference_mm, "mm")]
    several.append(("shear_mm", 1e3 * SHEAR_SHARE * found.tile.sensor_depth_m, "mm"))
    for load, chosen in load_groups(found.force_n):
        several.append((f"mean_after_mm_at_{load:.0f}_n", float(after[chosen].mean()), "mm"))
    inset = edge_distance_m(found.tile, found.at_m)
    for low, high in pairwise(_EDGES_M):
        chosen = (inset >= low) & (inset < high)
        if chosen.any():
            name = f"{1e2 * low:.0f}_to_{1e2 * high:.0f}_cm" if np.isfinite(high) else f"over_{1e2 * low:.0f}_cm"
            several.append((f"mean_after_mm_{name}_from_edge", float(after[chosen].mean()), "mm"))
    return tuple(several)


def verdict_of(found: CentroidAccuracy) -> str:
    """Return in plain words how accurate the centroid is, and what limits it."""
    figures = {name: value for name, value, _ in quantities_of(found)}
    text = (
        f"The centroid is accurate to {figures['mean_after_mm']:.1f} mm on average, "
        f"{figures['worst_after_mm']:.1f} mm at worst (uncorrected: {figures['mean_before_mm']:.1f} mm and "
        f"{figures['worst_before_mm']:.1f} mm)"
    )
    if "mean_over_time_mm" in figures:
        text += (
            f". With hysteresis and creep compensated: {figures['mean_over_time_mm']:.1f} mm, "
            f"{figures['worst_over_time_mm']:.1f} mm at worst"
        )
    text += "." if found.good else f"; {1e3 * ALLOWED_M:.0f} mm on average is allowed."
    if "expanded_mm" in figures:
        text += f" A place is uncertain by {figures['expanded_mm']:.1f} mm (95 %)."
    if figures["mean_after_mm"] <= 1.1 * figures.get("mean_bound_mm", 0.0):
        text += (
            f" Because of hysteresis, static curves cannot do better than about {figures['mean_bound_mm']:.1f} mm, "
            f"{figures['worst_bound_mm']:.1f} mm at worst."
        )
    if found.used.form == "none":
        text += " No correction improves places that were left out of its fit, so none is made."
    if figures["shear_mm"] > 0.0:
        text += (
            f" While walking, shear forces add about {figures['shear_mm']:.1f} mm: vertical sensors "
            f"{1e3 * found.tile.sensor_depth_m:.0f} mm below the surface do not measure them."
        )
    return text


def part_of(found: CentroidAccuracy, reference: str) -> Centroid:
    """Return the profile's part."""
    return Centroid(
        made=date.today().isoformat(),
        reference=reference,
        error=round(found.used.mean_mm, 4),
        error_allowed=1e3 * ALLOWED_M,
        error_unit="mm",
        good=found.good,
        verdict=verdict_of(found),
        figures={name: float(f"{value:.6g}") for name, value, _ in quantities_of(found)},
        sensors_m=tuple((float(x), float(y)) for x, y in found.tile.sensors_m),
        correction=found.correction,
        over_time=None if found.over_time is None else found.over_time.correction,
        least_n=min(20.0, 0.5 * float(found.force_n.min())),
    )


def drawings_of(found: CentroidAccuracy) -> tuple[Drawing, ...]:
    """Return error vectors before and after, error distribution, error over load, and that of the candidate models."""
    shown = [("before", "alarm", found.before_m), ("after", "contact", found.after_m)]
    if found.over_time is not None:
        shown.append(("after, hysteresis and creep compensated", "vibration", found.over_time.after_m))
    errors = [(name, colour, found.errors_mm(at_m)) for name, colour, at_m in shown]
    share = np.linspace(0.0, 100.0, len(found.at_m))
    vectors = []
    for k, (name, colour, at_m) in enumerate(shown):
        title = name.capitalize() + (", each place left out of its own correction" if k else "")
        vectors.append(error_vectors(title, found.at_m, (("measured", colour, at_m),), found.tile))
    below = tuple(series(name, np.sort(one), share, "line", colour) for name, colour, one in errors)
    over_load = tuple(series(name, found.force_n, one, "dots", colour) for name, colour, one in errors)
    names, errors_mm = zip(*found.used.tried, strict=True)
    candidates = series("", np.arange(1.0, len(names) + 1.0), errors_mm, "line")
    return (
        *vectors,
        Drawing("Cumulative distribution of the error", "error, mm", "% of presses below", below),
        Drawing("Error over load", "load, N", "error, mm", over_load),
        Drawing("Error of the candidates on places left out", "model", "RMS, mm", (candidates,), x_names=names),
    )


def error_vectors(title: str, at_m: Floats, found: tuple[tuple[str, str, Floats], ...], tile: Tile) -> Drawing:
    """Draw dots at the true positions, arrows to the measured ones, and the tile's edge: figure 5.5."""
    half = np.array(tile.size_m) / 2.0
    edge = np.array([half, half * (-1, 1), -half, half * (1, -1), half])
    shown: list[Series] = [series("", 1e3 * edge[:, 0], 1e3 * edge[:, 1], "line", "muted")]
    sensors = 1e3 * np.array(tile.sensors_m)
    shown.append(series("sensors", sensors[:, 0], sensors[:, 1], "dots", "events"))
    shown.append(series("pressed", 1e3 * at_m[:, 0], 1e3 * at_m[:, 1], "dots", "force"))
    shown += [
        series(name, 1e3 * at_m[:, 0], 1e3 * at_m[:, 1], "arrows", colour, 1e3 * to) for name, colour, to in found
    ]
    return Drawing(title, "x, mm", "y, mm", tuple(shown), equal=True)
