"""The load in the middle, by which the force of a foot is checked."""

import numpy as np
import pytest
from exact_hand import TILE, Hand, walked

from underfoot.calibration.procedure import run
from underfoot.calibration.procedures.fsr import FsrProcedure
from underfoot.calibration.rig import PressRequest
from underfoot.errors import BadMeasurement
from underfoot.floor.profile import Profile

QUICK = {"loadings": 2, "hold_s": 2.0, "full_scale_n": 400.0}


def test_a_sum_that_is_off_in_the_middle_is_not_good_though_each_sensor_is():
    """Loads over single sensors do not tell: there the sum is right whatever others were said to bear."""

    def counts(corners):  # a tenth of what all bear goes by another way
        return 2000.0 + 20.0 * corners * np.where(corners.min(axis=1, keepdims=True) > 1.0, 0.9, 1.0)

    good, bad = run(FsrProcedure(TILE), Hand(), QUICK), run(FsrProcedure(TILE), Hand(counts), QUICK)
    assert good.good
    assert good.figures["foot_expanded_percent"] == pytest.approx(1.0, abs=0.05)  # all of it the load cell's
    named = "load cell, uncertain by 3 % of full scale (k = 2)"
    worse = run(FsrProcedure(TILE), Hand(), QUICK | {"reference_percent": 3.0})
    assert worse.figures["foot_expanded_percent"] == pytest.approx(3.0, abs=0.05)
    assert worse.apply(Profile(tile="t1")).fsr.reference == named
    assert not bad.good
    assert bad.figures["foot_error_percent"] == pytest.approx(10.0, rel=0.05)
    assert "It was 10.0 % off in the middle; 5 % is allowed. Was each sensor loaded from right above" in bad.verdict
    assert [name for name, _, _ in bad.raw] == ["pairs", "foot"]


def test_a_load_in_the_middle_is_borne_by_several_sensors():
    procedure, hand = FsrProcedure(TILE), Hand()
    walked(procedure, hand, QUICK, "foot")
    hand.asked = PressRequest(TILE.sensors_m[2], 400.0)
    with pytest.raises(BadMeasurement, match="sensor 3 responds alone; press in the middle of the tile"):
        all(procedure.feed(hand.read()) is None for _ in range(999))
    assert procedure.page.key == "foot-hold"
    procedure.skip()
    assert "foot_expanded_percent" not in procedure.result.figures


def test_without_a_sensor_no_load_in_the_middle_is_asked_for_and_with_it_again_it_is():
    procedure, hand = FsrProcedure(TILE), Hand()
    walked(procedure, hand, QUICK, "sensor4")
    procedure.skip()
    assert "foot_expanded_percent" not in procedure.result.figures
    procedure.back()
    assert procedure.page.key == "sensor4-tare"
    assert walked(procedure, hand, QUICK, "foot").key == "foot-hold"
    procedure.skip()
    assert procedure.page.last
    procedure.back()
    assert procedure.page.key == "foot-hold"
    assert "foot_expanded_percent" in run(procedure, hand, QUICK).figures
