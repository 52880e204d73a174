"""A known weight that is not as heavy as was typed."""

import re
from dataclasses import replace
from types import SimpleNamespace

import made_sensors
import numpy as np
import pytest
from exact_hand import Hand

from underfoot.calibration.files.measurements import Pairs
from underfoot.calibration.procedure import run
from underfoot.calibration.procedures.fsr import FsrProcedure
from underfoot.calibration.rigs.simulated_hand import SimulatedHand
from underfoot.calibration.science.weight_checks import weight_warnings
from underfoot.floor.layout import default_floor
from underfoot.floor.simulated_tile import SimulatedTile

WEIGHTS_N = np.array([8.0, 16.0, 33.0, 66.0, 100.0, 150.0, 200.0])
ORDER = np.array([0, *range(1, 8), *range(6, 0, -1)])
"""Nothing, up, and down again."""


def weighed(curve, on=lambda sensor, k: 1.0, hysteresis=0.1, creep=0.03):
    """Weights on four sensors, each off by a factor `on` what is typed."""
    columns = []
    for j in range(4):
        typed = np.array([0.0, *WEIGHTS_N])[ORDER]
        true = typed * [on(j, k) for k in range(ORDER.size)]
        felt = made_sensors.lagging(true, hysteresis) + creep * (np.maximum.accumulate(true) - true)
        reading = made_sensors.read(curve, felt, j, gain=(0.85, 1.0, 1.1, 1.2)[j])
        columns.append([10.0 * np.arange(ORDER.size), np.full(ORDER.size, j), reading, typed])
    return Pairs("t1", *np.concatenate(columns, axis=1))


@pytest.mark.parametrize("curve", made_sensors.CURVES)
def test_no_weight_of_a_good_series_is_named(curve):
    assert weight_warnings(weighed(curve), ()) == ()


@pytest.mark.parametrize("factor", [0.8, 1.3])
@pytest.mark.parametrize("curve", made_sensors.CURVES)
def test_a_weight_that_is_another_than_was_typed_is_named_with_what_it_is(curve, factor):
    (every,) = weight_warnings(weighed(curve, lambda _, k: factor if ORDER[k] == 4 else 1.0), ())
    assert every.startswith("the weight of 66 N reads as ")
    assert float(re.search(r"as (\d+) N by", every)[1]) == pytest.approx(66.0 * factor, rel=0.06)


def test_a_weight_that_is_another_once_is_named_with_sensor_and_way():
    (once,) = weight_warnings(weighed("soft conductance", lambda j, k: 1.3 if (j, k) == (2, 10) else 1.0), ())
    assert once.startswith("the weight of 66 N on sensor 3, falling, reads as 8")


def test_a_weight_is_not_named_for_a_step_of_the_converter():
    """At 8 bits 5 N moved a reading by three or four steps: it was said to read as 4 N."""
    tile = default_floor(1, 1).tiles[0]
    hand = SimulatedHand(SimulatedTile(tile, seed=13), seed=13, rate_hz=100.0)

    def read():
        readings = hand.read()
        return replace(readings, force_n=None, values=readings.values // 256 * 256)

    values = {"reference": "known weights", "weights_n": (5.0, 10.0, 20.0, 50.0, 100.0, 200.0)}
    found = run(FsrProcedure(tile), SimpleNamespace(press=hand.press, read=read), values)
    assert not [said for said in found.warnings if "by the other weights" in said]


def test_whoever_calibrates_with_weights_is_told():
    """Of five on sensors that are all alike two explain the readings, and the last digit chose one of them."""
    hand = Hand(force=False, load=lambda press, force: force * (1.3 if press.force_n == 100.0 else 1.0))
    values = {"reference": "known weights", "weights_n": (25.0, 50.0, 100.0, 200.0, 300.0)}
    (said,) = run(FsrProcedure(default_floor(1, 1).tiles[0]), hand, values).warnings
    assert said.startswith("the weight of 100 N reads as 130 N, or the one of 200 N reads as 1")
    assert "N by the other weights: is it, or one beside it, as heavy as was typed?" in said
