"""Labels of figures: each calibration's figures can be told apart by them, and the unit is not repeated."""

import json
from pathlib import Path

import pytest

from underfoot.calibration.procedures import CALIBRATIONS
from underfoot.calibration.results.labels import label_of, unit_of
from underfoot.calibration.science.sensor_characteristics import SensorCharacteristics

HELD = json.loads((Path(__file__).parents[1] / "held.json").read_text())["calibration"]["figures"]
NOT_FIGURES = {"kind", "good", "verdict", "warnings"}


@pytest.mark.parametrize("kind", CALIBRATIONS)
def test_no_two_figures_have_the_same_label(kind):
    labels = [label_of(name) for name in HELD[kind].keys() - NOT_FIGURES]
    assert len(set(labels)) == len(labels) > 5
    assert not any(label.endswith((" percent", " mm", " db", " hz", " ms")) for label in labels)
    assert all(len(label) <= 40 for label in labels)  # the window's table shows no more


def test_units_of_forces_are_those_of_the_result():
    """In the table of what is in use, and in comparisons, all but the error were in %, as if of the force itself."""
    units = SensorCharacteristics.units()
    assert {name: unit_of(name, "% of full scale") for name in units} == units
