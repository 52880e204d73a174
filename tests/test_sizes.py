"""No function has over 60 lines, no file over 500 (CONTRIBUTING.md). Ruff counts parameters."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[1]
TEXTS = {
    path.relative_to(ROOT): path.read_text() for folder in ("workbench", "widgets", "tests")
    for path in sorted((ROOT / folder).rglob("*.py"))
}  # fmt: skip


def test_no_file_has_over_500_lines():
    assert [path for path, text in TEXTS.items() if text.count("\n") > 500] == []


def statements(body):
    """All statements, also within others: no function is in an expression, of which most of a file is."""
    for one in body:
        yield one
        for inside in ("body", "handlers", "cases", "orelse", "finalbody"):
            yield from statements(getattr(one, inside, ()))


def test_no_function_has_over_60_lines():
    functions = [
        (path, node.name, node.end_lineno - node.lineno + 1)
        for path, text in TEXTS.items() for node in statements(ast.parse(text).body)
        if isinstance(node, ast.FunctionDef)
    ]  # fmt: skip
    assert len(functions) > 1000
    assert [found for found in functions if found[2] > 60] == []
