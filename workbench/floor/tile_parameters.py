"""What a simulated tile is made of, as a file: sensors, plate, suspension, shaker, and who walks on it."""

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec.structs import replace

from underfoot.arguments import choice, require_within
from underfoot.documents import read_document, write_document
from underfoot.errors import BadFile, require
from underfoot.files import is_within, read_file, write_file
from underfoot.floor.layout import LOADS, Point, Tile
from underfoot.floor.simulated_people import MOST_PEOPLE, Person, people_of
from underfoot.models import gait
from underfoot.models.signals.random import stream_key, uniform
from underfoot.models.tile.assembly import Assembly, Foot
from underfoot.models.tile.fsr import Fsr
from underfoot.models.tile.plate import Plate
from underfoot.models.tile.shaker import Shaker
from underfoot.models.tile.suspension import Suspension
from underfoot.models.tile.variation import varied

FORMAT = "underfoot-simulation"
VERSION = 1


def simulation(text: str) -> tuple["TileParameters | None", tuple[Person, ...]]:
    """Return the parameters of simulated tiles, None for ideal ones, and the people who walk.

    `text` is what a target has behind "simulator:": nothing, a file, or people as `people_of` takes them. `BadFile` and
    `BadValue` where it cannot be.

    >>> tiles, people = simulation("people=2,path=crossing")
    >>> tiles, [person.path for person in people]
    (None, ['crossing', 'crossing'])
    """
    if "=" in text and not Path(text).is_file():
        return None, people_of(text)
    return (TileParameters.load(text) if text else None), ()


class Split(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How far a real plate is from a bilinear split of its load over the corners. `BadValue` outside the ranges.

    `deviation` is the typical deviation of a corner's force, as a share of the load, over places all over the plate: a
    tile's own is drawn between half and twice that (real plates: 0.7 to 2.8 %). `placement_m` is the deviation of the
    centroid from where it should be, in shift and in scale at the sensors. `shear` is the horizontal force of hands and
    feet, as a share of the vertical one (0.17 in walking); it moves the centroid by that times the sensors' depth: a
    foot's along its way, a hand's in a direction that is drawn once.
    """

    deviation: Annotated[float, (0.0, 0.2)] = 0.014
    placement_m: Annotated[float, (0.0, 0.05)] = 0.001
    shear: Annotated[float, (0.0, 1.0)] = 0.0

    def __post_init__(self) -> None:
        require_within(self)


class Accelerometer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Where acceleration is measured, and how well. `BadValue` outside the ranges.

    `place` is a share of the way from the tile's centre to its edges along x and y; the default is the thesis's (figure
    4.13): halfway from the centre to the edge, 15 degrees off the diagonal. `noise` is a density, m/s^2 per root hertz;
    beyond `range_m_s2` it clips.
    """

    place: Point = (0.5, 0.2887)
    noise: Annotated[float, (0.0, 10.0)] = 1e-4
    range_m_s2: float = 100.0

    def __post_init__(self) -> None:
        require(all(abs(x) <= 1.0 for x in self.place), "place", self.place, "two shares, -1 to 1")
        require_within(self)
        require(0.0 < self.range_m_s2 <= 1e5, "range_m_s2", self.range_m_s2, "above 0, up to 1e5")


class TileParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a simulated tile is made of; the default is the thesis's (chapter 4). Raises `BadValue`.

    The suspension carries its `mass_kg` on a tile of `reference_m`; on one of another size the plate weighs by its
    area, the frame by its edges and each shaker as ever. Each of `shakers_m` has `shaker_kg` at the plate, and the
    tile's drive. `tolerance` is how far rubber, plate and shaker may be from what is said here, as a share. The
    `walker` follows `path_m`, in the floor's frame; without one, round the floor. `people` (up to 8) walk instead of
    it. A `recording`, a force CSV of the same tiles, walks instead of all these, over and over; its path is taken from
    this file's.

    >>> TileParameters.loads(TileParameters().dumps()) == TileParameters()
    True
    >>> TileParameters.loads('{"format": "underfoot-simulation", "version": 1, "sensors": {"creep": 2}}', "a.json")
    Traceback (most recent call last):
    underfoot.errors.BadFile: a.json: $.sensors.creep is 2.0; allowed: 0 to 0.4
    """

    title: str = ""
    sensors: Fsr = Fsr()
    split: Split = Split()
    plate: Plate = Plate()
    suspension: Suspension = Suspension()
    shaker: Shaker = Shaker()
    shaker_kg: Annotated[float, (0.0, 100.0)] = 1.1
    shakers_m: tuple[Point, ...] = ((0.0, 0.0),)
    reference_m: Point = (0.304, 0.304)
    foot: Foot = Foot()
    accelerometer: Accelerometer = Accelerometer()
    tolerance: Annotated[float, (0.0, 0.2)] = 0.03
    walker: gait.Walker = gait.Walker()
    path_m: tuple[Point, ...] = ()
    people: tuple[Person, ...] = ()
    recording: str = ""

    def __post_init__(self) -> None:
        require_within(self)
        require(len(self.shakers_m) > 0, "shakers_m", self.shakers_m, "at least one place")
        require(all(0.0 < x <= 100.0 for x in self.reference_m), "reference_m", self.reference_m, "two lengths above 0")
        least = self.plate.mass_kg(self.reference_m) + len(self.shakers_m) * self.shaker_kg
        mass = self.suspension.mass_kg
        require(mass > least, "suspension.mass_kg", mass, f"more than plate and shakers weigh, {least:.3g} kg")
        require(len(self.people) <= MOST_PEOPLE, "people", len(self.people), f"at most {MOST_PEOPLE}")
        places = (*self.shakers_m, *self.path_m)
        require(
            all(abs(x) <= 1e4 for place in places for x in place), "path_m", self.path_m, "places within 10 km of 0"
        )

    def suspension_of(self, tile: Tile) -> Suspension:
        """Return the suspension of this tile with the mass that it carries."""
        bolted = len(self.shakers_m) * self.shaker_kg
        frame = self.suspension.mass_kg - self.plate.mass_kg(self.reference_m) - bolted
        frame *= sum(tile.size_m) / sum(self.reference_m)
        return replace(self.suspension, mass_kg=self.plate.mass_kg(tile.size_m) + bolted + frame)

    def accelerometer_m(self, tile: Tile) -> Point:
        """Return the accelerometer's place in the tile's frame."""
        x, y = self.accelerometer.place
        return 0.5 * x * tile.size_m[0], 0.5 * y * tile.size_m[1]

    def assembly(self, tile: Tile, load: str = "none") -> Assembly:
        """Return the tile as a vibrating body under one of `LOADS`; `BadValue` if it cannot be built on this tile."""
        choice("load", load, LOADS)
        x, y = tile.sensors_m[0]
        return Assembly(
            self.plate,
            self.suspension_of(tile),
            tile.size_m,
            tile.sensors_m,
            self.shakers_m,
            self.shaker_kg,
            None if load == "none" else self.foot,
            (0.75 * x, 0.75 * y) if load == "corner" else (0.0, 0.0),
        )

    def drawn(self, *names: object) -> "TileParameters":
        """Return parameters of one such tile, drawn within `tolerance`; sensors are drawn one by one."""
        key = stream_key("tile", *names)
        near = [1.0 + self.tolerance * (2.0 * uniform(key, draw) - 1.0) for draw in range(5)]
        return replace(
            self,
            plate=varied(self.plate, modulus_pa=near[0]),
            suspension=varied(self.suspension, modulus_pa=near[1]),
            shaker=varied(self.shaker, force_n=near[2], resonance_hz=near[3], colour_hz=near[4]),
        )

    def dumps(self) -> bytes:
        """Return the parameters as JSON with keys in a fixed order."""
        return write_document(FORMAT, VERSION, self)

    @staticmethod
    def loads(text: bytes | str, source: str = "simulation") -> "TileParameters":
        """Return the parameters in `text`; `BadFile` names `source`, the place in it, the value and what is allowed."""
        return read_document(text, source, FORMAT, VERSION, TileParameters)

    @staticmethod
    def load(path: str | Path) -> "TileParameters":
        """Return the parameters in a file; raise `BadFile` as `loads` does."""
        found = TileParameters.loads(read_file(path), str(path))
        if found.recording and not is_within(Path(path).parent / found.recording, Path(path).parent):
            raise BadFile(f"{path}: $.recording is {found.recording!r}; allowed: a file beside this one or below")
        beside = str(Path(path).parent / found.recording) if found.recording else ""
        return replace(found, recording=beside)

    def save(self, path: str | Path) -> None:
        """Write the parameters beside `path` and move them into place."""
        write_file(path, self.dumps() + b"\n")
