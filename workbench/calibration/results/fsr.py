"""Results of a linearisation: figures, verdict, the profile's part, and pictures of curves, residuals and creep."""

import math
from datetime import date

import numpy as np
from numpy.typing import NDArray

from underfoot.calibration.files.measurements import PAIR_HEADER, Pairs
from underfoot.calibration.result import Result
from underfoot.calibration.results.labels import title_of
from underfoot.calibration.science.linearisation import ALLOWED_PERCENT, Linearisation, SensorFit
from underfoot.calibration.science.sensor_characteristics import (
    SensorCharacteristics,
    creep_runs,
    held_s,
    spread_percent,
)
from underfoot.calibration.science.sensor_pairs import FALLING, HELD, RISING
from underfoot.drawing import Drawing, Series, series
from underfoot.drawing.look import CORNERS
from underfoot.floor.profile import Fsr

METHOD = (
    "Errors are of loadings that were not used to fit (cross-validation by loading), with all forces weighted alike, "
    "in % of the largest reference force. The error, that of each sensor, and what a force is said to be accurate to "
    "are root mean squares; of all figures of single sensors the mean is given. The least error of any static curve "
    "is what the best rising curve leaves on the same data. Hysteresis is the widest gap between falling and rising "
    "loads; creep is the growth of a held load's reading a decade of time, in % of itself; repeatability is the "
    "standard deviation between loadings, noise that of one reading of the empty tile. The spread of the sensors is "
    "half of the range of the forces at which they read the same, in % of their mean, at half of full scale. Creep "
    "is compensated by first-order lags and hysteresis by play operators (underfoot.models.tile.fsr_hysteresis). "
    "What the reference itself is off by is in the uncertainty of a foot's force alone."
)
_OF_COMPENSATED = (
    "The error with hysteresis compensated is of loadings as those of the fit, and of the force that the load cell "
    "gives to a sensor; what the others bear of it is known to 0.7 % of the force. On 39 simulated tiles, whose true "
    "forces are known, 0.54 % of full scale was 0.77 % of further loadings, 0.92 % of forces that fall in part, and "
    "1.0 % of footsteps; of single sensors up to 1.4 %. These are standard deviations (k = 1). "
    "Creep is that of this fit, in which each increment of the load creeps by itself (Boltzmann's "
    "superposition): a held load alone does not tell it, as it rose over seconds, and earlier loads are still felt. Of "
    "made sensors of 2 to 10 % a decade it was 0.1 to 0.4 too large, with hysteresis up to 1.5."
)
"""Measured with `FsrProcedure` and `SimulatedHand`, seeds 1 to 39, and readings of forces over each sensor."""
_OF_FOOT = (
    "The force of a foot is the sum of the four sensors. Its expanded uncertainty (k = 2) is twice the root of the sum "
    "of three squares: by how much the sum was off the load cell under a load in the middle (root mean square), where "
    "errors of what others bear add up; the sum of the errors of the four sensors, as a foot loads them alike; and "
    "half of the load cell's own expanded uncertainty. On 30 simulated tiles 99.8 % of the samples of footsteps of 500 "
    "to 1000 N were within it (98.8 % on the worst tile), and 99.2 % (92.4 %) of people who stand for 6 s again and "
    "again, so that creep adds up. A load cell's own error grows with the force: with cells that were off by 1 % "
    "(standard deviation), and 2 % entered, 99 % of the samples up to full scale were within it (91 % with one that "
    "was 3 % off), and 96 % (82 %) of all."
)
"""Measured as above, seeds 1 to 30, full scale 600 N: 14 steps and 14 times of standing within 8 cm of the middle; with
cells that are off, seeds 101 to 112.
"""
_OF_WEIGHTS = (
    "Weights stand on a sensor until they are read, and a foot comes and goes. How much less a footstep reads, at half "
    "of full scale, is the measured hysteresis and a creep of 5 % a decade of time, the most that the data sheet of a "
    "force sensing resistor allows, from 0.3 s to 10 s."
)
_CREEP_PERCENT = 5.0
"""Growth of a held load's reading by creep, % a decade of time, at most (data sheet: `underfoot.models.tile.fsr`)."""
_STEPPED_S, _STOOD_S = 0.3, 10.0
"""Time until a footstep has risen, and for which a weight has stood when it is read."""
_FALLEN = 0.3
"""Share of full scale above which a fall counts: two weights of which one is twice the other have a fall at half."""
_DOTS = 250
"""Approximate number of dots of a series; at most about twice this."""
_LOADED_N = 1.0
_DIRECTIONS = ((RISING, "rising", "force"), (FALLING, "falling", "events"), (HELD, "held", "contact"))


def result_of(found: Linearisation, reference: str) -> Result:
    """Return the result of a linearisation against `reference`, whose name goes to the profile."""
    return Result(
        kind="fsr",
        title=title_of("fsr", found.tile),
        quantities=quantities_of(found),
        verdict=verdict_of(found),
        good=found.good,
        warnings=found.warnings,
        drawings=drawings_of(found),
        raw=_raw(np.concatenate([sensor.rows(j) for j, sensor in enumerate(found.sensors)])),
        part=part_of(found, reference),
        tile=found.tile,
        method=" ".join(filter(None, (METHOD, _more_of_method(found)))),
    )


def inconclusive(tile: str, pairs: Pairs, reason: str, drawings: tuple[Drawing, ...]) -> Result:
    """Return the pairs alone, of a linearisation that was refused for this reason."""
    return Result("fsr", title_of("fsr", tile), (), reason, good=False, drawings=drawings, raw=_raw(pairs.rows()))


def _raw(rows: NDArray[np.float64]) -> tuple[tuple[str, str, NDArray[np.float64]], ...]:
    return (("pairs", PAIR_HEADER, rows),)


def quantities_of(found: Linearisation) -> tuple[tuple[str, float, str], ...]:
    """Return name, value and unit of all measured quantities: means over the sensors, then each sensor."""
    measured = [sensor.characteristics for sensor in found.sensors if sensor.characteristics is not None]
    several: list[tuple[str, float, str]] = [
        ("full_scale_n", found.full_scale_n, "N"),
        ("sensors_calibrated", float(len(found.calibrated)), ""),
    ]
    for name, unit in SensorCharacteristics.units().items():
        values = [value for one in measured if np.isfinite(value := getattr(one, name))]
        if values:
            several.append((name, float(np.mean(values)), unit))
    if _is_of_weights(found):
        several = [one for one in several if one[0] != "bound_percent"]  # a curve can go through so few pairs
        several.append(("footstep_less_percent", _footstep_less_percent(found), "%"))
    if (foot := found.foot) is not None:
        several.append(("foot_expanded_percent", foot.expanded_percent, "% of full scale"))
        several.append(("foot_error_percent", foot.error_percent, "% of full scale"))
        several.append(("foot_scatter_percent", foot.scatter_percent, "% of full scale"))
        several.append(("foot_reference_percent", foot.reference_percent, "% of full scale"))
    several.append(("spread_percent", spread_percent([found.sensors[j].curve for j in found.calibrated]), "%"))
    for j in found.calibrated:
        several.append((f"error_percent_{j + 1}", found.sensors[j].curve.error_percent, "% of full scale"))
    return tuple((name, value, unit) for name, value, unit in several if np.isfinite(value))


def verdict_of(found: Linearisation) -> str:
    """Return in plain words how accurate the forces are, and what limits them."""
    figures = {name: value for name, value, _ in quantities_of(found)}
    measured = "Standing weights" if _is_of_weights(found) else "Forces"
    text = f"{measured} are accurate to {found.error_percent:.1f} % of full scale ({found.full_scale_n:.0f} N)"
    if "memory_error_percent" in figures:
        text += f", or to {figures['memory_error_percent']:.1f} % with hysteresis and creep compensated"
    errors, allows = found.over_time_errors_percent, f"{ALLOWED_PERCENT:.0f} % is allowed"
    is_within = float(np.mean(list(errors.values()))) <= ALLOWED_PERCENT
    if not is_within:
        text += f"; {allows}"
    text += "."
    if (foot := found.foot) is not None:
        expanded = foot.expanded_percent
        text += (
            f" The force of a foot, the sum of all sensors, is uncertain by {expanded:.1f} % of full scale "
            f"({0.01 * expanded * found.full_scale_n:.0f} N; k = 2)."
        )
        if foot.error_percent > ALLOWED_PERCENT:
            text += (
                f" It was {foot.error_percent:.1f} % off in the middle; {allows}. Was each sensor "
                "loaded from right above, through a small foot? Then a channel leaks into others, or the plate "
                "touches something."
            )
    if "footstep_less_percent" in figures:
        text += (
            f" A footstep of {0.5 * found.full_scale_n:.0f} N may read some {figures['footstep_less_percent']:.0f} % "
            "less than such a weight: creep and hysteresis are compensated only after a calibration with a load cell."
        )
    bound = figures.get("bound_percent", 0.0)
    if found.error_percent <= 1.1 * bound and bound > 0.5:
        # A curve in the middle of a loop is off by half of its width at most; the rest is noise.
        why = "hysteresis" if abs(figures.get("hysteresis_percent", 0.0)) >= 2.0 * bound else "hysteresis and noise"
        text += f" Because of {why}, no static curve can be more accurate than {bound:.1f} %."
    if not any(_has_fallen(found.sensors[j]) for j in found.calibrated):
        text += " Forces were measured while they rose alone: what hysteresis adds is not in this."
    worst = max(errors, key=lambda j: errors[j])
    if is_within and errors[worst] > ALLOWED_PERCENT:
        text += f" The error of sensor {worst + 1} is {errors[worst]:.3g} %; {allows}."
    if found.saturated:
        ends = ", ".join(f"sensor {j + 1} above {end_n:.3g} N" for j, end_n in found.saturated)
        text += f" Saturated: {ends}; larger forces are underestimated."
    missing = [f"sensor {j + 1}: {found.sensors[j].curve.uncalibrated}" for j in range(4) if j not in found.calibrated]
    if missing:
        text += f" Not calibrated: {'; '.join(missing)}."
    return text


def _is_of_weights(found: Linearisation) -> bool:
    """Return whether single loads were measured, as weights are, and not how forces rise and fall over time."""
    known = [sensor.pairs for sensor in found.sensors if sensor.pairs is not None]
    return not any(pairs.timed for pairs in known)


def _more_of_method(found: Linearisation) -> str:
    """Return what holds of weights, or of compensated forces, alone."""
    if _is_of_weights(found):
        return _OF_WEIGHTS
    is_compensated = any(found.sensors[j].curve.compensation is not None for j in found.calibrated)
    return " ".join([_OF_COMPENSATED] * is_compensated + [_OF_FOOT] * (found.foot is not None))


def _footstep_less_percent(found: Linearisation) -> float:
    """Return by how much of itself a footstep of half of full scale may read less than a weight that stands, %."""
    gaps = [one.hysteresis_percent for sensor in found.sensors if (one := sensor.characteristics) is not None]
    gap = float(np.nan_to_num(np.mean(gaps)))
    # The curve is in the middle of the loop, half of the gap above rising forces; of half of full scale this is twice
    # the share.
    return max(gap, 0.0) + _CREEP_PERCENT * math.log10(_STOOD_S / _STEPPED_S)


def _has_fallen(sensor: SensorFit) -> bool:
    """Return whether a sensor was measured while its force fell from full scale, or may have been."""
    pairs = sensor.pairs
    if pairs is None:
        return False
    if not pairs.has_directions:
        return True
    high = pairs.force_n > _FALLEN * pairs.full_scale_n
    return bool(np.any(high & (pairs.direction != RISING) & (pairs.direction != HELD)))


def part_of(found: Linearisation, reference: str) -> Fsr:
    """Return the profile's part."""
    first, second, third, fourth = found.curves
    return Fsr(
        made=date.today().isoformat(),
        reference=reference,
        error=round(found.error_percent, 4),
        error_allowed=ALLOWED_PERCENT,
        error_unit="% of full scale",
        good=found.good,
        verdict=verdict_of(found),
        figures={name: float(f"{value:.6g}") for name, value, _ in quantities_of(found)},
        sensors=(first, second, third, fourth),
    )


def drawings_of(found: Linearisation) -> tuple[Drawing, ...]:
    """Return curves and residuals of every sensor, then hysteresis, creep and candidates of all."""
    fits = [(j, sensor) for j, sensor in enumerate(found.sensors) if sensor.pairs is not None]
    every: list[Drawing] = []
    for j, sensor in fits:
        every += [_curve(j, sensor), _residuals(j, sensor)]
    every += [_creep(fits), _candidates(fits)]
    return tuple(drawing for drawing in every if drawing.series)


def pairs_drawing(pairs: Pairs) -> tuple[Drawing, ...]:
    """Return a drawing of the pairs, one colour per sensor; nothing before the first load."""
    if pairs.force_n.max(initial=0.0) < _LOADED_N:
        return ()
    shown = []
    for j in range(4):
        mine = _some(pairs.sensor == j)
        if mine.size:
            shown.append(series(f"sensor {j + 1}", pairs.force_n[mine], pairs.reading[mine], "dots", CORNERS[j]))
    return (Drawing("Taken so far", "force, N", "reading, counts", tuple(shown)),)


def _some(chosen: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return the indices of the chosen pairs, thinned evenly where they are many."""
    places = np.flatnonzero(chosen)
    return places[:: max(1, places.size // _DOTS)]


def _curve(j: int, sensor: SensorFit) -> Drawing:
    """Draw pairs of a sensor and the curve through them."""
    pairs, curve = sensor.pairs, sensor.curve
    assert pairs is not None
    x = np.linspace(curve.readings[0], curve.readings[-1], 400)
    shown: list[Series] = []
    for direction, name, colour in _DIRECTIONS:
        mine = _some(pairs.direction == direction)
        if mine.size:
            shown.append(series(name, pairs.reading(pairs.x[mine]), pairs.force_n[mine], "dots", colour))
    shown.append(series(curve.family, x, curve.force(x), "line", "vibration"))
    return Drawing(f"Sensor {j + 1}: curve", "reading, counts", "force, N", tuple(shown))


def _residuals(j: int, sensor: SensorFit) -> Drawing:
    """Draw the held-out error of a sensor over force."""
    pairs, estimate_n = sensor.pairs, sensor.estimate_n
    assert pairs is not None
    assert estimate_n is not None
    assert sensor.seen is not None
    force, directions = pairs.force_n[sensor.seen], pairs.direction[sensor.seen]
    error = 100.0 * (estimate_n - force) / pairs.full_scale_n
    shown = []
    for direction, name, colour in _DIRECTIONS:
        mine = _some(directions == direction)
        if mine.size:
            shown.append(series(name, force[mine], error[mine], "dots", colour))
    return Drawing(f"Sensor {j + 1}: held-out error", "force, N", "error, % of full scale", tuple(shown))


def _creep(fits: list[tuple[int, SensorFit]]) -> Drawing:
    """Draw the longest hold of each sensor."""
    shown = []
    for j, sensor in fits:
        pairs = sensor.pairs
        assert pairs is not None
        runs = creep_runs(pairs)
        if not runs:
            continue
        run = max(runs, key=lambda r: float(pairs.time_s[r.stop - 1] - pairs.time_s[r.start]))
        since = held_s(pairs, run)
        later = since >= 0.05
        ratio = sensor.curve.force(pairs.reading(pairs.x[run]))[later] / pairs.force_n[run][later]
        shown.append(series(f"sensor {j + 1}", since[later], ratio, "line", CORNERS[j]))
    return Drawing("Creep: measured over true force of a held load", "time held, s", "ratio", tuple(shown), x_log=True)


def _candidates(fits: list[tuple[int, SensorFit]]) -> Drawing:
    """Draw the held-out error of the candidates, in order."""
    shown = []
    names = [name for name, _ in fits[0][1].tried] if fits else []
    for j, sensor in fits:
        errors = dict(sensor.tried)
        places = [k + 1.0 for k, name in enumerate(names) if name in errors]
        shown.append(series(f"sensor {j + 1}", places, [errors[n] for n in names if n in errors], "line", CORNERS[j]))
    return Drawing("Held-out error of the candidates", ", ".join(names), "% of full scale", tuple(shown))
