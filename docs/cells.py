"""The cells of notebooks, run one after the other: for the site, which shows what comes out, and for the tests."""

import ast
import json
import tempfile
from collections.abc import Iterator
from contextlib import chdir
from pathlib import Path
from typing import Any


def cells(path: Path) -> Iterator[tuple[str, str, Any]]:
    """Each cell of a notebook: "markdown" or "code", its text, and, of code, the value that its last line has.

    Code is run as it is asked for, in one namespace, as Jupyter does it.
    """
    names: dict[str, Any] = {"__name__": "__notebook__"}
    for number, cell in enumerate(json.loads(path.read_text(encoding="utf-8"))["cells"], 1):
        text = "".join(cell["source"])
        yield (
            cell["cell_type"],
            text,
            _run(text, names, f"{path.name}, cell {number}") if cell["cell_type"] == "code" else None,
        )


def _run(text: str, names: dict[str, Any], place: str) -> object:
    tree = ast.parse(text, place)
    last = tree.body[-1] if tree.body else None
    if not isinstance(last, ast.Expr):
        exec(compile(tree, place, "exec"), names)
        return None
    tree.body.pop()
    exec(compile(tree, place, "exec"), names)
    return eval(compile(ast.Expression(last.value), place, "eval"), names)


def markdown(path: Path) -> str:
    """A notebook as a page: its text, its code, and what came out of it."""
    parts = []
    with tempfile.TemporaryDirectory() as folder, chdir(folder):  # for what a notebook saves
        for kind, text, value in cells(path):
            parts.append(text if kind == "markdown" else f"```python\n{text}\n```")
            parts += _shown(value)
    return "\n\n".join(parts) + "\n"


def _shown(value: object) -> list[str]:
    if hasattr(value, "_repr_svg_"):
        return [_whole(value._repr_svg_())]
    if hasattr(value, "_repr_html_"):
        return [_whole(value._repr_html_())]
    return [] if value is None else [f"```text\n{value!r}\n```"]


def _whole(html: str) -> str:
    """HTML that Markdown leaves as it is: without empty lines."""
    return "<div>\n" + "\n".join(line for line in html.splitlines() if line.strip()) + "\n</div>"
