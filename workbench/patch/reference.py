"""Node reference from the declarations, as data and as text."""

import textwrap
from typing import Any

from underfoot.parameters import Number
from underfoot.patch.node import NodeType, Port, Registry


def reference(registry: Registry) -> list[dict[str, Any]]:
    """Return every node as plain data, family by family."""
    return [
        {
            "type": node.type,
            "label": node.label,
            "family": node.family,
            "doc": node.doc,
            "also_called": node.also_called,
            "accuracy": node.accuracy,
            "inputs": [_port(port) for port in node.input_ports.values()],
            "outputs": [_port(port) for port in node.outputs],
            "parameters": [_parameter(node, name) for name in node.parameters],
        }
        for node in _ordered(registry)
    ]


def text(registry: Registry) -> str:
    """Return every node as text for a terminal."""
    pages = []
    for node in _ordered(registry):
        lines = [f"{node.type}  ({node.family}: {node.label})", *_wrapped(node.doc, 2)]
        lines += _wrapped(f"also called: {node.also_called}", 2) if node.also_called else []
        lines += _wrapped(f"accuracy: {node.accuracy}", 2) if node.accuracy else []
        for word, ports in (("in", node.inputs), ("out", node.outputs)):
            for port in ports:
                unit = f" [{port.unit}]" if port.unit else ""
                lines += _wrapped(f"{word:4}{port.name}: {port.kind}{unit}{'; ' if port.doc else ''}{port.doc}", 2)
        for name, parameter in node.parameters.items():
            wired = "; a wire may drive it" if name in node.input_ports else ""
            doc = f"; {parameter.doc}" if parameter.doc else ""
            lines += _wrapped(f"{name} = {_short(parameter.default)} ({parameter.allowed}){doc}{wired}", 4)
        pages.append("\n".join(lines))
    return "\n\n".join(pages)


def _ordered(registry: Registry) -> list[NodeType]:
    return sorted(registry.values(), key=lambda node: (node.family, node.label))


def _port(port: Port) -> dict[str, str]:
    return {"name": port.name, "kind": port.kind, "unit": port.unit, "doc": port.doc}


def _parameter(node: NodeType, name: str) -> dict[str, Any]:
    parameter = node.parameters[name]
    data: dict[str, Any] = {
        "name": name,
        "kind": parameter.kind,
        "default": parameter.default,
        "allowed": parameter.allowed,
        "doc": parameter.doc,
    }
    if isinstance(parameter, Number):
        data |= {"low": parameter.low, "high": parameter.high, "unit": parameter.unit, "scale": parameter.scale}
        data["wire"] = parameter.wire
    return data


def _short(value: object) -> str:
    return textwrap.shorten(f"{value:g}" if isinstance(value, float) else str(value), 40, placeholder=" ...")


def _wrapped(line: str, indent: int) -> list[str]:
    return textwrap.wrap(line, 110, initial_indent=" " * indent, subsequent_indent=" " * (indent + 4))
