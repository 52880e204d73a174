"""`underfoot distribution`: the distributions of a node of a patch, printed and drawn."""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from underfoot.commands.compiling import report_compiling
from underfoot.commands.files import RUN_CODE, require_folders_writable
from underfoot.commands.options import command
from underfoot.errors import BadValue
from underfoot.options import argument, option, shared

if TYPE_CHECKING:
    from underfoot.drawing import Drawing


@dataclass(frozen=True)
class DistributionOptions:
    """Options of the command; None if not given."""

    patch: Path = argument("patches")
    node: str | None = argument()
    output: Path | None = option("Folder for a plot of each distribution.", flag="-o --output")
    run_code: bool = shared(RUN_CODE)
    as_json: bool = option("Print all points as JSON.", False, "--json")


@command(DistributionOptions)
def distribution(options: DistributionOptions) -> None:
    """Print the distributions that NODE of PATCH draws from, such as slip durations and event sizes.

    Without NODE: of every node that has distributions.
    """
    from underfoot.drawing.svg import svg
    from underfoot.files import make_folder, write_file
    from underfoot.nodes import REGISTRY
    from underfoot.patch.patch import Patch

    require_folders_writable(options.output)
    loaded = Patch.load(options.patch, REGISTRY)
    with_distributions = [node for node in loaded.nodes if REGISTRY[node.type].distributions is not None]
    chosen = [one for one in with_distributions if options.node in (None, one.id)]
    if not chosen:
        known = ", ".join(one.id for one in with_distributions) or "none: no node of this patch has distributions"
        none = f"{options.patch} has no node with distributions"
        raise BadValue(f"node is {options.node}; allowed: {known}" if options.node else none)
    found = {}
    with report_compiling():
        for one in chosen:
            type = REGISTRY[one.type]
            found[one.id] = type.drawings(type.values(one.parameters))
    if options.output is not None:
        make_folder(options.output)
        for id, drawings in found.items():
            for k, drawing in enumerate(drawings):
                write_file(options.output / f"{id}-{k + 1}.svg", svg(drawing).encode())
    if options.as_json:
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
