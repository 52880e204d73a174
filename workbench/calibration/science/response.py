"""Frequency response of a tile to its shaker: its level, its equaliser, its flatness, and its usable band."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from underfoot.arguments import numbers
from underfoot.calibration.science.tones import DistortionOverLevel
from underfoot.calibration.science.transfer_function import SweepMeasurement, within
from underfoot.errors import BadValue, require
from underfoot.kernels import Floats
from underfoot.models.filtering import cascade, equaliser
from underfoot.models.filtering.equaliser import BAND_HZ

INNER_HZ = (60.0, 700.0)
"""Band over which the corrected response has to be flat."""
ALLOWED_DB = 2.0
"""Largest deviation from flat, over `INNER_HZ`, of a good response."""
_MOVES_HZ, _CLEARLY = (100.0, 300.0), 0.65
"""Band in which a tile moves with its shaker, above their resonances and below most of the plate's, and the share of
its motion in it that has to be against the signal."""
USABLE_DB = 10.0
"""Largest drop below its level in the usable band of a response (thesis figure 4.14)."""


@dataclass(frozen=True)
class ResponseMeasurements:
    """Measurements of one tile; from files, under one load only.

    `loads` are responses by load on the tile ("none", "standing", "corner"), in recorded units per played unit, a
    recorded unit being `sensitivity` m/s^2. `order` is the equaliser's, `tones` the distortion over level, `again` the
    response measured through the equaliser, and `noise` the RMS of silence, in full scale. `sections` are the equaliser
    designed for the response under `load`, which `again` was measured under, too. `reference_percent` is the
    expanded uncertainty (k = 2) of the accelerometer, % of an acceleration; None where it was not given.
    """

    loads: Mapping[str, SweepMeasurement]
    sensitivity: float
    rate_hz: int
    order: int = 14
    tones: DistortionOverLevel | None = None
    again: SweepMeasurement | None = None
    noise: float = math.nan
    load: str = "none"
    reference_percent: float | None = None
    sections: Floats = field(init=False)

    def __post_init__(self) -> None:
        require(self.sensitivity > 0.0, "sensitivity", self.sensitivity, "above 0 m/s^2 a full-scale input")
        basis = self.basis
        low, high = float(basis.frequencies_hz[0]), float(basis.frequencies_hz[-1])
        if low > 1.02 * BAND_HZ[0] or high < BAND_HZ[1] / 1.02:
            raise BadValue(
                f"the sweep has power from {low:.0f} to {high:.0f} Hz only; to equalise {BAND_HZ[0]:g} to "
                f"{BAND_HZ[1]:g} Hz, sweep over all of them"
            )
        sections = equaliser.design(basis.frequencies_hz, basis.magnitude, self.rate_hz, self.order)
        object.__setattr__(self, "sections", sections)

    @property
    def basis(self) -> SweepMeasurement:
        """Response under the load that the equaliser is designed for."""
        return self.loads[self.load]

    @property
    def sweeps(self) -> dict[str, SweepMeasurement]:
        """All responses, by load or as "again"."""
        return {**self.loads, **({"again": self.again} if self.again else {})}

    @property
    def level(self) -> float:
        """m/s^2 per full-scale unit: the level at which a stimulus in m/s^2 plays."""
        return self.sensitivity * equaliser.level(self.basis.frequencies_hz, self.basis.magnitude)

    @property
    def computed(self) -> Floats:
        """Computed magnitude of the equalised response, in recorded units per played unit."""
        return self.basis.magnitude * np.abs(equaliser.gain(self.sections, self.basis.frequencies_hz, self.rate_hz))

    def relative_db(self, magnitude: Floats) -> Floats:
        """Return a magnitude in recorded units as decibels above the tile's level."""
        return np.asarray(20.0 * np.log10(np.maximum(self.sensitivity * magnitude / self.level, 1e-9)))


def flatness_db(frequencies_hz: Floats, relative_db: Floats) -> float:
    """Return the largest deviation from the midpoint between maximum and minimum, within `INNER_HZ`.

    >>> flatness_db(np.array([50.0, 100.0, 200.0]), np.array([-9.0, 1.0, -1.0]))
    1.0
    """
    _require_response(frequencies_hz, relative_db)
    inside = within(frequencies_hz, INNER_HZ)
    require(bool(inside.any()), "band_hz", INNER_HZ, "a band that was measured")
    return 0.5 * float(np.ptp(relative_db[inside]))


def usable_band_hz(frequencies_hz: Floats, relative_db: Floats) -> tuple[float, float]:
    """Return the band around 200 Hz in which the response is at most `USABLE_DB` below its level.

    >>> usable_band_hz(np.array([40.0, 50.0, 200.0, 700.0, 800.0]), np.array([-20.0, -9.0, 0.0, 1.0, -11.0]))
    (50.0, 700.0)
    """
    _require_response(frequencies_hz, relative_db)
    good = relative_db >= -USABLE_DB
    middle = int(np.argmin(np.abs(np.log(frequencies_hz / 200.0))))
    if not good[middle]:
        return 0.0, 0.0
    bad = np.flatnonzero(~good)
    low, high = bad[bad < middle].max(initial=-1) + 1, bad[bad > middle].min(initial=good.size) - 1
    return float(frequencies_hz[low]), float(frequencies_hz[high])


def change_db(measured: ResponseMeasurements, load: str) -> float:
    """Return the largest difference of the response under another load from that of the equaliser, `INNER_HZ`, dB."""
    basis, loaded = measured.basis, measured.loads[load]
    other = np.interp(basis.frequencies_hz, loaded.frequencies_hz, loaded.magnitude)
    inside = within(basis.frequencies_hz, INNER_HZ)
    return float(np.max(np.abs(20.0 * np.log10(other[inside] / basis.magnitude[inside]))))


def is_reversed(found: SweepMeasurement) -> bool:
    """Return whether a positive signal moves the accelerometer against its axis.

    Between the resonances of suspension and shaker and those of the plate, a tile follows the signal. Of its motion
    there, 70 to 92 % is with the signal on simulated tiles of the thesis, empty or with somebody on them, where the
    accelerometer is in the middle or half the way to an edge. Where the plate bends already, or the shaker resonates,
    it is less: the answer is no.

    >>> from dataclasses import replace
    >>> f = np.geomspace(20.0, 2000.0, 1000)
    >>> none = np.zeros(f.size)
    >>> up = SweepMeasurement(f, 1.0 + 0.0j * f, none, none, none, {}, 0.0, 1, 0.1, 0.0, (20.0, 2000.0))
    >>> is_reversed(up), is_reversed(replace(up, transfer=-up.transfer))
    (False, True)
    """
    transfer = found.transfer[within(found.frequencies_hz, _MOVES_HZ)]
    return bool(transfer.real.sum() < -_CLEARLY * np.abs(transfer).sum())


def equalise(sections: Floats, signal: Floats) -> Floats:
    """Filter a signal (frames,) by an equaliser of second-order sections (n, 6).

    >>> equalise(np.array([[0.5, 0.0, 0.0, 1.0, 0.0, 0.0]]), np.ones(2))
    array([0.5, 0.5])
    """
    given = numbers("signal", signal)
    out = np.zeros(given.size)
    cascade.run(np.zeros(1, cascade.STATE)[0], cascade.coefficients(sections), given, out)
    return out


def _require_response(frequencies_hz: Floats, relative_db: Floats) -> None:
    """Raise `BadValue` unless these are decibels at frequencies, both (n,)."""
    shapes = np.shape(frequencies_hz), np.shape(relative_db)
    good = shapes[0] == shapes[1] and len(shapes[0]) == 1 and shapes[0][0] > 0
    require(good, "relative_db", shapes[1], f"one for each of the frequencies, {shapes[0]}, at least one")
