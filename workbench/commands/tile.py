"""`underfoot tile`: properties of a tile from material and size, and plates that fit."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from underfoot.commands.files import require_folders_writable
from underfoot.commands.options import FIGURES_AS_JSON, command, two_numbers
from underfoot.errors import BadValue
from underfoot.options import argument, option, shared

if TYPE_CHECKING:
    from underfoot.floor.layout import Floor
    from underfoot.floor.tile_parameters import TileParameters


@dataclass(frozen=True)
class TileDesignOptions:
    """Options of the command; None if not given."""

    floor: Path = argument("floors")
    report: Path | None = option("Folder for a page with pictures, and all figures as JSON.")
    simulation: Path | None = option(
        "Parameters of the tile; by default the thesis's materials.", presets="simulations"
    )
    search: bool = option("Search plates over modulus and thickness instead (section 4.4.2).", False)
    modulus: str | None = option("Young's modulus, GPa; 1:220 by default.", metavar="LOW:HIGH")
    thickness: str | None = option("Thickness, mm; 5:50 by default.", metavar="LOW:HIGH")
    stiffness: str | None = option("textbook, thesis (sandwiches with the tile's facings) or solid.")
    density: float | None = option("Density of the whole plate, kg/m^3; by default the tile's own.")
    most_mass: float | None = option("Maximum mass of the plate, kg; by default 0.6.")
    most_sag: float | None = option("Maximum deflection of the middle under the load, mm; by default 0.2.")
    least_mode: float | None = option("Minimum first mode, edges held, Hz; by default 1000.")
    load: float | None = option("Load on the middle, N; 1000 by default.")
    as_json: bool = shared(FIGURES_AS_JSON)


@command(TileDesignOptions)
def tile(options: TileDesignOptions) -> None:
    """Compute resonances, deflections and bandwidth of the tiles of FLOOR (JSON), beside the thesis's values.

    With --search: list suitable plates for a tile, with a picture in the report.
    """
    from underfoot.floor.layout import Floor
    from underfoot.floor.tile_parameters import TileParameters

    require_folders_writable(options.report)
    floor = Floor.load(options.floor)
    parameters = TileParameters.load(options.simulation) if options.simulation else TileParameters()
    if options.search:
        _search(options, floor, parameters)
        return
    given = [name for name in _OF_SEARCH if getattr(options, name) is not None]
    if given:
        raise BadValue(f"--{given[0].replace('_', '-')} is given without --search; allowed: with it")
    _report(options, floor, parameters)


_OF_SEARCH = {
    "modulus": "modulus_pa",
    "thickness": "thickness_m",
    "stiffness": "stiffness",
    "density": "density_kg_m3",
    "most_mass": "most_kg",
    "most_sag": "most_deflection_m",
    "least_mode": "least_hz",
    "load": "load_n",
}
"""Fields of a `PlateSearch`, by the options that set them."""


def _report(options: TileDesignOptions, floor: "Floor", parameters: "TileParameters") -> None:
    from underfoot.floor.tile_design import designs
    from underfoot.floor.tile_report import data, text, write

    found = designs(floor, parameters)
    if options.report is not None:
        write(found, options.report)
    print(json.dumps(data(found)) if options.as_json else text(found))


def _search(options: TileDesignOptions, floor: "Floor", parameters: "TileParameters") -> None:
    import msgspec

    from underfoot.floor.plate_search import LABELS, PlateSearch, search, table, write

    spec = PlateSearch.like(parameters.plate)
    for name, field in _OF_SEARCH.items():
        value = getattr(options, name)
        if value is not None:
            size = LABELS[field][2] if field in LABELS else 1.0
            if name in ("modulus", "thickness"):
                low, high = two_numbers(f"--{name}", value, "LOW:HIGH, as 5:50")
                value = low * size, high * size
            spec = msgspec.structs.replace(spec, **{field: value * size if isinstance(value, float) else value})
    found = [search(one, parameters, spec) for one in {tile.size_m: tile for tile in floor.tiles}.values()]
    if options.report is not None:
        write(found, options.report)
    print(json.dumps([one.data() for one in found]) if options.as_json else "\n\n".join(map(table, found)))
