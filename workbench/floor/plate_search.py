"""A search over Young's modulus and thickness for a tile's plate (section 4.4.2).

The plate is to be light, is not to bend under a load, and its first mode is to lie above the band. Which of these can
be had together is seen on a grid: over modulus E and thickness h, with the density that the material has.
"""

import html
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.arguments import choice, ranges_of
from underfoot.drawing import Drawing, HeatMap, series
from underfoot.drawing.page import page
from underfoot.drawing.svg import svg
from underfoot.errors import BadValue
from underfoot.files import make_folder, write_file
from underfoot.floor.layout import Tile
from underfoot.floor.tile_design import TileProperties
from underfoot.floor.tile_parameters import TileParameters
from underfoot.models.tile.plate import Plate

STEPS = 96
"""Points of the grid along each axis."""
STIFFNESSES = ("textbook", "thesis", "solid")
"""Models of how a plate resists bending."""
SHOWN = 8
"""Plates of the table."""
LABELS = {
    "modulus_pa": ("modulus", "GPa", 1e9),
    "thickness_m": ("thickness", "mm", 1e-3),
    "most_kg": ("mass at most", "kg", 1.0),
    "most_deflection_m": ("sag at most", "mm", 1e-3),
    "load_n": ("load", "N", 1.0),
    "least_hz": ("first mode from", "Hz", 1.0),
}
"""What a person calls each field of a `PlateSearch`, the unit it is shown in, and that unit in SI units."""
_MILLI, _GIGA = 1e3, 1e9
_DEFAULT = Plate()
_FITS = 90
"""How bright plates that fit are drawn."""


class PlateSearch(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is searched, and what is asked of a plate. `BadValue` for ranges that are none.

    `stiffness` is how a plate resists bending (`models.tile.plate`), and `density_kg_m3` its own; a sandwich has two
    facings of `facing_m`. The load stands at the middle, the edges held.
    """

    modulus_pa: tuple[float, float] = (1e9, 220e9)
    thickness_m: tuple[float, float] = (0.005, 0.05)
    stiffness: str = _DEFAULT.stiffness
    density_kg_m3: float = _DEFAULT.density_kg_m3
    facing_m: float = _DEFAULT.facing_m
    most_kg: float = 0.6
    most_deflection_m: float = 2e-4
    load_n: float = 1000.0
    least_hz: float = 1000.0

    def __post_init__(self) -> None:
        for name in ("modulus_pa", "thickness_m"):
            label, unit, size = LABELS[name]
            low, high = (end / size for end in getattr(self, name))
            least, most = (end / size for end in ranges_of(Plate)[name])
            if not least <= low < high <= most:
                allowed = f"from a smaller to a larger number, {least:g} to {most:g} {unit}"
                raise BadValue(f"{label} is {low:g} to {high:g} {unit}; allowed: {allowed}")
        choice("stiffness", self.stiffness, STIFFNESSES)
        for name in ("most_kg", "most_deflection_m", "load_n", "least_hz"):
            label, unit, size = LABELS[name]
            given = getattr(self, name)
            if not 0.0 < given <= 1e6:
                raise BadValue(f"{label} is {given / size:g} {unit}; allowed: above 0, up to {1e6 / size:g} {unit}")

    @staticmethod
    def like(plate: Plate) -> "PlateSearch":
        """Return a search among plates like this one."""
        return PlateSearch(stiffness=plate.stiffness, density_kg_m3=plate.density_kg_m3, facing_m=plate.facing_m)

    def plate(self, modulus_pa: float, thickness_m: float) -> Plate:
        """Return one of the plates searched."""
        return Plate(
            stiffness=self.stiffness,  # type: ignore[arg-type]
            thickness_m=thickness_m,
            facing_m=self.facing_m,
            modulus_pa=modulus_pa,
            density_kg_m3=self.density_kg_m3,
        )


@dataclass(frozen=True)
class Candidate:
    """A plate, and what it comes to on a tile: mass, deflection, first mode with held edges, and that of the tile.

    `antiresonance_hz` is where the tile as a whole, with its shaker, has its first dip above the suspension's modes: it
    ends the band before the plate's own first mode does. NaN where the plate is heavier than what the mounts carry.
    """

    modulus_pa: float
    thickness_m: float
    mass_kg: float
    deflection_m: float
    first_hz: float
    antiresonance_hz: float

    def data(self) -> dict[str, float | None]:
        """Return plain data for JSON."""
        found = {name: float(getattr(self, name)) for name in self.__dataclass_fields__}
        return {name: value if np.isfinite(value) else None for name, value in found.items()}


@dataclass(frozen=True)
class SearchResult:
    """What a search found: mass, deflection and first mode over the grid [thickness, modulus], and the best plates."""

    spec: PlateSearch
    size_m: tuple[float, float]
    modulus_pa: NDArray[np.float64]
    thickness_m: NDArray[np.float64]
    mass_kg: NDArray[np.float64]
    deflection_m: NDArray[np.float64]
    first_hz: NDArray[np.float64]
    fits: NDArray[np.bool_]
    best: tuple[Candidate, ...]

    def data(self) -> dict[str, Any]:
        """Return plain data for JSON."""
        spec = msgspec.to_builtins(self.spec)
        share = float(self.fits.mean())
        return {"asked": spec, "size_m": self.size_m, "fits": share, "best": [one.data() for one in self.best]}


def search(tile: Tile, parameters: TileParameters, spec: PlateSearch) -> SearchResult:
    """Try all plates of a grid on a tile. The best are the lightest that fit, one for each of a few moduli.

    >>> from underfoot.floor.layout import default_floor
    >>> found = search(default_floor(1, 1).tiles[0], TileParameters(), PlateSearch())
    >>> [round(1e-9 * one.modulus_pa) for one in found.best][:2], round(found.best[0].mass_kg, 2)
    ([220, 99], 0.15)
    """
    moduli, thicknesses = (np.geomspace(*span, STEPS) for span in (spec.modulus_pa, spec.thickness_m))
    size = tile.size_m
    # Rigidity is proportional to the modulus: one plate of each thickness says what all others do.
    unit = [spec.plate(moduli[0], float(h)) for h in thicknesses]
    masses = np.repeat(np.array([one.mass_kg(size) for one in unit])[:, None], STEPS, axis=1)
    stiffer = moduli[None, :] / moduli[0]
    sag = np.array([one.static_deflection_m(size, (0.0, 0.0), (0.0, 0.0), spec.load_n, 39) for one in unit])
    first = np.array([one.frequency_hz(size) for one in unit])
    deflections, modes = sag[:, None] / stiffer, first[:, None] * np.sqrt(stiffer)
    fits = (masses <= spec.most_kg) & (deflections <= spec.most_deflection_m) & (modes >= spec.least_hz)
    chosen = []
    for column in np.unique(np.linspace(STEPS - 1, 0, SHOWN).round().astype(int))[::-1]:
        rows = np.flatnonzero(fits[:, column])
        if rows.size:
            thinnest = rows[0], column
            plate = spec.plate(float(moduli[column]), float(thicknesses[rows[0]]))
            chosen.append(
                Candidate(
                    plate.modulus_pa,
                    plate.thickness_m,
                    float(masses[thinnest]),
                    float(deflections[thinnest]),
                    float(modes[thinnest]),
                    _dip_hz(tile, parameters, plate),
                )
            )
    chosen.sort(key=lambda one: one.mass_kg)
    return SearchResult(spec, size, moduli, thicknesses, masses, deflections, modes, fits, tuple(chosen))


def _dip_hz(tile: Tile, parameters: TileParameters, plate: Plate) -> float:
    """Return the antiresonance of the tile with this plate; NaN if the plate is too heavy for the mounts."""
    try:
        return TileProperties(tile, replace(parameters, plate=plate)).bend_hz(is_peak=False)
    except BadValue:
        return math.nan


def table(found: SearchResult) -> str:
    """Return the best plates as a table for a terminal, or why none fits."""
    spec, (x, y) = found.spec, (100.0 * side for side in found.size_m)
    lines = [
        f"plates of {x:.4g} x {y:.4g} cm, {spec.stiffness}, {spec.density_kg_m3:g} kg/m3: at most "
        f"{spec.most_kg:g} kg and {_MILLI * spec.most_deflection_m:g} mm under {spec.load_n:g} N, first mode from "
        f"{spec.least_hz:g} Hz",
        f"{100.0 * found.fits.mean():.0f} % of the grid fit" if found.best else why_none(found),
    ]
    if found.best:
        lines.append(f"{'E, GPa':>8} {'h, mm':>7} {'mass, kg':>9} {'sag, mm':>8} {'f1, Hz':>7} {'dip of tile, Hz':>16}")
    for one in found.best:
        lines.append(
            f"{one.modulus_pa / _GIGA:8.3g} {_MILLI * one.thickness_m:7.3g} {one.mass_kg:9.3g} "
            f"{_MILLI * one.deflection_m:8.3g} {one.first_hz:7.0f} {one.antiresonance_hz:16.0f}"
        )
    return "\n".join(lines)


def why_none(found: SearchResult) -> str:
    """Return which of the three conditions no plate of the grid meets together with the others."""
    spec = found.spec
    met = {
        "mass": found.mass_kg <= spec.most_kg,
        "deflection": found.deflection_m <= spec.most_deflection_m,
        "first mode": found.first_hz >= spec.least_hz,
    }
    alone = [name for name, ok in met.items() if not ok.any()]
    if alone:
        return f"no plate fits: none meets the asked {' nor the asked '.join(alone)}"
    return "no plate fits: each condition can be met, but not all together"


def drawing(found: SearchResult) -> Drawing:
    """Draw the region of the grid in which plates fit, with the limit of each condition."""
    spec, gpa, mm = found.spec, found.modulus_pa / _GIGA, _MILLI * found.thickness_m
    span, room = (float(gpa[0]), float(gpa[-1])), (float(mm[0]), float(mm[-1]))
    stiff_gpa = gpa[0] * found.deflection_m[:, 0] / spec.most_deflection_m
    high_gpa = gpa[0] * (spec.least_hz / found.first_hz[:, 0]) ** 2
    heaviest_mm = np.interp(spec.most_kg, found.mass_kg[:, 0], mm)
    lines = [series(f"mass {spec.most_kg:g} kg", span, [heaviest_mm] * 2, colour="force")]
    for name, least_gpa, colour in (
        (f"sag {_MILLI * spec.most_deflection_m:g} mm", stiff_gpa, "events"),
        (f"first mode {spec.least_hz:g} Hz", high_gpa, "vibration"),
    ):
        seen = (least_gpa >= span[0]) & (least_gpa <= span[1])
        lines.append(series(name, least_gpa[seen], mm[seen], colour=colour))
    if found.best:
        best = found.best[0]
        lines.append(series("lightest", [best.modulus_pa / _GIGA], [_MILLI * best.thickness_m], "dots", "contact"))
    levels = np.where(found.fits, _FITS, 0).astype(np.uint8)
    return Drawing(
        "Plates that fit, over modulus and thickness", "Young's modulus, GPa", "thickness, mm", tuple(lines),
        x_log=True, y_log=True, x_range=_beyond(span), y_range=_beyond(room), heat=HeatMap(levels, span, room),
    )  # fmt: skip


def _beyond(ends: tuple[float, float]) -> tuple[float, float]:
    """Leave room for a dot at the far edge of the grid."""
    return ends[0], 1.05 * ends[1]


def write(found: list[SearchResult], folder: Path) -> None:
    """Write `index.html`, `plates.json` and a picture of each search into `folder`; `BadFile` where that cannot be."""
    make_folder(folder)
    body = []
    for number, one in enumerate(found, start=1):
        picture = svg(drawing(one))
        write_file(folder / f"plates-{number}.svg", picture.encode())
        body += [f"<pre>{html.escape(table(one))}</pre>", picture]
    write_file(folder / "index.html", page("Plates that fit", body).encode())
    write_file(folder / "plates.json", json.dumps([one.data() for one in found], indent=1).encode() + b"\n")
