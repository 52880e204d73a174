"""The numbers of a plot as CSV, read by Python's own reader."""

import csv
import io

import numpy as np
import pytest

from underfoot.drawing import Drawing, HeatMap, Series, series
from underfoot.drawing.table import csv as table_of


def rows(drawing):
    return list(csv.reader(io.StringIO(table_of(drawing))))


def test_every_point_of_every_series_is_there():
    lines = (series('a "b", c', [1, 2], [3.5, np.nan]), series("", [0], [1], "arrows", to=[[2, 3]]))
    head, *body = rows(Drawing("T", "time, s", "force, N", lines))
    assert head == ["series", "time, s", "force, N", "to_x", "to_y"]
    assert body == [['a "b", c', "1", "3.5", "", ""], ['a "b", c', "2", "nan", "", ""], ["force", "0", "1", "2", "3"]]


def test_a_band_has_its_mean_and_how_far_it_reaches():
    """What was saved of mean and standard deviation was an outline, there and back."""
    around = Series("± 1 SD", np.array([0.0, 50.0]), np.array([20.0, 700.0]), "band", spread=np.array([5.0, 40.0]))
    head, *body = rows(Drawing("T", "stance, %", "force, N", (around, series("mean", [0, 50], [20, 700]))))
    assert head == ["series", "stance, %", "force, N", "plus_minus"]
    assert body[:3] == [["± 1 SD", "0", "20", "5"], ["± 1 SD", "50", "700", "40"], ["mean", "0", "20", ""]]


def test_what_is_drawn_beside_a_name_has_it():
    drawing = Drawing("T", "stimulus", "dB", (series("each", [0.85, 1.85], [3, 4], "dots"),), x_names=("TD", "a, b"))
    assert rows(drawing)[1:] == [["each", "TD", "3"], ["each", "a, b", "4"]]


def test_levels_of_a_heat_map_stand_at_the_middles_of_their_cells():
    heat = HeatMap(np.array([[1, 2], [3, 4]], np.uint8), (0.0, 4.0), (10.0, 1000.0))
    *_, last = rows(Drawing("T", "time, ms", "frequency, Hz", heat=heat, y_log=True))
    assert last[0] == "3"
    assert float(last[1]) == pytest.approx(10.0 * 100.0**0.75)
    assert last[2] == "4"


def test_a_series_on_the_right_axis_is_called_by_it():
    right = Series("", np.zeros(1), np.ones(1), right=True)
    assert rows(Drawing("T", "x", "y", (right,), right="force, N"))[1][0] == "force"
