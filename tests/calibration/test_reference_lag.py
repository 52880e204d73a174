"""A reference force that comes later than the readings, as of a load cell that is filtered."""

import made_sensors
import numpy as np
import pytest
from exact_hand import TILE
from scipy.signal import lfilter

from underfoot.calibration.files.measurements import Pairs
from underfoot.calibration.procedure import run
from underfoot.calibration.procedures.fsr import FsrProcedure
from underfoot.calibration.rigs import simulated_hand
from underfoot.calibration.science.linearisation import linearise
from underfoot.floor.simulated_tile import SimulatedTile

RATE_HZ = 200.0


def delayed(lag_s):
    return lambda time_s, force: np.interp(time_s - lag_s, time_s, force)


def filtered(time_constant_s):
    kept = np.exp(-1.0 / (RATE_HZ * time_constant_s))
    return lambda _, force: lfilter([1.0 - kept], [1.0, -kept], force)


def noisy(_, force):
    return force + 2.0 * np.random.default_rng(9).standard_normal(force.size)


def said_of(measured, bits=16, hysteresis=0.1, power=1):
    """Return what is said of four sensors, each loaded three times by a hand that trembles, with forces `measured`.

    With a `power` of 2 forces begin softly.
    """
    columns = []
    for j in range(4):
        time_s, force = made_sensors.loadings(RATE_HZ, j, count=3)
        force = made_sensors.FULL_N * (force / made_sensors.FULL_N) ** power
        noise = np.random.default_rng(50 + j).standard_normal(force.size)
        force = force * (1.0 + 0.01 * lfilter([0.38], [1.0, -0.92], noise))  # for 60 ms
        reading = made_sensors.read("soft conductance", made_sensors.lagging(force, hysteresis), j)
        coarse = 2.0 ** (16 - bits)
        late = measured(time_s, force)
        columns.append([time_s + 100.0 * j, np.full(force.size, j), np.floor(reading / coarse) * coarse, late])
    return linearise(Pairs("t1", *np.concatenate(columns, axis=1)), hysteresis=False).warnings


@pytest.mark.parametrize(("lag_s", "bits"), [(0.02, 16), (0.05, 8), (0.1, 12), (-0.04, 16)])
def test_a_force_that_comes_late_or_early_is_told_to_some_milliseconds(lag_s, bits):
    """A wide loop hid what a filter delays: 50 ms passed as good, and forces were 8 % of full scale off."""
    (said,) = said_of(delayed(lag_s), bits)
    _, _, _, comes, told_ms, _, way, *_ = said.split()
    assert (comes, way) == ("comes", "after" if lag_s > 0.0 else "before")
    assert float(told_ms) == pytest.approx(1000.0 * abs(lag_s), abs=4.0)


@pytest.mark.parametrize("time_constant_s", [0.07, 0.15])
def test_a_filter_that_takes_the_tremor_away_is_told(time_constant_s):
    """Each rise by itself tells another lag then."""
    assert any(line.startswith("the reference force comes ") for line in said_of(filtered(time_constant_s), power=2))


@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_hysteresis_creep_and_a_coarse_converter_are_no_lag(bits):
    assert said_of(delayed(0.0), bits, hysteresis=0.2) == ()


def test_noise_of_a_load_cell_is_no_lag():
    """It weighs most where a sensor reads light forces, and of those a later cell has fewer."""
    assert said_of(noisy, power=2) == ()


@pytest.mark.parametrize("seed", [1, 2])
def test_a_testing_machine_whose_force_does_not_tremble_is_not_late(seed, monkeypatch):
    """Of a good tile, whose sensors creep, it was told to come 26 to 31 ms too early."""
    monkeypatch.setattr(simulated_hand, "_TREMOR", 0.0)
    hand = simulated_hand.SimulatedHand(SimulatedTile(TILE, seed=seed), seed=seed, rate_hz=200.0)
    assert not any("reference force comes" in line for line in run(FsrProcedure(TILE), hand).warnings)
