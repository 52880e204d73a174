"""Real PortAudio into a PulseAudio null sink, judged by the samples that arrive there."""

import itertools
import re
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest
from live import live
from made_patches import hum, rough_step
from null_sink import listening
from scipy.signal import correlate

from underfoot.clock import FADE
from underfoot.devices.accelerometers import Accelerometer
from underfoot.devices.sound import PlayRecord, Stream, device_of, devices, max_channels, portaudio
from underfoot.engine.commands import Level, Panic, Swap
from underfoot.engine.reports import Costs, Notice, OutputChanged, Started
from underfoot.engine.safety import PANIC
from underfoot.engine.session_replay import ReplayJob
from underfoot.errors import DeviceError
from underfoot.floor.layout import Floor, default_floor
from underfoot.nodes import REGISTRY
from underfoot.records.recording import Recording

BUFFER_S = 0.08
SINE = {"frequency": 100.0, "harmonics": (1.0,), "amplitude": 4.0}


def placed(heard, played):
    """Where `played` [frame, channel] begins in `heard`, sample for sample; None where it is not in it."""
    frame = int(np.argmax(np.abs(played).max(axis=1)))
    for at in np.flatnonzero((heard[:, : played.shape[1]] == played[frame]).all(axis=1)):
        begin = at - frame
        if begin >= 0 and np.array_equal(heard[begin : begin + len(played), : played.shape[1]], played):
            return begin
    return None


def settled(playing):
    playing.started()
    playing.session.send(Level(0.0))
    playing.play(24_000)


def test_what_arrives_is_what_the_engine_says_it_played(null_sink, until):
    """Bit for bit, on every tile's own channel, in every tenth of a second that this machine lets through whole."""
    late = {}  # of each tenth that arrived whole, by how many frames it is later in what was heard

    def compare():
        playing.poll()
        arrived = heard()
        for first in range(14_400, playing.end - 4_800, 4_800):
            part = playing.played(first, 4_800)
            if first not in late and part.any() and (place := placed(arrived, part)) is not None:
                late[first] = place - first
        ask_nothing = [late[first] == late[first + 4_800] for first in late if first + 4_800 in late]
        return len(late) >= 10 and sum(ask_nothing) >= 5

    with listening(null_sink) as heard, live(rough_step(), until, sound="", latency_s=BUFFER_S) as playing:
        assert playing.started().where == "sound card"
        playing.session.send(Level(0.0))
        playing.until(lambda: playing.end > 19_200 and playing.played(19_200, playing.end - 19_200).any(axis=0).all())
        until(compare, "ten tenths arrive, and some behind one another", every=0.1)
    assert (np.diff([late[first] for first in sorted(late)]) >= 0).all()


def test_a_panic_drops_what_waits_in_the_buffer(null_sink, until, tmp_path):
    """And what was recorded of it is replayed to the same bytes."""
    path = tmp_path / "session.uf"
    patch = hum(tone=SINE)
    with listening(null_sink) as heard, live(patch, until, path, sound="", latency_s=BUFFER_S, walker=False) as playing:
        settled(playing)
        until(lambda: np.abs(heard()[-480:]).max() > 0.1, "it is heard", seen=heard.summary)
        before = len(heard())
        playing.session.panic()
        edge = playing.done(Panic)
        until(lambda: not heard()[-9_600:].any(), "it is silent", seen=heard.summary)
        arrived = heard()
        last = np.flatnonzero(arrived.any(axis=1))[-1]
        assert last - before < 240_000  # the buffer, a block, and for how long this machine may hold parec up
        playing.play(9_600)
        assert not playing.played(edge + PANIC, 9_000).any()
        assert not heard()[last + 1 :].any()
        playing.session.play()
        until(lambda: (playing.poll(), np.abs(heard()[-480:]).max() > 0.1)[1], "it is heard again", seen=heard.summary)
        playing.session.stop_recording()
    with Recording(path) as recording:
        played = recording.vibration()[1]
    assert played.any()
    assert ReplayJob(path).run().samples.tobytes() == played.tobytes()


@pytest.mark.parametrize("sound", ["no such card", ""])
def test_without_a_sound_card_the_session_goes_on_and_says_so_once(until, monkeypatch, tmp_path, sound):
    if not sound:
        cards = Path("/proc/asound/cards")
        if cards.exists() and "no soundcards" not in cards.read_text():
            pytest.skip("this machine has a sound card")
        (tmp_path / "asound.conf").write_text("pcm.!default { type hw\n card 0 }\nctl.!default { type hw\n card 0 }\n")
        monkeypatch.setenv("ALSA_CONFIG_PATH", str(tmp_path / "asound.conf"))
    with live(hum(), until, sound=sound) as playing:
        started = playing.started()
        assert started.where == "the simulator, without sound"
        assert re.fullmatch(r"there is no sound device|sound device 'no such card' cannot play .*", started.notice)
        playing.play(9_600)
        assert playing.played(playing.end - 480, 480).any()
        assert len(playing.of(Started)) == 1
        assert playing.of(Notice) == []


def test_a_sound_card_that_goes_away_does_not_end_the_session(null_sink, until, capfd):
    """PortAudio and ALSA wrote six lines to the terminal every two seconds until it was back."""
    with live(hum(), until, sound="", latency_s=BUFFER_S) as playing:
        assert playing.started().where == "sound card"
        playing.play(9_600)
        null_sink.stop()
        playing.until(lambda: playing.of(Notice), "it is told")
        gone = "the default sound device has gone; going on without sound until it is back"
        where = "the simulator, without sound"
        assert playing.of(Notice) == [OutputChanged(gone, where, "the default sound device is not there")]
        playing.play(24_000)
        assert len(playing.of(Started)) == 1
        assert len(playing.of(Notice)) == 1
        assert playing.session.health.stream_latency_s == 0.0
    assert capfd.readouterr().err == ""


def test_a_sound_card_that_comes_back_is_heard_again_in_a_ramp(null_sink, until):
    """And when it goes away once more, that is told once more."""
    with live(hum(tone=SINE), until, sound="", latency_s=BUFFER_S, walker=False) as playing:
        settled(playing)
        null_sink.stop()
        playing.until(lambda: len(playing.of(OutputChanged)) == 1, "it is told")
        known = null_sink.socket
        null_sink.socket = known.with_name("beside")
        null_sink.start()
        with listening(null_sink) as heard:
            null_sink.socket = null_sink.socket.rename(known)  # from now on the session can find it
            until(
                lambda: (playing.poll(), np.count_nonzero(heard()[:, 0]) > 2_400)[1],
                "it is heard again",
                seen=heard.summary,
            )
            arrived = heard()[:, 0]
        begin = np.flatnonzero(arrived)[0] - 1  # the ramp's first frame is silent
        period = arrived[begin + FADE : begin + 2 * FADE]  # the ramp is as long as the period
        assert np.abs(period).max() > 0.1
        np.testing.assert_allclose(arrived[begin : begin + FADE], period * np.linspace(0.0, 1.0, FADE), atol=0.003)
        assert playing.of(OutputChanged)[1:] == [OutputChanged("the default sound device is back", "sound card")]
        null_sink.stop()
        playing.until(lambda: len(playing.of(OutputChanged)) == 3, "it is told again")


def test_a_sound_card_that_is_there_later_than_the_session_is_found(null_sink, until):
    """As after a power cut: the session stayed silent."""
    null_sink.stop()
    with live(hum(), until, sound="", latency_s=BUFFER_S) as playing:
        assert playing.started().where == "the simulator, without sound"
        null_sink.start()
        playing.until(lambda: playing.of(OutputChanged), "it is found")
        assert playing.of(OutputChanged) == [OutputChanged("the default sound device is back", "sound card")]


def test_a_tile_without_a_channel_is_named(null_sink, until):
    tiles = default_floor(1, 3).tiles
    floor = Floor((*tiles[:2], msgspec.structs.replace(tiles[2], output=40)))
    with live(hum(), until, sound="", latency_s=BUFFER_S, floor=floor) as playing:
        assert playing.started().notice == "tiles without a channel: t3"
        playing.play(4_800)
        assert not playing.played(playing.end - 480, 480)[:, 2].any()
        assert playing.played(playing.end - 480, 480)[:, 0].any()


@pytest.mark.parametrize(("tiles", "sound"), [(1, ""), (3, ""), (2, "uf=4")])
def test_tiles_are_heard_on_their_own_channels(null_sink, until, tiles, sound):
    """A sound server played a single one on all outputs, the third of three on none, and two on 3 and 4, too."""
    how = {"sound": sound, "latency_s": BUFFER_S, "walker": False, "floor": default_floor(1, tiles)}
    with listening(null_sink) as heard, live(hum(tone=SINE), until, **how) as playing:
        settled(playing)
        until(lambda: (np.abs(heard()[-480:, :tiles]).max(axis=0) > 0.1).all(), "all are heard", seen=heard.summary)
        assert not heard()[:, tiles].any()


@pytest.mark.parametrize("tiles", [2, 3])
def test_sound_for_ears_arrives_on_the_channel_behind_the_tiles(null_sink, until, tiles):
    """Of tiles that are silent. Behind three a card has one open for their pairs: a later patch's Sound plays there."""
    silent = hum(tone=SINE).set("tile-output", "level", 0.0, REGISTRY)
    patch = silent.add("sound-output", REGISTRY).connect("tone.out", "sound-output.sound", REGISTRY)
    how = {"sound": "", "latency_s": BUFFER_S, "walker": False, "floor": default_floor(1, tiles)}
    with listening(null_sink) as heard, live(silent if tiles == 3 else patch, until, **how) as playing:
        settled(playing)
        playing.session.edit(patch)
        playing.until(lambda: np.abs(heard()[-480:, tiles]).max() > 0.1, "it is heard")
        assert not np.delete(heard(), tiles, axis=1).any()
        assert playing.started().notice == ""


def test_sound_that_comes_with_a_later_patch_is_said_to_have_no_channel_and_the_end_is_a_ramp(null_sink, until):
    """Once, and what the tiles are heard to do goes on meanwhile, until the session ends."""
    patch = hum(tone=SINE)
    with listening(null_sink) as heard:
        with live(patch, until, sound="", latency_s=BUFFER_S, walker=False) as playing:
            settled(playing)
            lacking = patch.add("sound-output", REGISTRY).connect("tone.out", "sound-output.sound", REGISTRY)
            for times, edited in enumerate((lacking, patch, lacking), 1):  # as by cues that play a preset, and stop it
                playing.session.edit(edited)
                playing.done(Swap, times)
            playing.until(lambda: playing.of(Notice), "it is told")
            (told,) = playing.of(Notice)
            assert told.text.startswith("this patch's Sound has no channel; choose the sound card again")
            playing.until(lambda: any("sound-output" in costs.left_out for costs in playing.of(Costs)), "it is not run")
            until(lambda: np.abs(heard()[-480:]).max() > 0.1, "it is heard", seen=heard.summary)
        until(lambda: not heard()[-9_600:].any(), "it is silent", seen=heard.summary)
        arrived = heard()[:, 0]
    end = np.flatnonzero(arrived)[-1] + 1
    period = arrived[end - 2 * FADE : end - FADE]  # 480 frames: the ramp is as long as the period
    np.testing.assert_allclose(arrived[end - FADE : end], period * np.linspace(1.0, 0.0, FADE), atol=0.003)


def test_a_device_that_is_not_there_is_named_in_one_line():
    pytest.importorskip("sounddevice", reason="PortAudio is not installed", exc_type=OSError)
    with pytest.raises(DeviceError, match="no such card") as error:
        Stream("no such card", 2, 48_000, 128, lambda: 0)
    assert "\n" not in str(error.value)


def test_a_sounddevice_without_what_moves_memory_is_named_in_one_line(monkeypatch):
    sounddevice = pytest.importorskip("sounddevice", reason="PortAudio is not installed", exc_type=OSError)
    monkeypatch.delattr(sounddevice, "_ffi")
    with pytest.raises(DeviceError, match=r"sounddevice [\d.]+ cannot be played with .*; install sounddevice 0\.5"):
        Stream("", 2, 48_000, 128, lambda: 0)


_CUT = """
import threading
import numpy as np
from underfoot.devices.sound import PlayRecord

rate = 48_000
tone = 0.4 * np.sin(2.0 * np.pi * 100.0 * np.arange(20 * rate) / rate)
exchange = None

def silence_after(frames, exchange):
    while exchange.played_frames < frames:
        threading.Event().wait(0.002)
    exchange.silence()

while exchange is None or exchange.lost:
    exchange = PlayRecord("", "", np.stack([tone, tone], axis=1).astype(np.float32), 1, rate)
    if CUT_AFTER:
        threading.Thread(target=silence_after, args=(CUT_AFTER, exchange), daemon=True).start()
    else:
        exchange.silence()
    exchange.run()
print(exchange.silenced, exchange.played_frames)
"""


def _cut(after):
    """What an exchange of 20 s that is silenced after so many frames says of itself, and how many frames it played.

    A machine that is too busy loses samples, or PortAudio ends the stream; then the exchange is taken again.
    """
    script = _CUT.replace("CUT_AFTER", repr(after))
    run = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True, timeout=300)
    silenced, frames = run.stdout.split()
    return silenced == "True", int(frames)


def test_an_exchange_that_is_silenced_is_ramped_down_and_ends(null_sink, until):
    with listening(null_sink) as heard:
        silenced, frames = _cut(48_000)
        all_arrived = len(heard()) + 96_000
        until(
            lambda: len(heard()) > all_arrived and not heard()[-9_600:].any(), "it is silent again", seen=heard.summary
        )
        arrived = heard()[:, 0]
    assert silenced
    assert frames < 5 * 48_000
    end = np.flatnonzero(arrived)[-1] + 1
    period = arrived[end - 2 * FADE : end - FADE]  # the tone's period is as long as the ramp
    assert np.abs(period).max() > 0.3
    np.testing.assert_allclose(arrived[end - FADE : end], period * np.linspace(1.0, 0.0, FADE), atol=0.005)


def test_an_exchange_that_is_silenced_before_it_begins_plays_nothing(null_sink, until):
    with listening(null_sink) as heard:
        silenced, frames = _cut(0)
        seen = len(heard())
        until(lambda: len(heard()) > seen + 4_800, "the sink goes on", seen=heard.summary)
        assert not heard().any()
    assert silenced
    assert frames < 48_000


def test_an_exchange_with_a_device_that_is_not_there_is_one_line():
    pytest.importorskip("sounddevice", reason="PortAudio is not installed", exc_type=OSError)
    with pytest.raises(DeviceError, match="no such card") as error:
        PlayRecord("no such card", "", np.zeros((48, 1), np.float32), 1, 48_000).run()
    assert "\n" not in str(error.value)


def test_a_device_says_how_many_channels_it_has(monkeypatch):
    sounddevice = pytest.importorskip("sounddevice", reason="PortAudio is not installed", exc_type=OSError)
    for channels, most in ((2, 2), (128, 32)):
        device = {"max_output_channels": channels}
        monkeypatch.setattr(sounddevice, "query_devices", lambda name, kind, device=device: device)
        assert max_channels("") == most
    monkeypatch.undo()
    assert max_channels("no such card") == 32


@pytest.fixture
def windows_cards(monkeypatch):
    """sounddevice with the cards of a computer under Windows: one pair of speakers, which three systems list."""
    sounddevice = pytest.importorskip("sounddevice", reason="PortAudio is not installed", exc_type=OSError)
    systems = ("MME", "Windows DirectSound", "Windows WASAPI", "ASIO")
    listed = [("Speakers (USB Audio)", 2, k) for k in range(3)]
    listed += [("Microphone (USB Audio)", 0, 2), ("Headphones", 2, 2), ("ASIO4ALL v2", 8, 3)]
    cards = [
        {
            "name": name,
            "hostapi": system,
            "max_output_channels": channels,
            "max_input_channels": 2 - channels,
            "default_samplerate": 48_000.0,
        }
        for name, channels, system in listed
    ]
    monkeypatch.setattr(sounddevice, "query_devices", lambda: cards)
    monkeypatch.setattr(sounddevice, "query_hostapis", lambda k: {"name": systems[k]})
    return sounddevice


def test_a_card_that_several_systems_list_is_named_with_each_and_found_by_that_name(windows_cards):
    named = [card.name for card in devices()]
    assert named == [
        "Speakers (USB Audio), MME",
        "Speakers (USB Audio), Windows DirectSound",
        "Speakers (USB Audio), Windows WASAPI",
        "Speakers (USB Audio), Windows WASAPI, exclusive",
        "Headphones, Windows WASAPI",
        "Headphones, Windows WASAPI, exclusive",
        "ASIO4ALL v2, ASIO",
    ]
    # What every stream calls to find its card; it has no public name.
    found = [windows_cards._get_device_id(device_of(name), "output", raise_on_error=True) for name in named]  # noqa: SLF001
    assert found == [0, 1, 2, 2, 4, 4, 5]


def test_cards_of_one_system_have_their_names_alone(windows_cards, monkeypatch):
    cards = windows_cards.query_devices()[2:5]
    monkeypatch.setattr(windows_cards, "query_devices", lambda: cards)
    assert [card.name for card in devices()] == ["Speakers (USB Audio)", "Headphones"]


@pytest.mark.parametrize("name", ["Headphones, Windows WASAPI", "Headphones, Windows WASAPI, exclusive"])
def test_a_card_is_opened_exclusively_where_its_name_says_so(windows_cards, monkeypatch, name):
    asked = {}

    class Settings(windows_cards.WasapiSettings):
        def __init__(self, exclusive):
            super().__init__(exclusive=exclusive)
            self.is_exclusive = exclusive

    monkeypatch.setattr(windows_cards, "RawOutputStream", lambda **how: asked.update(how))
    monkeypatch.setattr(windows_cards, "WasapiSettings", Settings)
    Stream(name, 2, 48_000.0, 64, lambda: 0)
    assert asked["device"] == "Headphones, Windows WASAPI"
    settings = asked["extra_settings"]
    assert (settings is not None and settings.is_exclusive) == name.endswith("exclusive")


@pytest.mark.parametrize(("system", "cure"), [("linux", "libportaudio2"), ("win32", "sounddevice again")])
def test_what_is_to_be_installed_where_portaudio_is_missing_depends_on_the_system(monkeypatch, system, cure):
    monkeypatch.setitem(sys.modules, "sounddevice", None)
    monkeypatch.setattr(sys, "platform", system)
    with pytest.raises(DeviceError, match=cure):
        portaudio()


def test_without_portaudio_there_are_no_devices():
    script = """
import sys
sys.modules["sounddevice"] = None
from underfoot.devices import sound
assert sound.devices() == []
"""
    subprocess.run([sys.executable, "-c", script], check=True)


def found_later(path):
    """By how many frames pieces of what two accelerometers measured come later than what was played there.

    Of 25 ms each, and only those that arrived whole: others lie between two underruns, or the server mixed them.
    """
    with Recording(path) as recording:
        begun, played = recording.vibration()
        asked = recording.acceleration("commanded")[1]
        first, measured = recording.acceleration("measured")
    assert not measured[:, [2, 3]].any()
    assert asked.any()
    delays = []
    for at, tile in itertools.product(range(24_000, 96_000, 1_200), (0, 1)):
        begin = begun + at - first
        part = measured[max(begin, 0) : begin + 1_200, tile] / 20.0
        if len(part) == 1_200 and np.abs(part).max() > 0.01:  # the last are told late
            around = played[at - 9_600 : at + 14_400, tile]
            place = int(np.argmax(correlate(around, part, "valid", "fft")))
            if np.allclose(around[place : place + 1_200], part, rtol=1e-6, atol=1e-9):
                delays.append(place - 9_600)
    return delays


def test_accelerometers_are_heard_at_the_frames_that_were_played(null_sink, until, tmp_path):
    """The sink's monitor is the input: what comes back stands where it was played, whatever the device says."""
    told = (Accelerometer("t1", 0, 20.0), Accelerometer("t2", 1, 20.0))  # two of four inputs: the server mixes
    how = {"sound": "", "latency_s": BUFFER_S, "accelerometers": told}
    delays = []
    with live(rough_step(), until, **how) as playing:
        assert playing.started().where == "sound card"
        playing.session.send(Level(0.0))

        def enough():
            path = tmp_path / f"{len(list(tmp_path.glob('*.uf')))}.uf"
            playing.session.record(path)
            playing.play(144_000)
            playing.session.stop_recording()
            delays.extend(found_later(path))
            return len(delays) >= 3

        def agree():  # not while a busy machine's sound server has just lost blocks
            playing.play(24_000)
            health = playing.session.health
            return 0.0 < health.stream_latency_s <= health.round_trip_s and health.clock_trip_s > 0.0

        until(enough, "three pieces come back whole", seconds=400.0, seen=lambda: delays)
        until(agree, "the latency is part of the round trip", seconds=400.0, seen=lambda: playing.session.health)
    assert np.median(delays) == 0.0


def test_a_computer_without_any_sound_device_is_said_in_words(monkeypatch):
    """PortAudio says "Error querying device -1"."""
    sounddevice = portaudio()

    def fail(**how):
        raise sounddevice.PortAudioError("Error querying device -1")

    monkeypatch.setattr(sounddevice, "query_devices", lambda *_: [])
    monkeypatch.setattr(sounddevice, "RawOutputStream", fail)
    with pytest.raises(DeviceError, match=r"^there is no sound device$"):
        Stream("", 4, 48_000.0, 64, lambda: 0)
    with pytest.raises(DeviceError, match=r"^sound device 'mine' cannot play 4 channels at 48000 Hz: Error"):
        Stream("mine", 4, 48_000.0, 64, lambda: 0)
