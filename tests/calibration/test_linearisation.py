"""From pairs to newtons: sensors of many laws, held to loadings that the fit has not seen."""

from functools import cache

import made_sensors
import numpy as np
import pytest

from workbench.calibration.linearisation import Divider, linearise
from workbench.calibration.tables import Pairs
from workbench.errors import BadValue
from workbench.floor.profile import Profile


def pairs(rows):
    return Pairs("t1", rows[:, 0], rows[:, 1].astype(int), rows[:, 2], rows[:, 3])


@cache
def fitted(law):
    """Four sensors of a law and of different gains, and their fit."""
    return linearise(pairs(made_sensors.pairs_rows(law)))


def four_alike(rows):
    """The pairs of one sensor as those of four, one after the other."""
    return np.concatenate([rows + np.array([400.0 * j, j, 0.0, 0.0]) for j in range(4)])


def profile_of(found):
    return Profile(tile="t1").with_part(found.part("made"))


def unseen_error_percent(profile, law, width=0.0, over_time=False, gain=1.0, sensor=1):
    time_s, force = made_sensors.loadings(100.0, 77)
    reading = made_sensors.read(law, made_sensors.lagging(force, width), 78, gain)
    four = np.repeat(reading[:, None], 4, axis=1)
    newtons = profile.force_over_time(four, time_s) if over_time else profile.force(four)
    loaded = force > 2.0
    return 100.0 * np.sqrt(np.mean((newtons[loaded, sensor] - force[loaded]) ** 2)) / made_sensors.FULL_N


@pytest.mark.parametrize("law", made_sensors.LAWS)
def test_every_law_is_found_to_half_a_percent_on_loadings_not_seen(law):
    found = fitted(law)
    assert found.calibrated == (0, 1, 2, 3)
    assert found.error_percent < 0.5
    assert unseen_error_percent(profile_of(found), law) < 0.5
    assert found.good


def test_the_law_that_made_the_readings_is_chosen_where_it_is_simple():
    for law, name in (("logarithm", "exponential"), ("divider that falls", "rational"), ("power", "power")):
        found = fitted(law)
        assert [sensor.curve.law for sensor in found.sensors] == [name] * 4


def test_a_known_divider_gives_the_resistance_law_its_constants():
    time_s, force = made_sensors.loadings(100.0, 0)
    with np.errstate(divide="ignore"):
        resistance = 1e5 / force + 300.0
    reading = 65535.0 * 2000.0 / (2000.0 + resistance)
    rows = np.stack([time_s, np.zeros(force.size), reading, force], axis=1)
    rows = four_alike(rows)
    found = linearise(pairs(rows), Divider(2000.0))
    assert dict(found.sensors[0].tried)["resistor"] < 1e-3
    curve = found.sensors[0].curve
    assert curve.law == "resistor"
    assert curve.parameters == pytest.approx({"rs_ohm_n": 1e5, "r0_ohm": 300.0}, rel=1e-3)
    assert "resistor" not in dict(linearise(pairs(rows)).sensors[0].tried)


def test_hysteresis_bounds_the_curve_and_the_memory_goes_past_it():
    width = 0.08
    found = linearise(pairs(made_sensors.pairs_rows("soft conductance", width=width, gains=(1.0,) * 4)))
    figures = {name: value for name, value, _ in found.quantities}
    # Half the gap, with loads spread evenly up to full scale: 4 % / sqrt(3); less, for the gap closes at each top.
    assert 0.7 < figures["bound_percent"] / (100.0 * 0.5 * width / np.sqrt(3.0)) < 1.0
    assert figures["bound_percent"] < found.error_percent < 1.15 * figures["bound_percent"]
    assert figures["hysteresis_percent"] == pytest.approx(100.0 * width, rel=0.3)
    assert figures["memory_error_percent"] < 0.6 * found.error_percent
    static = unseen_error_percent(profile_of(found), "soft conductance", width)
    assert unseen_error_percent(profile_of(found), "soft conductance", width, over_time=True) < 0.8 * static


def test_creep_is_measured_and_repeated_loads_repeat():
    time_s, force = made_sensors.loadings(100.0, 3)
    hold = np.concatenate([np.linspace(0.0, 120.0, 100), np.full(3000, 120.0), np.linspace(120.0, 0.0, 100)])
    force = np.concatenate([force, hold, np.zeros(50)])
    time_s = np.arange(force.size) / 100.0
    held = np.clip(time_s - time_s[-3150], 0.01, None)
    felt = np.where(force > 119.0, force * (1.0 + 0.05 * np.log10(np.maximum(held, 0.1) / 0.1)), force)
    felt[: force.size - hold.size - 50] = force[: force.size - hold.size - 50]
    rows = np.stack([time_s, np.zeros(force.size), 32768.0 + 60.0 * felt, force], axis=1)
    rows = four_alike(rows)
    figures = {name: value for name, value, _ in linearise(pairs(rows), memories=False).quantities}
    assert figures["creep_percent_decade"] == pytest.approx(5.0, rel=0.15)
    assert figures["repeatability_percent"] < 0.3


def test_rest_is_nought_and_nothing_is_wild_beyond_the_pairs():
    for law in made_sensors.LAWS:
        found = fitted(law)
        profile = profile_of(found)
        rest = [sensor.curve.rest for sensor in found.sensors]
        assert profile.force(rest) == pytest.approx(np.zeros(4), abs=1e-6)
        everything = profile.force(np.repeat(np.arange(0.0, 65536.0, 50.0)[:, None], 4, axis=1))
        assert np.all(everything >= -0.1 * found.full_scale_n - 1e-9)
        assert np.all(everything <= 1.25 * found.full_scale_n + 1e-9)
        steps = np.diff(everything, axis=0) * [sensor.recording.sign for sensor in found.sensors]
        assert np.all(steps >= -1e-9)


def test_order_and_repeated_times_do_not_matter():
    rows = made_sensors.pairs_rows("logarithm")
    mixed = np.random.default_rng(0).permutation(rows)
    doubled = np.concatenate([rows, rows[::7]])
    sorted_error = fitted("logarithm").error_percent
    assert linearise(pairs(mixed)).error_percent == pytest.approx(sorted_error, rel=1e-6)
    assert linearise(pairs(doubled)).error_percent < 0.5


def test_a_few_known_weights_are_enough_for_a_curve():
    weights = np.array([0.0, 10.0, 20.0, 40.0, 80.0, 120.0, 160.0, 200.0])
    up_and_down = np.concatenate([weights, weights[-2::-1]])
    rows = np.concatenate(
        [
            np.stack(
                [np.arange(15.0), np.full(15, j), made_sensors.LAWS["soft conductance"](up_and_down), up_and_down], 1
            )
            for j in range(4)
        ]
    )
    found = linearise(pairs(rows))
    assert found.calibrated == (0, 1, 2, 3)
    assert unseen_error_percent(profile_of(found), "soft conductance") < 2.5


def test_a_sensor_without_pairs_dead_or_loose_is_named_and_the_others_work():
    rows = made_sensors.pairs_rows("soft conductance")
    rows = rows[rows[:, 1] != 0]
    rows[rows[:, 1] == 2, 2] = 812.0
    draws = np.random.default_rng(0)
    loose = rows[:, 1] == 3
    rows[loose, 2] = draws.permutation(rows[loose, 2])
    found = linearise(pairs(rows))
    assert found.calibrated == (1,)
    assert not found.good
    said = " ".join(found.warnings)
    assert "sensor 1 is not calibrated: there are no pairs" in said
    assert "sensor 3 is not calibrated: it is dead" in said
    assert "sensor 4 is not calibrated: its reading does not follow" in said
    assert all(words in found.verdict for words in ("sensor 1", "sensor 3", "sensor 4"))
    newtons = profile_of(found).force(np.full(4, 30000.0))
    assert np.isfinite(newtons).tolist() == [False, True, False, False]


def test_what_clips_is_calibrated_up_to_there_and_not_good():
    rows = made_sensors.pairs_rows("straight, with an offset")
    rows[:, 2] = np.minimum(rows[:, 2] + 24000.0, 65535.0)
    found = linearise(pairs(rows))
    ends = [(65535.0 - 56768.0) / 60.0 / gain for gain in (0.85, 1.0, 1.1, 1.2)]
    for sensor, end in zip(found.sensors, ends, strict=True):
        assert sensor.recording.saturates_n == pytest.approx(end, rel=0.05)
        assert sensor.curve.force(60000.0) == pytest.approx((60000.0 - 56768.0) / 8767.0 * end, rel=0.03)
    assert not found.good
    assert "aturated" in found.verdict


def test_nothing_that_can_be_calibrated_is_refused_with_the_reasons():
    rows = made_sensors.pairs_rows("soft conductance")
    rows[:, 2] = 500.0
    with pytest.raises(BadValue, match=r"no sensor can be calibrated: sensor 1 .* dead"):
        linearise(pairs(rows))
    rows[:, 3] = 0.0
    with pytest.raises(BadValue, match="force_n"):
        linearise(pairs(rows))
