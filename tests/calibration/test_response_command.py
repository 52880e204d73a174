"""`underfoot calibrate response`: from two WAV files and on the simulator; what cannot be is one line."""

import json
import re
from functools import cache

import numpy as np
import pytest
import soundfile
from click.testing import CliRunner

from underfoot.__main__ import cli
from underfoot.calibration.science.sweep import exponential, train
from underfoot.errors import BadFile, BadMeasurement, BadValue, DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Profile
from underfoot.floor.simulated_tile import SimulatedTile

RATE = 48_000
SENSITIVITY = 50.0
SWEEP = train(exponential(20.0, 2000.0, 1.5, RATE, 0.1), 1, RATE)


@cache
def tile():
    return SimulatedTile(default_floor().tiles[0], seed=4)


@cache
def heard():
    """What the accelerometer hears of the sweep."""
    return tile().respond(SWEEP, RATE, "none") / SENSITIVITY


@pytest.fixture
def wavs(tmp_path):
    """A sweep and its recording: 24 bits, with the sweep in the second channel of a stereo recording."""
    sweep, recorded = tmp_path / "sweep.wav", tmp_path / "recorded.wav"
    soundfile.write(sweep, SWEEP, RATE, subtype="PCM_24")
    silence = 1e-5 * np.random.default_rng(1).standard_normal(SWEEP.size)
    late = np.concatenate([np.zeros(700), heard()])[: heard().size]
    soundfile.write(recorded, np.stack([silence, late], axis=1), RATE, subtype="PCM_24")
    return ["--sweep", str(sweep), "--recorded", str(recorded)]


def said(*options):
    """What the command prints; what it raises is raised here."""
    result = CliRunner().invoke(cli, ["calibrate", "response", *options], catch_exceptions=False)
    return result.stdout


def test_from_files_to_a_profile_and_a_report(wavs, tmp_path):
    profile, report = tmp_path / "t1.json", tmp_path / "report"
    options = [*wavs, "--sensitivity", str(SENSITIVITY), "--profile", str(profile), "--report", str(report), "--json"]
    options += ["--reference-percent", "3", "--conditions", "352C33 no. 1742, 21 °C"]
    figures = json.loads(said(*options))
    found = Profile.load(profile)
    assert found.tile == "t1"
    assert figures["acceleration_per_unit"] == pytest.approx(found.acceleration_per_unit)
    assert figures["latency_ms"] == pytest.approx(700.0 / 48.0, abs=0.4)
    inner = np.geomspace(60.0, 700.0, 300)
    through = np.ones(inner.size, complex)
    z = np.exp(-2j * np.pi * inner / RATE)
    for b0, b1, b2, a0, a1, a2 in found.equaliser:
        through *= (b0 + b1 * z + b2 * z * z) / (a0 + a1 * z + a2 * z * z)
    true = np.abs(tile().transfer(inner) * through) / found.acceleration_per_unit
    assert np.abs(20.0 * np.log10(true)).max() < 1.0
    assert found.equaliser.shape == (7, 6)
    page = (report / "response.html").read_text()
    assert found.response.reference.endswith("50 m/s^2 a full-scale input, uncertain by 3 % (k = 2)")
    assert "<th>conditions</th><td>352C33 no. 1742, 21 °C</td>" in page
    assert page.count("<svg") == 4
    assert f"<th>calibration</th><td>{found.response.identity}</td>" in page
    assert page.count("m/s²") >= 3  # among the drawings, the figures and the verdict
    assert not re.search(r"<b>[^<]*m/s\^2|<t[dh]>(-|m/s\^2)", page)
    assert (report / "response-none.csv").exists()


def test_one_accelerometer_on_both_channels_is_one_measurement(tmp_path):
    sweep = write(tmp_path / "sweep.wav", np.stack([SWEEP, SWEEP], axis=1))
    levels = []
    for name, recorded in (("one", heard()), ("both", np.stack([heard(), 0.5 * heard()], axis=1))):
        path = write(tmp_path / f"{name}.wav", recorded)
        levels.append(json.loads(said("--sweep", sweep, "--recorded", path, "--json"))["acceleration_per_unit"])
    assert levels[0] == levels[1]


def test_a_part_goes_into_the_profile_that_is_there(wavs, tmp_path):
    path = tmp_path / "t1.json"
    Profile(tile="t1", serial="A7").save(path)
    for order in ("10", "14"):
        said(*wavs, "--order", order, "--profile", str(path))
    found = Profile.load(path)
    assert found.serial == "A7"
    assert len(found.equaliser) == 7
    assert len(found.earlier) == 1
    assert len(found.restored(0).equaliser) == 5


def test_on_the_simulator(tmp_path):
    path = tmp_path / "t2.json"
    figures = json.loads(
        said("--target", "simulator", "--tile", "t2", "--seed", "3", "--no-loads", "--profile", str(path), "--json")
    )
    assert figures["flatness_measured_db"] < 0.5
    assert figures["good"] is True
    truth = SimulatedTile(default_floor().tiles[1], seed=3).transfer([200.0])
    assert Profile.load(path).tile == "t2"
    gain = abs(truth[0])
    assert 0.3 * gain < figures["acceleration_per_unit"] < 3.0 * gain


def write(path, samples, rate=RATE):
    soundfile.write(path, samples, rate, subtype="FLOAT")
    return str(path)


@pytest.mark.parametrize(
    ("make", "error", "word"),
    [
        (lambda f: ["--sweep", f["sweep"]], BadValue, "give either"),
        (lambda f: [], BadValue, "give either"),
        (lambda f: [*f["both"], "--target", "simulator"], BadValue, "give either"),
        (lambda f: [*f["both"], "--sensitivity", "0"], BadValue, "--sensitivity"),
        (lambda f: [*f["both"], "--order", "9"], BadValue, "--order is 9"),
        (lambda f: [*f["both"], "--channel", "5"], BadFile, "--channel is 5"),
        (lambda f: [*f["both"], "--channel", "0"], BadMeasurement, "no signal|do not fit"),
        (lambda f: ["--sweep", f["sweep"], "--recorded", f["silent"]], BadMeasurement, "no signal"),
        (lambda f: ["--sweep", f["sweep"], "--recorded", f["clipped"]], BadMeasurement, "clipped"),
        (lambda f: ["--sweep", f["sweep"], "--recorded", f["slow"]], BadMeasurement, "44100 Hz"),
        (lambda f: ["--sweep", f["sweep"], "--recorded", f["short"]], BadMeasurement, "does not hold the whole"),
        (lambda f: ["--sweep", f["sweep"], "--recorded", f["twice"]], BadMeasurement, "say --channel"),
        (lambda f: ["--sweep", f["narrow"], "--recorded", f["narrow_heard"]], BadFile, "sweep over all of them"),
        (lambda f: ["--sweep", f["sweep"], "--recorded", f["text"]], BadFile, "cannot be read"),
        (lambda f: ["--sweep", f["sweep"], "--recorded", f["hours"]], BadFile, "allowed: 67108864 samples, 23 minutes"),
        (lambda f: ["--sweep", "no.wav", "--recorded", f["silent"]], BadFile, r"no\.wav cannot be read: no such file"),
        (lambda f: ["--target", "moon"], BadValue, "--target"),
        (lambda f: ["--target", "simulator", "--tile", "t9"], BadValue, "t9"),
        (lambda f: ["--target", "simulator", "--seed", "-1"], BadValue, "--seed"),
        (lambda f: ["--target", "simulator", "--level", "2"], BadValue, "level"),
        (lambda f: ["--target", "sound", "--output", "no such card"], DeviceError, "no such card|PortAudio"),
    ],
)
def test_what_cannot_be_is_one_line_and_changes_nothing(wavs, tmp_path, make, error, word):
    narrow = train(exponential(100.0, 400.0, 1.0, RATE, 0.1), 1, RATE)
    (tmp_path / "text.wav").write_text("not a sound")
    soundfile.write(tmp_path / "hours.wav", np.zeros(480), RATE, format="FLAC")
    hours = bytearray((tmp_path / "hours.wav").read_bytes())
    hours[22:26] = (1 << 30).to_bytes(4)  # of the 36 bits of STREAMINFO (RFC 9639, 8.2)
    (tmp_path / "hours.wav").write_bytes(hours)
    files = {
        "both": wavs,
        "sweep": wavs[1],
        "silent": write(tmp_path / "silent.wav", np.zeros(SWEEP.size)),
        "clipped": write(tmp_path / "clipped.wav", np.clip(heard(), -0.02, 0.02)),
        "slow": write(tmp_path / "slow.wav", heard(), 44_100),
        "short": write(tmp_path / "short.wav", heard()[: heard().size // 2]),
        "twice": write(tmp_path / "twice.wav", np.stack([heard(), heard() + np.roll(heard(), 40)], axis=1)),
        "narrow": write(tmp_path / "narrow.wav", narrow),
        "narrow_heard": write(tmp_path / "narrow_heard.wav", tile().respond(narrow, RATE, "none") / SENSITIVITY),
        "text": str(tmp_path / "text.wav"),
        "hours": str(tmp_path / "hours.wav"),
    }
    profile = tmp_path / "t1.json"
    with pytest.raises(error, match=word) as caught:
        said(*make(files), "--profile", str(profile))
    assert "\n" not in str(caught.value)
    assert not profile.exists()
