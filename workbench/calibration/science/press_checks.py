"""Checks of presses at known positions during a measurement: start, steadiness and plausibility."""

import numpy as np

from underfoot.calibration.files.measurements import LARGEST_READING
from underfoot.calibration.rig import Readings
from underfoot.calibration.science.centroid_fit import centroid
from underfoot.devices.framing.wire_format import unshifted
from underfoot.errors import BadMeasurement
from underfoot.kernels import Floats

EMPTY_S = 0.15
"""Time for which the tile must be empty before a press, for its baseline."""
PRESSED = 0.3
"""Share of the load above which the tile counts as pressed."""
_FORCE_STEADY, _PLACE_STEADY_M = 0.05, 0.006
"""Largest standard deviations of a steady press: of the force, as a share of the load, and of the position."""
_UNSTEADY_S = 20.0
"""Time after which an unsteady press is given up."""
_WRONG_PLACE_M = 0.08
"""Largest distance of a press from the requested position."""
_ENDS, _CLEAR_COUNTS, _MOVES = (0.0, LARGEST_READING), 400.0, 10
"""Ends of the converter's range, a change of reading that is no noise, and different readings of one that moves."""
_LEAST_SHARE = 0.02
"""Share of a load below which sensors count as giving no signal."""


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


def is_steady(force_share: float, place_m: float, pressed_s: float) -> bool:
    """Return whether these standard deviations are small; `BadMeasurement` if they are not after `pressed_s`.

    >>> is_steady(0.01, 0.001, 0.5), is_steady(0.2, 0.001, 0.5)
    (True, False)
    """
    if force_share <= _FORCE_STEADY and place_m <= _PLACE_STEADY_M:
        return True
    if pressed_s > _UNSTEADY_S:
        raise BadMeasurement(
            f"the press is unsteady: its force varies by {100 * force_share:.0f} %, its place by "
            f"{1e3 * place_m:.0f} mm (standard deviations); hold still"
        )
    return False


def require_place(forces_n: Floats, sensors_m: Floats, wanted_m: tuple[float, float]) -> None:
    """Raise `BadMeasurement` for a press that sensors (4,) at (4, 2) measure far from the requested position."""
    off = float(np.hypot(*(centroid(forces_n, sensors_m) - wanted_m)))
    if off > _WRONG_PLACE_M:
        shares = ", ".join(f"{round(share)}" for share in (100.0 * forces_n / forces_n.sum()).tolist())
        raise BadMeasurement(
            f"the press is measured {1e3 * off:.0f} mm from where it was asked for: another place, or a sensor "
            f"swapped, loose or dead? Sensors 1 to 4 bear {shares} % of it"
        )


def require_signal(load_n: float, reference_n: Floats | None, measured_n: Floats) -> None:
    """Raise `BadMeasurement` where sensors and reference, newtons (n,), do not give the same load, nearly or at all."""
    if reference_n is None:
        return
    reference, measured = float(np.median(reference_n)), float(np.median(measured_n))
    if reference > 0.8 * load_n and measured < _LEAST_SHARE * reference:
        raise BadMeasurement(f"no signal: the sensors add up to {measured:.3g} N under {load_n:.0f} N")
    if measured > 0.8 * load_n and reference < PRESSED * measured:
        raise BadMeasurement(
            f"the load cell gives {reference:.3g} N, and the sensors add up to {measured:.3g} N: does it count "
            "newtons, and does all of the load go through it?"
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
