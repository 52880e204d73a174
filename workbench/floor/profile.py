"""The calibration of one tile, in one file: from readings to newtons, to a centroid, and from drive to acceleration.

A profile has up to five parts. `fsr` turns readings into newtons, `centroid` newtons into a place, `response` says how
the plate responds to its shaker, and `latency` how long that takes; `plate` is the stiffness of a variable stiffness
plate that stands on it. Each part keeps its date, its reference, its measured error and its verdict; a part that is
replaced goes to `earlier` and can be restored.
"""

import os
import re
from collections.abc import Mapping
from datetime import date
from pathlib import Path
from typing import ClassVar

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import ArrayLike, NDArray

from underfoot.arguments import array, choice, numbers
from underfoot.documents import as_declared, identity_of, read_document, write_document
from underfoot.drawing import Drawing, series
from underfoot.drawing.look import CORNERS
from underfoot.drawing.picture import Picture
from underfoot.errors import BadFile, BadValue, require
from underfoot.files import read_file, write_file
from underfoot.floor.centroid_correction import CentroidCorrection
from underfoot.floor.curves import Curve, require_numbers
from underfoot.floor.layout import LOADS, Floor
from underfoot.floor.profile_parts import PARTS
from underfoot.models.filtering import cascade
from underfoot.models.tile.fsr_hysteresis import STATE
from underfoot.parameters import require_identifier
from underfoot.version import __version__

FORMAT = "underfoot-profile"
VERSION = 1
OLD_DAYS = 90
"""A part older than this is flagged: rubber creeps, resistors wear, screws work loose."""
NOMINAL_ACCELERATION = 20.0
"""m/s^2 a full-scale unit until the response is measured (docs/contracts.md#output)."""


class Part(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What every part has: its date and reference, its error, and whether the error is acceptable.

    `conditions` are what a person noted of it: instruments with their serial numbers, temperature.
    `error` is in `error_unit`, measured on data that was not used to fit, and not known without a unit; `error_allowed`
    is what the verdict allows. `figures` are all that was measured, by name with the unit in it. `simulated` if the
    tile was.
    """

    made: str
    reference: str = ""
    software: str = __version__
    error: float = 0.0
    error_allowed: float = 0.0
    error_unit: str = ""
    good: bool = True
    verdict: str = ""
    figures: dict[str, float] = msgspec.field(default_factory=dict)
    simulated: bool | msgspec.UnsetType = msgspec.UNSET
    conditions: str | msgspec.UnsetType = msgspec.UNSET
    errs: ClassVar[str] = "errs by"
    """The words before its error."""
    error_names: ClassVar[tuple[str, ...]]
    """Names of its error among the figures, of which it has the first one that is there."""

    def __post_init__(self) -> None:
        _require_date("made", self.made)

    @property
    def measured(self) -> dict[str, float]:
        """All figures by name, with the error first, if it is known."""
        name = next((name for name in self.error_names if name in self.figures), self.error_names[0])
        return {name: self.error, **self.figures} if self.error_unit else self.figures

    @property
    def identity(self) -> str:
        """Its day and a digest."""
        return identity_of(self, self.made)


class Fsr(Part, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Readings to newtons: one curve a sensor, exactly four."""

    error_names: ClassVar[tuple[str, ...]] = ("error_percent",)

    sensors: tuple[Curve, Curve, Curve, Curve]


class Centroid(Part, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Newtons to a place on the tile, whose sensors are at `sensors_m`. Below `least_n` newtons there is no place.

    `correction` is for what `Profile.force` gives; `over_time` for what `Profile.force_over_time` gives, where that was
    measured, too.
    """

    error_names: ClassVar[tuple[str, ...]] = ("mean_over_time_mm", "mean_after_mm")

    sensors_m: tuple[tuple[float, float], ...]
    correction: CentroidCorrection = CentroidCorrection()
    over_time: CentroidCorrection | None = None
    least_n: float = 20.0

    def __post_init__(self) -> None:
        super().__post_init__()
        require(len(self.sensors_m) == 4, "sensors_m", self.sensors_m, "exactly four points")
        for point in self.sensors_m:
            require_numbers("sensors_m", point, 100.0)
        require_numbers("least_n", (self.least_n,), 1e6)


class Response(Part, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The response of the plate to its shaker: `magnitude` in m/s^2 a full-scale unit at `frequencies_hz`.

    `acceleration_per_unit` is the level at which a stimulus in m/s^2 plays, with the equaliser before it; `equaliser`
    are second-order sections (b0, b1, b2, a0, a1, a2) at `rate_hz`; `band_hz` is the band that can be used. All hold
    for what was on the tile while it was measured: `load`, one of `LOADS`.
    """

    error_names: ClassVar[tuple[str, ...]] = ("flatness_measured_db", "flatness_computed_db")

    frequencies_hz: tuple[float, ...]
    magnitude: tuple[float, ...]
    acceleration_per_unit: float = NOMINAL_ACCELERATION
    equaliser: tuple[tuple[float, float, float, float, float, float], ...] = ()
    rate_hz: int = 48000
    band_hz: tuple[float, float] = (0.0, 0.0)
    load: str = "none"

    def __post_init__(self) -> None:
        super().__post_init__()
        require(
            len(self.frequencies_hz) == len(self.magnitude),
            "magnitude",
            len(self.magnitude),
            f"as many values as frequencies_hz, {len(self.frequencies_hz)}",
        )
        for name, values in (("frequencies_hz", self.frequencies_hz), ("magnitude", self.magnitude)):
            require_numbers(name, values, 1e12)
        for section in self.equaliser:
            require_numbers("equaliser", section, 1e9)
        level = self.acceleration_per_unit
        require(0.0 < level < 1e6, "acceleration_per_unit", level, "above 0, below 1e6 m/s^2")
        stable = all(cascade.is_stable(section) for section in self.equaliser)
        require(stable, "equaliser", self.equaliser, "stable second-order sections with a0 = 1")
        choice("load", self.load, LOADS)


class Latency(Part, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How long what is played takes to come back on an input: the median, on a card at `rate_hz` in such blocks.

    Its error is the jitter.
    """

    errs: ClassVar[str] = "jitter"
    error_names: ClassVar[tuple[str, ...]] = ("jitter_ms",)

    round_trip_ms: float
    rate_hz: int = 48000
    block: int = 128

    def __post_init__(self) -> None:
        super().__post_init__()
        require_numbers("round_trip_ms", (self.round_trip_ms,), 1e5)


class PlateStiffness(Part, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Stiffness in N/mm of a variable stiffness plate at positions of its servo, both rising."""

    error_names: ClassVar[tuple[str, ...]] = ("mean_error_percent",)

    positions: tuple[float, ...]
    stiffness_n_mm: tuple[float, ...]

    def __post_init__(self) -> None:
        super().__post_init__()
        same = len(self.positions) == len(self.stiffness_n_mm)
        require(same, "stiffness_n_mm", len(self.stiffness_n_mm), f"as many as positions, {len(self.positions)}")
        require_numbers("positions", self.positions, 1.0)
        require_numbers("stiffness_n_mm", self.stiffness_n_mm, 1e6)


class Earlier(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A part that was replaced, and the day it was."""

    replaced: str
    fsr: Fsr | None = None
    centroid: Centroid | None = None
    response: Response | None = None
    latency: Latency | None = None
    plate: PlateStiffness | None = None

    def __post_init__(self) -> None:
        _require_date("replaced", self.replaced)
        require(sum(getattr(self, kind) is not None for kind in PARTS) == 1, "earlier", self.kind, "exactly one part")

    @property
    def kind(self) -> str:
        """Which part it was."""
        return next((kind for kind in PARTS if getattr(self, kind) is not None), "")


class Profile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The calibration of one tile. Raises `BadValue` for values that are not allowed.

    >>> profile = Profile(tile="t1")
    >>> profile.acceleration_per_unit, profile.equaliser.shape, profile.is_calibrated
    (20.0, (0, 6), False)
    >>> profile.force([[1.0, 2.0, 3.0, float("nan")]])
    array([[ 1.,  2.,  3., nan]])
    """

    tile: str
    serial: str = ""
    made: str = ""
    reference: str = ""
    software: str = __version__
    fsr: Fsr | None = None
    centroid: Centroid | None = None
    response: Response | None = None
    latency: Latency | None = None
    plate: PlateStiffness | None = None
    earlier: tuple[Earlier, ...] = ()

    def __post_init__(self) -> None:
        require_identifier("tile", self.tile)
        as_declared(self)
        if self.made:
            _require_date("made", self.made)

    def __repr__(self) -> str:
        parts = [kind for kind in PARTS if self.part(kind) is not None]
        return f"<Profile of {self.tile}: {', '.join(parts) or 'not calibrated'}>"

    def plot(self) -> Picture:
        """Plot the curve of each sensor and the response of the plate, as far as they were measured."""
        drawings = []
        if self.fsr is not None:
            curves = [
                series(f"sensor {j + 1}", curve.readings, curve.forces_n, colour=CORNERS[j])
                for j, curve in enumerate(self.fsr.sensors)
            ]
            drawings.append(Drawing(f"Sensors of {self.tile}", "reading, counts", "force, N", tuple(curves)))
        if self.response is not None:
            curve = series("", self.response.frequencies_hz, self.response.magnitude)
            title = f"Response of {self.tile}"
            drawings.append(Drawing(title, "frequency, Hz", "m/s^2 at full scale", (curve,), x_log=True, y_log=True))
        return Picture(tuple(drawings) or (Drawing(f"Profile of {self.tile}", "", "", note="not calibrated"),))

    @property
    def is_calibrated(self) -> bool:
        """Whether `force` turns readings into newtons."""
        return self.fsr is not None

    def force(self, readings: ArrayLike) -> NDArray[np.float64]:
        """Return forces in newtons of `readings`, shape (..., 4), by the static curves.

        Without an `fsr` part readings count as newtons; of a sensor that could not be calibrated, NaN. NaN stays NaN. A
        reading beyond the calibrated range goes on along the curve's last slope, at most a quarter of full scale above
        the highest force and a tenth below 0. `BadValue` unless the last axis is 4.
        """
        counts = _four(readings, "readings")
        if self.fsr is None:
            return counts.copy()
        newtons = np.empty_like(counts)
        for j, curve in enumerate(self.fsr.sensors):
            newtons[..., j] = curve.force(counts[..., j])
        return newtons

    @staticmethod
    def rested() -> NDArray[np.void]:
        """Return the states of four sensors at rest, (4,), for `force_over_time`, which updates them."""
        return np.zeros(4, STATE)

    def force_over_time(
        self, readings: ArrayLike, time_s: ArrayLike, states: NDArray[np.void] | None = None
    ) -> NDArray[np.float64]:
        """Return forces in newtons of `readings`, shape (n, 4), at `time_s` (n,), with hysteresis and creep
        compensated.

        The sensors have rested before, or are as the block before left their `states` (see `rested`); any split gives
        the same newtons. A sensor whose calibration has no compensation is as in `force`. Time that runs back counts as
        none passed.
        """
        counts, times = _four(readings, "readings"), numbers("time_s", time_s)
        require(counts.ndim == 2, "readings", counts.shape, "shape (n, 4)")
        require(times.shape == counts.shape[:1], "time_s", times.shape, f"as many as readings, {counts.shape[:1]}")
        if self.fsr is None:
            return counts.copy()
        states = self.rested() if states is None else states
        is_of_four = isinstance(states, np.ndarray) and (states.dtype, states.shape) == (STATE, (4,))
        require(is_of_four, "states", states, "those of `rested`, which the block before left")
        columns = [
            curve.force_over_time(np.ascontiguousarray(counts[:, j]), times, states[j])
            for j, curve in enumerate(self.fsr.sensors)
        ]
        return np.stack(columns, axis=1)

    def position(self, forces: ArrayLike, *, over_time: bool = False) -> NDArray[np.float64]:
        """Return the centroid in metres, tile frame, shape (..., 2), of `forces` in newtons, shape (..., 4).

        `forces` are those of `force`, or, with `over_time`, of `force_over_time`: each has its own correction. NaN
        below the part's least force, and where a force is NaN. `BadValue` unless the last axis is 4, and where the
        profile has no centroid part.
        """
        newtons = _four(forces, "forces")
        part = self.centroid
        if part is None:
            raise BadValue(f"the profile of {self.tile} has no centroid part; calibrate the centroid first")
        correction = part.over_time if over_time and part.over_time is not None else part.correction
        return correction.position(newtons, np.array(part.sensors_m), part.least_n)

    @property
    def equaliser(self) -> NDArray[np.float64]:
        """Second-order sections, shape (sections, 6); no section without an equaliser."""
        sections = () if self.response is None else self.response.equaliser
        return np.array(sections, dtype=np.float64).reshape(-1, 6)

    @property
    def acceleration_per_unit(self) -> float:
        """m/s^2 that a full-scale unit plays at; 20.0 until calibrated."""
        return NOMINAL_ACCELERATION if self.response is None else self.response.acceleration_per_unit

    def flags(self, tile: str, today: date, *, simulated: bool = False) -> tuple[str, ...]:
        """Return the reasons against using this profile on `tile`, which may be `simulated`, today, one line each.

        >>> Profile(tile="t1").flags("t2", date(2024, 5, 1))
        ('profile of t1 is used on t2', 'profile of t1 has no calibrated part')
        """
        found = []
        if tile != self.tile:
            found.append(f"profile of {self.tile} is used on {tile}")
        parts = [(kind, part) for kind in PARTS if (part := self.part(kind)) is not None]
        if not parts:
            found.append(f"profile of {self.tile} has no calibrated part")
        for kind, part in parts:
            days = (today - date.fromisoformat(part.made)).days
            if days > OLD_DAYS:
                found.append(f"{PARTS[kind]} of {self.tile}: measured {days} days ago; measure again after {OLD_DAYS}")
            elif days < 0:
                found.append(f"{PARTS[kind]} of {self.tile}: dated {part.made}, after today")
            if part.simulated and not simulated:
                found.append(f"{PARTS[kind]} of {self.tile}: measured on a simulated tile; measure this one")
            if not part.good:
                errs = f"{part.errs} {part.error:.3g} {part.error_unit}; {part.error_allowed:.3g} allowed"
                if part.error <= part.error_allowed:  # as where one sensor of four errs more
                    errs += ", but not all of it is good: read its verdict"
                found.append(f"{PARTS[kind]} of {self.tile}: {errs if part.error_unit else 'its error is not known'}")
            used = re.search(r"calibrated (\d{4}-\d\d-\d\d [0-9a-f]{12})", part.reference)
            if used is not None and self.fsr is not None and used[1] != self.fsr.identity:
                found.append(
                    f"{PARTS[kind]} of {self.tile}: measured with the forces of {used[1][:10]}, which others have "
                    "replaced since; measure again"
                )
        if self.fsr is not None:
            found += [
                f"sensor {j + 1} of {self.tile} is not calibrated: {curve.uncalibrated}"
                for j, curve in enumerate(self.fsr.sensors)
                if curve.uncalibrated
            ]
        return tuple(found)

    def part(self, kind: str) -> Part | None:
        """Return the part with a name of `PARTS`; None if it was not measured."""
        choice("kind", kind, PARTS)
        found: Part | None = getattr(self, kind)
        return found

    def with_part(self, part: Part, today: date | None = None, tile: str = "") -> "Profile":
        """Return the profile with a new part; the part it replaces is added to `earlier` with today's date.

        With the part that is in use already, the same profile. `BadValue` if it was measured on another `tile`.
        """
        require(tile in ("", self.tile), "the measured tile", tile, f"{self.tile}, whose profile this is")
        kind = _KINDS[type(part)]
        day = (date.today() if today is None else today).isoformat()
        old = self.part(kind)
        if old == part:
            return self
        kept = self.earlier if old is None else (*self.earlier, Earlier(replaced=day, **{kind: old}))  # type: ignore[arg-type]
        return replace(
            self, **{kind: part}, earlier=kept, made=part.made, reference=part.reference, software=__version__
        )

    def restored(self, place: int, today: date | None = None) -> "Profile":
        """Return the profile with `earlier[place]` in use again; the part it replaces is added to the earlier ones.

        `BadValue` where there is no such part.
        """
        require(0 <= place < len(self.earlier), "place", place, f"0 to {len(self.earlier) - 1}")
        back = self.earlier[place]
        part = getattr(back, back.kind)
        others = self.earlier[:place] + self.earlier[place + 1 :]
        return replace(self, earlier=others).with_part(part, today)

    def dumps(self) -> bytes:
        """Return the profile as JSON with keys in a fixed order."""
        return write_document(FORMAT, VERSION, self)

    @staticmethod
    def loads(text: bytes | str, source: str = "profile") -> "Profile":
        """Return the profile in `text`; `BadFile` names `source`, the place in it, the value and what is allowed.

        >>> Profile.loads('{"format": "underfoot-profile", "version": 1, "tile": "a b"}', "t1.json")
        Traceback (most recent call last):
        underfoot.errors.BadFile: t1.json: $.tile is 'a b'; allowed: letters, digits, - and _
        """
        return read_document(text, source, FORMAT, VERSION, Profile)

    @staticmethod
    def load(path: str | Path) -> "Profile":
        """Return the profile in a file; raise `BadFile` as `loads` does."""
        return Profile.loads(read_file(path), str(path))

    def save(self, path: str | Path) -> None:
        """Write the profile beside `path` and move it into place: the old one stays until the new is whole."""
        write_file(path, self.dumps() + b"\n")


def profiles_of(folder: str | Path | None, floor: Floor) -> dict[str, Profile]:
    """Return the profiles `<tile>.json` in a folder by tile id; tiles without one are omitted. None without a folder.

    `BadFile` where the folder is not there, and for a file that is not a profile.
    """
    if not folder:
        return {}
    folder = Path(folder)
    if not folder.is_dir():
        raise BadFile(f"{folder} is not a folder of profiles")
    paths = {tile: folder / f"{tile}.json" for tile in floor.ids}
    return {tile: Profile.load(path) for tile, path in paths.items() if os.path.exists(path)}


def round_trip_frames(profiles: Mapping[str, Profile], rate_hz: int, block: int) -> int:
    """Return the measured round trip of the sound card of these tiles; 0 if it was not measured at this rate and block.

    >>> part = Latency(made="2024-05-01", round_trip_ms=10.0)
    >>> round_trip_frames({"t1": Profile(tile="t1", latency=part)}, 48000, 128)
    480
    """
    parts = [profile.latency for profile in profiles.values() if profile.latency is not None]
    found = [part.round_trip_ms for part in parts if (part.rate_hz, part.block) == (rate_hz, block)]
    return round(1e-3 * rate_hz * float(np.median(found))) if found else 0


def load_for_tile(path: str | Path, tile: str, serial: str = "") -> Profile:
    """Return the profile in a file to which a part of `tile` will be added.

    `BadFile` where the file is not a profile, or is one of another tile or serial number: a part of one tile never goes
    into another's file.
    """
    found = Profile.load(path)
    if found.tile != tile:
        raise BadFile(f"{path} is the profile of tile {found.tile}; allowed: {tile}")
    if serial and found.serial and serial != found.serial:
        raise BadFile(f"{path} is of serial {found.serial}; allowed: {serial}")
    return replace(found, serial=serial or found.serial)


def _four(values: ArrayLike, name: str) -> NDArray[np.float64]:
    return array(name, values, "numbers with a last axis of 4, one for each sensor", 4)


_KINDS = {Fsr: "fsr", Centroid: "centroid", Response: "response", Latency: "latency", PlateStiffness: "plate"}
"""The names in `PARTS` of parts, by their types."""


def _require_date(name: str, given: str) -> None:
    try:
        date.fromisoformat(given)
    except ValueError:
        raise BadValue(f"{name} is {given!r}; allowed: a date such as 2024-05-31") from None
