"""The node reference of the site: every node, with a picture of what it gives in one step over a tile.

What a node takes comes from the plainest source of its kind: a force from the tile, events from the footfall and a
strike, any other signal from a tone. The picture is computed as the page is built.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from underfoot.drawing import Drawing, series
from underfoot.drawing.svg import svg
from underfoot.drawing.thinning import extremes
from underfoot.engine.preview import ONE_TILE, previewed
from underfoot.nodes import REGISTRY
from underfoot.patch.node import NodeType
from underfoot.patch.patch import Patch
from underfoot.patch.reference import reference

SECONDS, RATE_HZ = 0.9, 48_000.0
_POINTS = 600
_COLOURS = ("vibration", "force", "contact", "corner 1")
SOURCES = {
    "N": ("tile-force", "force"),
    "m": ("contact", "x"),
    "event": ("footfall", "onset"),
    "signal": ("tone", "out"),
}
"""The node and the output that stand for a unit, or for a kind."""


def page() -> str:
    """The page, in Markdown."""
    parts = ["# Node reference", "Each picture is one step over a tile, with a strike by hand as the foot comes down."]
    family = ""
    for data in reference(REGISTRY):
        node = REGISTRY[data["type"]]
        if node.family != family:
            family = node.family
            parts.append(f"## {family}")
        parts += [f"### {node.label}", f"`{node.type}`. {node.doc}", *_picture(node), *tables(data)]
    return "\n\n".join(parts) + "\n"


def tables(data: Mapping[str, Any]) -> list[str]:
    """The ports and the parameters of a node, each as a table in Markdown if there are any."""
    ports = [
        (way, port["name"], port["kind"], port["unit"], port["doc"])
        for way, key in (("in", "inputs"), ("out", "outputs"))
        for port in data[key]
    ]
    parameters = [(one["name"], one["default"], one["allowed"], one["doc"]) for one in data["parameters"]]
    tables = (
        _table(("", "port", "kind", "unit", ""), ports),
        _table(("parameter", "default", "allowed", ""), parameters),
    )
    return [table for table in tables if table]


def _table(head: Sequence[str], rows: Sequence[Sequence[object]]) -> str:
    lines = [head, ["---"] * len(head), *rows] if rows else []
    return "\n".join(f"| {' | '.join(map(_cell, line))} |" for line in lines)


def _cell(value: object) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return (text if len(text) <= 60 or " " in text else text[:57] + "...").replace("|", "\\|").replace("\n", " ")


def _picture(node: NodeType) -> list[str]:
    """What comes from the outputs of a node, as SVG; nothing of a node without outputs."""
    if not node.outputs:
        return []
    patch = Patch().add(node.type)
    for port in node.inputs:
        source, output = SOURCES.get(port.unit, SOURCES[port.kind])
        patch = patch.add(source)
        patch = patch.connect(f"{patch.nodes[-1].id}.{output}", f"{node.type}.{port.name}")
    outputs = tuple(f"{node.type}.{port.name}" for port in node.outputs)
    _, signals, events = previewed(patch, outputs, ONE_TILE, SECONDS, RATE_HZ)
    lines, time_s = [], np.arange(round(SECONDS * RATE_HZ)) / RATE_HZ
    for k, (name, values) in enumerate(signals.items()):
        x, y, _ = extremes(time_s, values[:, None], SECONDS / _POINTS)
        lines.append(series(name, x, y[:, 0], colour=_COLOURS[k % len(_COLOURS)]))
    for name, rows in events.items():
        lines.append(series(name, rows[:, 0] / RATE_HZ, rows[:, 1], "stems", "events"))
    units = dict.fromkeys(port.unit or ("strength" if port.kind == "event" else "value") for port in node.outputs)
    note = "" if any(len(one.x) for one in lines) else "nothing comes of one step"
    drawing = Drawing(node.label, "time, s", " or ".join(units), tuple(lines), x_range=(0.0, SECONDS), note=note)
    return ["<div>" + "\n".join(line for line in svg(drawing).splitlines() if line.strip()) + "</div>"]
