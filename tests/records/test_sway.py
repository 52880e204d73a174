"""The sway of who stands, of a recording whose centre of pressure goes where it was made to go."""

import csv

import numpy as np
import pytest
from swayed import RADII_M, ROUND_S, WEIGHT_N, swayed

from underfoot.errors import BadValue
from underfoot.floor.contacts import ContactRows
from underfoot.records.balance import BalanceMeans
from underfoot.records.sway import standing_stretches, sway_of


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
    assert "0 to 13 s" in refused("sway", stood, "--to", 13.0)
    assert "from 3 to 16.99" in refused("sway", stood, "--from", 3.0), "the recording's end"


def balance_of(time_s, load_n, way_m=0.0):
    """Return what a survey keeps of one contact, which lies at `way_m` along both axes."""
    count = len(time_s)
    rows = ContactRows(time_s, np.ones(count), *(np.zeros((2, count)) + way_m), load_n, np.ones((count, 1), bool))
    means = BalanceMeans()
    return bytearray(means.take(rows) + means.rest())


@pytest.mark.parametrize(("change_n", "ends"), [(32.0, [(0.0, 20.0)]), (200.0, [(0.0, 10.0), (10.0, 20.0)])])
def test_no_second_is_in_two_stretches(change_n, ends):
    """Somebody takes up a thing at 10 s: two seconds around it vary by up to 2.2 % or 12 %, those beside do not."""
    time_s = np.arange(0.0, 20.0, 0.01)
    found = standing_stretches(balance_of(time_s, 700.0 + change_n * (time_s >= 10.0)))
    assert found == [pytest.approx(stretch, abs=0.2) for stretch in ends]


def test_what_sways_at_5_hz_has_half_of_its_power():
    """Means over 25 ms leave sin(pi 5 0.025) / (pi 5 0.025), 0.974; at 40 Hz the low-pass is one of 5.1 Hz."""
    time_s = np.arange(0.0, 30.0, 0.001)
    balance = balance_of(time_s, 700.0 + 0.0 * time_s, 0.01 * np.sin(10.0 * np.pi * time_s))
    assert sway_of(balance, 5.0, 25.0).rms_x_mm == pytest.approx(0.974 * 10.0 / np.sqrt(2.0) / np.sqrt(2.0), rel=0.05)


def test_who_leaves_the_ground_does_not_stand():
    """From 9.9 to 10.1 s only a cable or a shoe is on the floor."""
    time_s = np.arange(0.0, 20.0, 0.01)
    balance = balance_of(time_s, np.where(abs(time_s - 10.0) < 0.1, 20.0, 700.0))
    assert sway_of(balance, 3.0001, 5.0001).load_n == pytest.approx(700.0)  # two seconds, by decimals
    with pytest.raises(BadValue, match="from 8 to 12 s; allowed: a stretch of 2 s or more throughout"):
        sway_of(balance, 8.0, 12.0)
