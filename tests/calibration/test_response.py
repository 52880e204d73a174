"""The procedure of the frequency response on simulated tiles, page by page, compared with their true responses."""

import math
from dataclasses import replace
from datetime import date
from functools import cache

import numpy as np
import pytest
from scipy.signal import freqz, lfilter, sosfreqz

from underfoot.calibration.procedure import run, step
from underfoot.calibration.procedures.response import LOUDEST, ResponseProcedure
from underfoot.calibration.results.response import result_of
from underfoot.calibration.rig import Sound
from underfoot.calibration.science.response import ResponseMeasurements, equalise, flatness_db, usable_band_hz
from underfoot.calibration.science.sweep import exponential, train
from underfoot.calibration.science.tones import DistortionOverLevel, harmonics
from underfoot.calibration.science.transfer_function import measure
from underfoot.engine.safety import Limits
from underfoot.engine.shaker_rigs import SimulatedShaker
from underfoot.errors import BadMeasurement, BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile
from underfoot.floor.tile_parameters import Accelerometer, TileParameters

TILE = default_floor().tiles[0]
RATE = 16_000
QUICK = {"sweep_s": 1.5, "passes": 2, "level": 0.1}


class Listening:
    """A simulated shaker that may spoil what comes back, and notes what was played."""

    def __init__(self, seed=1, spoil=lambda heard: heard):
        self.tile = SimulatedTile(TILE, seed=seed)
        self._shaker, self.spoil = SimulatedShaker(self.tile), spoil
        self.played = []

    def press(self, press):
        raise AssertionError("nothing is pressed")

    def read(self):
        raise AssertionError("nothing is read")

    def play(self, sound):
        self.played.append(sound)
        return self.spoil(self._shaker.play(sound))

    def close(self):
        pass


def finished(seed=1, **values):
    """The result of the whole procedure, and its shaker; several tests read those of the same answers."""
    return _finished(seed, tuple(sorted(({"order": 14} | values).items())))


@cache
def _finished(seed, values):
    rig = Listening(seed)
    return run(ResponseProcedure(TILE, RATE), rig, QUICK | dict(values)), rig


def truth_db(tile, sections, level, frequencies_hz, rate=RATE, load="none"):
    """The tile's true response to small signals through the sections, over a level."""
    _, gain = sosfreqz(sections, frequencies_hz, fs=rate)
    return 20.0 * np.log10(np.abs(tile.transfer(frequencies_hz, load) * gain) / level)


def skip_what_may_be(procedure, rig, until=""):
    """Go through to a page, by default the last, skipping where allowed; the key of each page, and whether it was."""
    seen = []
    while not procedure.page.last and procedure.page.key != until:
        seen.append((procedure.page.key, procedure.page.may_skip))
        if procedure.page.may_skip:
            procedure.skip()
        elif procedure.page.sound is not None:
            procedure.take_recording(rig.play(procedure.page.sound))
        else:
            procedure.answer({})
    return seen


@pytest.mark.parametrize(("seed", "order"), [(1, 14), (2, 14), (3, 10)])
def test_what_it_corrects_is_truly_flat_and_truly_as_loud_as_it_says(seed, order):
    """Against the model's transfer function, not against the measurement that the equaliser was made from."""
    result, rig = finished(seed, order=order)
    with pytest.raises(BadValue, match="the measured tile is 't1'; allowed: other, whose profile this is"):
        result.apply(Profile(tile="other"))
    profile = result.apply(Profile(tile=TILE.id))
    inner, whole = np.geomspace(60.0, 700.0, 400), np.array([50.0, 750.0])
    found = truth_db(rig.tile, profile.equaliser, profile.acceleration_per_unit, inner)
    assert np.abs(found).max() < 1.0
    assert np.ptp(found) < 1.0
    assert truth_db(rig.tile, profile.equaliser, profile.acceleration_per_unit, whole).min() > -10.0
    figures = result.figures
    assert figures["flatness_measured_db"] < 0.5 < 3.0 < figures["flatness_before_db"]
    assert figures["usable_low_hz"] < 50.0 < 750.0 < figures["usable_high_hz"]
    assert result.good
    assert profile.equaliser.shape == (order // 2, 6)
    assert profile.flags(TILE.id, date.today()) == ()


def test_a_stimulus_in_m_s2_plays_at_that_level():
    """A 200 Hz tone of 3 m/s^2, through equaliser and divided by the level, at the accelerometer."""
    result, rig = finished(5)
    profile = result.apply(Profile(tile=TILE.id))
    asked = 3.0 * np.sin(2.0 * math.pi * 200.0 * np.arange(RATE) / RATE)
    drive = equalise(profile.equaliser, asked) / profile.acceleration_per_unit
    given = rig.tile.respond(drive, RATE, "none")[RATE // 2 :]
    assert math.sqrt(2.0 * float(np.mean(given**2))) == pytest.approx(3.0, rel=0.06)


@pytest.mark.parametrize(("seed", "load"), [(1, "none"), (2, "none"), (1, "standing")])
def test_accelerations_are_within_the_uncertainty_that_is_stated(seed, load):
    """Of tones up to the level of the sweeps, against what the simulated tile does, whose accelerometer is exact."""
    result, rig = finished(seed) if load == "none" else finished(seed, load=load)
    profile = result.apply(Profile(tile=TILE.id))
    names = ("reference", "repeatability", "flatness", "linearity")
    parts = [result.figures[f"acceleration_{name}_percent"] for name in names]
    assert result.figures["acceleration_expanded_percent"] == pytest.approx(2.0 * math.hypot(*parts), rel=1e-5)
    assert parts[0] == 5.0
    assert profile.response.reference == "accelerometer, 100 m/s^2 a full-scale input, uncertain by 10 % (k = 2)"
    expanded = 0.01 * 2.0 * math.hypot(*parts[1:])
    off, time_s = [], np.arange(RATE // 2) / RATE
    for hz, share in zip(np.geomspace(60.0, 700.0, 12), np.tile([0.03, 0.2, 1.0], 4), strict=True):
        drive = equalise(profile.equaliser, np.sin(2.0 * math.pi * hz * time_s))
        level = share * QUICK["level"] / np.abs(drive[RATE // 4 :]).max()
        given = harmonics(rig.tile.respond(level * drive, RATE, load)[RATE // 4 :], hz, RATE, 2)[0]
        off.append(given / (level * profile.acceleration_per_unit) - 1.0)
    assert np.mean(np.abs(off) < expanded) > 0.9
    assert math.sqrt(np.mean(np.square(off))) > 0.2 * expanded


def test_loads_change_the_response_as_they_truly_do():
    result, rig = finished(2)
    tables = {name: rows for name, _, rows in result.raw}
    assert {"none", "standing", "corner", "equalised", "equaliser"} <= set(tables)
    for load in ("none", "standing", "corner"):
        rows = tables[load]
        inside = (rows[:, 0] > 40.0) & (rows[:, 0] < 700.0)
        true = np.abs(rig.tile.transfer(rows[inside, 0], load))
        assert np.abs(20.0 * np.log10(rows[inside, 1] / true)).mean() < 0.5
    assert result.figures["standing_changes_db"] > 3.0
    drawn = result.drawings[0]
    assert [line.name for line in drawn.series] == ["nothing on it", "standing in the middle", "a foot on a corner"]


@pytest.mark.parametrize("load", ["standing", "corner"])
def test_a_tile_calibrated_under_a_load_is_flat_under_that_load_and_says_how_far_off_it_is_otherwise(load):
    result, rig = finished(1, load=load)
    profile = result.apply(Profile(tile=TILE.id))
    assert Profile.loads(profile.dumps()).response.load == load
    assert [sound.load for sound in rig.played[-2:]] == ["none", load]  # tones, and the sweeps through the equaliser
    inner = np.geomspace(60.0, 700.0, 400)
    sections, level = profile.equaliser, profile.acceleration_per_unit
    assert np.abs(truth_db(rig.tile, sections, level, inner, load=load)).max() < 1.0
    assert result.figures["flatness_measured_db"] < 0.5
    named = {"none": "nobody on it", "standing": "a person in the middle", "corner": "a foot on a corner"}
    assert result.verdict.startswith(f"With {named.pop(load)}, flat within ")
    for other, who in named.items():
        off = np.abs(truth_db(rig.tile, sections, level, inner, load=other)).max()
        assert result.figures[f"{other}_changes_db"] == pytest.approx(off, abs=0.7)
        assert f"up to {result.figures[f'{other}_changes_db']:.1f} dB with {who}" in result.verdict


def test_the_load_that_the_equaliser_is_for_cannot_be_left_out():
    procedure, rig = ResponseProcedure(TILE, RATE), Listening()
    procedure.answer(QUICK | {"load": "standing"})
    seen = skip_what_may_be(procedure, rig)
    place = ("standing-place", False)
    skipped = ("corner-place", True)
    assert seen[2:] == [
        place,
        ("standing", False),
        skipped,
        ("leave", False),
        ("tones", False),
        place,
        ("again", False),
    ]
    assert "It is off by up to" in procedure.result.verdict
    procedure.back()
    procedure.back()
    assert (procedure.page.key, procedure.page.title) == ("standing-place", "Once more")


def test_distortion_grows_with_level_as_the_shaker_compresses():
    result, _ = finished(1, level=0.45)
    rows = next(rows for name, _, rows in result.raw if name == "distortion-over-level")
    assert (np.diff(rows[:, 1]) > 0.0).all()
    assert rows[-1, 2] > 3.0 * rows[4, 2]
    assert 0.01 < rows[-1, 2] < 0.2
    assert result.figures["distortion_3_percent"] > result.figures["distortion_2_percent"]


def test_nothing_louder_than_the_limits_is_played():
    _, rig = finished(3, level=LOUDEST)
    assert len(rig.played) == 6
    for sound in rig.played:
        assert np.abs(sound.signal).max() <= LOUDEST + 1e-9 < Limits().peak
    loud = Sound(np.full(4_800, 3.0), RATE, "none")
    quiet = SimulatedShaker(SimulatedTile(TILE, seed=1)).play(loud)
    hard = SimulatedTile(TILE, seed=1).respond(np.full(4_800, 0.95), RATE, "none") / 100.0
    assert np.abs(quiet).max() <= np.abs(hard).max() * 1.01


def test_the_pages_come_in_order_and_back_forgets():
    procedure, rig = ResponseProcedure(TILE, RATE), Listening()
    keys = []

    def go_on():
        keys.append(procedure.page.key)
        if procedure.page.sound is not None:
            procedure.take_recording(rig.play(procedure.page.sound))
        else:
            procedure.answer(QUICK if procedure.page.questions else {})

    for _ in range(4):
        go_on()
    assert procedure.page.key == "standing"
    assert len(procedure.drawings) == 1
    procedure.back()
    procedure.back()
    assert procedure.page.key == "none"
    assert [drawing.title for drawing in procedure.drawings] == ["Noise floor: 0.009 m/s^2 RMS"]
    procedure.back()
    assert procedure.drawings == ()
    go_on()
    while not procedure.page.last:
        go_on()
    assert keys[4:] == [
        "quiet", "none", "standing-place", "standing", "corner-place", "corner", "leave", "tones", "again",
    ]  # fmt: skip
    assert procedure.result is not None
    assert procedure.result.method.endswith(f"Sweeps had a peak of {QUICK.get('level', 0.25):g} of full scale.")
    shares = [0.0, 1.0]
    assert procedure.page.share == shares[1]
    procedure.back()
    assert procedure.page.key == "again"
    assert procedure.result is None


def test_loads_may_be_left_out():
    procedure, rig = ResponseProcedure(TILE, RATE), Listening()
    procedure.answer(QUICK | {"passes": 1})
    skip_what_may_be(procedure, rig)
    names = [name for name, _, _ in procedure.result.raw]
    assert "standing" not in names
    assert any("nor whether samples were lost" in line for line in procedure.result.warnings)


@pytest.mark.parametrize(
    ("page", "spoil", "reason"),
    [
        ("none", lambda heard: 0.0 * heard, "no signal"),
        ("none", lambda heard: np.clip(heard, -0.01, 0.01), "clipped"),
        ("none", lambda heard: 0.01 * np.random.default_rng(1).standard_normal(heard.size), "do not fit"),
        ("none", lambda heard: heard[:1000], "lasts"),
        ("quiet", lambda heard: 0.0 * heard, "no noise: every sample of the silence is 0 of full scale"),
        ("quiet", lambda heard: heard + np.sin(0.1 * np.arange(heard.size)), "silence is recorded"),
        ("tones", lambda heard: 0.0 * heard, "no signal"),
        ("tones", lambda heard: np.clip(heard, -0.003, 0.003), "clipped"),
        ("again", lambda heard: heard[::-1], "do not fit|does not hold"),
        ("none", lambda heard: np.stack([heard, heard]), "one channel"),
        ("none", lambda heard: np.full(heard.size, np.nan), "finite"),
    ],
)
def test_what_cannot_be_right_is_refused_on_its_page_and_can_be_taken_again(page, spoil, reason):
    procedure, rig = ResponseProcedure(TILE, RATE), Listening()
    procedure.answer(QUICK)
    skip_what_may_be(procedure, rig, until=page)
    heard = rig.play(procedure.page.sound)
    with pytest.raises(BadMeasurement, match=reason):
        procedure.take_recording(spoil(heard))
    assert procedure.page.key == page
    kept = procedure.without_conclusion("refused")
    names = [] if kept is None else [name for name, _, rows in kept.raw if rows.size]
    assert names == {"tones": ["none"], "again": ["none", "distortion-over-level"]}.get(page, [])
    procedure.take_recording(heard)
    assert procedure.page.key != page


def test_a_page_takes_only_what_it_asks_for():
    procedure = ResponseProcedure(TILE, RATE)
    with pytest.raises(BadValue, match="takes no recording"):
        procedure.take_recording(np.zeros(10))
    for values, word in (({"order": 13}, "order is 13"), ({"level": 0.9}, "level is 0.9"), ({"mass": 1.0}, "mass")):
        with pytest.raises(BadValue, match=word):
            procedure.answer(values)
    assert procedure.page.key == "setup"
    procedure.answer(QUICK)
    with pytest.raises(BadValue, match="takes a recording"):
        procedure.answer({})


def test_from_two_recordings_alone():
    """What a command has: no loads, no tones, nothing measured again, a single pass."""
    tile = SimulatedTile(TILE, seed=6)
    sweep = train(exponential(20.0, 2000.0, 2.0, RATE, 0.1), 1, RATE)
    found = measure(sweep, tile.respond(sweep, RATE, "none") / 50.0, RATE)
    result = result_of(ResponseMeasurements({"none": found}, 50.0, RATE, 12))
    assert "computed, not measured again" in result.verdict
    assert "acceleration_expanded_percent" not in result.figures
    profile = result.apply(Profile(tile=TILE.id))
    assert profile.response.made == date.today().isoformat()
    inner = np.geomspace(60.0, 700.0, 400)
    assert np.abs(truth_db(tile, profile.equaliser, profile.acceleration_per_unit, inner)).max() < 1.0
    assert Profile.loads(profile.dumps()).equaliser.tobytes() == profile.equaliser.tobytes()
    kept = np.interp(inner, profile.response.frequencies_hz, profile.response.magnitude)
    assert np.abs(20.0 * np.log10(kept / np.abs(tile.transfer(inner)))).max() < 0.5


def test_distortion_is_told_in_percent():
    """A square and a cube of a sine of 0.4 make harmonics of a u / 2 and b u^2 / 4 of it, before a low-pass."""
    sweep = train(exponential(20.0, 2000.0, 2.0, RATE, 0.4), 1, RATE)
    found = measure(sweep, lfilter([0.2], [1.0, -0.8], sweep + 0.1 * sweep**2 + 0.75 * sweep**3), RATE)
    share = np.array([0.01, 0.12])
    tones = DistortionOverLevel(np.array([0.1, 0.4]), np.array([5.0, 20.0]), share)
    result = result_of(ResponseMeasurements({"none": found}, 50.0, RATE, 2, tones=tones))
    passed = np.abs(freqz([0.2], [1.0, -0.8], [300.0, 600.0, 900.0], fs=RATE)[1])
    second, third = 100 * np.array([0.1 * 0.4 / 2.0, 0.75 * 0.4**2 / 4.0]) * passed[1:] / passed[0]
    assert result.figures["distortion_2_percent"] == pytest.approx(second, rel=0.15)
    assert result.figures["distortion_3_percent"] == pytest.approx(third, rel=0.15)
    assert result.figures["thd_loudest_percent"] == pytest.approx(12.0)
    assert "the loudest tone has 12 % of harmonic distortion" in result.warnings
    drawn = {drawing.title: drawing.series for drawing in result.drawings}
    assert np.interp(300.0, drawn["Distortion by order"][0].x, drawn["Distortion by order"][0].y) == pytest.approx(
        second, rel=0.15
    )
    (over_level,) = (series for title, (series, *_) in drawn.items() if title.startswith("Distortion at"))
    assert over_level.y == pytest.approx([1.0, 12.0])


def test_hum_of_the_mains_that_bends_the_response_is_warned_of():
    """It is far below what the page of the noise floor refuses, and the median over the band does not show it."""
    draws = np.random.default_rng(3)

    def hum(heard):
        return heard + 0.004 * np.sin(2.0 * np.pi * (50.0 * np.arange(heard.size) / RATE + draws.uniform()))

    result = run(ResponseProcedure(TILE, RATE), Listening(spoil=hum), QUICK | {"level": 0.25})
    assert result.figures["snr_db"] > 60.0
    assert abs(result.figures["at_50_hz_db"]) > 1.0
    (warning,) = (line for line in result.warnings if "signal-to-noise" in line)
    assert warning.startswith("at 50 Hz the signal-to-noise ratio is only ")
    assert not any("signal-to-noise" in line for line in finished()[0].warnings)


def test_hum_is_seen_before_the_first_sweep():
    def hum(heard):
        return heard + 0.004 * np.sin(2.0 * np.pi * 50.0 * np.arange(heard.size) / RATE)

    procedure, rig = ResponseProcedure(TILE, RATE), Listening(spoil=hum)
    for page in ("setup", "quiet"):
        assert (procedure.page.key, procedure.drawings) == (page, ())
        step(procedure, rig, QUICK)
    (drawn,) = procedure.drawings
    assert drawn.title.startswith("Noise floor: 0.28 m/s^2 RMS, strongest at 50 Hz")
    (spectrum,) = drawn.series
    assert spectrum.y.max() == pytest.approx(100.0 * 0.004 / math.sqrt(2.0), rel=0.02)  # of the sine, m/s^2
    assert np.median(spectrum.y) < 0.01 * spectrum.y.max()
    step(procedure, rig)
    assert [drawing.title for drawing in procedure.drawings] == ["Response by load"]


def test_a_tile_that_cannot_be_made_flat_is_not_good():
    tile = SimulatedTile(TILE, seed=6)
    sweep = train(exponential(20.0, 2000.0, 2.0, RATE, 0.1), 1, RATE)
    found = measure(sweep, tile.respond(sweep, RATE, "none") / 50.0, RATE)
    result = result_of(ResponseMeasurements({"none": found}, 50.0, RATE, 2))
    assert not result.good
    assert "not flat enough" in result.verdict
    assert "errs by" in result.apply(Profile(tile=TILE.id)).flags(TILE.id, date.today())[0]


@pytest.mark.parametrize(("gain", "warned"), [(1.0, ""), (0.5, "6.0 dB lower"), (2.0, "6.0 dB higher")])
def test_a_gain_that_changed_before_the_last_sweep_is_warned_of(gain, warned):
    sweep = train(exponential(20.0, 2000.0, 2.0, RATE, 0.1), 1, RATE)
    found = measure(sweep, SimulatedTile(TILE, seed=1).respond(sweep, RATE, "none") / 50.0, RATE)
    plain = ResponseMeasurements({"none": found}, 50.0, RATE)
    result = result_of(replace(plain, again=replace(found, transfer=gain * plain.computed + 0j)))
    assert result.good
    assert [line for line in result.warnings if "measured again" in line] == (
        [f"measured again, the level is {warned}, and m/s^2 with it: did a gain or the accelerometer's place change?"]
        if warned
        else []
    )


@pytest.mark.parametrize(
    ("cooler", "warned"), [(1.0, ""), (0.95, "the gain has fallen by 5 %"), (1.05, "risen by 5 %")]
)
def test_a_shaker_that_warms_up_between_sweeps_and_tones_is_warned_of(cooler, warned):
    """One that lost 20 % passed; that a loud one compresses is in both."""
    tile, level = SimulatedTile(TILE, seed=1), 0.45
    sweep = train(exponential(20.0, 2000.0, 2.0, RATE, level), 1, RATE)
    found = measure(sweep, tile.respond(sweep, RATE, "none") / 50.0, RATE)
    tone = tile.respond(level * np.sin(2.0 * np.pi * 300.0 * np.arange(RATE) / RATE), RATE, "none")
    heard = cooler * harmonics(tone[RATE // 2 :], 300.0, RATE, 2)[0]
    tones = DistortionOverLevel(np.array([level]), np.array([heard]), np.zeros(1))
    warnings = result_of(ResponseMeasurements({"none": found}, 50.0, RATE, tones=tones)).warnings
    lines = [line for line in warnings if "the gain has" in line]
    assert len(lines) == bool(warned)
    assert all(warned in line for line in lines)


@pytest.mark.parametrize("place", [(0.5, 0.2887), (0.0, 0.0)])
@pytest.mark.parametrize("load", ["none", "standing"])
def test_a_shaker_whose_wires_are_swapped_is_warned_of(place, load):
    """It passed everything, and beside other tiles played against them."""
    tile = SimulatedTile(TILE, TileParameters(accelerometer=Accelerometer(place=place)), seed=1)
    sweep = train(exponential(20.0, 2000.0, 2.0, RATE, 0.1), 1, RATE)
    for sign in (1.0, -1.0):
        found = measure(sweep, tile.respond(sign * sweep, RATE, load) / 50.0, RATE)
        warnings = result_of(ResponseMeasurements({load: found}, 50.0, RATE, load=load)).warnings
        assert ("wires of the shaker" in " ".join(warnings)) == (sign < 0.0)


def test_no_band_is_usable_beyond_the_end_of_the_sweep():
    """It ended at 767 Hz of a sweep up to 750 Hz: the power of a sweep does not."""
    sweep = train(exponential(20.0, 750.0, 2.0, RATE, 0.1), 1, RATE)
    found = measure(sweep, SimulatedTile(TILE, seed=6).respond(sweep, RATE, "none") / 50.0, RATE)
    figures = result_of(ResponseMeasurements({"none": found}, 50.0, RATE, 12)).figures
    assert found.frequencies_hz[-1] > 760.0
    assert found.swept_hz == pytest.approx((20.0, 750.0), rel=0.08)
    assert found.swept_hz[1] < 750.0
    assert figures["usable_high_hz"] == found.swept_hz[1]


def test_a_profile_keeps_no_response_beyond_the_sweep():
    """Four points lay above 2 kHz, where a sweep to there has nothing but what its end leaks."""
    assert 1900.0 < finished()[0].part.frequencies_hz[-1] <= 2000.0


def test_a_band_ends_where_the_response_falls_too_far():
    f = np.array([20.0, 30.0, 60.0, 200.0, 600.0, 700.0, 900.0])
    assert usable_band_hz(f, np.array([-40.0, -9.0, 0.0, 1.0, 0.0, -11.0, 0.0])) == (30.0, 600.0)
    assert usable_band_hz(f, np.full(7, -11.0)) == (0.0, 0.0)
    assert flatness_db(f, np.array([-40.0, -9.0, 0.5, 1.0, 0.0, -1.0, 0.0])) == 1.0
