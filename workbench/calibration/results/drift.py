"""Drift of a tile: how far a calibration is off the one before, where that is more than both can be by themselves."""

import math

import numpy as np

from underfoot.calibration.reference import COVERAGE
from underfoot.calibration.results.latency import STEADY_MS
from underfoot.floor.profile import Fsr, Latency, Part, PlateStiffness, Response

_MOST_FORCE_PERCENT = 2.0
"""Difference of two calibrations of one sensor's curve, % of full scale, that is no hand's.

Of one simulated tile they were 0.1 to 0.3 apart; loadings by a person repeat to about 1 %.
"""
_UNCERTAIN = ("repeatability", "flatness", "linearity")
"""Parts of the uncertainty of an acceleration that two calibrations with one accelerometer do not share."""


def drift(now: Part | None, before: Part | None) -> str:
    """Return a line on how a calibration differs from the one `before` it; "" where that is within both.

    Levels of acceleration differ if they are apart by more than the root of the sum of both squared expanded
    uncertainties (E_n above 1, ISO 13528), the accelerometer's own left out, under one load. A sensor's curve differs
    by its root mean square over the readings that both have, a plate's stiffness by more than footsteps of both are off
    their means (k = 2), and a round trip at one rate and block by more than counts as steady. A simulated tile and
    hardware are no one tile.
    """
    if now is None or before is None or now.simulated != before.simulated:
        return ""
    if isinstance(now, Response) and isinstance(before, Response):
        return _of_level(now, before)
    if isinstance(now, Fsr) and isinstance(before, Fsr):
        return _of_curves(now, before)
    if isinstance(now, PlateStiffness) and isinstance(before, PlateStiffness):
        return _of_stiffness(now, before)
    if isinstance(now, Latency) and isinstance(before, Latency):
        return _of_round_trip(now, before)
    return ""


def _of_level(now: Response, before: Response) -> str:
    parts = [one.figures.get(f"acceleration_{name}_percent", math.nan) for one in (now, before) for name in _UNCERTAIN]
    change = 100.0 * (now.acceleration_per_unit / before.acceleration_per_unit - 1.0)
    if now.load != before.load or not abs(change) > COVERAGE * math.hypot(*parts):
        return ""
    way = "more" if change > 0.0 else "less"
    return (
        f"acceleration at full scale is {abs(change):.0f} % {way} than on {before.made}, "
        f"beyond the {COVERAGE * math.hypot(*parts):.1f} % of both (k = 2): did a gain, the accelerometer or its place "
        "change, or did something come loose?"
    )


def _of_curves(now: Fsr, before: Fsr) -> str:
    apart = []
    for j, (new, old) in enumerate(zip(now.sensors, before.sensors, strict=True)):
        if not new.uncalibrated and not old.uncalibrated:
            readings = np.linspace(new.readings[0], min(new.readings[-1], old.readings[-1]), 50)
            off = 100.0 * float(np.sqrt(np.mean((new.force(readings) - old.force(readings)) ** 2))) / new.full_scale_n
            if off > _MOST_FORCE_PERCENT:
                apart.append(f"sensor {j + 1} ({off:.0f} %)")
    if not apart:
        return ""
    return (
        f"forces differ from those of {before.made} by more than {_MOST_FORCE_PERCENT:g} % of full scale: "
        f"{', '.join(apart)}; has the sensor aged, was it moved, or is the load cell another?"
    )


def _of_stiffness(now: PlateStiffness, before: PlateStiffness) -> str:
    errors = [one.measured.get("mean_error_percent", math.nan) for one in (now, before)]
    old = np.exp(np.interp(now.positions, before.positions, np.log(before.stiffness_n_mm)))
    both = (np.array(now.positions) >= before.positions[0]) & (np.array(now.positions) <= before.positions[-1])
    changes = np.where(both, 100.0 * (np.array(now.stiffness_n_mm) / old - 1.0), 0.0)
    k, most = int(np.abs(changes).argmax()), COVERAGE * math.hypot(*errors)
    if not abs(changes[k]) > most:
        return ""
    way = "stiffer" if changes[k] > 0.0 else "softer"
    return (
        f"at position {now.positions[k]:g} the plate is {abs(changes[k]):.0f} % {way} than on {before.made}, beyond "
        f"the {most:.1f} % of both (k = 2): has its foam aged, or the scale of a sensor changed?"
    )


def _of_round_trip(now: Latency, before: Latency) -> str:
    change_ms = now.round_trip_ms - before.round_trip_ms
    if (now.rate_hz, now.block) != (before.rate_hz, before.block) or not abs(change_ms) > STEADY_MS:
        return ""
    way = "longer" if change_ms > 0.0 else "shorter"
    return (
        f"the round trip is {abs(change_ms):.1f} ms {way} than on {before.made}, at the same rate and block: another "
        "card, driver or way back, or does it change each time the card is opened?"
    )
