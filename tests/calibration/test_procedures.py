"""Procedures on presses without a window: from first to last page, refusals on the spot, the way back."""

import msgspec
import numpy as np
import pytest
from exact_hand import TILE, Hand, walked

from underfoot.calibration.procedure import run, step
from underfoot.calibration.procedures.centroid import CentroidProcedure
from underfoot.calibration.procedures.fsr import FsrProcedure
from underfoot.calibration.result import Inconclusive
from underfoot.calibration.rig import PressRequest, Readings
from underfoot.calibration.rigs.simulated_hand import SimulatedHand
from underfoot.errors import BadMeasurement, BadValue, DeviceError
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile

QUICK = {"loadings": 2, "hold_s": 2.0, "full_scale_n": 400.0}


# --- on the simulator, with no hands ---


def test_both_procedures_run_on_the_simulator_from_first_to_last_page():
    hand = SimulatedHand(SimulatedTile(TILE, seed=5), seed=5, rate_hz=100.0)
    seen = []
    result = run(FsrProcedure(TILE), hand, QUICK | {"loadings": 3}, lambda page: seen.append(page))
    assert [seen[k].key for k in (0, -2, -1)] == ["setup", "sensor4-release", "foot-hold"]
    assert [page.share for page in seen] == sorted(page.share for page in seen)
    figures = result.figures
    assert figures["sensors_calibrated"] == 4.0
    assert figures["error_percent"] < 1.15 * figures["bound_percent"]
    assert figures["memory_error_percent"] < 2.0
    assert result.good
    profile = result.apply(Profile(tile="t1"))
    # What is said of a foot holds for steps whose forces are known.
    tile, step_n = SimulatedTile(TILE, seed=5), 500.0 * np.sin(np.pi * np.linspace(0.0, 1.0, 150)) ** 0.5
    forces = np.tile(np.append(step_n, np.zeros(150)), 10)
    at_m = np.repeat(np.random.default_rng(5).uniform(-0.08, 0.08, (10, 2)), 300, axis=0)
    readings = tile.sense(tile.corner_forces(at_m, forces), 250.0)
    error_n = profile.force_over_time(readings, np.arange(forces.size) / 250.0).sum(axis=1) - forces
    expanded_n = 4.0 * figures["foot_expanded_percent"]
    inside = np.abs(error_n[forces > 50.0]) < expanded_n * np.array([[1.0], [0.5]])
    assert inside.mean(axis=1) == pytest.approx([0.95, 0.8], abs=0.05)
    with pytest.raises(BadValue, match="the measured tile is 't1'; allowed: t2, whose profile this is"):
        result.apply(Profile(tile="t2"))
    result = run(
        CentroidProcedure(TILE, profile), hand, {"form": "quick", "loads_n": (100.0, 200.0, 400.0), "falling": "yes"}
    )
    assert result.figures["mean_over_time_mm"] < 5.0
    assert result.figures["mean_after_mm"] < 8.0
    assert result.figures.get("mean_bound_mm", 0.0) <= result.figures["mean_after_mm"]
    assert result.figures["mean_after_mm_falling"] > 0.0
    assert [drawing.title for drawing in result.drawings][:1] == ["Before"]
    done = result.apply(profile)
    assert done.fsr == profile.fsr
    assert done.centroid.over_time is not None
    assert (
        done.centroid.reference
        == f"presses at known places, uncertain by 2 mm (95 %); forces calibrated {profile.fsr.identity}"
    )


def test_the_simulated_hand_presses_where_and_what_it_is_asked():
    tile = SimulatedTile(TILE, seed=2)
    hand = SimulatedHand(tile, seed=2)
    procedure = CentroidProcedure(TILE, None)
    procedure.answer({"form": "quick"})
    for page_place in procedure.page.places_m[:3]:
        hand.press(PressRequest(page_place, 300.0))
        readings = [hand.read() for _ in range(60)][-1]
        assert readings.force_n == pytest.approx(np.full(100, 300.0), rel=0.05)
        hand.press(PressRequest(page_place, 0.0))
        assert np.abs([hand.read() for _ in range(30)][-1].force_n).max() < 1.0


# --- a person's hands ---


def test_known_weights_make_a_curve():
    procedure, hand = FsrProcedure(TILE), Hand(force=False)
    result = run(procedure, hand, {"reference": "known weights", "weights_n": (20.0, 50.0, 100.0, 200.0, 400.0)})
    profile = result.apply(Profile(tile="t1"))
    assert profile.force(np.full(4, 2000.0 + 20.0 * 150.0)) == pytest.approx(np.full(4, 150.0), rel=0.01)


@pytest.mark.parametrize("zero_n", [0.0, 3.5])
def test_the_load_cell_makes_the_same_curve(zero_n):
    """Also one that is off its zero, by less than is refused: it was in all forces."""
    hand = Hand(spoil=lambda readings: np.add(readings.force_n, zero_n, out=readings.force_n))
    result = run(FsrProcedure(TILE), hand, QUICK)
    profile = result.apply(Profile(tile="t1"))
    assert profile.force(np.full(4, 2000.0 + 20.0 * 150.0)) == pytest.approx(np.full(4, 150.0), rel=0.01)
    assert result.figures["error_percent"] < 0.2


def test_a_sensor_that_drifts_while_others_are_loaded_is_named():
    """Its own loads begin with a tare of its own, and the verdict was good."""
    hand = Hand(spoil=lambda readings: np.add(readings.values[:, 2], 10 * readings.time_s, out=readings.values[:, 2]))
    said = run(FsrProcedure(TILE), hand, QUICK).warnings
    assert [words.partition(": ")[0] for words in said] == ["sensor 3 drifts"]


def test_what_a_sensor_crept_before_a_skipped_one_and_what_lay_on_the_tile_at_first_are_no_drift():
    procedure, loaded = FsrProcedure(TILE), iter(range(30))

    def spoil(readings):
        if procedure.page.key == "sensor3-tare":
            is_loaded = next(loaded, None) is not None
            readings.values[:] += [200.0, 0.0, 1000.0 * is_loaded, 0.0]
            readings.force_n[:] += 50.0 * is_loaded

    hand = Hand(spoil=spoil)
    walked(procedure, hand, QUICK, "sensor2-tare")
    procedure.skip()
    assert run(procedure, hand, QUICK).warnings == ("sensor 2 is not calibrated: it has no pairs",)


def test_who_skips_every_sensor_is_told_so_and_can_go_back():
    procedure = FsrProcedure(TILE)
    procedure.answer({})
    for _ in range(3):
        procedure.skip()
    with pytest.raises(BadMeasurement, match="every sensor was skipped"):
        procedure.skip()
    assert procedure.result is None
    procedure.back()
    assert procedure.page.key == "sensor4-tare"


@pytest.mark.parametrize("page", ["sensor2-tare", "sensor2-hold"])
def test_back_after_skip_returns_to_the_skipped_sensor_and_keeps_the_one_before_it(page):
    procedure, hand = FsrProcedure(TILE), Hand()
    walked(procedure, hand, QUICK, "sensor2-tare")
    first = [data.step.page.key for data in procedure.step_data()]
    walked(procedure, hand, QUICK, page)
    procedure.skip()
    assert procedure.page.key == "sensor3-tare"
    procedure.back()
    assert procedure.page.key == "sensor2-tare"
    assert [data.step.page.key for data in procedure.step_data()] == first
    assert run(procedure, hand, QUICK).figures["sensors_calibrated"] == 4.0


@pytest.mark.parametrize(
    ("jump_n", "said"),
    [(1200.0, "the load cell gave 1200 N, where up to 400"), (395.0, "jumped to 395 N for a moment")],
)
def test_a_load_cell_that_jumps_costs_its_page_and_not_the_calibration(jump_n, said):
    procedure, hand = FsrProcedure(TILE), Hand()
    walked(procedure, hand, QUICK, "sensor1-rise2")
    good = hand.read

    def jumping():
        readings = good()
        if 100.0 < readings.force_n[5] < 200.0:
            readings.force_n[5] = jump_n
        return readings

    hand.read = jumping
    with pytest.raises(BadMeasurement, match=said):
        walked(procedure, hand, QUICK, "sensor1-fall2")
    assert procedure.page.key == "sensor1-rise2"
    hand.read, hand.force = good, 0.0
    result = run(procedure, hand, QUICK)
    assert result.figures["full_scale_n"] == pytest.approx(400.0)


@pytest.mark.parametrize(
    ("page", "again", "after"),
    [
        ("tare", "tare", "rise1"),
        ("rise1", "rise1", "fall1"),
        ("fall2", "rise2", "rise3"),
        ("hold", "hold", "release"),
        ("release", "hold", "release"),
    ],
)
def test_a_page_begins_again_after_a_line_that_was_gone(page, again, after):
    """A falling force with its rise: whoever let go meanwhile has nothing left that could fall."""
    procedure, hand = FsrProcedure(TILE), Hand()
    walked(procedure, hand, QUICK | {"loadings": 3}, f"sensor1-{page}")
    assert step(procedure, hand)
    hand.time += 4.0
    with pytest.raises(BadMeasurement, match=r"nothing was read for 4\.0 s"):
        step(procedure, hand)
    assert procedure.page.key == f"sensor1-{again}"
    before_s, hand.force = hand.time, 0.0
    walked(procedure, hand, QUICK, f"sensor1-{after}")
    measured = {data.step.page.key[8:]: data.readings for data in procedure.step_data()}
    assert measured[again].time_s[0] > before_s
    assert page not in measured or measured[page].time_s[0] > before_s


def test_a_line_that_is_silent_is_said_once_and_its_page_begins_again():
    """It was said a second time, as a gap, once the line was back."""
    procedure, hand = FsrProcedure(TILE), Hand()
    walked(procedure, hand, QUICK, "sensor1-fall2")
    assert step(procedure, hand)
    read = hand.read

    def silent():
        raise DeviceError("nothing comes of tile number 0")

    hand.read = silent
    with pytest.raises(DeviceError):
        step(procedure, hand)
    assert procedure.page.key == "sensor1-rise2"
    hand.read = read
    hand.time += 12.0
    assert step(procedure, hand)


def test_weights_out_of_order_are_refused():
    procedure = FsrProcedure(TILE)
    with pytest.raises(BadMeasurement, match="weights out of order: 20 N after 50 N"):
        procedure.answer({"reference": "known weights", "weights_n": (10.0, 50.0, 20.0)})
    assert procedure.page.key == "setup"
    values = {"reference": "known weights", "weights_n": (20.0, 50.0, 100.0)}
    walked(procedure, Hand(force=False), values, "sensor1-weight2")
    with pytest.raises(BadMeasurement, match=r"out of order: 15 N after 20 N on the way up; go back if 20 N was wrong"):
        procedure.answer({"weight_n": 15.0})
    assert procedure.page.questions


def test_40_n_typed_as_400_is_refused_and_can_be_mended():
    procedure, hand = FsrProcedure(TILE), Hand(force=False)
    values = {"reference": "known weights", "weights_n": (10.0, 20.0, 30.0, 40.0, 500.0)}
    walked(procedure, hand, values, "sensor1-weight4")
    procedure.answer({"weight_n": 400.0})
    with pytest.raises(BadMeasurement, match=r"400 N was typed, but sensor 1 reads as under about 4\d N"):
        walked(procedure, hand, values, "sensor1-weight5")
    assert procedure.page.key == "sensor1-weight4"
    procedure.answer({"weight_n": 40.0})
    while procedure.page.key == "sensor1-weight4":
        step(procedure, hand, values)
    assert procedure.page.key == "sensor1-weight5"


@pytest.mark.parametrize(
    ("page", "lies_n", "said"),
    [
        ("weight1", 0.0, "25 N was typed, but sensor 1 reads as with nothing on it; is the weight on it"),
        ("weight3", 50.0, "100 N was typed, but sensor 1 reads as under the 50 N before; is the weight on it"),
        ("weight5", 200.0, "100 N was typed, but sensor 1 reads as under the 200 N before; are those still on it"),
    ],
)
def test_a_weight_that_was_typed_while_another_or_none_was_on_is_refused(page, lies_n, said):
    """The first one was taken for 25 N that change nothing, and 450 N for what 600 read."""
    values = {"reference": "known weights", "weights_n": (25.0, 50.0, 100.0, 200.0)}
    procedure, hand = FsrProcedure(TILE), Hand(force=False)
    walked(procedure, hand, values, f"sensor1-{page}")
    load, hand.load = hand.load, lambda press, force: np.full(force.size, lies_n)
    with pytest.raises(BadMeasurement, match=said):
        walked(procedure, hand, values, "sensor2")
    assert procedure.page.key == f"sensor1-{page}"
    hand.load = load
    walked(procedure, hand, values, "sensor2")


def test_a_silent_sensor_is_refused_and_can_be_skipped():
    procedure = FsrProcedure(TILE)

    def dead(corners):
        counts = 2000.0 + 20.0 * corners
        counts[:, 1] = 730.0
        return counts

    hand = Hand(dead)
    with pytest.raises(BadMeasurement, match=r"sensor 2 gives no signal: it stays at 730 under .*; look at its plug"):
        run(procedure, hand, QUICK)
    assert procedure.page.key == "sensor2-rise1"
    procedure.skip()
    assert procedure.page.key == "sensor3-tare"
    result = run(procedure, hand, QUICK)
    assert not result.good
    assert "sensor 2: it has no pairs" in result.verdict
    assert np.isnan(result.apply(Profile(tile="t1")).force(np.full(4, 3000.0))).tolist() == [False, True, False, False]


@pytest.mark.parametrize(
    ("hand", "said"),
    [
        (Hand(lambda corners: 2000.0 + 20.0 * corners[:, [1, 0, 2, 3]]), "sensor 2 responds when sensor 1 is pressed"),
        (Hand(lambda corners: np.minimum(2000.0 + 300.0 * corners, 65535.0)), "sensor 1 clips: it stays at 65535"),
        (
            Hand(lambda corners: np.where(corners > 150.0, 0.0, 2000.0 + 20.0 * corners)),
            r"sensor 1 goes to 0 at 1\d\d N, against the way of its reading; look for a loose plug or wire",
        ),
        (
            Hand(lambda corners: np.minimum(200.0 + 3.0 * corners, 1023.0)),
            "stays at 1023 .*; does its device send 10 bits",
        ),
        (Hand(force=False), "there is no load cell among the readings"),
    ],
)
def test_what_cannot_be_right_is_refused_on_the_spot(hand, said):
    procedure = FsrProcedure(TILE)
    with pytest.raises(BadMeasurement, match=said):
        run(procedure, hand, QUICK)
    assert procedure.page.key == "sensor1-rise1"
    assert procedure.result is None


@pytest.mark.parametrize(
    ("gain", "said"),
    [
        (0.0, "the load cell gives no force while sensor 1 is pressed: 0 N at most; does the press go through it"),
        (102.0, "the load cell gave 4080 N, where up to 400 N are asked for; .* does it count grams"),
        (-1.0, "the load cell gives -80 N while sensor 1 is pressed; turn the sign of its newtons a count"),
    ],
)
def test_a_load_cell_that_is_silent_or_reversed_is_refused(gain, said):
    class Wrong(Hand):
        def read(self):
            readings = super().read()
            return Readings(readings.time_s, readings.values, gain * readings.force_n)

    with pytest.raises(BadMeasurement, match=said):
        run(FsrProcedure(TILE), Wrong(), QUICK)


@pytest.mark.parametrize(
    ("share", "said"), [(0.0025, r"N\.$"), (1.0 / 9.81, r"N\. .* exceed 41 N: does it count kilograms, or pounds\?$")]
)
def test_who_does_not_press_or_presses_a_cell_in_kilograms_is_given_up(share, said):
    class Absent(Hand):
        def press(self, press):
            super().press(type(press)(press.at_m, share * press.force_n, press.hold_s, press.sensor))

    with pytest.raises(BadMeasurement, match=rf"not complete after 120 s\. Press harder, up to 400 {said}"):
        run(FsrProcedure(TILE), Absent(), QUICK)


def test_back_while_a_load_is_on_asks_to_let_go_and_the_way_down_is_no_rise():
    """By hand a falling page without a load was done at once, so that *Back* never came past it."""
    procedure, hand = FsrProcedure(TILE), Hand()
    walked(procedure, hand, QUICK, "sensor1-fall1")
    procedure.back()
    assert procedure.page.key == "sensor1-rise1"
    step(procedure, hand)
    assert procedure.progress.hint == "Let go, and raise the force from 0 N."
    while hand.force > 0.0:
        hand.press(PressRequest(TILE.sensors_m[0], 0.0))
        procedure.feed(hand.read())
        assert procedure.page.key == "sensor1-rise1"
    walked(procedure, hand, QUICK, "sensor1-rise2")
    rises = [data.readings.force_n for data in procedure.step_data() if "rise" in data.step.page.key]
    assert rises[-1][-1] == pytest.approx(400.0, rel=0.05)


def test_back_forgets_what_was_taken_and_a_page_with_a_press_takes_nothing_else():
    procedure, hand = FsrProcedure(TILE), Hand()
    procedure.back()
    assert procedure.page.key == "setup"
    walked(procedure, hand, QUICK, "sensor1-rise2")
    assert procedure.drawings
    procedure.back()
    assert procedure.page.key == "sensor1-rise1"
    first = run(procedure, hand, QUICK)
    assert first.figures["error_percent"] < 0.5
    procedure.back()
    assert procedure.result is None
    with pytest.raises(BadValue, match="takes a press, not an answer"):
        procedure.answer({})
    with pytest.raises(BadValue, match="takes no recording"):
        procedure.take_recording(np.zeros(3))


def test_answers_are_checked():
    procedure = FsrProcedure(TILE)
    for values, said in (
        ({"reference": "thumb"}, "reference is 'thumb'; allowed: load cell, known weights"),
        ({"full_scale_n": -3.0}, "full_scale_n is -3.0; allowed: 5 to 5000 N"),
        ({"colour": 3}, "does not ask for colour"),
    ):
        with pytest.raises(BadValue, match=said):
            procedure.answer(values)
    assert procedure.page.key == "setup"


# --- the centroid ---


def newtons(**more):
    return Hand(lambda corners: corners, **more)


def test_readings_that_are_newtons_need_no_profile():
    result = run(CentroidProcedure(TILE), newtons(force=False), {"form": "quick"})
    assert result.figures["worst_after_mm"] < 0.5
    assert result.figures["presses"] == 27.0
    name, header, rows = result.raw[0]
    assert (name, header.count(",") + 1, rows.shape) == ("presses", 12, (27, 11))


@pytest.mark.parametrize(("times", "warned"), [(0.9, False), (1.3, True)])
def test_a_load_cell_that_disagrees_with_the_calibrated_sensors_is_named(times, warned):
    warnings = run(CentroidProcedure(TILE), Hand(lambda corners: times * corners), {"form": "quick"}).warnings
    assert warned == any("add up to 1.3 times what the load cell gives" in line for line in warnings)


def test_back_repeats_one_place_and_keeps_the_others():
    """The third of nine places is pressed wrongly: it alone is pressed again. The last one is left out."""
    hand, quick = newtons(), {"form": "quick"}
    procedure = CentroidProcedure(TILE)
    walked(procedure, hand, quick, "place3-150")
    hand.counts = lambda corners: corners * [1.0, 1.0, 1.0, 1.6]
    walked(procedure, hand, quick, "place4-150")
    assert "at x -132.5 mm, y 0 mm, and" in procedure.page.instruction  # as the picture says it
    hand.counts = lambda corners: corners
    walked(procedure, hand, quick, "place9-300")
    for place in range(9, 2, -1):
        procedure.back()
        assert procedure.page.key == f"place{place}-150"
    assert procedure.page.share > 0.8
    assert len(procedure.step_data()) == 1 + 8 * 3
    result = run(procedure, hand, quick)
    assert (result.figures["presses"], result.figures["worst_after_mm"] < 0.5) == (27.0, True)
    procedure.back()
    assert (procedure.page.key, procedure.result) == ("place9-150", None)
    procedure.skip()
    assert procedure.page.key == "release"
    assert run(procedure, hand, quick).figures["presses"] == 24.0


def test_what_still_drifts_from_older_loads_is_taken_off():
    class Drifting(Hand):
        def read(self):
            readings = super().read()
            drift = np.outer(60.0 - 0.3 * readings.time_s, [1.0, 0.0, 0.3, 0.0])
            return Readings(readings.time_s, readings.values + drift, readings.force_n)

    procedure = CentroidProcedure(TILE)
    run(procedure, Drifting(lambda corners: corners), {"form": "quick"})
    found = procedure.accuracy
    assert found.errors_mm(found.before_m).max() < 0.3


def test_one_s_own_places_are_pressed():
    own = ((0.0, 0.0), (0.1, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.1, -0.1), (0.05, 0.0))
    procedure = CentroidProcedure(TILE)
    run(procedure, newtons(), {"pattern": "own", "places_m": own, "loads_n": (100.0, 300.0)})
    assert {tuple(place) for place in procedure.accuracy.at_m} == set(own)
    with pytest.raises(BadValue, match="at least 6 places of your own"):
        CentroidProcedure(TILE).answer({"pattern": "own", "places_m": own[:3]})
    with pytest.raises(BadMeasurement, match="loads out of order"):
        CentroidProcedure(TILE).answer({"loads_n": (300.0, 100.0)})


def test_a_place_beside_a_narrow_tile_is_refused():
    narrow = msgspec.structs.replace(TILE, size_m=(0.6, 0.3))
    own = [(0.29, 0.1), (-0.29, 0.1), (0.0, 0.14), (0.0, -0.14), (0.1, 0.0), (0.0, 0.0)]
    CentroidProcedure(narrow).answer({"pattern": "own", "places_m": own})
    with pytest.raises(BadValue, match=r"y m -0\.15 to 0\.15"):
        CentroidProcedure(narrow).answer({"pattern": "own", "places_m": [*own, (0.0, 0.2)]})


def test_a_press_at_another_place_and_an_unsteady_one_are_refused():
    swapped = Hand(lambda corners: corners[:, [2, 3, 0, 1]])
    with pytest.raises(BadMeasurement, match="mm from where it was asked for"):
        run(CentroidProcedure(TILE), swapped, {"form": "quick"})
    draws = np.random.default_rng(0)
    shaking = newtons(load=lambda press, force: force * (1.0 + 0.15 * draws.standard_normal(force.size)), force=False)
    with pytest.raises(BadMeasurement, match="the press is unsteady: its force varies by"):
        run(CentroidProcedure(TILE), shaking, {"form": "quick", "loads_n": (100.0,)})


@pytest.mark.parametrize(
    ("sensors", "bear"), [([0, -1, 2, 3], "0, 0, 99, 0"), ([0, 1, 3, 2], "0, 0, 0, 99")], ids=["2 dead", "3, 4 swapped"]
)
def test_what_each_sensor_bears_of_a_refused_press_is_told(sensors, bear):
    """A dead one was told as another place, and then a swapped one, which bears nothing of it either, as dead."""
    hand = Hand(lambda corners: np.column_stack([corners, 0.0 * corners[:, 0]])[:, sensors])
    with pytest.raises(BadMeasurement, match=f"swapped, loose or dead. Sensors 1 to 4 bear {bear} % of it; sensor"):
        run(CentroidProcedure(TILE), hand, {"form": "quick"})


def test_presses_that_lead_to_no_result_are_not_lost():
    own = tuple((0.038 * np.cos(turn), 0.038 * np.sin(turn)) for turn in range(6))
    procedure = CentroidProcedure(TILE)
    swapped = Hand(lambda corners: corners[:, [1, 0, 3, 2]])
    with pytest.raises(Inconclusive, match="sensors 1 and 2 and 3 and 4 look swapped") as refused:
        run(procedure, swapped, {"pattern": "own", "places_m": own, "loads_n": (100.0, 300.0)})
    measured = procedure.without_conclusion(str(refused.value))
    name, header, rows = measured.raw[0]
    assert (name, header.count(",") + 1, rows.shape) == ("presses", 12, (12, 11))
    assert (measured.good, measured.quantities, measured.verdict) == (False, (), str(refused.value))
    assert procedure.page.key == "release"
    assert procedure.result is None


def test_a_tile_that_is_silent_under_load_is_refused():
    with pytest.raises(BadMeasurement, match="no signal: the sensors add up to 0 N"):
        run(CentroidProcedure(TILE), Hand(lambda corners: 0.0 * corners), {"form": "quick"})
