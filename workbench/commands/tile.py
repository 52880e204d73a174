"""`underfoot tile`: what a tile will do, from its material and size."""

import json
from pathlib import Path

import click

from underfoot.commands.files import FILE


@click.command()
@click.argument("floor", type=FILE)
@click.option("--report", type=FILE, help="Folder for a page with pictures, and all figures as JSON.")
@click.option("--simulation", type=FILE, help="Parameters of the tile; by default the thesis's materials.")
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
def tile(floor: Path, report: Path | None, simulation: Path | None, as_json: bool) -> None:
    """Resonances, deflections and bandwidth of the tiles of FLOOR (JSON), beside the thesis's values."""
    from underfoot.floor.layout import Floor
    from underfoot.floor.tile_design import designs
    from underfoot.floor.tile_parameters import TileParameters
    from underfoot.floor.tile_report import data, text, write

    parameters = TileParameters.load(simulation) if simulation else TileParameters()
    found = designs(Floor.load(floor), parameters)
    if report is not None:
        write(found, report)
    print(json.dumps(data(found)) if as_json else text(found))
