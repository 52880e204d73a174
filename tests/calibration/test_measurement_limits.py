"""Where a measurement is refused as implausible, and what may just pass."""

import re
from dataclasses import replace

import numpy as np
import pytest
from exact_hand import TILE, Hand

from underfoot.calibration.procedure import run
from underfoot.calibration.procedures.centroid import CentroidProcedure
from underfoot.calibration.procedures.fsr import FsrProcedure
from underfoot.calibration.rigs.simulated_hand import SimulatedHand
from underfoot.calibration.science.centroid_fit import centroid
from underfoot.calibration.science.clicks import click_delays, click_train
from underfoot.calibration.science.load_checks import require_response, require_weight
from underfoot.calibration.science.pair_plausibility import require_plausible
from underfoot.calibration.science.plate_stiffness import line_of
from underfoot.calibration.science.press_checks import is_steady, require_place, require_signal, require_unclipped
from underfoot.calibration.science.recording_checks import require_not_silent, require_same_sweep
from underfoot.calibration.science.response import equalise, flatness_db, usable_band_hz
from underfoot.calibration.science.sweep import train
from underfoot.calibration.science.tones import harmonics, tone_series
from underfoot.errors import BadMeasurement, BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile

UNKNOWN_WAYS = (0.0, 0.0, 0.0, 0.0)
"""Of four sensors that had no load yet."""
REST = np.full(4, 1000.0)


def weighed(given_n, change=2000.0, other=0.0, apparent_n=None):
    """A weight over the first of four sensors of 200 N, the change of its reading, and that of another one's."""
    require_weight(
        0, given_n, REST + np.array([change, other, 0.0, 0.0]), REST, 200.0, (2.0, 0.0), apparent_n, UNKNOWN_WAYS
    )


@pytest.mark.parametrize("ratio", [0.4, 2.5])
def test_a_weight_may_differ_from_what_its_reading_suggests(ratio):
    weighed(100.0 * ratio, apparent_n=100.0)


@pytest.mark.parametrize("ratio", [0.3, 3.5])
def test_a_weight_is_refused_at_about_three_times_what_its_reading_suggests(ratio):
    with pytest.raises(BadMeasurement, match="reads as under about 100 N; check the weight"):
        weighed(100.0 * ratio, apparent_n=100.0)


def test_a_sensor_is_silent_that_changes_by_a_few_counts_under_a_third_of_full_scale():
    weighed(40.0, change=15.0)
    weighed(70.0, change=45.0)
    with pytest.raises(BadMeasurement, match="sensor 1 gives no signal"):
        weighed(70.0, change=15.0)


def test_another_sensor_responds_if_it_changes_by_more_than_noise():
    weighed(40.0, change=100.0, other=300.0)
    with pytest.raises(BadMeasurement, match="sensor 2 responds when sensor 1 is loaded; is the load over sensor 1"):
        weighed(40.0, change=300.0, other=900.0)
    with pytest.raises(BadMeasurement, match=r"their wires swapped, or does sensor 1 give no signal\? Then look at"):
        weighed(40.0, change=3.0, other=900.0)
    swapped = REST + np.array([1000.0, 8000.0, 600.0, 700.0])  # a little of a load goes to all: 'all sensors respond'
    with pytest.raises(BadMeasurement, match=r"sensor 2 responds .* are their wires swapped"):
        require_weight(0, 40.0, swapped, REST, 200.0, (2.0, 0.0), None, UNKNOWN_WAYS)


def test_two_sensors_that_read_alike_are_told_where_one_of_them_is_loaded():
    """Of a channel that was read twice the calibration ended with the other sensor as dead."""
    weighed(40.0, change=9000.0, other=6000.0)
    with pytest.raises(BadMeasurement, match=r"sensor 2 responds nearly as sensor 1 .* is one channel read twice"):
        weighed(40.0, change=9000.0, other=6600.0)


def test_light_weights_stand_beside_a_sensor_that_goes_back_from_heavy_ones():
    """It had crept, and went back by as much as 5 N change the next one's reading: both were 'nearly alike', at once of
    half of all good series."""
    crept = REST + np.array([600.0, -700.0, 0.0, 0.0])
    require_weight(0, 5.0, crept, REST, 200.0, (2.0, 0.0), None, (0, 1, 0, 0))
    with pytest.raises(BadMeasurement, match=r"sensor 2 responds nearly as sensor 1"):  # as loads of its own move it
        require_weight(0, 5.0, crept, REST, 200.0, (2.0, 0.0), None, (0, -1, 0, 0))
    hand = SimulatedHand(SimulatedTile(TILE, seed=1), rate_hz=100.0)
    weights = {"reference": "known weights", "weights_n": (5.0, 50.0, 200.0)}
    assert run(FsrProcedure(TILE), hand, weights).part is not None


def test_who_stood_on_the_tile_that_was_to_be_empty_is_asked_about():
    """The next weight was said to be missing, or wires to be swapped."""
    readings = REST + np.array([2000.0, 100.0, 300.0, 100.0])
    require_weight(0, 40.0, readings, REST, 200.0, (2.0, 0.0), None, UNKNOWN_WAYS)
    with pytest.raises(BadMeasurement, match=r"sensor 2 responds .* or does sensor 1 give no signal"):
        require_weight(0, 40.0, REST + np.array([5.0, 500.0, 450.0, 0.0]), REST, 200.0, (2.0, 0.0), None, UNKNOWN_WAYS)
    with pytest.raises(BadMeasurement, match=r"all sensors respond .* was the tile empty before"):
        require_weight(0, 40.0, readings, REST + 6000.0, 200.0, (2.0, 0.0), None, UNKNOWN_WAYS)


@pytest.mark.parametrize(("full_n", "plausible"), [(0.3, False), (1.0, True), (15_000.0, True), (25_000.0, False)])
def test_full_scale_is_that_of_a_floors_sensor(full_n, plausible):
    share = np.tile(np.linspace(0.0, 1.0, 50), 2)
    table = [(np.arange(100) * 0.02, 30_000.0 * share, full_n * share)]
    if plausible:
        require_plausible(table)
    else:
        with pytest.raises(BadValue, match="is it in newtons"):
            require_plausible(table)


def test_a_press_is_steady_or_waited_for_or_given_up():
    assert is_steady(0.03, 0.004, 1.0)
    assert not is_steady(0.08, 0.004, 1.0)
    assert not is_steady(0.03, 0.010, 1.0)
    assert not is_steady(0.08, 0.010, 15.0)
    with pytest.raises(BadMeasurement, match=r"its force varies by 8 %, its place by 10 mm"):
        is_steady(0.08, 0.010, 25.0)


def test_hum_of_the_mains_is_named_in_place_of_the_hand():
    """Forces passed it, and Places told who pressed to hold still."""

    def humming(swing):  # 50 Hz, read at 100 Hz
        wave = swing * np.array([1.0, -1.0] * 5)
        return lambda readings: np.add(readings.values[:, 1], wave, out=readings.values[:, 1])

    *_, said = run(FsrProcedure(TILE), Hand(spoil=humming(160.0)), {"loadings": 1, "hold_s": 3.0}).warnings
    assert re.match("sensor 2 swings by [78] N with nothing on the tile: look for hum of the mains", said)
    hand = Hand(lambda corners: corners, spoil=humming(9.0))
    with pytest.raises(BadMeasurement, match="a sensor swings by 9 N on the empty tile: look for hum of the mains"):
        run(CentroidProcedure(TILE), hand, {"form": "quick", "loads_n": (100.0,)})


@pytest.mark.parametrize(("from_n", "advice"), [(400.0, "choose a smaller full scale"), (3.0, "look for hum")])
def test_a_reading_that_clips_under_nearly_nothing_needs_no_smaller_full_scale(from_n, advice):
    """Hum of 1000 counts reached the end of the range at 3 of 600 N."""
    force = np.linspace(0.0, 500.0, 501)
    readings = np.tile(REST, (501, 1))
    readings[:, 0] = np.where(force < from_n, 1000.0 + 20.0 * force, 65535.0)
    with pytest.raises(BadMeasurement, match=rf"clips: it stays at 65535 above {from_n:.0f} N; {advice}.* or take"):
        require_response(0, REST, readings, force, 600.0)


def test_a_press_elsewhere_is_refused_from_some_centimetres_on():
    corners = np.array([[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]])
    require_place(np.array([45.0, 25.0, 5.0, 25.0]), corners, (0.0, -0.02), "")  # at (0.04, 0.04)
    with pytest.raises(
        BadMeasurement,
        match="measured 100 mm from where it was asked for: another place, or a sensor swapped, loose or dead",
    ):
        require_place(np.array([60.0, 30.0, 5.0, 5.0]), corners, (0.03, -0.02), "")  # at (0.03, 0.08)


def test_sensors_are_silent_that_give_a_twentieth_of_the_load():
    require_signal(100.0, np.full(9, 100.0), np.full((9, 4), 4.0), "")
    with pytest.raises(BadMeasurement, match="no signal: the sensors add up to 5 N under 100 N; sensor 3, the nearest"):
        require_signal(100.0, np.full(9, 100.0), np.full((9, 4), 1.25), "sensor 3, the nearest, reads 0")


@pytest.mark.parametrize(
    ("cell", "said"), [(True, "no signal: the sensors add up to"), (False, "Press with 150 N. If")]
)
def test_a_dead_sensor_under_the_first_place_is_named(cell, said):
    """It was 'no signal' of none, and without a load cell, after two minutes, 'Press harder'."""
    dead = Hand(lambda corners: corners * [1.0, 1.0, 0.0, 1.0], force=cell, reach=1.13)  # right above the sensor
    with pytest.raises(BadMeasurement, match=rf"{said}.* sensor 3, the nearest, reads 0, and 0 .*: look at its plug"):
        run(CentroidProcedure(TILE), dead, {"form": "quick"})


def test_a_load_cell_in_kilograms_is_told_by_calibrated_sensors_at_once():
    """Places said 'Press with 100 N' for two minutes."""
    forces = np.tile([70.0, 20.0, 10.0, 0.0], (9, 1))
    require_signal(100.0, np.full(9, 40.0), forces, "")
    said = r"the load cell gives 10\.2 N, and the sensors add up to 100 N: does it .*1 to 4 give 70, 20, 10, 0 N$"
    with pytest.raises(BadMeasurement, match=said):
        require_signal(100.0, np.full(9, 100.0 / 9.81), forces, "")


def test_a_sensor_clips_whose_rest_is_elsewhere():
    readings = np.tile([65535.0, 3000.0, 3000.0, 3000.0], (20, 1))
    require_unclipped(readings, np.array([65535.0 - 200.0, 0.0, 0.0, 0.0]))
    with pytest.raises(BadMeasurement, match="sensor 1 clips"):
        require_unclipped(readings, np.array([65535.0 - 900.0, 0.0, 0.0, 0.0]))


def test_a_sensor_clips_that_stands_still_at_its_largest_reading_whatever_its_bits():
    """One of 12 bits passed, which does not reach the end of 16; coarse ones that all stand still are no proof."""
    steady = np.tile([3000.0, 3000.0, 3000.0, 3000.0], (50, 1))
    require_unclipped(steady, np.zeros(4))
    trembling = steady + np.round(30.0 * np.sin(np.arange(50.0)))[:, None]
    require_unclipped(trembling, np.zeros(4))
    for readings, at, question in ((steady, 4095.0, "does its device send 12 bits"), (trembling, 3500.0, "")):
        clipped = readings.copy()
        clipped[:, 2] = at
        with pytest.raises(BadMeasurement, match=f"sensor 3 clips: its reading stays at {at:.0f};.*{question}"):
            require_unclipped(clipped, np.zeros(4))
    require_unclipped(np.array([[1969.0, 3955.0, 4095.0, 2893.0]]), np.zeros(4))  # a press that just began
    light = trembling.copy()
    light[:, 2] = 500.0  # coarse, and hardly loaded
    require_unclipped(light, np.zeros(4))
    settling = 1.0 - 0.04 * np.exp(-0.2 * np.arange(100.0))
    require_unclipped(
        np.round(np.outer(settling, [520.0, 511.0, 480.0, 470.0])), np.zeros(4)
    )  # at last all stand still


@pytest.mark.parametrize("reference", ["load cell", "known weights"])
def test_what_others_bear_of_loads_beside_their_sensors_is_taken_off_and_named(reference):
    """Forces were up to 23 % too large, and the verdict said nothing: a stack of weights cannot stand over a corner."""
    values = {"reference": reference, "loadings": 1, "hold_s": 2.0, "weights_n": (50.0, 100.0, 200.0, 300.0, 600.0)}
    found = run(FsrProcedure(TILE), Hand(reach=0.8), values)
    corners = np.array([40.0, 80.0, 160.0, 320.0])
    assert found.apply(Profile(tile=TILE.id)).force(2000.0 + 20.0 * corners) == pytest.approx(corners, rel=0.02)
    assert "carried a share of the loads over sensor 1 (19 %), sensor 2 (19 %)" in " ".join(found.warnings)


def test_weights_each_twice_the_one_before_are_known_to_have_been_taken_off():
    """The verdict said that forces were measured while they rose alone: what fell was half of full scale, not more."""
    values = {"reference": "known weights", "weights_n": (150.0, 300.0, 600.0)}
    assert "rose alone" not in run(FsrProcedure(TILE), Hand(force=False), values).verdict


def test_the_next_tare_waits_for_the_last_known_weight_to_be_taken_off():
    """It stands over another sensor, and was read as nothing on the tile."""
    tile = default_floor().tiles[0]
    procedure, hand = FsrProcedure(tile), SimulatedHand(SimulatedTile(tile))
    procedure.answer({"reference": "known weights", "weights_n": (25.0, 50.0, 100.0)})

    def press(request):
        hand.press(request)
        procedure.feed(replace(hand.read(), force_n=None))

    while procedure.page.key != "sensor2-tare":
        if procedure.page.questions:
            procedure.answer({})
        weight = procedure.page.press
        press(weight)
    for _ in range(30):
        press(weight)
    assert procedure.progress.hint == "The weight over sensor 1 is still on it; take it off."
    while procedure.page.key == "sensor2-tare":
        press(procedure.page.press)


def test_a_recording_is_silent_below_the_last_bit_of_sixteen():
    """One bit of 16 is 3e-5 of full scale; a good converter hears a third of that."""
    tone = np.sin(np.arange(4800) / 10.0)
    require_not_silent(2e-5 * tone)
    with pytest.raises(BadMeasurement, match="is the accelerometer connected"):
        require_not_silent(5e-6 * tone)


@pytest.mark.parametrize(("late_ms", "same"), [(20.0, True), (60.0, False)])
def test_octaves_that_arrive_late_are_of_another_sweep(late_ms, same):
    """An impulse whose octaves above 1 kHz come later; where they are not above the noise, that says nothing."""
    f = np.fft.rfftfreq(16_000, 1.0 / 16_000.0)
    response = np.fft.irfft(np.exp(-2j * np.pi * f * np.where(f > 1000.0, 0.1 + 1e-3 * late_ms, 0.1)))
    grid_hz = np.array([20.0, 999.0, 1001.0, 4000.0])
    require_same_sweep(response, 16_000.0, grid_hz, np.array([0.0, 0.0, 1.0, 1.0]))
    unknown = np.full(4, np.nan)
    if same:
        require_same_sweep(response, 16_000.0, grid_hz, unknown)
    else:
        with pytest.raises(BadMeasurement, match=r"some octaves arrive (59|60|61) ms later"):
            require_same_sweep(response, 16_000.0, grid_hz, unknown)


def test_an_octave_that_swells_before_the_response_begins_is_not_late():
    """Its envelope, as wide as a low octave's is, came round at the end: 1 in 260 made tiles was refused."""
    t_s = np.arange(-40, 4000) / 8000.0
    response = np.where(t_s >= 0.0, np.cos(1508.0 * t_s + 1.5) * np.exp(-20.4 * np.maximum(t_s, 0.0)), 0.0)
    response[40] += 10.0
    require_same_sweep(response, 8000.0, np.array([10.0, 2000.0]), np.full(2, np.nan))


SIGNAL = np.linspace(0.0, 1.0, 100)
TRAIN, ONSETS = click_train(20, 48_000.0, 0.5)


@pytest.mark.parametrize(
    ("call", "name"),
    [
        (lambda: click_train(0, 48_000.0, 0.5), "count"),
        (lambda: click_train(5, 48_000.0, np.nan), "level"),
        (lambda: click_train(5, 0.0, 0.5), "rate_hz"),
        (lambda: click_delays(TRAIN, ONSETS[:0], TRAIN, 48_000.0), "onsets"),
        (lambda: click_delays(TRAIN, ONSETS + 0.5, TRAIN, 48_000.0), "onsets"),
        (lambda: click_delays(TRAIN[:, None], ONSETS, TRAIN, 48_000.0), "played"),
        (lambda: train(np.ones((3, 2)), 2, 48_000.0), "sweep"),
        (lambda: train(SIGNAL, 2, 48_000.0, -1.0), "quiet_s"),
        (lambda: tone_series(0.5, 48_000.0, -1.0), "quiet_s"),
        (lambda: tone_series(0.5, 0.0, 0.1), "rate_hz"),
        (lambda: harmonics(SIGNAL, 0.0, 48_000.0), "frequency_hz"),
        (lambda: harmonics(SIGNAL, 300.0, 0.0), "rate_hz"),
        (lambda: line_of(0.5, SIGNAL, SIGNAL[1:]), "displacement_mm"),
        (lambda: line_of(0.5, SIGNAL[:, None], SIGNAL), "force_n"),
        (lambda: line_of(np.nan, SIGNAL, SIGNAL), "position"),
        (lambda: centroid(np.ones((5, 3)), np.ones((4, 2))), "forces_n"),
        (lambda: centroid(np.ones((5, 4)), np.ones((3, 2))), "sensors_m"),
        (lambda: flatness_db(SIGNAL, SIGNAL[1:]), "relative_db"),
        (lambda: usable_band_hz(SIGNAL[:0], SIGNAL[:0]), "relative_db"),
        (lambda: equalise(np.array([[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]]), np.ones((9, 2))), "signal"),
    ],
)
def test_what_a_script_gives_in_a_wrong_shape_is_named_in_one_line(call, name):
    """NumPy said something of its own, or the answer was wrong."""
    with pytest.raises(BadValue, match=rf"^{name} is .*; allowed: [^\n]+$"):
        call()
