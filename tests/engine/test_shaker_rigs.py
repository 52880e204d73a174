"""The bench of a sound card: real PortAudio into a PulseAudio null sink, whose monitor is the input."""

import subprocess
import sys

import numpy as np
import pytest
from null_sink import listening

from underfoot.calibration.rig import Sound
from underfoot.calibration.science.sweep import exponential, train
from underfoot.calibration.science.transfer_function import measure
from underfoot.engine.safety import Limits, limited
from underfoot.engine.shaker_rigs import SimulatedShaker, SoundCard, require_channel, simulated_recording
from underfoot.errors import BadMeasurement, BadValue, DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.simulated_tile import SimulatedTile

RATE = 48_000
TILE = default_floor().tiles[0]


def test_what_a_card_plays_has_passed_the_limiter_and_comes_back(null_sink, tmp_path):
    """The sink's monitor hears what is played: the sweep itself, which is what the measurement says of it.

    Other inputs hear nothing of it, though the server mixes: what few outputs play goes to all, few inputs hear all.
    In a process of its own, since PortAudio looks for devices only once. A busy machine may lose samples, and says so,
    or be late to answer.
    """
    script = f"""
import numpy as np
from underfoot.calibration.rig import Sound
from underfoot.engine import card_process
from underfoot.engine.shaker_rigs import SoundCard
from underfoot.errors import BadMeasurement
card_process.ANSWER_S = 120.0
for channel, input_channel in ((0, 0), (0, 2), (2, 0)):
    card = SoundCard(channel=channel, input_channel=input_channel, channels=4)
    for _ in range(8):
        try:
            heard = card.play(Sound(np.load("sweep.npy"), {RATE}, "none"))
            break
        except BadMeasurement as reason:
            assert "lost samples" in str(reason)
    else:
        break
    card.close()
    np.save(f"heard{{channel}}{{input_channel}}.npy", heard)
"""
    sweep = train(exponential(20.0, 2000.0, 1.0, RATE, 0.4), 1, RATE, 0.3)
    np.save(tmp_path / "sweep.npy", sweep)
    subprocess.run([sys.executable, "-c", script], check=True, cwd=tmp_path)
    if not (tmp_path / "heard20.npy").exists():
        pytest.skip("this machine lets no sound through whole")
    heard, from_first, at_first = (np.load(tmp_path / f"heard{how}.npy") for how in ("00", "02", "20"))
    assert not from_first.any()
    assert not at_first.any()
    played = limited(sweep, RATE)
    at = int(np.argmax(np.correlate(heard, played[50_000:60_000], "valid"))) - 50_000
    np.testing.assert_allclose(heard[at + 14_400 : at + 60_000], played[14_400:60_000], atol=1e-4)
    with pytest.raises(BadMeasurement, match="the sweep itself"):
        measure(sweep, heard, RATE)


def test_a_card_that_is_silenced_or_unplugged_ends_the_sweep_and_takes_nothing(null_sink, until):
    """Where this machine loses samples, the sweep is taken again, as a person would."""
    script = f"""
import sys, threading
from underfoot.calibration.rig import Sound
from underfoot.calibration.science.sweep import exponential
from underfoot.engine.shaker_rigs import SoundCard
from underfoot.errors import BadMeasurement, DeviceError
card = SoundCard()
def silence():
    sys.stdin.readline()
    card.silence()
threading.Thread(target=silence).start()
reason = None
for end in ("was stopped", "cannot play"):
    while end not in str(reason):
        try:
            card.play(Sound(exponential(20.0, 2000.0, 20.0, {RATE}, 0.4), {RATE}, "none"))
        except (BadMeasurement, DeviceError) as refused:
            reason = refused
            print(reason, flush=True)
    card.silence()
    if end == "was stopped":
        sys.stdin.readline()
"""
    with listening(null_sink) as heard:
        pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
        with subprocess.Popen([sys.executable, "-c", script], text=True, **pipes) as run:
            try:
                until(lambda: heard().any(), "it sounds", seen=heard.summary, every=0.1)
                before = len(heard())
                run.stdin.write("\n")
                run.stdin.flush()
                while "was stopped; take it again" not in run.stdout.readline():
                    assert run.poll() is None
                until(lambda: not heard()[-9_600:].any(), "it is silent again", seen=heard.summary, every=0.1)
                last = np.flatnonzero(heard().any(axis=1))[-1]
                run.stdin.write("\n")
                run.stdin.flush()
                until(lambda: heard()[last + 1 :].any(), "it sounds again", seen=heard.summary, every=0.1)
                null_sink.stop()
                said, _ = run.communicate(timeout=300)
            finally:
                run.kill()
    assert last - before < 10 * RATE
    *stopped, gone = said.splitlines()
    assert "the sound card lost samples and stopped; is it plugged in? Take it again" in stopped
    assert gone.startswith("sound device 'default' cannot play and record: Error opening")
    assert gone.endswith("; is it plugged in, and free?")


@pytest.mark.parametrize("kind", ["input", "output"])
def test_a_card_without_the_channel_is_named(kind):
    stereo = {"name": "Stereo", "max_input_channels": 2, "max_output_channels": 2}
    with pytest.raises(DeviceError, match=f"^sound device 'Stereo' has 2 {kind} channels, from 0; not 2$"):
        require_channel(stereo, kind, 2)


def test_without_the_card_the_error_is_one_line():
    pytest.importorskip("sounddevice", reason="PortAudio is not installed", exc_type=OSError)
    with pytest.raises(DeviceError, match="no such card") as error:
        SoundCard("no such card")
    assert "\n" not in str(error.value)


def test_without_portaudio_the_error_is_one_line(tmp_path, monkeypatch):
    (tmp_path / "sounddevice.py").write_text('raise OSError("PortAudio library not found")')
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    script = """
from underfoot.engine.shaker_rigs import SoundCard
from underfoot.errors import DeviceError
try:
    SoundCard()
except DeviceError as error:
    assert "PortAudio" in str(error) and "\\n" not in str(error)
else:
    raise SystemExit("it opened")
"""
    subprocess.run([sys.executable, "-c", script], check=True)


def test_channels_that_cannot_be_are_refused():
    for channels in ({"channel": -1}, {"input_channel": 99}):
        with pytest.raises(BadValue):
            SoundCard(**channels)


def test_the_simulated_shaker_hears_the_simulated_tile_past_the_limiter():
    loud = Sound(np.concatenate([np.zeros(100), np.full(4_800, 2.0)]), RATE, "none")
    heard = SimulatedShaker(SimulatedTile(TILE, seed=2)).play(loud)
    again = SimulatedTile(TILE, seed=2)
    expected = again.respond(limited(loud.signal, RATE), RATE, "none") / again.parameters.accelerometer.range_m_s2
    np.testing.assert_array_equal(heard, expected)
    np.testing.assert_array_equal(simulated_recording(SimulatedTile(TILE, seed=2), loud), heard)
    assert np.abs(limited(loud.signal, RATE)).max() <= Limits().peak
