"""The notebooks of docs/ run from the first cell to the last, and what they say of their numbers is so."""

import importlib.util
import json
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"
NOTEBOOKS = sorted((DOCS / "notebooks").glob("*.ipynb"))
spec = importlib.util.spec_from_file_location("notebook_cells", DOCS / "cells.py")
notebook_cells = importlib.util.module_from_spec(spec)
spec.loader.exec_module(notebook_cells)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_runs(path, folder):
    if "to_dataframe" in path.read_text():
        pytest.importorskip("pandas")
    shown = [value for kind, _, value in notebook_cells.cells(path) if value is not None]
    assert any(hasattr(value, "_repr_svg_") for value in shown)


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_without_outputs(path):
    for cell in json.loads(path.read_text())["cells"]:
        assert not cell.get("outputs")
        assert cell.get("execution_count") is None


def test_there_are_six():
    assert len(NOTEBOOKS) == 6
