"""The equalisers of tiles in the engine: what is asked is what a tile gives; without a profile nothing changes."""

import json
import tracemalloc

import numpy as np
import pytest
import soundfile
from click.testing import CliRunner
from live import live
from loops import FLOOR, loop_of, played
from made_patches import hum, patch_of, rough_step, stepped_bank
from made_recordings import ABOUT
from scipy.signal import butter, sosfilt

from underfoot.__main__ import cli
from underfoot.clock import FADE
from underfoot.devices.simulated_floor import SimulatedFloor
from underfoot.engine.calibrations import calibrations_in_use, with_responses
from underfoot.engine.commands import Pulse, TileEqualiser, equalisers_of, from_text, to_text
from underfoot.engine.loop import LoopOptions
from underfoot.engine.render import render_source
from underfoot.engine.safety import Limits
from underfoot.engine.session_replay import ReplayJob
from underfoot.engine.target import Target
from underfoot.engine.tile_pulse import PULSE_S
from underfoot.errors import BadFile, BadValue
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Centroid, Latency, Profile, Response
from underfoot.patch import preset_files
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer

RATE = 48_000
BAND = tuple(map(tuple, butter(4, [50.0, 750.0], "bandpass", fs=RATE, output="sos").tolist()))
LOW = tuple(map(tuple, butter(2, 400.0, fs=RATE, output="sos").tolist()))
OPEN = (Limits(peak=1.0, rms=1.0),) * 4


@pytest.mark.parametrize("patch", [stepped_bank(), rough_step(), hum()])
def test_a_tile_is_filtered_and_scaled_as_its_profile_says_and_no_other(patch):
    plain = played(loop_of(patch, limits=OPEN), RATE)
    equalisers = [TileEqualiser("t1", 20.0, BAND), TileEqualiser("t2", 10.0)]
    out = played(loop_of(patch, limits=OPEN, equalisers=equalisers), RATE)
    assert plain[:, :2].any(axis=0).all()
    # Both stages behind are linear here, but for the ramp of the start: their order does not matter after that.
    expected = sosfilt(BAND, plain[:, 0].astype(float))
    kept = slice(10 * FADE, None)
    assert np.abs(out[kept, 0] - expected[kept]).max() < 2e-3 * np.abs(expected).max() + 1e-6
    assert np.abs(out[:, 1] - 2.0 * plain[:, 1]).max() < 1e-6
    assert out[:, 2:].tobytes() == plain[:, 2:].tobytes()


AT_ODD_FRAMES = (
    (5_003, TileEqualiser("t3", 9.0, LOW, 44_100.0)),
    (5_100, TileEqualiser("t3", 12.0)),
    (5_107, TileEqualiser("t1", 14.0, LOW)),
    (20_011, TileEqualiser("t1", 30.0, BAND)),
    (21_013, Pulse("t4")),
    (21_500, TileEqualiser("t4", 5.0, BAND)),
)


@pytest.mark.parametrize("patch", [stepped_bank(), rough_step()])
@pytest.mark.parametrize("blocks", [[64], [7], [1, 500, 33, 3000]])
def test_the_same_bytes_at_any_block_size(patch, blocks):
    def run(blocks):
        loop = loop_of(patch, max(blocks), equalisers=[TileEqualiser("t1", 11.0, BAND), TileEqualiser("t2", 30.0)])
        for frame, command in AT_ODD_FRAMES:
            loop.send(command, frame)
        return played(loop, 40_000, blocks), [(done.frame, done.command) for done in loop.applied]

    whole, told = run([1024])
    out, again = run(blocks)
    assert whole.any(axis=0).sum() >= 3
    assert out.tobytes() == whole.tobytes()
    assert again == told
    assert [command for _, command in told if isinstance(command, TileEqualiser)] == [
        command for _, command in AT_ODD_FRAMES if isinstance(command, TileEqualiser)
    ]


def test_without_a_profile_the_bytes_are_what_they_were():
    for patch in (rough_step(), hum()):
        plain = played(loop_of(patch), 24_000)
        unmeasured = equalisers_of({"t1": Profile(tile="t1")})
        assert played(loop_of(patch, equalisers=unmeasured), 24_000).tobytes() == plain.tobytes()
        loop = loop_of(patch)
        for tile in FLOOR.ids:
            loop.send(TileEqualiser(tile), 9_000)
        assert played(loop, 24_000).tobytes() == plain.tobytes()


def test_a_change_is_faded_over_480_frames_and_the_next_one_waits_for_it():
    """Also back to none. The filter turns the tone by a quarter, so that what it remembers is heard."""
    patch = hum(tone={"frequency": 4_800.0, "amplitude": 2.0})
    turned, edge = butter(2, 4_800.0, fs=RATE, output="sos"), 9_600
    plain = played(loop_of(patch, walking=False, limits=OPEN), 12_000)[:, 0].astype(float)
    loop = loop_of(patch, walking=False, limits=OPEN)
    loop.send(TileEqualiser("t1", 20.0, tuple(map(tuple, turned.tolist()))), edge)
    loop.send(TileEqualiser("t1", 20.0), edge + 100)
    out = played(loop, 12_000)[:, 0].astype(float)
    share = np.interp(np.arange(12_000), [edge, edge + FADE, edge + 2 * FADE], [0.0, 1.0, 0.0])
    filtered = np.concatenate([plain[:edge], sosfilt(turned, plain[edge:])])
    np.testing.assert_allclose(out, plain + share * (filtered - plain), atol=2e-3 * np.abs(plain).max())
    assert out[:edge].tobytes() == plain[:edge].tobytes()


def test_a_row_whose_input_is_zero_rings_out_and_is_then_exactly_zero():
    loop = loop_of(patch_of(), walking=False, equalisers=[TileEqualiser("t1", 20.0, BAND)], limits=OPEN)
    loop.send(Pulse("t1"), 960)
    burst_end = 960 + round(PULSE_S * RATE)
    played(loop, burst_end + 480)
    assert loop.equalisers.ringing() == (True, False, False, False)
    assert np.abs(played(loop, 480)[:, 0]).max() > 1e-6
    played(loop, RATE)
    assert loop.equalisers.ringing() == (False,) * 4
    output, zero_rows = np.zeros((4, 64)), np.ones(4, np.uint8)
    loop.equalisers.apply(output, zero_rows, loop.frame, 64)
    assert not output.any()
    assert zero_rows.all()


def test_a_value_that_is_not_a_number_does_not_stay_in_an_equaliser():
    loop = loop_of(hum(), limits=OPEN, walking=False, equalisers=[TileEqualiser("t1", 20.0, BAND)])
    output = np.zeros((4, 64))
    output[0, 3] = np.nan
    output[0, 5] = np.inf
    loop.equalisers.apply(output, np.zeros(4, np.uint8), 0, 64)
    assert np.isnan(output[0, 3])
    assert np.isinf(output[0, 5])
    assert np.isfinite(output[0, 6:]).all()


def test_nothing_is_allocated_while_equalisers_run():
    loop = loop_of(rough_step(), 64, equalisers=[TileEqualiser(tile, 15.0, BAND) for tile in FLOOR.ids])
    prepared = TileEqualiser("t2", 8.0, LOW).prepared(loop)
    for _ in range(100):
        loop.run(64)
    tracemalloc.start()
    try:
        for _ in range(50):
            loop.run(64)
        before = tracemalloc.take_snapshot()
        loop.send(prepared)
        for _ in range(200):
            loop.run(64)
        grown = sum(stat.size_diff for stat in tracemalloc.take_snapshot().compare_to(before, "filename"))
    finally:
        tracemalloc.stop()
    assert grown < 4096  # what the notes of the command itself take


def test_equalisers_that_cannot_be_are_refused():
    loop = loop_of(patch_of(), walking=False)
    with pytest.raises(BadValue, match="sections is"):
        loop.send(TileEqualiser("t1", 20.0, ((1.0, 0.0, 0.0, 1.0, 0.0, 1.5),)))
    with pytest.raises(BadValue, match="tile is"):
        loop.send(TileEqualiser("t9"))


def test_an_equaliser_is_recorded_as_it_was():
    for command in (TileEqualiser("t1", 31.4, BAND, 44_100.0, "2026-05-02 a07be6c51f98"), TileEqualiser("t2")):
        assert from_text(*to_text(command)) == command


def measured(tile):
    """A profile of a tile that gives 30 m/s^2 at full scale, and has BAND for its equaliser."""
    part = Response(
        made="2024-05-01", frequencies_hz=(50.0,), magnitude=(30.0,), acceleration_per_unit=30.0, equaliser=BAND
    )
    return Profile(tile=tile).with_part(part)


def test_a_live_session_takes_its_profiles_and_a_new_one_at_once_and_is_replayed(until, tmp_path):
    path, folder = tmp_path / "session.uf", tmp_path / "profiles"
    folder.mkdir()
    measured("t1").save(folder / "t1.json")
    with live(hum(), until, path, profiles=str(folder), walker=False) as playing:
        playing.started()
        playing.play(9_600)
        with pytest.raises(BadValue, match="sections is"):
            playing.session.send(TileEqualiser("t2", 20.0, ((1.0, 0.0, 0.0, 1.0, 0.0, 2.0),)))
        with pytest.raises(BadValue, match="acceleration_per_unit is"):
            playing.session.send(TileEqualiser("t2", 0.0))
        playing.session.send(TileEqualiser("t2", 5.0))
        edge = playing.done(TileEqualiser)
        playing.play(24_000)
        before, after = playing.played(edge - 4_800, 4_800), playing.played(edge + 9_600, 4_800)
        playing.session.stop_recording()
    loud = np.abs(after).max(axis=0) / np.abs(before).max(axis=0)
    np.testing.assert_allclose(loud, [1.0, 4.0, 1.0, 1.0], rtol=0.02)
    assert np.abs(before[:, 0]).max() < 0.8 * np.abs(before[:, 2]).max()
    with Recording(path) as recording:
        played_live = recording.vibration()[1]
        used = recording.calibrations
    assert used == {"t1": {"response": Profile.load(folder / "t1.json").response.identity}}
    assert ReplayJob(path).run().samples.tobytes() == played_live.tobytes()


def test_forces_and_places_are_in_use_where_there_are_readings_and_a_latency_where_it_holds(tmp_path):
    place = Centroid(made="2024-05-01", sensors_m=FLOOR.tiles[0].sensors_m)
    lag = Latency(made="2024-05-02", round_trip_ms=20.0)
    profiles = {"t1": Profile(tile="t1", centroid=place, latency=lag), "t2": Profile(tile="t2")}
    wired = Target(FLOOR, "serial", "none", round_trip_frames=960)
    assert with_responses(calibrations_in_use(wired, profiles), {}) == {
        "t1": {"centroid": place.identity, "latency": lag.identity}
    }
    simulated = Target(FLOOR, simulation=str(preset_files.simulations()["plywood-tile"]))
    assert with_responses(calibrations_in_use(simulated, profiles), {}) == {"t1": {"centroid": place.identity}}
    for ideal in (Target(FLOOR), Target(FLOOR, simulation="people=2", block=64, round_trip_frames=960)):
        assert with_responses(calibrations_in_use(ideal, profiles), {}) == {}
    was = {"fsr": "2024-04-30 0f3c9a1b2d4e", "response": "2024-05-02 a07be6c51f98"}
    recorded = tmp_path / "walk.underfoot"
    for said, known in ((json.dumps({"t1": was}), {"t1": {"fsr": was["fsr"]}}), ("damaged", {})):
        Writer(recorded, ABOUT | {"calibrations": said}).close()  # of the tiles t1 and t2
        played = Target(default_floor(2, 1), "replay", str(recorded))
        assert with_responses(calibrations_in_use(played, profiles), {}) == known
        recorded.unlink()


def test_a_patch_is_rendered_with_the_profiles_of_a_folder(tmp_path):
    patch, folder = tmp_path / "hum.json", tmp_path / "profiles"
    hum().save(patch)
    folder.mkdir()
    measured("t1").save(folder / "t1.json")
    peaks = []
    for more in ([], ["--profiles", str(folder)], ["--profiles", str(tmp_path / "nowhere")]):
        wav = tmp_path / f"{len(peaks)}.wav"
        options = [str(patch), "--seconds", "0.2", "--force", "none", "-o", str(wav), *more]
        ran = CliRunner().invoke(cli, ["render", *options])
        if ran.exception is not None:
            assert isinstance(ran.exception, BadFile)
            break
        peaks.append(np.abs(soundfile.read(wav)[0]).max(axis=0))
    plain, driven = peaks
    assert driven[0] == pytest.approx(plain[0] * 20.0 / 30.0, rel=0.1)
    np.testing.assert_array_equal(driven[1:], plain[1:])


def test_a_profile_drives_its_tile():
    profile = measured("t1")
    assert TileEqualiser.of_profile("t1", profile) == TileEqualiser(
        "t1", 30.0, BAND, calibration=profile.response.identity
    )
    source = SimulatedFloor(FLOOR)
    rendered = render_source(hum(), source, 0.2, LoopOptions(equalisers=equalisers_of({"t1": profile})))
    out = played(loop_of(hum(), equalisers=[TileEqualiser("t1", 30.0, BAND)]), 9_600)
    assert rendered.samples.tobytes() == out.tobytes()
