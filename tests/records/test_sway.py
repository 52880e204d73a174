"""The sway of who stands, of a recording whose centre of pressure goes where it was made to go."""

import csv

import numpy as np
import pytest
from swayed import RADII_M, ROUND_S, WEIGHT_N, swayed

from underfoot.floor.contacts import ContactRows
from underfoot.records.balance import BalanceMeans
from underfoot.records.sway import standing_stretches


def test_the_sway_is_that_of_the_way_of_the_centre_of_pressure(underfoot, refused, folder):
    """The figures are the closed forms of an ellipse, of whose places x and y are 1/sqrt(2) of the radii (RMS)."""
    stood = swayed(folder / "stood.underfoot")
    (line,) = csv.DictReader(underfoot("sway", stood, "--from", 3, "--to", 13).out.splitlines())
    found = {name: float(value) for name, value in line.items()}
    a, b = (1e3 * radius_m for radius_m in RADII_M)
    angle = np.linspace(0.0, 2.0 * np.pi, 10_001)
    way_mm = np.trapezoid(np.hypot(a * np.sin(angle), b * np.cos(angle)), angle) * 10.0 / ROUND_S
    assert (found["from_s"], found["to_s"]) == (3.0, 13.0)
    assert found["load_n"] == pytest.approx(WEIGHT_N, abs=0.5)
    assert found["path_mm"] == pytest.approx(way_mm, rel=0.02)
    assert found["velocity_mm_s"] == pytest.approx(way_mm / 10.0, rel=0.02)
    assert found["ellipse_95_mm2"] == pytest.approx(5.991 * np.pi * a * b / 2.0, rel=0.01)  # chi square of two, 0.95
    assert (found["rms_x_mm"], found["rms_y_mm"]) == pytest.approx((a / np.sqrt(2.0), b / np.sqrt(2.0)), rel=0.01)
    assert (found["range_x_mm"], found["range_y_mm"]) == pytest.approx((2.0 * a, 2.0 * b), rel=0.02)
    (whole,) = csv.DictReader(underfoot("sway", stood).out.splitlines())
    assert float(whole["from_s"]) == pytest.approx(1.2, abs=0.1)
    assert float(whole["to_s"]) == pytest.approx(15.0, abs=0.1)
    for stretch in ((0.0, 10.0), (10.0, 16.5), (5.0, 6.0), (10.0, 5.0), (5.0, "inf")):
        said = refused("sway", stood, "--from", stretch[0], "--to", stretch[1])
        assert "allowed: a stretch of 2 s or more throughout which somebody stands" in said
    assert "allowed: both --from and --to" in refused("sway", stood, "--to", 20.0)


@pytest.mark.parametrize(("change_n", "ends"), [(32.0, [(0.0, 20.0)]), (200.0, [(0.0, 10.0), (10.0, 20.0)])])
def test_no_second_is_in_two_stretches(change_n, ends):
    """Somebody takes up a thing at 10 s: two seconds around it vary by up to 2.2 % or 12 %, those beside do not."""
    time_s = np.arange(0.0, 20.0, 0.01)
    load_n = 700.0 + change_n * (time_s >= 10.0)
    rows = ContactRows(time_s, *np.ones((3, 2000)), load_n, np.ones((2000, 1), bool))
    means = BalanceMeans()
    found = standing_stretches(bytearray(means.take(rows) + means.rest()))
    assert found == [pytest.approx(stretch, abs=0.2) for stretch in ends]
