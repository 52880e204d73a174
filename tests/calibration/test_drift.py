"""A calibration that differs from the one before: named in the report, by the command, and in the window."""

from dataclasses import replace

import pytest
from made_curves import line
from PySide6.QtWidgets import QWidget

from underfoot.calibration.files.report import write_report
from underfoot.calibration.result import Result
from underfoot.calibration.results.drift import drift
from underfoot.commands.tile_options import TileOptions
from underfoot.floor.profile import Fsr, Latency, PlateStiffness, Profile, Response
from underfoot.quantities import pretty_text
from underfoot.widgets.calibrate.result_view import ResultView


def response(level, percent=1.5, **others):
    """A part of this level, uncertain by three such parts, 2 * 1.5 * sqrt(3) = 5.2 % (k = 2)."""
    names = ("repeatability", "flatness", "linearity")
    figures = {f"acceleration_{name}_percent": percent for name in names} | {"acceleration_reference_percent": 5.0}
    measured = {"acceleration_per_unit": level, "frequencies_hz": (100.0,), "magnitude": (level,), "figures": figures}
    return Response(made="2026-03-04", **(measured | others))


@pytest.mark.parametrize(
    ("now", "told"),
    [
        (response(32.2), ""),  # 7.3 %, of 2 * 1.5 * sqrt(6) = 7.35 %
        (response(32.4), "acceleration at full scale is 8 % more than on 2026-03-04, beyond the 7.3 % of both (k = 2)"),
        (response(27.0), "acceleration at full scale is 10 % less than on 2026-03-04"),
        (response(60.0, load="standing"), ""),  # another load is no drift
        (response(60.0, simulated=True), ""),  # nor is hardware after a rehearsal, or before one
        (response(60.0, figures={}), ""),  # of files nothing is known
    ],
)
def test_a_level_drifts_by_more_than_both_are_uncertain_without_the_accelerometer(now, told):
    found = drift(now, response(30.0))
    assert found.startswith(told)
    assert bool(found) == bool(told)


def plate(*stiffness_n_mm, positions=(0.0, 0.5, 1.0), percent=1.0):
    """A part whose footsteps are off their mean by so much: two differ beyond 2 * sqrt(2) = 2.8 % (k = 2)."""
    return PlateStiffness(
        made="2026-03-04",
        positions=positions,
        stiffness_n_mm=stiffness_n_mm,
        error=percent,
        error_unit="%",
        figures={"mean_error_percent": percent},
    )


@pytest.mark.parametrize(
    ("now", "before", "told"),
    [
        (plate(40.0, 82.0, 160.0), plate(40.0, 80.0, 160.0), ""),
        (plate(40.0, 73.6, 158.0), plate(40.0, 80.0, 160.0), "at position 0.5 the plate is 8 % softer than on 2026-03"),
        (plate(40.0, 86.0, 160.0, percent=5.0), plate(40.0, 80.0, 160.0), ""),
        (plate(40.0, 80.0, 160.0), plate(40.0, 80.0, positions=(0.0, 0.5)), ""),  # nothing is known of 1
        (plate(40.0, 80.0, 160.0), plate(40.0, 160.0, positions=(0.0, 1.0)), ""),  # 80 is between the logarithms
        (Latency(made="2026-03-04", round_trip_ms=9.4), Latency(made="2026-03-04", round_trip_ms=9.0), ""),
        (
            Latency(made="2026-03-04", round_trip_ms=11.7),
            Latency(made="2026-03-04", round_trip_ms=9.0),
            "the round trip is 2.7 ms longer",
        ),
        (Latency(made="2026-03-04", round_trip_ms=11.7, block=64), Latency(made="2026-03-04", round_trip_ms=9.0), ""),
    ],
)
def test_a_plate_drifts_beyond_what_footsteps_are_off_and_a_round_trip_at_one_block_beyond_steady(now, before, told):
    found = drift(now, before)
    assert found.startswith(told)
    assert bool(found) == bool(told)


def forces(made, *gains_n):
    """A part of four straight curves, newtons a thousand counts, up to 400 N."""
    return Fsr(made=made, sensors=tuple(line(slope=n / 1e3, rest=0.0, full=400.0) for n in gains_n))


def test_a_sensor_that_has_aged_is_named_in_the_report_by_the_command_and_in_the_window(tmp_path, qtbot, capsys):
    """36 N more at 400 N are 9 % / sqrt(3) of it, a root mean square; those of sensor 2 are 1.1, as hands differ."""
    before, now = forces("2026-03-04", 20.0, 20.0, 20.0, 20.0), forces("2026-09-01", 20.0, 20.4, 22.0, 20.0)
    assert drift(now, None) == drift(before, before) == ""
    result = Result("fsr", "Forces", (("full_scale_n", 400.0, "N"),), "", good=True, part=now)
    known = Profile(tile="t1").with_part(before)
    line = "forces differ from those of 2026-03-04 by more than 2 % of full scale: sensor 3 (5 %);"
    assert pretty_text(line) in write_report(result, tmp_path, result.apply(known)).read_text()
    TileOptions().conclude(result, known)
    assert line in capsys.readouterr().err
    parent = QWidget()
    qtbot.addWidget(parent)
    view = ResultView(parent)
    view.show_result(result, before, simulated=False)
    assert pretty_text(line) in view.warnings.text()
    view.show_result(replace(result), before, simulated=True)
    assert not view.warnings.text()
