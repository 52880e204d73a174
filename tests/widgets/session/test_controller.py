"""The controller: sessions that are opened, released and opened again, on one simulated floor after another."""

import threading
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace

import pytest
from polling import Poll
from PySide6.QtTest import QSignalSpy
from windows import LONG_MS, noise_patch

from underfoot.devices.accelerometers import Accelerometer
from underfoot.engine.session import Session
from underfoot.engine.target import Target
from underfoot.errors import DeviceError
from underfoot.floor.layout import default_floor
from underfoot.floor.profile import Latency, Profile
from underfoot.nodes import REGISTRY
from underfoot.widgets.session.controller import SessionController
from underfoot.widgets.session.profile_folder import profile_folder
from underfoot.widgets.session.settings import Settings
from underfoot.widgets.session.target_selection import TargetSelection


@pytest.fixture
def controller(qtbot, tmp_path):
    """A controller before its start; profiles are in `tmp_path`."""
    made = SessionController(REGISTRY, Settings(), Target(default_floor()), tmp_path)
    made.edit(noise_patch(), None)
    yield made
    made.close()


def test_a_recording_that_ends_before_the_engine_has_started_is_not_called_saved(controller, tmp_path, monkeypatch):
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    said = []
    controller.notified.connect(said.append)
    controller.recording.record(True)
    assert said == ["Nothing is recorded yet: the engine is starting."]
    controller.session = Session(controller.target, noise_patch(), REGISTRY)  # its engine is not started
    now = SimpleNamespace(now=lambda: datetime(2026, 11, 29, 9, 30))
    monkeypatch.setattr("underfoot.records.recording_format.datetime", now)
    other = SessionController(REGISTRY, Settings(), controller.target, tmp_path)  # another window, in the same second
    other.session = Session(controller.target, noise_patch(), REGISTRY)
    for window in (other, controller):
        window.recording.record(True)
    path = controller.session.recording
    assert (other.session.recording.name, path.name) == tuple(
        f"2026-11-29 09.30.00{which}.underfoot" for which in ("", " 2")
    )
    for window in (other, controller):
        window.recording.record(False)
    other.close()
    assert said[1:] == [f"Recording to {path}", "Nothing was recorded: the engine has not started."]


def test_a_recording_is_called_saved_once_its_file_is_there(controller, qtbot, tmp_path, monkeypatch):
    """A recorder that loaded late began the file after its end was announced, and lists of recordings lacked it.
    The second of two in one second was refused: it had the name of the first.
    """
    now = SimpleNamespace(now=lambda: datetime(2026, 11, 29, 9, 30))
    monkeypatch.setattr("underfoot.records.recording_format.datetime", now)
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    path, said, shown = tmp_path, [], []
    controller.notified.connect(lambda line: said.append((line, path.exists())))
    controller.recording.file_changed.connect(lambda path: shown.append((path, controller.recording.is_written(path))))
    with qtbot.waitSignals([controller.opened, controller.bridge.started], timeout=LONG_MS):
        controller.start()
    for end, name in ((lambda: controller.recording.record(False), "09.30.00"), (controller.release, "09.30.00 2")):
        controller.recording.record(True)
        path, played_s = controller.session.recording, controller.played_s
        assert (path.name, controller.recording.is_written(path)) == (f"2026-11-29 {name}.underfoot", True)
        qtbot.waitUntil(lambda so_far_s=played_s: controller.played_s > so_far_s + 0.1, timeout=LONG_MS)
        end()
        qtbot.waitUntil(lambda one=path: bool(shown) and shown[-1] == (one, False), timeout=LONG_MS)
        assert said[-1] == (f"The recording was saved as {path}", True)
        shown.clear()


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder in which nobody can write")
def test_a_recording_that_fails_is_not_shown_as_going_on(controller, qtbot, tmp_path, monkeypatch):
    """The button stayed red, and named the file to which nothing was written any more."""
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    (tmp_path / "Underfoot").symlink_to("/proc")
    shown, said = [], []
    controller.recording.changed.connect(shown.append)
    controller.bridge.notified.connect(said.append)
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.start()
    controller.recording.record(True)
    path = controller.session.recording
    qtbot.waitUntil(lambda: len(shown) > 1, timeout=LONG_MS)
    assert shown == [path, None]
    assert any(line.startswith(f"{path} is not recorded any further: ") for line in said)


@pytest.fixture
def refused(controller, qtbot, tmp_path, monkeypatch):
    """The file of a recording whose end the disk will refuse; `controller` has begun it. One that it refuses before
    leaves no file.
    """
    resource = pytest.importorskip("resource", reason="this system cannot limit the size of files")
    monkeypatch.setattr("platformdirs.user_documents_dir", lambda: str(tmp_path))
    with qtbot.waitSignals([controller.opened, controller.bridge.started], timeout=LONG_MS):
        controller.start()

    def begin(is_there):
        controller.recording.record(True)
        path = controller.session.recording
        qtbot.waitUntil(lambda: path.stat().st_size > 0 or not is_there, timeout=LONG_MS)
        resource.prlimit(controller.session.pids["recorder"], resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
        return path

    never = begin(is_there=False)
    qtbot.waitUntil(lambda: not controller.recording.is_on, timeout=LONG_MS)
    assert not never.exists()
    return begin(is_there=True)


def test_what_a_disk_refuses_of_a_recording_that_another_target_ends_is_told(controller, refused, qtbot):
    said = []
    controller.notified.connect(said.append)
    with qtbot.waitSignal(controller.released, timeout=LONG_MS):
        controller.release()
    assert any(line.startswith(f"{refused} is not recorded any further: ") for line in said)


def test_what_a_disk_refuses_of_a_recording_that_the_end_of_the_window_ends_is_told(controller, refused):
    said = []
    controller.notified.connect(said.append)
    controller.close()
    assert any(line.startswith(f"{refused} is not recorded any further: ") for line in said)


def test_the_target_is_released_and_opened_again(controller, qtbot):
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.start()
    with qtbot.waitSignal(controller.released, timeout=LONG_MS):
        controller.release()
    assert controller.session is None
    assert controller.lend() is None
    assert controller.target_is_locked  # a study that could not begin unlocked it
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS) as opened:
        controller.reopen()
    assert not controller.target_is_locked
    assert opened.args == [controller.target]
    assert controller.session.patch == noise_patch()


def test_a_session_that_is_being_opened_is_released_too(controller, qtbot):
    with qtbot.waitSignal(controller.released, timeout=LONG_MS):
        controller.start()
        controller.release()
    assert controller.session is None


def test_a_profile_that_cannot_be_used_does_not_keep_the_session_from_playing(controller, qtbot, tmp_path):
    floor = default_floor(1, 3)
    folder = profile_folder(tmp_path, floor)
    folder.mkdir(parents=True)
    (folder / "t1.json").write_text("{}")
    said = []
    controller.notified.connect(said.append)
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.start()
        controller.set_target(Target(floor))
        assert controller.target.profiles == str(folder)
    assert controller.target.profiles == ""
    assert controller.target.floor == controller.session.target.floor == floor
    assert any("t1.json" in line for line in said)


def test_a_round_trip_in_a_profile_does_not_open_the_session_for_ever(controller, qtbot, tmp_path):
    """The session adds it to its target, which is then not the one that was asked for."""
    floor = default_floor(1, 3)
    folder = profile_folder(tmp_path, floor)
    folder.mkdir(parents=True)
    measured = Latency(made="2026-01-01", round_trip_ms=10.0, rate_hz=48_000, block=controller.target.block)
    Profile(tile="t1", latency=measured).save(folder / "t1.json")
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.set_target(Target(floor, accelerometers=(Accelerometer("t1", 0, 100.0),)))
        controller.start()
    assert controller.session.target.round_trip_frames == 480
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.set_target(Target(floor))
    assert controller.session.target.round_trip_frames == 0, "on the simulator it is that of the simulated tile"


@pytest.mark.parametrize("kind", ["fsr", "centroid", "latency"])
def test_a_part_of_a_profile_that_a_session_reads_when_it_opens_is_used_at_once(controller, qtbot, tmp_path, kind):
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.start()
    opened = QSignalSpy(controller.opened)
    controller.use_profile(Profile(tile="t1"), kind, tmp_path)
    qtbot.waitUntil(lambda: opened.count() == 1, timeout=LONG_MS)


def test_a_profile_that_changes_while_a_session_is_being_opened_is_used_by_it(controller, qtbot, tmp_path):
    """As where two earlier calibrations are put into use one after the other: the second waited for the next start."""
    measured = Latency(made="2026-01-01", round_trip_ms=10.0, rate_hz=48_000, block=controller.target.block)
    profile = Profile(tile="t1", latency=measured)
    controller.set_target(
        Target(default_floor(), accelerometers=(Accelerometer("t1", 0, 100.0),), profiles=str(tmp_path))
    )
    controller.start()
    Poll()(lambda: "open session" not in {thread.name for thread in threading.enumerate()}, "it has read the profiles")
    profile.save(tmp_path / "t1.json")
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.use_profile(profile, "latency", tmp_path)
    assert controller.session.target.round_trip_frames == 480


def test_forces_that_cannot_be_read_leave_the_floor_and_the_reason_to_be_read(qtbot, tmp_path):
    """The four tiles of a first start came instead, and "The target is now" took the reason away at once."""
    settings, floor = Settings(), default_floor(1, 3)
    path = tmp_path / "walk.csv"
    default_floor(1, 1).save(tmp_path / "walk.floor.json")
    path.write_text("time_s,t1.1,t1.2,t1.3,t1.4\n0,0,0,0,0\n0.001,0,,0,0\n")
    controller = SessionController(REGISTRY, settings, Target(floor), tmp_path)
    said = []
    controller.notified.connect(said.append)
    try:
        with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
            controller.start()
        with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
            TargetSelection(controller, settings).use_forces(path)
        assert controller.session.target == controller.target == Target(floor)
        assert said[-1] == f"{path}: line 3, column t1.2 is ''; allowed: a number, -1e+12 to 1e+12"
        assert (settings.kind, settings.source) == ("simulator", "")
    finally:
        controller.close()


def test_where_no_target_can_be_used_the_reason_is_said_once(qtbot, tmp_path, monkeypatch):
    """The four simulated tiles were tried again and again, without a word."""
    tried = []

    def no_memory(*given):
        tried.append(given)
        raise DeviceError("no shared memory")

    monkeypatch.setattr("underfoot.engine.session.SessionMemory.create", no_memory)
    controller = SessionController(REGISTRY, Settings(), Target(default_floor(1, 3)), tmp_path)
    said = []
    controller.notified.connect(said.append)
    try:
        controller.start()
        qtbot.waitUntil(lambda: bool(said), timeout=LONG_MS)
    finally:
        controller.close()
    assert said == ["no shared memory"]
    assert len(tried) == 2


def test_the_latest_edit_is_played_by_a_session_that_was_being_opened(controller, qtbot, tmp_path):
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.start()
        controller.edit(noise_patch("Edited"), tmp_path)
    assert controller.session.patch == noise_patch("Edited")
    assert controller.session.folder == tmp_path


def test_a_sound_card_starts_silent_until_the_person_says_play(null_sink, qtbot, tmp_path):
    settings = Settings(level_db=-12.0)
    controller = SessionController(REGISTRY, settings, Target(default_floor(), sound="", latency_s=0.08), tmp_path)
    said = QSignalSpy(controller.notified)
    controller.start()
    try:
        qtbot.waitUntil(lambda: said.count() > 0, timeout=60_000)
        assert said.at(0)[0] == "The output is silent. Space plays, at −12 dB."
        assert not controller.is_playing
        assert not controller.session.playing
        controller.play_or_stop()
        assert controller.session.playing
    finally:
        controller.close()


def test_a_panic_while_the_engine_starts_holds_where_no_card_is_found(qtbot, tmp_path):
    """The engine opened the output as it had started, a moment after the panic."""
    controller = SessionController(REGISTRY, Settings(), Target(default_floor(), sound="no such card"), tmp_path)
    with qtbot.waitSignal(controller.opened, timeout=LONG_MS):
        controller.start()
        controller.panic()
    try:
        with qtbot.waitSignal(controller.bridge.started, timeout=60_000):
            pass
        assert not controller.is_playing
        assert not controller.session.playing
    finally:
        controller.close()


def test_without_a_sound_card_it_plays_at_once(qtbot, tmp_path):
    controller = SessionController(REGISTRY, Settings(), Target(default_floor(), sound="no such card"), tmp_path)
    controller.start()
    try:
        qtbot.waitUntil(lambda: controller.is_playing, timeout=60_000)
    finally:
        controller.close()
