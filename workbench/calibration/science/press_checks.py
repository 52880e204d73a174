"""Checks of presses at known positions during a measurement: start, steadiness and plausibility."""

import numpy as np

from underfoot.calibration.files.measurements import LARGEST_READING
from underfoot.calibration.rig import Readings
from underfoot.calibration.science.centroid_fit import centroid
from underfoot.calibration.science.load_checks import HUM, LEAST_COUNTS, LOOK
from underfoot.devices.framing.wire_format import unshifted
from underfoot.errors import BadMeasurement
from underfoot.kernels import Floats

EMPTY_S = 0.15
"""Time for which the tile must be empty before a press, for its baseline."""
PRESSED = 0.3
"""Share of the load above which the tile counts as pressed."""
_FORCE_STEADY, _PLACE_STEADY_M = 0.05, 0.006
"""Largest standard deviations of a steady press: of the force, as a share of the load, and of the position."""
_UNSTEADY_S, _HUM_N = 20.0, 1.0
"""Time after which an unsteady press is given up, and swing of a sensor on the empty tile that explains it."""
_WRONG_PLACE_M = 0.08
"""Largest distance of a press from the requested position."""
_EQUALLY_M = 0.02
"""Difference of distance from a press up to which sensors are equally near to it."""
_ENDS, _CLEAR_COUNTS, _MOVES = (0.0, LARGEST_READING), 400.0, 10
"""Ends of the converter's range, a change of reading that is no noise, and different readings of one that moves."""
_LEAST_SHARE = 0.1
"""Share of a load below which sensors give no signal: of one above a dead sensor, the others bear less."""


def press_begun(readings: Readings, total_n: Floats, load_n: float) -> tuple[float, Floats, Readings] | None:
    """Return when the tile was last empty before a press with `load_n`, the values (m,) then, and the press's readings.

    `total_n` (n,) is the load during the readings, from a reference or from the sensors. None if the readings do not
    start with an empty tile.
    """
    light = np.flatnonzero(total_n < PRESSED * load_n)
    if not light.size:
        return None
    empty = light[total_n[light] <= total_n[light].min() + 0.03 * load_n]
    if readings.time_s[empty[-1]] - readings.time_s[empty[0]] < 0.9 * EMPTY_S:
        return None
    late = empty[readings.time_s[empty] >= readings.time_s[empty[-1]] - EMPTY_S]
    when = float(readings.time_s[late].mean())
    return when, np.median(readings.values[late], axis=0), readings.since(int(light[-1]))


def is_steady(force_share: float, place_m: float, pressed_s: float, swings_n: float = 0.0) -> bool:
    """Return whether these standard deviations are small; `BadMeasurement` if they are not after `pressed_s`.

    `swings_n` is how far a sensor swings on the empty tile.

    >>> is_steady(0.01, 0.001, 0.5), is_steady(0.2, 0.001, 0.5)
    (True, False)
    """
    if force_share <= _FORCE_STEADY and place_m <= _PLACE_STEADY_M:
        return True
    if pressed_s > _UNSTEADY_S:
        raise BadMeasurement(
            f"the press is unsteady: its force varies by {100 * force_share:.0f} %, its place by "
            f"{1e3 * place_m:.0f} mm (standard deviations); "
            + (f"a sensor swings by {swings_n:.0f} N on the empty tile: {HUM}" if swings_n >= _HUM_N else "hold still")
        )
    return False


def nearest_words(wanted_m: tuple[float, float], sensors_m: Floats, readings: Floats, rest: Floats) -> str:
    """Return what the sensor nearest to a press reads, of `readings` (n, 4), and read on the empty tile (4,).

    Of sensors that are equally near, it is the one that moves least.

    >>> corners, rest = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]]), np.full(4, 730.0)
    >>> nearest_words((-0.08, 0.09), corners, np.array([[900.0, 731.0, 730.0, 730.0]]), rest)
    'sensor 2, the nearest, reads 731, and 730 on the empty tile: look at its plug, its wire and its channel'
    """
    reads, away_m = np.median(readings, axis=0) + 0.0, np.hypot(*(sensors_m - wanted_m).T)
    moved = np.where(away_m < away_m.min() + _EQUALLY_M, np.abs(reads - rest), np.inf)
    j = int(moved.argmin())
    told = f"sensor {j + 1}, the nearest, reads {reads[j]:.0f}, and {rest[j]:.0f} on the empty tile"
    return f"{told}: {LOOK}" if moved[j] < LEAST_COUNTS else told


def require_place(forces_n: Floats, sensors_m: Floats, wanted_m: tuple[float, float], nearest: str) -> None:
    """Raise `BadMeasurement` for a press that sensors (4,) at (4, 2) measure far from the requested position.

    `nearest` are words on the sensor nearest to that.
    """
    off = float(np.hypot(*(centroid(forces_n, sensors_m) - wanted_m)))
    if off > _WRONG_PLACE_M:
        shares = ", ".join(f"{round(share)}" for share in (100.0 * forces_n / forces_n.sum()).tolist())
        raise BadMeasurement(
            f"the press is measured {1e3 * off:.0f} mm from where it was asked for: another place, or a sensor "
            f"swapped, loose or dead? Sensors 1 to 4 bear {shares} % of it; {nearest}"
        )


def require_signal(load_n: float, reference_n: Floats | None, forces_n: Floats, nearest: str) -> None:
    """Raise `BadMeasurement` where sensors (n, 4) and reference (n,), newtons, do not give the same load, or nearly so.

    `nearest` are words on the sensor nearest to the press.
    """
    if reference_n is None:
        return
    reference, measured = float(np.median(reference_n)), float(np.median(forces_n.sum(axis=1)))
    if reference > 0.8 * load_n and measured < _LEAST_SHARE * reference:
        raise BadMeasurement(f"no signal: the sensors add up to {measured:.3g} N under {load_n:.0f} N; {nearest}")
    if measured > 0.8 * load_n and reference < PRESSED * measured:
        each = ", ".join(f"{newtons:.0f}" for newtons in np.median(forces_n, axis=0) + 0.0)
        raise BadMeasurement(
            f"the load cell gives {reference:.3g} N, and the sensors add up to {measured:.3g} N: does it count "
            f"newtons, and does all of the load go through it? Sensors 1 to 4 give {each} N"
        )


def require_unclipped(readings: Floats, rest: Floats) -> None:
    """Raise `BadMeasurement` for a sensor whose readings (n, 4) stay at one value, unlike `rest` (4,), where they clip.

    That is the end of the word, or, in ten readings, of a converter of fewer bits; or any value that half of the
    readings of the sensor with the largest change have, and none exceeds, while another moves: a press trembles. Under
    one that has settled all stand still, on a coarse converter.
    """
    highest = np.where(readings.mean(axis=0) >= rest, readings.max(axis=0), readings.min(axis=0))
    stands = (readings == highest).mean(axis=0) > 0.5
    change, largest = np.abs(highest - rest), max(readings.max(), rest.max())
    is_full = len(readings) >= _MOVES  # a rise passes 4095, too
    at_end = np.array([v in _ENDS or (is_full and v == largest and bool(unshifted(int(v)))) for v in highest])
    most = int(change.argmax())
    moves = any(np.unique(column).size >= _MOVES for column in readings[readings[:, most] == highest[most]].T)
    clips = at_end | (moves & (np.arange(change.size) == most))
    railed = np.flatnonzero(stands & clips & (change > _CLEAR_COUNTS))
    if railed.size:
        value = float(highest[railed[0]])
        raise BadMeasurement(
            f"sensor {railed[0] + 1} clips: its reading stays at {value:.0f}; press less hard there"
            f"{unshifted(int(value))}"
        )
