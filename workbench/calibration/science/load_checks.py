"""Plausibility of loads over single sensors during a measurement, and the share carried by other sensors."""

from collections.abc import Sequence

import numpy as np

from underfoot.calibration.files.measurements import LARGEST_READING
from underfoot.calibration.science.pair_plausibility import force_outliers
from underfoot.devices.framing.wire_format import unshifted
from underfoot.devices.health.sensor_health import NOISY_N
from underfoot.errors import BadMeasurement
from underfoot.floor.curves import Curve
from underfoot.kernels import Floats

NEAR = 0.96
"""Share of the requested load that is enough."""
_STEPS, COVERED = 20, 0.8
"""Equal steps of force, and the share of them that a loading must pass through."""
_MOST_SHARED, _SHARED = 0.4, 0.1
"""Largest share of a load over one sensor that the others carry; above the second one it is not over that sensor."""
_RAILS = (0.0, LARGEST_READING)
"""Ends of the converter's range."""
LEAST_COUNTS, _CLEAR_COUNTS = 20.0, 400.0
"""Changes of reading: below the first value there is none, above the second it is not noise."""
LOOK = "look at its plug, its wire and its channel"
"""What to do about a sensor whose reading does not move."""
_REVERSED = 0.1
"""Share of full scale below 0 that is no drift of a load cell."""
_LOADED = 0.3
"""Share of full scale above which a sensor must respond."""
_STAYS = 0.05
"""Rise of the force, as a share of full scale, at one reading inside the range, from which on that reading clips."""
_LEAST_SAMPLES = 20
_MOST_OVER = 1.5
"""Share of full scale above which a force is not a press that goes too far."""
_HEAVIER, _NO_MORE = 1.5, 1.03
"""A weight heavier by the first factor changes the reading by more than the second: creep alone stays below that."""
_LIGHTER, _NO_LESS = 1.3, 0.995
"""A weight lighter by the first factor reads less: only a hysteresis of as much would hold the reading."""
_ALIKE = 0.5
"""Share of a loaded sensor's change of reading that two others reach only where it is not loaded alone."""
_TWIN = 0.7
"""Share of a loaded sensor's change of reading that no other one reaches, unless a load is between them."""
_MOST_DRIFT = 0.01
"""Largest change of an empty tile's force, as a share of full scale: twice as much as creep leaves."""
HUM = "look for hum of the mains: keep wires short, away from the amplifier's, and grounded at one point"
"""What to do about sensors that swing without a load."""
_APPARENT = (0.35, 2.8)
"""Range of factors between a typed weight and the load that its reading suggests."""


def covered_share(force_n: Floats, full_scale_n: float) -> float:
    """Return the share of the steps from 5 to 95 % of full scale that a loading has passed through."""
    steps = np.floor((force_n / full_scale_n - 0.05) / 0.9 * _STEPS)
    return np.unique(steps[(steps >= 0) & (steps < _STEPS)]).size / _STEPS


def latest_rise(force_n: Floats, full_scale_n: float) -> Floats:
    """Return the forces from the last light load to the last one near full scale; none if the load was never light.

    The way down from a load that was on already, or was put on too fast, is thus not taken for a rise.
    """
    light = force_n <= (1.0 - COVERED) * full_scale_n
    if not light.any():
        return force_n[:0]
    heavy_before = np.flatnonzero(~light[: int(np.flatnonzero(light)[-1])])
    rise = force_n[heavy_before[-1] + 1 :] if heavy_before.size else force_n
    high = np.flatnonzero(rise >= NEAR * full_scale_n)
    return rise[: high[-1] + 1] if high.size else rise


def require_response(sensor: int, rest: Floats, readings: Floats, force_n: Floats, full_scale_n: float) -> None:
    """Raise `BadMeasurement` for a silent sensor, a clipping one, a response of another one, and a wrong load cell.

    `rest` (4,) are the readings of the empty tile, `readings` (n, 4) those under `force_n` (n,) over `sensor`, from 0.
    """
    if float(force_n.min()) < -_REVERSED * full_scale_n:
        raise BadMeasurement(
            f"the load cell gives {force_n.min():.0f} N while sensor {sensor + 1} is pressed; turn the sign of its "
            "newtons a count"
        )
    loaded = force_n >= _LOADED * full_scale_n
    change = np.abs(readings - rest)
    pressed = readings[:, sensor]
    if np.count_nonzero(loaded) >= _LEAST_SAMPLES:
        typical = np.median(change[loaded], axis=0)
        _require_own(sensor, typical, "pressed")
        if typical[sensor] < LEAST_COUNTS:
            raise BadMeasurement(
                f"sensor {sensor + 1} gives no signal: it stays at {np.median(pressed[loaded]):.0f} under "
                f"{np.median(force_n[loaded]):.0f} N; {LOOK}"
            )
    elif float(np.ptp(pressed)) > 6000.0 and float(force_n.max()) < 0.01 * full_scale_n:
        raise BadMeasurement(
            f"the load cell gives no force while sensor {sensor + 1} is pressed: {force_n.max():.2g} N at most; does "
            "the press go through it, and does it count newtons?"
        )
    _require_unclipped(sensor, float(rest[sensor]), pressed, force_n, full_scale_n)


def require_cell(sensor: int, readings: Floats, force_n: Floats, full_scale_n: float) -> None:
    """Raise `BadMeasurement` for a load cell that gives far more than full scale, or jumps where the reading does not.

    `readings` (n,) are those of the loaded `sensor`, from 0, `force_n` (n,) those of the cell.
    """
    require_within_scale(force_n, full_scale_n)
    out = force_outliers(readings, force_n)[1]
    if out.any():
        raise BadMeasurement(
            f"the load cell jumped to {force_n[out][0]:.0f} N for a moment, and sensor {sensor + 1} did not; "
            "look for a loose wire"
        )


def require_within_scale(force_n: Floats, full_scale_n: float) -> None:
    """Raise `BadMeasurement` for forces (n,) of a load cell that go far beyond full scale."""
    most = float(force_n.max())
    if most > _MOST_OVER * full_scale_n:
        raise BadMeasurement(
            f"the load cell gave {most:.0f} N, where up to {full_scale_n:.0f} N are asked for; press less hard, choose "
            "a larger full scale, look for a loose wire, or does it count grams?"
        )


def require_weight(
    sensor: int,
    given_n: float,
    readings: Floats,
    rest: Floats,
    full_scale_n: float,
    before: tuple[float, float],
    apparent_n: float | None,
    ways: Sequence[float],
) -> None:
    """Raise `BadMeasurement` for an implausible weight `given_n` over `sensor`, from 0.

    `readings` (4,) are the steady ones of all sensors and `rest` (4,) those of the empty tile; `before` has change of
    reading and newtons of the sensor's last weight, or its drift and 0; `apparent_n` is the load suggested by other
    weights (`apparent_load_n`), None if unknown. `ways` (4,) are 1 or -1, as loads move the reading of each sensor, or
    0 of one that had none: what goes the other way has crept under a load of before, and goes back.
    """
    reading = float(readings[sensor])
    change = abs(reading - float(rest[sensor]))
    if reading in _RAILS and change > _CLEAR_COUNTS:
        raise BadMeasurement(f"sensor {sensor + 1} clips at {given_n:g} N: its reading stays at {reading:.0f}")
    if given_n > 0.0:
        moved = readings - rest
        goes_back = (moved * np.array(ways) < 0.0) & (np.arange(moved.size) != sensor)
        _require_own(sensor, np.where(goes_back, -1.0, 1.0) * np.abs(moved), "loaded")
        _require_other(sensor, given_n, change, before)
    if given_n >= _LOADED * full_scale_n and change < LEAST_COUNTS:
        raise BadMeasurement(
            f"sensor {sensor + 1} gives no signal: it stays at {reading:.0f} under {given_n:g} N; {LOOK}"
        )
    low, high = _APPARENT
    if given_n > 0.0 and apparent_n is not None and not low <= given_n / apparent_n <= high:
        raise BadMeasurement(
            f"{given_n:g} N was typed, but sensor {sensor + 1} reads as under about {apparent_n:.0f} N; "
            "check the weight"
        )


def _require_unclipped(sensor: int, rest: float, pressed: Floats, force_n: Floats, full_scale_n: float) -> None:
    """Refuse readings (n,) of the pressed sensor that stay at an end of its range, away from the one at `rest`."""
    top = float(pressed.max())
    question = unshifted(int(top))
    railed = np.isin(pressed, (*_RAILS, top) if question else _RAILS) & (np.abs(pressed - rest) > _CLEAR_COUNTS)
    # One of fewer bits is passed on the way up, too: it stays there while the force rises.
    rises = np.ptp(force_n[railed]) > _STAYS * full_scale_n if question and railed.any() else True
    if np.count_nonzero(railed) >= _LEAST_SAMPLES and rises:
        stays = float(pressed[railed][0])
        others, least_n = pressed[~railed & (force_n > _STAYS * full_scale_n)], float(force_n[railed].min())
        if others.size and (np.median(others) - rest) * (stays - rest) < 0.0:
            raise BadMeasurement(
                f"sensor {sensor + 1} goes to {stays:.0f} at {least_n:.0f} N, against the way of its "
                "reading; look for a loose plug or wire"
            )
        why = "choose a smaller full scale" if least_n > _STAYS * full_scale_n else HUM
        raise BadMeasurement(
            f"sensor {sensor + 1} clips: it stays at {stays:.0f} above {least_n:.0f} N; {why}, or take "
            f"another divider{question}"
        )


def _require_other(sensor: int, given_n: float, change: float, before: tuple[float, float]) -> None:
    """Refuse a weight that is much heavier or lighter than the one `before` and leaves the reading as it was."""
    last, last_n = before
    if given_n >= _HEAVIER * last_n and change <= _NO_MORE * last:
        reads = f"reads as under the {last_n:g} N before" if last_n else "reads as with nothing on it"
        else_ = ", or does the sensor clip?" if last_n else f"? If it is, {LOOK}"
        raise BadMeasurement(f"{given_n:g} N was typed, but sensor {sensor + 1} {reads}; is the weight on it{else_}")
    if _LIGHTER * given_n <= last_n and change > _NO_LESS * last:
        raise BadMeasurement(
            f"{given_n:g} N was typed, but sensor {sensor + 1} reads as under the {last_n:g} N before; "
            "are those still on it?"
        )


def _require_own(sensor: int, change: Floats, is_what: str) -> None:
    """Refuse changes of reading (4,) if that of another sensor is by far the largest, or if all or two are alike.

    Those of sensors that go back from loads of before are below 0.
    """
    strongest, own = int(np.argmax(change)), float(change[sensor])
    others = float(np.median(np.abs(np.delete(change, sensor))))
    if strongest != sensor and change[strongest] > _CLEAR_COUNTS and change[strongest] > 2.0 * own:
        dead = f", or does sensor {sensor + 1} give no signal? Then {LOOK}" if own < LEAST_COUNTS else "?"
        raise BadMeasurement(
            f"sensor {strongest + 1} responds when sensor {sensor + 1} is {is_what}; is the load over sensor "
            f"{sensor + 1}, is the tile turned, or are their wires swapped{dead}"
        )
    if own >= LEAST_COUNTS and others > max(_ALIKE * own, _CLEAR_COUNTS):
        raise BadMeasurement(
            f"all sensors respond when sensor {sensor + 1} is {is_what}; is the load over it, and was the tile empty "
            "before? If not, go back to the page with nothing on it"
        )
    twin = int(np.argmax(np.where(np.arange(change.size) == sensor, -np.inf, change)))
    if change[twin] > max(_TWIN * own, _CLEAR_COUNTS):
        raise BadMeasurement(
            f"sensor {twin + 1} responds nearly as sensor {sensor + 1} does when it is {is_what}; is the load between "
            "them, is one channel read twice, or does it leak into the next one?"
        )


def drift_warnings(unloaded_n: dict[int, Floats], full_scale_n: float) -> tuple[str, ...]:
    """Return a line on each sensor whose force drifts while nothing is on the tile.

    `unloaded_n` are newtons (4,) of the empty tile, as a session has them, before the loads of each sensor that was not
    skipped. Of the tare after its own loads nothing is concluded: without a load cell, what a sensor has crept is in
    it, and goes back within half a minute.
    """
    found = []
    for j, own in unloaded_n.items():
        after = min((k for k in unloaded_n if k > j), default=None)
        apart = max(abs(float(other[j] - own[j])) for k, other in unloaded_n.items() if k != after)
        if apart > _MOST_DRIFT * full_scale_n:
            found.append(
                f"sensor {j + 1} drifts: with nothing on the tile it moved by {apart:.0f} N while others were loaded; "
                "is it warm, wet, or loose, or was something on the tile? Wait until it is steady, and measure again"
            )
    return tuple(found)


def swings_n(force_n: Floats) -> float:
    """Return how far a force (n,) of a second swings to and fro; of several (n, m), the one that does most.

    That is half of its range within a tenth of the time, so that a single step is no swing; 0 of a board too slow.

    >>> round(swings_n(3.0 * np.sin(0.1 * np.pi * np.arange(1000.0))), 6), swings_n(np.arange(7.0))
    (3.0, 0.0)
    """
    parts = np.array_split(force_n, min(10, len(force_n)))
    return 0.5 * float(np.median([np.ptp(part, axis=0) for part in parts], axis=0).max())


def noise_warnings(curves: Sequence[Curve], tares: dict[int, Floats]) -> tuple[str, ...]:
    """Return a line on each sensor that swings as far as those that Monitor calls noisy.

    `tares` are readings (n, 4) of the empty tile before the loads of each sensor that was not skipped.
    """
    swings = {j: swings_n(curves[j].force(values[:, j])) for j, values in tares.items() if not curves[j].uncalibrated}
    return tuple(
        f"sensor {j + 1} swings by {swing_n:.0f} N with nothing on the tile: {HUM}"
        for j, swing_n in swings.items()
        if swing_n >= NOISY_N
    )


def share_warnings(shares: Floats) -> tuple[str, ...]:
    """Return a line on the sensors that were not loaded alone, by the shares (4,) that the others carried."""
    over = [f"sensor {j + 1} ({100.0 * share:.0f} %)" for j, share in enumerate(shares) if abs(share) > _SHARED]
    if not over:
        return ()
    return (
        f"the other sensors carried a share of the loads over {', '.join(over)}; it is taken off, but known to a fifth "
        "of it only: load each sensor from right above, through a small foot",
    )


def apparent_load_n(change: float, weights: Sequence[tuple[float, float]]) -> float:
    """Return the load suggested by a change of reading, from known weights: (change of reading, newtons) of each.

    Interpolated on logarithmic axes; extrapolated along the last slope.

    >>> round(apparent_load_n(400.0, [(100.0, 10.0), (200.0, 20.0), (800.0, 80.0)]), 6)
    40.0
    """
    x, f = np.log(np.array(weights)).T
    order = np.argsort(x)
    x, f = x[order], np.maximum.accumulate(f[order])
    at = float(np.log(max(change, 1.0)))
    if x[0] <= at <= x[-1]:
        return float(np.exp(np.interp(at, x, f)))
    two = slice(-2, None) if at > x[-1] else slice(0, 2)
    slope = float(np.clip(np.diff(f[two])[0] / max(np.diff(x[two])[0], 1e-3), 0.3, 4.0))
    end = -1 if at > x[-1] else 0
    return float(np.exp(f[end] + slope * (at - x[end])))


def share_of_others(curves: Sequence[Curve], sensor: int, time_s: Floats, readings: Floats, load_n: Floats) -> float:
    """Return the share of loads (n,) over one sensor that the others carry, as a plate is never perfectly flat.

    `curves` are those of all sensors, `readings` (n, 4) at `time_s` (n,). It is the slope of the others' sum over the
    load, with a slow drift removed: they still creep after loads of their own.
    """
    others = np.nansum([curve.force(readings[:, k]) for k, curve in enumerate(curves) if k != sensor], axis=0)
    terms = np.stack([load_n, np.ones(load_n.size), time_s - time_s[0], np.log1p(time_s - time_s[0])], axis=1)
    slope = float(np.linalg.lstsq(terms, others, rcond=None)[0][0])
    return float(np.clip(slope, -_MOST_SHARED, _MOST_SHARED))
