"""Forces of a floor for scripts, from files or simulated people, with their contacts and steps."""

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec.structs import force_setattr, replace
from numpy.typing import NDArray

from underfoot.arguments import TINY, array, integer, number
from underfoot.clock import RATE_HZ
from underfoot.devices.force_source import MAX_SAMPLES, SENSOR_HZ
from underfoot.devices.simulated_floor import WALK_S, SimulatedFloor
from underfoot.drawing import Drawing, Series, series
from underfoot.drawing.picture import Picture
from underfoot.drawing.thinning import thinned
from underfoot.errors import require
from underfoot.files import path_of
from underfoot.floor.contacts import ContactRows
from underfoot.floor.forces import LEAST_HZ, MOST_HZ, ForceSeries, floor_beside
from underfoot.floor.layout import Floor, default_floor
from underfoot.floor.simulated_people import MOST_PEOPLE, PATHS, drawn_people
from underfoot.floor.step_finder import Detections, find_steps
from underfoot.patch.preset_files import walks
from underfoot.quantities import counted
from underfoot.records.force_files import notes_of, read_force_file
from underfoot.records.notes import Notes
from underfoot.records.tables import Table, force_table, step_columns, to_dataframe

if TYPE_CHECKING:
    import pandas

_POINTS = 600
"""Points across a plot."""


class Forces(ForceSeries, frozen=True):
    """Corner forces of a `floor`: `time_s` (n,) ascending, `force_n` (n, tiles, 4) in newtons, `rate_hz`.

    Those of a recording have what is noted of its steps as `notes`.

    >>> walk(2.0)
    <Forces: 2000 samples of 4 tiles at 1000 Hz, 2 s>
    """

    floor: Floor
    notes: Notes | None = None

    def __post_init__(self) -> None:
        require(isinstance(self.floor, Floor), "floor", self.floor, "a Floor, such as default_floor(1, 8)")
        for name in ("time_s", "force_n"):
            force_setattr(self, name, array(name, getattr(self, name), "numbers, (n,) and (n, tiles, 4)"))
        require(self.time_s.ndim == 1, "the shape of time_s", self.time_s.shape, "(n,)")
        given, allowed = self.force_n.shape, (len(self.time_s), len(self.floor.tiles), 4)
        require(given == allowed, "the shape of force_n", given, f"{allowed}, as of the floor")
        rate_hz = number("rate_hz", self.rate_hz, LEAST_HZ, MOST_HZ, f"{LEAST_HZ:g} to {MOST_HZ:g} Hz")
        force_setattr(self, "rate_hz", rate_hz)
        apart_s = np.diff(self.time_s)
        require(bool((apart_s >= 0.0).all()), "time_s", self.time_s, "ascending seconds")
        found_hz = 1.0 / max(float(np.median(apart_s)), 1e-9) if len(apart_s) else rate_hz
        require(0.05 < found_hz / rate_hz < 20.0, "rate_hz", rate_hz, f"{found_hz:.6g}, by time_s in seconds")

    def __repr__(self) -> str:
        what = f"{counted(len(self), 'sample')} of {counted(len(self.floor.tiles), 'tile')} at {self.rate_hz:.6g} Hz"
        return f"<Forces: {what}, {self.seconds:.6g} s>"

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def seconds(self) -> float:
        """Duration, including one period after the last sample."""
        return float(self.time_s[-1] - self.time_s[0]) + 1.0 / self.rate_hz if len(self) else 0.0

    def steps(self) -> Table:
        """Return the footsteps, one row each, with all measures of `underfoot.floor.footsteps.Step`.

        Of a recording, each has why it is left out, body weight, and forces in percent of it, as in its exports.

        >>> walk(4.0).steps()["tile"]
        array(['t1', 't2', 't4', 't3', 't1', 't2'], dtype='<U2')
        """
        found = [step for part in self._found() for step in part.steps]
        if self.notes is None:
            return Table("steps", step_columns(found))
        return Table("steps", step_columns(self.notes.on(found), recorded=True))

    def contacts(self) -> Table:
        """Return the contacts, one row per contact and sample: time_s, contact, x_m, y_m, force_n and tiles.

        `contact` is the id of the contact; x_m and y_m are its centroid, in the floor's frame.

        >>> contacts = walk(2.0).contacts()
        >>> bool(contacts["force_n"].max() > 500.0), list(contacts)
        (True, ['time_s', 'contact', 'x_m', 'y_m', 'force_n', 'tiles'])
        """
        parts = [part.rows for part in self._found()]
        columns = {name: np.concatenate([getattr(rows, name) for rows in parts]) for name in _CONTACT_COLUMNS}
        tiles = [name for rows in parts for name in rows.tiles(self.floor)]
        return Table("contact samples", {**columns, "tiles": np.array(tiles, dtype=np.str_)})

    def plot(self) -> Picture:
        """Plot the load of each tile over time, and the paths of the contacts' centroids on the floor."""
        return Picture((self._loads(), self._ways()))

    def to_dataframe(self) -> "pandas.DataFrame":
        """Return a pandas DataFrame: `time_s`, then one column per sensor, named as in a force CSV."""
        return to_dataframe(self._columns())

    def save(self, path: str | Path) -> None:
        """Write a force CSV, and its floor beside it; `BadFile` if that fails.

        Samples that one tile of several lost (NaN) are left out, as `read_forces` takes none.
        """
        force_table(path, {name: column[self.is_whole] for name, column in self._columns().items()})
        self.floor.save(floor_beside(path))

    def _columns(self) -> dict[str, Any]:
        sensors = {
            f"{tile.id}.{sensor + 1}": self.force_n[:, row, sensor]
            for row, tile in enumerate(self.floor.tiles)
            for sensor in range(4)
        }
        return {"time_s": self.time_s, **sensors}

    def _found(self) -> Iterator[Detections]:
        return find_steps([(self.time_s, self.force_n)], self.floor, self.rate_hz)

    def _loads(self) -> Drawing:
        loads = self.force_n.sum(axis=2)
        step_s = max(self.seconds, 1e-9) / _POINTS
        x, y = thinned(self.time_s, loads, step_s)
        most = np.argsort(-np.abs(loads).max(axis=0, initial=0.0), kind="stable")[: len(_OF_CURVES)]
        rows = sorted(row for row in most if loads[:, row].any())
        lines = [series(self.floor.ids[row], x, y[:, row], colour=_colour(place)) for place, row in enumerate(rows)]
        title = "Load of each tile" if len(self.floor.tiles) <= len(_OF_CURVES) else "Load of the tiles with most of it"
        return Drawing(title, "time, s", "force, N", tuple(lines), note="" if lines else "no load")

    def _ways(self) -> Drawing:
        contacts = self.contacts()
        outlines = [_outline(np.array([*tile.corners_m(), tile.corners_m()[0]])) for tile in self.floor.tiles]
        ways = []
        for place, contact in enumerate(np.unique(contacts["contact"])):
            rows = np.flatnonzero(contacts["contact"] == contact)
            rows = rows[:: max(1, len(rows) // 100)]
            ways.append(series("", contacts["x_m"][rows], contacts["y_m"][rows], colour=_colour(place)))
        return Drawing("Ways of the contacts' centroids", "x, m", "y, m", (*outlines, *ways), equal=True)


_CONTACT_COLUMNS = tuple(name for name in ContactRows.__struct_fields__ if name != "on_tile")
_OF_CURVES = ("force", "vibration", "events", "contact", "corner 1", "corner 2")


def _colour(place: int) -> str:
    return _OF_CURVES[place % len(_OF_CURVES)]


def _outline(corners_m: NDArray[np.float64]) -> Series:
    return series("", corners_m[:, 0], corners_m[:, 1], colour="muted")


def read_forces(
    path: str | Path, floor: Floor | str | Path | None = None, stretch_s: tuple[float, float] | None = None
) -> Forces:
    """Read the forces of a CSV file, of a recording, of a C3D file with force plates, or of a sample walk by its name.

    The floor of walk.csv is in walk.floor.json beside it, unless `floor` is another one, or its file. `stretch_s` are
    the seconds of the file from and up to which forces are read; times count from its beginning all the same. Of a
    recording of hours, which does not fit into memory, only the stretch is read. Its steps are found in it alone: their
    numbers and persons count from there, so that of the body weights only that of all is on them. Raises `BadFile` if a
    file is missing or cannot be read, or has fewer than two samples there.

    >>> read_forces("corridor"), read_forces("corridor", stretch_s=(1.0, 3.0))
    (<Forces: 1000 samples of 8 tiles at 200 Hz, 5 s>, <Forces: 400 samples of 8 tiles at 200 Hz, 2 s>)
    """
    found = path_of(path)
    if str(path) in walks() and not os.path.isfile(found):
        found = walks()[str(path)]
    other = floor if floor is None or isinstance(floor, Floor) else Floor.load(path_of(floor, "floor"))
    if stretch_s is not None:
        allowed = "two seconds, the first below the second, as (60.0, 120.0)"
        ends_s = array("stretch_s", stretch_s, allowed)
        require(ends_s.shape == (2,) and bool(ends_s[0] < ends_s[1]), "stretch_s", stretch_s, allowed)
        stretch_s = float(ends_s[0]), float(ends_s[1])
    forces, own = read_force_file(found, other, stretch_s)
    notes = notes_of(found)
    if notes is not None and stretch_s is not None:
        notes = replace(notes, body_weights=[one for one in notes.body_weights if not one.person])
    return Forces(forces.time_s, forces.force_n, forces.rate_hz, own, notes)


def walk(
    seconds: float = 10.0, floor: Floor | None = None, *, people: int = 1, path: str = "", seed: int = 1
) -> Forces:
    """Return the forces of simulated people at 1 kHz, by default of one walker on 2 x 2 tiles.

    `path` is "straight", "turn", "in-place", "random" or "crossing"; "" is round and round for one person, random for
    several. The same seed gives the same walk. Raises `BadValue` for values out of range.

    >>> forces = walk(3.0, default_floor(1, 4), people=2, path="straight")
    >>> forces.force_n.shape, forces.floor.ids
    ((3000, 4, 4), ('t1', 't2', 't3', 't4'))
    """
    seconds = number("seconds", seconds, TINY, WALK_S, f"above 0, up to {WALK_S:g} s")
    require(floor is None or isinstance(floor, Floor), "floor", floor, "a Floor, such as default_floor(1, 8)")
    seed = integer("seed", seed, -(2**63), 2**63 - 1, "-2^63 to 2^63 - 1")
    people = integer("people", people, 1, MOST_PEOPLE, f"1 to {MOST_PEOPLE}")
    require(isinstance(path, str), "path", path, ", ".join(PATHS))
    who = drawn_people(people, path or "random", seed) if people != 1 or path else ()
    source = SimulatedFloor(floor or default_floor(), RATE_HZ, seed, people=who)
    count = max(round(seconds * SENSOR_HZ), 1)
    force_n = np.zeros((count, len(source.floor.tiles), 4))
    for at in range(0, count, MAX_SAMPLES):
        n = min(MAX_SAMPLES, count - at)
        source.pull(round((at + n) * RATE_HZ / SENSOR_HZ))
        force_n[at : at + n] = source.forces[:n]
    return Forces(np.arange(count) / SENSOR_HZ, force_n, SENSOR_HZ, source.floor)
