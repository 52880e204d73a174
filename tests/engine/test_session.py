"""Live sessions: replayed to the same bytes, edited, silenced, and restarted after a process is killed."""

import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from live import live
from made_patches import hum, patch_of, rough_step, stepped_bank
from scipy.io import wavfile
from wired import ends

from underfoot.clock import FADE
from underfoot.devices.emulation.emulator import Emulator
from underfoot.devices.replay import Replay
from underfoot.engine.commands import Level, Panic, PressTile, Pulse, Set, Strike, Swap, Tare, Walk
from underfoot.engine.reports import Notice, Outlines, OutputChanged, PatchRefused, Preview, ProcessDied, SensorFaults
from underfoot.engine.safety import PANIC
from underfoot.engine.session import Session
from underfoot.engine.session_replay import ReplayJob
from underfoot.engine.target import Target
from underfoot.errors import BadValue, DeviceError
from underfoot.floor.forces import ForceSeries
from underfoot.floor.layout import default_floor
from underfoot.nodes import REGISTRY
from underfoot.patch.patch import Patch
from underfoot.records.recording import Recording

SINE = {"frequency": 100.0, "harmonics": (1.0,), "amplitude": 4.0}


def test_a_live_session_replayed_gives_the_same_bytes(until, tmp_path):
    """Everything that a hand can do to a session while it runs, and then the recording at three block sizes."""
    path = tmp_path / "session.uf"
    patch = stepped_bank()
    with live(patch, until, record=path) as playing:
        session = playing.session
        session.edit(patch.set("modal-bank", "decay", 1.2, REGISTRY))
        playing.started()
        for command in (Level(-6.0), Strike("", "t2", 0.8), PressTile("t3", 0.05, 0.02, 350.0)):
            session.send(command)
            playing.play(3_000)
        session.edit(session.patch.set("modal-bank", "pitch", 1.5, REGISTRY))
        session.send(Strike("", "t1", 0.4))
        session.edit(rough_step())
        session.send(PressTile("t3", -0.05, 0.01, 500.0))
        playing.done(Swap)
        session.send(Tare())
        session.send(Set("scale", "out_high", 6.0))
        playing.play(5_000)
        session.panic()
        playing.done(Panic)
        session.play()
        session.send(Pulse("t4"))
        session.edit(stepped_bank())
        session.edit(hum().set("tone", "frequency", 80.0, REGISTRY))
        playing.done(Swap, times=2)
        session.stop()
        playing.play(2_000)
        session.play()
        session.send(Walk(False))
        session.send(PressTile("t3", 0.0, 0.0, 0.0))
        playing.play(5_000)
        session.stop_recording()
    with Recording(path) as recording:
        first, played = recording.vibration()
        commands = {kind for _, kind, _ in recording.commands()}
        tiles = {
            "commanded": recording.acceleration("commanded")[1],
            "accelerometer": recording.acceleration("measured")[1],
        }
        assert recording.gaps() == recording.gaps("measured") == []
    assert first == 0
    assert {"Set", "Swap", "Strike", "Press", "Level", "Panic", "Play", "Tare", "Walk", "Pulse"} <= commands
    assert played.any(axis=0).all()
    assert tiles["accelerometer"].any(axis=0).all()
    for block in (7, 64, 1024):
        again = ReplayJob(path, block, ("accelerometer",)).run()
        assert again.samples.tobytes() == played.tobytes(), block
        for name, samples in tiles.items():
            assert again.tiles[name].tobytes() == samples.tobytes(), (name, block)


def test_a_force_file_played_live_and_recorded_gives_the_same_bytes(until, tmp_path):
    """At a rate at which samples fall between frames, with gaps, over and over."""
    time_s = np.arange(0.0, 0.6, 1.0 / 431.7)
    time_s = time_s[(time_s < 0.3) | (time_s > 0.37)]
    on = np.where((time_s > 0.1) & (time_s < 0.5), 300.0, 0.0)
    lines = [f"{now!r},{','.join([repr(force)] * 4)}" for now, force in zip(time_s.tolist(), on.tolist(), strict=True)]
    csv = tmp_path / "walk.csv"
    csv.write_text("\n".join(["time_s,t1.1,t1.2,t1.3,t1.4", *lines]))
    path, floor = tmp_path / "session.uf", default_floor(1, 1)
    with live(rough_step(), until, record=path, floor=floor, kind="replay", source=str(csv)) as playing:
        playing.started()
        playing.play(48_000)
        shown = playing.session.health.frame
        playing.session.stop_recording()
    with Recording(path) as recording:
        played = recording.vibration()[1]
    assert len(played) >= shown  # and not only what the engine had reported, a block or more ago
    assert played.any()
    for block in (7, 1024):
        assert ReplayJob(path, block).run().samples.tobytes() == played.tobytes()


@pytest.fixture(scope="module")
def shared(until):
    with live(hum(tone=SINE), until, walker=False) as playing:
        playing.complete()
        playing.session.send(Level(0.0))
        yield playing


@pytest.fixture
def playing(shared):
    """A session that plays 100 Hz on all tiles, the same one for several tests."""
    shared.session.edit(hum(tone=SINE))
    shared.play(20_000)  # until the DC block has settled
    shared.reports.clear()
    return shared


def test_edits_are_heard_without_a_click(playing):
    """A tone of 100 Hz repeats itself every 480 frames, whatever is put behind it, and through any swap."""
    session = playing.session
    behind = patch_of(("tone.out", "gain.signal"), ("gain.out", "tile-output.acceleration"), tone=SINE)
    session.edit(behind)
    swap = playing.done(Swap)
    playing.play(8_000)
    session.edit(behind.set("gain", "gain", 0.5, REGISTRY))
    move = playing.done(Set)
    playing.play(4_000)
    around = playing.played(swap - 2_400, 2_400 + FADE + 2_400)[:, 0]
    assert np.abs(around).max() == pytest.approx(0.2, rel=0.01)
    np.testing.assert_allclose(around[480:], around[:-480], atol=2e-6)
    ramp = playing.played(move - 480, 1_440)[:, 0]
    steepest = 0.2 * (2.0 * np.pi * 100.0 / 48_000 + 0.5 / 240)
    assert np.abs(np.diff(ramp)).max() <= steepest
    assert np.abs(ramp[-480:]).max() == pytest.approx(0.1, rel=0.03)


def test_a_panic_is_silence_in_a_millisecond_until_play(playing):
    session = playing.session
    session.panic()
    assert session.memory.status.panic
    edge = playing.done(Panic)
    playing.play(4_800)
    assert playing.played(edge - 480, 480).any(axis=0).all()
    assert not playing.played(edge + PANIC, 4_000).any()
    session.play()
    assert not session.memory.status.panic
    playing.until(lambda: playing.played(playing.end - 480, 480).any(), "sound is let out again")


def test_an_engine_that_is_killed_is_back_with_the_patch_that_played(playing):
    """Also when the patch that is wanted cannot be played."""
    session = playing.session
    session.send(Set("tone", "frequency", 200.0))
    session.edit(patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": "none.wav"}))
    playing.until(lambda: playing.of(Notice), "the patch is refused")
    assert "none.wav" in playing.of(Notice)[0].text
    killed = time.perf_counter()
    os.kill(session.pids["engine"], signal.SIGKILL)
    playing.until(lambda: not session.health.running, "the death is noticed")
    playing.started()
    playing.play(4_800)
    back = time.perf_counter() - killed
    assert [(lost.process, lost.reason) for lost in playing.of(ProcessDied)] == [("engine", "signal 9")]
    ((end, start),) = playing.gaps
    assert 0.0 < (start - end) / 48_000 < back + 0.5  # the time without an engine is a gap
    playing.until(lambda: np.isfinite(playing.played(playing.end - 2_400, 2_400)).all(), "it has played for so long")
    sounding = playing.played(playing.end - 2_400, 2_400)[:, 0]
    assert np.argmax(np.abs(np.fft.rfft(sounding))) == 10  # 200 Hz, as was set
    assert np.abs(sounding).max() == pytest.approx(0.2, rel=0.05)
    playing.until(lambda: "standby" in session.pids, "another engine stands by")


def test_what_began_in_silence_waits_for_no_card_also_after_another_engine(until, monkeypatch):
    """As in the window without its card: one that came after an engine had died sounded with nobody asked."""
    monkeypatch.setattr("underfoot.engine.card_search.RETRY_S", 1e-3)
    with live(hum(), until, sound="no such card", start=False) as playing:
        session = playing.session
        session.stop()
        session.start()
        playing.started()
        session.play()
        os.kill(session.pids["engine"], signal.SIGKILL)
        playing.started(2)
        playing.play(4_800)
        assert "card search" not in session.pids


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_an_engine_leaves_it_to_the_session_when_to_end(playing, name):
    """A service manager sends SIGTERM to all processes: the output was cut off at full level, a blow of the shakers."""
    os.kill(playing.session.pids["engine"], getattr(signal, name))
    playing.play(9_600)
    assert playing.of(ProcessDied) == []


def test_an_engine_that_is_not_started_any_more_does_not_seem_to_run(until, monkeypatch):
    """The window said that it plays on, and `monitor` waited for ever for what it would play."""
    monkeypatch.setattr("underfoot.engine.session.MOST_DEATHS", 0)
    with live(hum(), until) as playing:
        playing.started()
        playing.play(4_800)
        os.kill(playing.session.pids["engine"], signal.SIGKILL)
        playing.until(lambda: playing.of(OutputChanged), "it is given up")
        assert not playing.session.health.running
    (given_up,) = playing.of(OutputChanged)
    assert given_up.text == "the engine fails again and again; it is not started any more: signal 9"
    assert [died.is_restarted for died in playing.of(ProcessDied)] == [False]
    assert given_up.where == "nothing"


def test_a_compiler_that_fails_again_and_again_takes_no_restart_from_the_engine(until, monkeypatch):
    """Four deaths of any process were counted together: the next one of the engine was silence."""
    monkeypatch.setattr("underfoot.engine.session.MOST_DEATHS", 1)
    with live(hum(), until) as playing:
        playing.complete()
        os.kill(playing.session.pids["compiler"], signal.SIGKILL)
        playing.until(lambda: playing.of(ProcessDied), "the death of the compiler is noticed")
        assert playing.session.is_compiled, "nothing waited: what plays was compiled and faded in again"
        os.kill(playing.session.pids["engine"], signal.SIGKILL)
        playing.started(2)
        assert playing.of(OutputChanged) == []


def test_a_patch_whose_compiler_is_given_up_is_refused(until, monkeypatch):
    """A cue or a stimulus waited for it for ever."""
    monkeypatch.setattr("underfoot.engine.session.MOST_DEATHS", 0)
    with live(hum(), until) as playing:
        playing.complete()
        os.kill(playing.session.pids["compiler"], signal.SIGSTOP)  # so that it does not answer before it dies
        playing.session.edit(patch_of(("noise.out", "tile-output.acceleration")))
        os.kill(playing.session.pids["compiler"], signal.SIGKILL)
        playing.until(lambda: playing.of(PatchRefused), "it is refused")
        (refused,) = playing.of(PatchRefused)
        reason = "the compiler fails again and again, the last time with signal 9"
        assert refused.text == f"the patch is not played: {reason}"
        playing.session.edit(hum(tone=SINE).set("tone", "harmonics", (1.0, 0.5), REGISTRY))
        playing.done(Swap)


def test_an_engine_that_stands_still_is_started_again_and_the_reason_is_told(playing, monkeypatch):
    """A sound server that stopped was told as signal 9, which was Underfoot's own."""
    playing.play(4_800)
    with monkeypatch.context() as patch:  # not for the next engine, on a busy machine
        patch.setattr("underfoot.engine.engine_supervisor.STALL_S", 2.0)
        os.kill(playing.session.pids["engine"], signal.SIGSTOP)
        playing.until(lambda: playing.of(ProcessDied), "it is lost")
    playing.started()
    (lost,) = playing.of(ProcessDied)
    look = "the sound card and its server answer, and whether a node of your own ends"
    assert lost.reason == f"nothing was played for 2 s; look whether {look}"
    playing.until(lambda: "standby" in playing.session.pids, "another engine stands by")


def test_an_engine_that_was_stopped_with_its_session_goes_on_with_it(playing, monkeypatch):
    """Ctrl-Z and fg: the engine was killed for the time, and the sound card was blamed."""
    playing.play(4_800)
    engine = playing.session.pids["engine"]
    os.kill(engine, signal.SIGSTOP)
    playing.poll()
    with monkeypatch.context() as patch:
        later = SimpleNamespace(perf_counter=lambda: time.perf_counter() + 60.0)
        patch.setattr("underfoot.engine.engine_supervisor.time", later)
        playing.poll()
        os.kill(engine, signal.SIGCONT)
        playing.play(4_800)
    assert (playing.of(ProcessDied), playing.session.pids["engine"]) == ([], engine)


def test_a_compiler_that_is_killed_is_back_with_the_picture_that_was_awaited(playing):
    session = playing.session
    playing.until(lambda: "compiler" in session.pids)
    pictures = {
        Preview: lambda: session.preview(session.patch, "tone"),
        Outlines: lambda: session.outline(hum(), ["tone"]),
    }
    for deaths, (kind, request) in enumerate(pictures.items(), 1):
        killed = session.pids["compiler"]
        os.kill(killed, signal.SIGSTOP)  # so that it does not answer before it dies
        ticket = request()
        os.kill(killed, signal.SIGKILL)
        playing.until(lambda deaths=deaths: len(playing.of(ProcessDied)) == deaths, "the death is noticed")
        playing.until(lambda kind=kind: playing.of(kind), "the picture comes")
        assert [picture.ticket for picture in playing.of(kind)] == [ticket]
    session.edit(patch_of(("noise.out", "tile-output.acceleration")))
    playing.done(Swap)


def test_an_engine_that_dies_while_a_patch_is_compiled_is_back_with_the_numbers_set_since(playing):
    """It came back with those that the patch was compiled with: a tone that was turned down was loud again."""
    session = playing.session
    playing.until(lambda: "compiler" in session.pids)
    session.send(Set("tone", "frequency", 200.0))
    os.kill(session.pids["compiler"], signal.SIGSTOP)  # so that it compiles for as long as is needed
    session.edit(session.patch.add("noise", REGISTRY))
    session.send(Set("tone", "amplitude", 2.0))
    os.kill(session.pids["engine"], signal.SIGKILL)
    playing.started()
    playing.play(4_800)
    playing.until(lambda: np.isfinite(playing.played(playing.end - 2_400, 2_400)).all(), "it has played for so long")
    sounding = playing.played(playing.end - 2_400, 2_400)[:, 0]
    os.kill(session.pids["compiler"], signal.SIGCONT)
    assert np.argmax(np.abs(np.fft.rfft(sounding))) == 10
    assert np.abs(sounding).max() == pytest.approx(0.1, rel=0.05)
    playing.done(Swap)


def test_after_a_patch_that_the_engine_refuses_the_next_engine_plays_what_played(until, tmp_path):
    """The next one was given the patch that was refused, and was silent."""
    sound = tmp_path / "crackle.wav"
    wavfile.write(sound, 48_000, np.full(4_800, 0.5, np.float32))
    with live(hum(tone=SINE), until, folder=tmp_path) as playing:
        session = playing.session
        playing.complete()
        os.kill(session.pids["engine"], signal.SIGSTOP)  # so that the file is gone before the engine reads it
        session.edit(patch_of(("wav-player.out", "tile-output.acceleration"), wav_player={"file": sound.name}))
        playing.until(lambda: session.is_compiled, "its kernels are compiled")
        sound.unlink()
        os.kill(session.pids["engine"], signal.SIGCONT)
        playing.until(lambda: playing.of(PatchRefused), "it is refused")
        os.kill(session.pids["engine"], signal.SIGKILL)
        playing.started(2)
        assert len(playing.of(PatchRefused)) == 1
        playing.play(4_800)
        assert np.abs(playing.played(playing.end - 2_400, 2_400)).max() > 0.01


def test_a_level_that_is_set_while_the_engine_loads_is_the_one_it_begins_with(until):
    with live(hum(tone=SINE), until, start=False) as playing:
        playing.session.start()
        playing.session.send(Level(-60.0))
        playing.until(lambda: playing.end >= 24_000, "half a second is played")
    assert 0.0 < max(np.abs(frames).max() for _, frames in playing.parts) < 1e-3


def test_outlines_come_with_their_ticket_and_are_of_the_tile(playing):
    session, tile = playing.session, playing.session.target.floor.tiles[-1]
    playing.until(lambda: "compiler" in session.pids)
    ticket = session.outline(Patch().add("tile-place", REGISTRY), ["tile-place"], 0.9, tile)
    playing.until(lambda: playing.of(Outlines), "the outlines come")
    assert playing.of(Outlines)[0].ticket == ticket
    assert playing.of(Outlines)[0].signals["tile-place.x"].max() == pytest.approx(tile.centre_m[0])


def test_what_must_not_reach_the_engine_is_refused_here(until):
    with live(hum(), until, start=False) as playing:
        session = playing.session
        for command in (
            Strike("", "nowhere"),
            PressTile("t9", 0.0, 0.0, 1.0),
            Pulse(""),
            PressTile("t1", 0.0, 0.0, float("nan")),
            Level(float("inf")),
            Set("tone", "frequency", -3.0),
            Set("tone", "colour", 1.0),
            Set("none", "frequency", 50.0),
        ):
            with pytest.raises(BadValue, match="allowed: "):
                session.send(command)


@pytest.mark.parametrize(
    "ask",
    [
        Session.start,
        Session.play,
        Session.panic,
        lambda session: session.health,
        lambda session: session.edit(hum()),
        lambda session: session.send(Strike("", "t1", 1.0)),
        lambda session: session.preview(hum(), "tone"),
        lambda session: session.record("never.underfoot"),
        lambda session: session.force.read(),
        lambda session: session.vibration.read(),
        lambda session: session.response.read(),
    ],
)
def test_what_is_asked_of_a_closed_session_is_refused_in_a_line(ask):
    session = Session(Target(default_floor()), hum(), REGISTRY)
    session.close()
    with pytest.raises(DeviceError, match="the session is closed; start another one"):
        ask(session)
    assert (session.poll(), session.close(), session.pids) == ([], [], {})


def test_a_session_that_never_started_leaves_nothing(until):
    with live(hum(), until, start=False) as playing:
        assert playing.session.poll() == []
        assert not playing.session.health.running
        playing.session.close()
        playing.session.close()


_OPENS_A_SESSION = """
import sys, threading

def until(holds, what, seconds):
    while not holds():
        threading.Event().wait(0.005)

def main():  # what it imports is not for its children, which read this file, too
    sys.path[:0] = {paths!r}
    from live import Live
    from made_patches import stepped_bank
    from underfoot.engine.session import Session
    from underfoot.engine.target import Target
    from underfoot.floor.layout import default_floor
    from underfoot.nodes import REGISTRY

    session = Session(Target(default_floor()), stepped_bank(), REGISTRY)
    session.record({record!r})
    session.start()
    playing = Live(session, until)
    playing.{begins}()
    playing.play(24_000)
    print(*session.pids.values(), flush=True)
    names = session.memory.names
    print(names.status, *(ring.name for ring in names.rings), flush=True)
    {then}

if __name__ == "__main__":
    main()
"""


def opened(tmp_path, processes, **code):
    """A process that opened a session and records it; the ids of its children, `processes` at least, and its blocks of
    shared memory."""
    script = tmp_path / "opens.py"
    paths = [p for p in sys.path if p]
    script.write_text(_OPENS_A_SESSION.format(paths=paths, record=str(tmp_path / "session.uf"), **code))
    window = subprocess.Popen([sys.executable, script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    children = [int(word) for word in window.stdout.readline().split()]
    blocks = window.stdout.readline().split()
    if len(children) < processes:  # where the machine is busy, more of them than asked for have started by now
        window.kill()
        pytest.fail(window.communicate()[1])
    return window, children, blocks


def test_a_session_on_hardware_tells_faulty_sensors_and_silent_tiles_for_as_long_as_they_are(until):
    """For whoever looks at the floor later than the line was said, as where Monitor is opened then."""
    times_s = np.arange(3000) / 1000.0
    force_n = np.where((times_s > 0.2)[:, None], [150.0, 150.0, 0.0, 150.0], 0.0)[:, None, :]
    floor = default_floor(1, 1)
    sender, transport = ends("udp")
    target = {"floor": default_floor(1, 2), "kind": "udp", "source": transport.name.partition(":")[2]}
    emulator = Emulator(sender, Replay(ForceSeries(times_s, force_n, 1000.0), floor, 48_000.0))
    with live(hum(), until, **target) as playing, closing(emulator):
        playing.started()
        emulator.start()
        said = "nothing comes from t2; tile t1: sensor 3 is dead (reads 1000 while its neighbours carry 450 N)"
        playing.until(lambda: [told.in_words for told in playing.of(SensorFaults)].count(said) >= 2, "it is told again")


def is_alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (FileNotFoundError, ProcessLookupError):
        return False


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
@pytest.mark.parametrize("dies", [True, False])
def test_when_the_window_is_gone_everything_ends_and_the_recording_is_whole(until, tmp_path, dies):
    """Killed in the middle of it, with all processes that there can be, or ended without a word to its session."""
    if dies:
        window, children, blocks = opened(tmp_path, 4, begins="complete", then="playing.play(1 << 40)")
        assert all(is_alive(child) for child in children)
        window.kill()
    else:
        window, children, blocks = opened(tmp_path, 2, begins="started", then="pass")
    window.communicate()
    until(lambda: not any(is_alive(child) for child in children), "the processes end")
    until(lambda: not any(Path("/dev/shm", name).exists() for name in blocks), "shared memory is let go of")
    path = tmp_path / "session.uf"
    assert not path.with_name("session.uf-wal").exists()  # it was closed, not only left
    with Recording(path) as recording:
        first, played = recording.vibration()
        assert recording.gaps() == []
    assert first == 0
    assert len(played) >= 20_000
    assert played[:20_000].any()
    assert played[:20_000].tobytes() == ReplayJob(path).run().samples[:20_000].tobytes()
