"""The tile design report: figures 4.9, 4.11 and 4.13 for the tile at hand, and a table beside the thesis's values.

`tile_design` has the figures; this draws and writes them.
"""

import html
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from underfoot.drawing import Drawing, series
from underfoot.drawing.page import facts_table, made_by, page
from underfoot.drawing.svg import svg
from underfoot.files import make_folder, write_file
from underfoot.floor.layout import LOADS
from underfoot.floor.tile_design import ALUMINIUM, F0_LIMIT_HZ, LOAD_N, PLYWOOD, SAG_LIMIT_M, Design, TileProperties
from underfoot.models.tile.plate import Plate
from underfoot.models.tile.suspension import Suspension, deflection_at_resonance_m

_MILLI = 1000.0


def text(found: list[Design]) -> str:
    """Return the figures as tables for a terminal."""
    lines = []
    for design in found:
        lines += [_heading(design), f"{'':50} {'thesis':>9} {'ours':>9} {'this tile':>9}"]
        lines += [
            f"{row.name + ', ' + row.unit:50} {_number(row.thesis):>9} {_number(row.ours):>9} {_number(row.here):>9}"
            for row in design.rows
        ]
        lines.append("")
    return "\n".join(lines).rstrip()


def data(found: list[Design]) -> dict[str, Any]:
    """Return all figures as plain data for JSON."""
    return {"designs": [design.data() for design in found]}


def write(found: list[Design], folder: Path) -> None:
    """Write `index.html`, `tile.json` and every picture as SVG into `folder`; `BadFile` where that cannot be."""
    make_folder(folder)
    body = [facts_table(made_by())]
    for design in found:
        body += _section(design)
        for name, drawing in drawings(design.measured):
            picture = svg(drawing)
            beside = f"{name}.svg" if len(found) == 1 else f"{name}-{design.alike[0]}.svg"
            write_file(folder / beside, picture.encode())
            body.append(picture)
    write_file(folder / "index.html", page("Tile design", body).encode())
    write_file(folder / "tile.json", json.dumps(data(found), indent=1).encode() + b"\n")


def drawings(here: TileProperties) -> list[tuple[str, Drawing]]:
    """Return the report's pictures by the names of their files."""
    drawn = (
        _resonance_drawing, _deflection_drawing, _trade_off_drawing, _plate_drawing, _places_drawing, _loads_drawing
    )  # fmt: skip
    return [draw(here) for draw in drawn]


def _resonance_drawing(here: TileProperties) -> tuple[str, Drawing]:
    """Draw figure 4.9: resonance over Young's modulus."""
    modulus, variants = _suspensions(here)
    f0 = np.array([variant.resonance_hz() for variant in variants])
    chosen = here.suspension.modulus_pa / 1e6
    lines = (
        series("f0", modulus, f0),
        series("50 Hz", modulus[[0, -1]], [F0_LIMIT_HZ] * 2, "dashed", "alarm"),
        series("this tile", [chosen] * 2, [float(f0[0]), float(f0[-1])], "dashed", "muted"),
    )
    title = "Suspension resonance (figure 4.9)"
    return "suspension-resonance", Drawing(title, "Young's modulus, MPa", "f0, Hz", lines, x_log=True)


def _deflection_drawing(here: TileProperties) -> tuple[str, Drawing]:
    """Draw figure 4.9: deflection over Young's modulus."""
    modulus, variants = _suspensions(here)
    shared, corner = (
        [_MILLI * variant.deflection_m(LOAD_N, load) for variant in variants] for load in ("shared", "corner")
    )
    chosen = here.suspension.modulus_pa / 1e6
    lines = (
        series("over one corner", modulus, corner, colour="force"),
        series("shared by four", modulus, shared, colour="contact"),
        series("5 mm", modulus[[0, -1]], [_MILLI * SAG_LIMIT_M] * 2, "dashed", "alarm"),
        series("this tile", [chosen] * 2, [shared[-1], corner[0]], "dashed", "muted"),
    )
    title = "Deflection under 1000 N (figure 4.9)"
    return "suspension-deflection", Drawing(
        title, "Young's modulus, MPa", "deflection, mm", lines, x_log=True, y_log=True
    )


def _trade_off_drawing(here: TileProperties) -> tuple[str, Drawing]:
    """Draw deflection over resonance, which no choice of material can change."""
    hz = np.linspace(20.0, 120.0, 200)
    shared = _MILLI * deflection_at_resonance_m(hz, here.suspension.mass_kg, LOAD_N)
    f0 = here.suspension.resonance_hz()
    lines = (
        series("one mount alone", hz, 4.0 * shared, colour="alarm"),
        series("over one corner", hz, 3.0 * shared, colour="force"),
        series("shared by four", hz, shared, colour="contact"),
        series("5 mm", [20.0, 120.0], [_MILLI * SAG_LIMIT_M] * 2, "dashed", "alarm"),
        series("thesis: 49 Hz, 4.5 mm", [49.0], [4.5], "dots", "events"),
        series("this tile", [f0] * 2, [float(shared[-1]), 4.0 * float(shared[0])], "dashed", "muted"),
    )
    title = "Deflection under 1000 N over f0, whatever the material"
    return "suspension-trade-off", Drawing(title, "f0, Hz", "deflection, mm", lines, y_log=True)


def _suspensions(here: TileProperties) -> tuple[NDArray[np.float64], list[Suspension]]:
    """Return Young's moduli in MPa, and the tile's suspension with each."""
    modulus = np.geomspace(0.3, 20.0, 200)
    return modulus, [replace(here.suspension, modulus_pa=1e6 * one) for one in modulus]


def _plate_drawing(here: TileProperties) -> tuple[str, Drawing]:
    """Draw the first bending mode over thickness, by material."""
    thickness = np.linspace(0.004, 0.05, 100)
    sandwich = replace(here.plate, stiffness="textbook")
    if here.plate.stiffness == "solid":
        sandwich = Plate()
    kinds = [
        ("sandwich, textbook's", sandwich, "vibration", "line"),
        ("sandwich, thesis's", replace(sandwich, stiffness="thesis"), "vibration", "dashed"),
        ("aluminium, solid", ALUMINIUM, "muted", "line"),
        ("plywood, solid", PLYWOOD, "force", "line"),
    ]
    lines = []
    for name, plate, colour, style in kinds:
        own = [replace(plate, thickness_m=float(h)).frequency_hz(here.tile.size_m) for h in thickness]
        lines.append(series(name, 100.0 * thickness, own, style, colour))
    f1 = here.plate.frequency_hz(here.tile.size_m)
    lines.append(series("this plate", [100.0 * here.plate.thickness_m], [f1], "dots", "events"))
    lines.append(series("1 kHz", [0.4, 5.0], [1000.0] * 2, "dashed", "alarm"))
    title = "First bending mode, edges held, without shaker"
    return "plate-modes", Drawing(title, "thickness, cm", "f1, Hz", tuple(lines))


def _places_drawing(here: TileProperties) -> tuple[str, Drawing]:
    colours = ("vibration", "force", "contact", "events")
    seen = _is_seen(here)
    lines = tuple(
        series(name, here.frequencies_hz[seen], level[seen], colour=colour)
        for (name, level), colour in zip(here.places_db().items(), colours, strict=True)
    )
    title = "Acceleration of the plate at four places (figure 4.11)"
    return "response-places", Drawing(title, "frequency, Hz", "dB re a rigid tile", lines)


def _loads_drawing(here: TileProperties) -> tuple[str, Drawing]:
    names = {"none": "no load", "standing": "a foot in the middle", "corner": "a foot at a corner"}
    colours = {"none": "vibration", "standing": "force", "corner": "contact"}
    seen = _is_seen(here)
    levels = {load: here.response_db(load)[seen] for load in LOADS}
    lines = [series(names[load], here.frequencies_hz[seen], levels[load], colour=colours[load]) for load in LOADS]
    low, high = float(levels["none"].min()), float(levels["none"].max())
    for name, edge in (("10 dB band", here.low_hz), ("", here.high_hz)):
        lines.append(series(name, [edge] * 2, [low, high], "dashed", "muted"))
    title = "Response at the accelerometer (figure 4.13)"
    return "response-loads", Drawing(title, "frequency, Hz", "dB re 1 m/s^2 a full-scale unit", tuple(lines))


def _is_seen(here: TileProperties) -> NDArray[np.bool_]:
    """Return which frequencies are drawn."""
    return (here.frequencies_hz >= 20.0) & (here.frequencies_hz <= 1500.0)


def _section(design: Design) -> list[str]:
    """Return the table of one kind of tile as HTML."""
    head = "".join(f"<th>{word}</th>" for word in ("", "", "thesis", "ours for its tile", "this tile", ""))
    body = "".join(
        f"<tr><td>{html.escape(row.name)}</td><td>{html.escape(row.unit)}</td><td>{_number(row.thesis)}</td>"
        f"<td>{_number(row.ours)}</td><td>{_number(row.here)}</td><td>{html.escape(row.why)}</td></tr>"
        for row in design.rows
    )
    modes = "".join(
        f"<tr><td>{html.escape(name)}</td><td>{', '.join(f'{x:.1f}' for x in hz)}</td></tr>"
        for name, hz in design.modes_hz.items()
    )
    return [
        f"<h2>{html.escape(_heading(design))}</h2><table><tr>{head}</tr>{body}</table>",
        f"<h3>Modes, Hz</h3><table>{modes}</table>",
    ]


def _heading(design: Design) -> str:
    x, y = (100.0 * side for side in design.size_m)
    return f"{x:.4g} x {y:.4g} cm: {', '.join(design.alike)}"


def _number(value: float | None) -> str:
    return "" if value is None else "none" if not math.isfinite(value) else f"{value:.4g}"
