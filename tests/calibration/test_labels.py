"""Labels of figures: each calibration's figures can be told apart by them, and the unit is not repeated."""

import json
from pathlib import Path

import pytest

from underfoot.calibration.procedures import CALIBRATIONS
from underfoot.calibration.results.labels import label_of

HELD = json.loads((Path(__file__).parents[1] / "held.json").read_text())["calibration"]["figures"]
NOT_FIGURES = {"kind", "good", "verdict", "warnings"}


@pytest.mark.parametrize("kind", CALIBRATIONS)
def test_no_two_figures_have_the_same_label(kind):
    labels = [label_of(name) for name in HELD[kind].keys() - NOT_FIGURES]
    assert len(set(labels)) == len(labels) > 5
    assert not any(label.endswith((" percent", " mm", " db", " hz", " ms")) for label in labels)
    assert all(len(label) <= 40 for label in labels)  # the window's table shows no more
