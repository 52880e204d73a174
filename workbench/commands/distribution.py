"""`underfoot distribution`: the distributions of a node of a patch, printed and drawn."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import FILE, PATCH, RUN_CODE, require_folders_writable
from underfoot.errors import BadValue

if TYPE_CHECKING:
    from underfoot.drawing import Drawing


@click.command()
@click.argument("patch", type=PATCH)
@click.argument("node", required=False)
@click.option("-o", "--output", type=FILE, help="Folder for a plot of each distribution.")
@RUN_CODE
@click.option("--json", "as_json", is_flag=True, help="Print all points as JSON.")
def distribution(patch: Path, node: str | None, output: Path | None, as_json: bool) -> None:
    """Print the distributions that NODE of PATCH draws from, such as slip durations and event sizes.

    Without NODE: of every node that has distributions.
    """
    from underfoot.drawing.svg import svg
    from underfoot.files import make_folder, write_file
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch

    require_folders_writable(output)
    loaded = Patch.load(patch, REGISTRY)
    with_distributions = [node for node in loaded.nodes if REGISTRY[node.type].distributions is not None]
    chosen = [one for one in with_distributions if node is None or one.id == node]
    if not chosen:
        known = ", ".join(one.id for one in with_distributions) or "none: no node of this patch has distributions"
        raise BadValue(f"node is {node}; allowed: {known}" if node else f"{patch} has no node with distributions")
    found = {}
    with report_compiling():
        for one in chosen:
            type = REGISTRY[one.type]
            found[one.id] = type.drawings(type.values(one.parameters))
    if output is not None:
        make_folder(output)
        for id, drawings in found.items():
            for k, drawing in enumerate(drawings):
                write_file(output / f"{id}-{k + 1}.svg", svg(drawing).encode())
    if as_json:
        print(json.dumps({id: [_data(drawing) for drawing in drawings] for id, drawings in found.items()}))
    else:
        print("\n".join(line for id, drawings in found.items() for line in _lines(id, drawings)))


def _data(drawing: "Drawing") -> dict[str, Any]:
    series = [{"name": series.name, "x": series.x.tolist(), "y": series.y.tolist()} for series in drawing.series]
    return {"title": drawing.title, "x": drawing.x, "y": drawing.y, "series": series}


def _lines(id: str, drawings: "tuple[Drawing, ...]") -> list[str]:
    """Return one line per series with the range of each distribution."""
    lines = [id]
    width = max((len(series.name) for drawing in drawings for series in drawing.series), default=0)
    for drawing in drawings:
        lines.append(f"  {drawing.title}: {drawing.y} over {drawing.x}")
        for series in drawing.series:
            top = int(series.y.argmax()) if len(series.y) else -1
            if top >= 0 and math.isfinite(series.y[top]):
                ends = f"{series.x.min():.4g} to {series.x.max():.4g}"
                name = (series.name or "found").ljust(width)
                lines.append(f"    {name} from {ends}, most at {series.x[top]:.4g}: {series.y[top]:.4g}")
    return lines
