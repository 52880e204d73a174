"""Jumps: heights of forces whose take-off velocity is known in closed form, and what is no jump."""

import csv

import numpy as np
import pytest
from jumped import (
    FLIGHT_S,
    HEIGHT_MM,
    LANDING_N,
    STANDS_S,
    TAKE_OFF_S,
    VELOCITY_M_S,
    WEIGHT_N,
    jumped,
    load_n,
)
from swayed import swayed

from underfoot.records.jumps import jump_of


@pytest.fixture
def listed(underfoot):
    """Return what the command lists of a recording, as numbers; NaN where a cell is empty."""

    def listed(path):
        lines = csv.DictReader(underfoot("jumps", path).out.splitlines())
        return [{name: float(cell or "nan") for name, cell in line.items()} for line in lines]

    return listed


@pytest.mark.parametrize(("rate_hz", "error_mm"), [(1000.0, 3.0), (100.0, 6.0)])
def test_both_heights_are_those_of_the_take_off_velocity(listed, folder, rate_hz, error_mm):
    (found,) = listed(jumped(folder / "jumped.underfoot", rate_hz))
    assert found["take_off_s"] == pytest.approx(TAKE_OFF_S, abs=1e-3)
    assert found["flight_ms"] == pytest.approx(1e3 * FLIGHT_S, abs=1.5)
    assert found["flight_height_mm"] == pytest.approx(HEIGHT_MM, abs=2.0)
    assert found["contact_ms"] == pytest.approx(1e3 * (TAKE_OFF_S - STANDS_S), abs=25.0)  # from 20 N a tile
    assert found["push_peak_n"] == pytest.approx(2.4 * WEIGHT_N, abs=5.0)
    assert found["landing_peak_n"] == pytest.approx(LANDING_N, rel=0.05)
    assert found["weight_n"] == pytest.approx(WEIGHT_N, abs=0.5)
    assert found["velocity_m_s"] == pytest.approx(VELOCITY_M_S, abs=0.02)
    assert found["impulse_height_mm"] == pytest.approx(HEIGHT_MM, abs=error_mm)


def test_who_lands_elsewhere_lands_with_both_feet(listed, folder):
    """Two feet that land on tiles nobody stood on are contacts of their own; the load is that of both."""
    (found,) = listed(jumped(folder / "further.underfoot", further=3))
    assert found["flight_height_mm"] == pytest.approx(HEIGHT_MM, abs=2.0)
    assert found["landing_peak_n"] == pytest.approx(LANDING_N, rel=0.05)


def test_noise_of_many_sensors_does_not_end_a_flight(listed, folder):
    """3 N of each of 8 sensors are 8 N of their sum, which is above 20 N a few times in a flight."""
    (found,) = listed(jumped(folder / "noisy.underfoot", noise_n=3.0))
    assert found["flight_height_mm"] == pytest.approx(HEIGHT_MM, abs=3.0)


def test_no_impulse_without_its_beginning(listed, folder):
    """Where samples are missing while somebody dips, or nobody stood still before, only the flight is known."""
    path = jumped(folder / "gap.underfoot", lost=lambda time_s: abs(time_s - 3.2) < 0.1)
    (found,) = listed(path)
    assert found["flight_height_mm"] == pytest.approx(HEIGHT_MM, abs=2.0)
    assert np.isnan([found[name] for name in ("weight_n", "velocity_m_s", "impulse_height_mm")]).all()
    (late,) = listed(jumped(folder / "late.underfoot", lost=lambda time_s: (time_s > 0.5) & (time_s < 2.6)))
    assert np.isnan(late["weight_n"])


def test_a_time_without_samples_is_no_flight(listed, folder):
    lost = jumped(folder / "lost.underfoot", lost=lambda time_s: abs(time_s - TAKE_OFF_S - 0.5 * FLIGHT_S) < 0.25)
    assert listed(lost) == listed(swayed(folder / "stood.underfoot")) == []
    time_s = np.arange(STANDS_S, 6.0, 1e-3)
    flight_s = (TAKE_OFF_S, TAKE_OFF_S + FLIGHT_S)
    there = abs(time_s - np.mean(flight_s) - 0.1) > 0.05
    assert jump_of(time_s, load_n(time_s), flight_s) is not None
    assert jump_of(time_s[there], load_n(time_s[there]), flight_s) is None


def test_the_weight_before_one_jump_holds_for_the_next_flight(listed, folder):
    """Who stands, jumps, and then steps off and leans on the floor with 300 N has jumped once."""
    knots_s = [1.0, 1.1, 3.0, 3.2, 3.5, 3.51, 3.9, 3.95, 4.3, 4.6, 4.7, 5.0, 5.1, 5.3, 5.4]
    loads_n = [0.0, 700.0, 700.0, 300.0, 1700.0, 0.0, 0.0, 1800.0, 500.0, 800.0, 0.0, 0.0, 300.0, 300.0, 0.0]
    path = jumped(folder / "leans.underfoot", load_n=lambda time_s: np.interp(time_s, knots_s, loads_n))
    assert [one["take_off_s"] for one in listed(path)] == [pytest.approx(3.51, abs=0.02)]


def test_who_steps_off_and_on_does_not_jump(listed, folder, underfoot):
    """The load sinks from the weight to nothing; then leans on the floor, of an unknown weight until it is noted."""
    path = folder / "off.underfoot"
    knots_s, loads_n = (
        [2.9, 3.3, 3.8, 4.1, 4.5, 4.6, 5.0, 5.2, 5.5],
        [700.0, 0.0, 0.0, 840.0, 840.0, 0.0, 0.0, 400.0, 0.0],
    )
    time_s = np.arange(STANDS_S, 6.0, 1e-3)
    stepped = jump_of(time_s, np.interp(time_s, knots_s, loads_n), (3.3, 3.8))
    assert (stepped.velocity_m_s < 0.0, stepped.impulse_height_mm, stepped.is_of(WEIGHT_N)) == (True, 0.0, False)
    jumped(path, load_n=lambda time_s: np.interp(time_s, [1.0, 1.1, *knots_s], [0.0, 840.0, *loads_n]))
    assert [one["take_off_s"] for one in listed(path)] == [pytest.approx(3.3, abs=0.02), pytest.approx(4.6, abs=0.02)]
    underfoot("steps", path, "--body-weight", f"{WEIGHT_N} N")
    assert listed(path) == []
