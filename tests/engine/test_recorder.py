"""The recorder: all that was played is in its file, whatever is killed, and nothing is written over."""

import multiprocessing
import os
import re
import resource
import signal
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

import numpy as np
import pytest
from earlier_recordings import make_earlier
from live import live
from made_patches import hum, stepped_bank
from made_recordings import ABOUT

from underfoot.engine.commands import Level, Panic, Play, PressTile, Set, Strike, Swap, from_text, to_text
from underfoot.engine.recorder import RecordCommand, Recorder, RecordMark
from underfoot.engine.reports import Notice, ProcessDied
from underfoot.engine.rings import Ring
from underfoot.engine.session_replay import ReplayJob
from underfoot.errors import BadFile
from underfoot.records.recording import Gap, Recording, is_recording
from underfoot.records.recording_writer import Writer


class Rings:
    """The rings that a recorder reads, and what was written to them."""

    def __init__(self):
        self.force, self.vibration = Ring.create(10, 4_096, "float64"), Ring.create(2, 65_536)
        self.commanded, self.measured = Ring.create(2, 65_536), Ring.create(2, 65_536)
        self.recorded = {name: getattr(self, name) for name in ("force", "vibration", "commanded", "measured")}

    def write(self, count):
        """The next frames and samples; every number says where it stands."""
        frames = np.arange(self.vibration.written, self.vibration.written + count)[:, None] / [[1e6, -1e6]]
        self.vibration.write(frames.astype(np.float32), count)
        samples = np.arange(self.force.written, self.force.written + count // 48)[:, None] + np.zeros(10)
        self.force.write(samples, len(samples))

    def close(self):
        for ring in self.recorded.values():
            ring.close()


@pytest.fixture
def rings():
    rings = Rings()
    yield rings
    rings.close()


@pytest.fixture
def record(rings, tmp_path):
    """Starts a recorder of the rings; one that a failed test leaves running is killed."""

    def start(name="a.uf"):
        return Recorder(tmp_path / name, ABOUT, rings.recorded)

    yield start
    for process in multiprocessing.active_children():
        process.kill()
        process.join()


def opened_by(pid):
    """The files that a process has open, or had a moment ago."""
    for entry in Path(f"/proc/{pid}/fd").iterdir():
        with suppress(OSError):
            yield entry.readlink()


def kept_by(recorder):
    """How many frames it has made safe, when it was told what there is to be told."""
    recorder.receive()
    return frames_in(recorder.path)


def frames_in(path):
    """How many frames are safe in a file that is being written."""
    if not path.exists():
        return 0
    base = sqlite3.connect(path)
    try:
        return base.execute("select max(first + count) from vibration").fetchone()[0] or 0
    finally:
        base.close()


def expected(first, end):
    return (np.arange(first, end)[:, None] / [[1e6, -1e6]]).astype(np.float32)


def reason_of_death(recorder, until):
    until(lambda: recorder.has_died, "it died")
    return recorder.reap()


def test_all_that_is_played_from_now_on_is_in_the_file(rings, record, until):
    rings.write(9_600)
    recorder = record()
    rings.write(4_800)
    until(lambda: kept_by(recorder) == 14_400, "the first frames are safe")
    rings.write(4_800)
    recorder.send(RecordCommand(12_000, *to_text(Level(-3.0))))
    recorder.end(19_200)
    assert recorder.has_ended(10.0)
    with Recording(recorder.path) as recording:
        first, played = recording.vibration()
        assert (first, len(played)) == (9_600, 9_600)
        np.testing.assert_array_equal(played, expected(9_600, 19_200))
        np.testing.assert_array_equal(recording.force_samples()[:, 3], np.arange(200, 400))
        assert recording.commands() == [(12_000, "Level", '{"db":-3.0}')]
        assert recording.about == ABOUT
        assert recording.gaps() == recording.gaps("force") == []
    assert is_recording(recorder.path)
    assert sorted(path.name for path in recorder.path.parent.iterdir()) == ["a.uf"]


def test_a_recording_ends_before_the_frame_that_it_is_told(rings, record, until):
    recorder = record()
    for _ in range(3):
        rings.write(4_800)
        until(lambda: kept_by(recorder) == rings.vibration.written)
    recorder.end(9_000)
    assert recorder.has_ended(10.0)
    with Recording(recorder.path) as recording:
        np.testing.assert_array_equal(recording.vibration()[1], expected(0, 9_000))


@pytest.mark.parametrize("marks", [(), (RecordMark(0, "here"),)])
def test_a_recording_ended_before_its_first_frame_leaves_a_file_only_for_its_marks(rings, record, until, marks):
    recorder = record()
    for mark in marks:
        recorder.send(mark)
    until(lambda: recorder.receive() or recorder.has_begun)
    rings.write(4_800)
    recorder.end(0)
    until(recorder.has_ended)
    assert recorder.path.exists() == bool(marks)


def test_a_recorder_killed_at_any_moment_has_lost_at_most_the_last_block(rings, record, until):
    recorder = record()
    rings.write(9_600)
    until(lambda: kept_by(recorder) == 9_600)
    rings.write(4_800)
    os.kill(recorder.pid, signal.SIGKILL)
    assert reason_of_death(recorder, until) == "signal 9"
    with Recording(recorder.path) as recording:
        first, played = recording.vibration()
        assert first == 0
        assert len(played) in (9_600, 14_400)
        np.testing.assert_array_equal(played, expected(0, len(played)))
        assert recording.about["patch"] == ABOUT["patch"]
        assert len(recording.force_samples()) == len(played) // 48

    recorder.restart()
    rings.write(4_800)
    recorder.send(RecordCommand(15_000, *to_text(Level(0.0))))
    recorder.end(1 << 40)
    assert recorder.has_ended(10.0)
    with Recording(recorder.path) as recording:
        np.testing.assert_array_equal(recording.vibration()[1], expected(0, 19_200))
        np.testing.assert_array_equal(recording.force_samples()[:, 3], np.arange(400))
        assert len(recording.commands()) == 1


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_recorder_asked_to_end_with_all_other_processes_closes_its_file(rings, record, until, name):
    """As by a service manager, or the end of a terminal; a copy of the file alone had nothing in it."""
    recorder = record()
    rings.write(9_600)
    until(lambda: kept_by(recorder) == 9_600)
    os.kill(recorder.pid, getattr(signal, name))
    rings.write(4_800)
    recorder.end(14_400)
    assert recorder.has_ended(10.0)
    assert sorted(path.name for path in recorder.path.parent.iterdir()) == ["a.uf"]
    with Recording(recorder.path) as recording:
        np.testing.assert_array_equal(recording.vibration()[1], expected(0, 14_400))


def test_a_recorder_killed_before_there_is_a_file_begins_anew(rings, record, until):
    recorder = record()
    os.kill(recorder.pid, signal.SIGKILL)
    assert reason_of_death(recorder, until) == "signal 9"
    rings.write(480)
    recorder.restart()
    recorder.end(480)
    assert recorder.has_ended(10.0)
    with Recording(recorder.path) as recording:
        assert len(recording.vibration()[1]) == 480


@pytest.mark.skipif(not Path("/proc/self/fd").exists(), reason="looks for open files in /proc")
def test_while_somebody_has_the_file_locked_nothing_is_lost(rings, record, until):
    recorder = record()
    rings.write(9_600)
    until(lambda: kept_by(recorder) == 9_600)
    os.kill(recorder.pid, signal.SIGKILL)
    assert reason_of_death(recorder, until) == "signal 9"
    with closing(sqlite3.connect(recorder.path)) as other:
        other.execute("pragma locking_mode = exclusive")
        other.execute("select count(*) from about").fetchone()
        recorder.restart()
        until(lambda: (recorder.receive(), recorder.path in opened_by(recorder.pid))[1], "it waits for the file")
        for _ in range(30):  # more than twice what the ring holds
            rings.write(4_800)
            recorder.receive()
            recorder.receive()
    recorder.end(1 << 40)
    assert recorder.has_ended(10.0)
    with Recording(recorder.path) as recording:
        assert recording.gaps() == []
        np.testing.assert_array_equal(recording.vibration()[1], expected(0, 9_600 + 30 * 4_800))


def test_where_an_engine_took_over_there_is_a_gap(rings, record):
    recorder = record()
    rings.write(4_800)
    rings.vibration.skip(24_000)
    rings.write(4_800)
    recorder.end(1 << 40)
    assert recorder.has_ended(10.0)
    with Recording(recorder.path) as recording:
        first, played = recording.vibration()
        assert recording.gaps() == [Gap(4_800, 19_200)]
        np.testing.assert_array_equal(played[:4_800], expected(0, 4_800))
        np.testing.assert_array_equal(played[24_000:], expected(24_000, 28_800))
        assert (first, played[4_800:24_000].any()) == (0, False)
    with pytest.raises(BadFile, match="gaps"):
        ReplayJob(recorder.path).run()


def test_a_file_that_is_there_is_not_written_over(rings, record):
    recorder = record()
    rings.write(4_800)
    recorder.end(4_800)
    assert recorder.has_ended(10.0)
    os.mkfifo(recorder.path.with_name("pipe.uf"))  # which is as empty as a file that keeps the name of a recording
    for name in (recorder.path.name, "pipe.uf"):
        with pytest.raises(BadFile, match="there already"):
            record(name)


@pytest.mark.parametrize("other", [b"", b"of a program that keeps folders alike"])
def test_a_file_that_is_moved_away_is_told_and_is_whole(rings, record, until, other):
    """As by a file manager; the recorder went on in a file that was gone, and it was called saved."""
    recorder = record()
    rings.write(9_600)
    until(lambda: kept_by(recorder) == 9_600)
    moved = recorder.path.rename(recorder.path.with_name("b.uf"))
    if other:
        recorder.path.write_bytes(other)
    assert until(recorder.receive, "it says so") == [
        f"{recorder.path} is not recorded any further: the file was moved, removed or replaced"
    ]
    until(lambda: recorder.has_died, "it ends")
    assert sorted(path.name for path in moved.parent.iterdir()) == ["a.uf"] * bool(other) + ["b.uf"]
    with Recording(moved) as recording:
        np.testing.assert_array_equal(recording.vibration()[1], expected(0, 9_600))


def test_a_place_that_cannot_be_written_is_told_in_one_line(rings, record, until):
    recorder = record("none/a.uf")
    said = until(recorder.receive, "it says so")
    assert len(said) == 1
    assert re.search("none/a.uf is not recorded any further: it cannot be written: [a-z ]+$", said[0])
    assert reason_of_death(recorder, until) == ""


def test_what_a_full_disk_refuses_at_the_end_is_told(rings, record, until):
    recorder = record()
    until(lambda: recorder.receive() or recorder.has_begun)
    rings.write(4_800)
    until(lambda: kept_by(recorder) == 4_800)
    resource.prlimit(recorder.pid, resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
    rings.write(4_800)
    recorder.end(9_600)
    until(recorder.has_ended)
    (said,) = recorder.last_notices
    assert "a.uf is not recorded any further" in said


def test_a_recorder_that_is_lost_while_it_ends_is_told(rings, record, until):
    """The file was called saved, whatever it lacked."""
    recorder = record()
    until(lambda: recorder.receive() or recorder.has_begun)
    os.kill(recorder.pid, signal.SIGSTOP)
    rings.write(4_800)
    recorder.end(4_800)
    assert not recorder.has_ended()
    os.kill(recorder.pid, signal.SIGKILL)
    until(recorder.has_ended)
    line = f"{recorder.path} is not recorded to the end: the recorder was lost: signal 9"
    assert recorder.last_notices == [line]


# --- in a session ---


def test_a_recorder_that_is_killed_goes_on_in_the_same_file(until, tmp_path):
    path = tmp_path / "live.uf"
    with live(stepped_bank(), until, record=path) as playing:
        session = playing.session
        playing.started()
        playing.play(9_600)
        playing.until(lambda: frames_in(path) > 4_800, "it is recorded")
        os.kill(session.pids["recorder"], signal.SIGKILL)
        playing.until(lambda: playing.of(ProcessDied), "the death is noticed")
        assert playing.of(ProcessDied)[0].process == "recorder"
        safe = frames_in(path)
        playing.until(lambda: frames_in(path) > safe + 4_800, "it goes on")
        session.stop_recording()
        assert session.recording is None
    with Recording(path) as recording:
        assert recording.gaps() == []
        first, played = recording.vibration()
    assert first == 0
    heard = playing.played(0, len(played))
    known = np.isfinite(heard).all(axis=1)  # this process, too, may have been held up for longer than the ring is
    assert known.sum() > 9_600
    np.testing.assert_array_equal(played[known], heard[known])


def test_what_a_full_disk_refuses_while_a_session_waits_for_the_end_is_told(until, tmp_path):
    path = tmp_path / "live.uf"
    with live(stepped_bank(), until, record=path) as playing:
        playing.started()
        playing.until(lambda: frames_in(path) > 4_800, "it is recorded")
        resource.prlimit(playing.session.pids["recorder"], resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
        before = playing.session.health.frame
        until(lambda: playing.session.health.frame > before + 9_600, "there is more to record")
        (said,) = playing.session.stop_recording()
    assert f"{path} is not recorded any further" in said
    assert " is in it and live.uf-wal together, " in said


def test_somebody_else_may_write_between_what_a_writer_reads_and_what_it_writes(tmp_path):
    path = tmp_path / "a.uf"
    writer = Writer(path, ABOUT)
    writer.put("vibration", 0, expected(0, 480))
    writer.commit()
    resumed = Writer(path, ABOUT, resume=True)  # as beside one that was killed
    assert resumed.end("vibration") == 480
    with Recording(path) as reader:
        reader.add_mark(100, "turned round")
    resumed.put("vibration", 480, expected(480, 960))
    resumed.mark(480, "and back")
    resumed.close()
    writer.close()
    with Recording(path) as recording:
        assert [mark.frame for mark in recording.marks()] == [100, 480]
        np.testing.assert_array_equal(recording.vibration()[1], expected(0, 960))


def test_marks_of_one_text_at_one_frame_are_all_there_and_none_twice_where_a_writer_goes_on(tmp_path):
    """Of several triggers within a block one was kept; what a recorder that died may not have written comes again."""
    path = tmp_path / "a.uf"
    writer = Writer(path, ABOUT)
    for text in ("hit", "hit", "hit"):
        writer.mark(480, text)
    writer.close()
    resumed = Writer(path, ABOUT, resume=True)
    for text in ("hit", "hit", "miss", "miss"):
        resumed.mark(480, text)
    resumed.close()
    with Recording(path) as recording:
        assert [mark.text for mark in recording.marks()] == ["hit"] * 3 + ["miss"] * 2


def test_a_recording_that_cannot_be_made_is_told_and_ends(until, tmp_path):
    with live(stepped_bank(), until, record=tmp_path / "none" / "a.uf", start=False) as playing:
        playing.until(lambda: playing.of(Notice), "it is told")
        playing.until(lambda: playing.session.recording is None, "it ends")
        assert playing.of(ProcessDied) == []


def test_a_recording_that_cannot_be_made_is_told_although_it_was_ended_before(until, tmp_path):
    with live(stepped_bank(), until, record=tmp_path / "none" / "a.uf", start=False) as playing:
        playing.session.end_recording()
        playing.until(lambda: playing.of(Notice), "it is told")


def test_what_was_recorded_later_cannot_be_replayed(rings, record):
    rings.write(480)
    recorder = record()
    rings.write(480)
    recorder.end(960)
    assert recorder.has_ended(10.0)
    with pytest.raises(BadFile, match="does not begin with its session"):
        ReplayJob(recorder.path).run()


def test_a_patch_that_cannot_be_played_is_told_with_the_name_of_its_recording(tmp_path):
    path = tmp_path / "a.uf"
    writer = Writer(path, ABOUT)
    writer.put("vibration", 0, expected(0, 480))
    writer.command(96, *to_text(Swap(hum().dumps().replace(b'"tone"', b'"bagpipe"'))))
    writer.close()
    with pytest.raises(BadFile, match=r"a\.uf: .*bagpipe"):
        ReplayJob(path).run()


# --- the file ---


@pytest.mark.parametrize(
    "command",
    [
        Strike("bank", "t1", 0.5),
        Set("tone", "frequency", 81.25),
        Swap(hum().dumps(), ("tone.out",)),
        Swap(hum().dumps(), together=False),
        Panic(),
        PressTile("t1", 0.1, -0.2, 300.0),
        Play(True),
    ],
)
def test_commands_are_what_they_were(command):
    assert from_text(*to_text(command)) == command


def test_cut_takes_away_whole_blocks_and_parts_of_them(tmp_path):
    writer = Writer(tmp_path / "a.uf", ABOUT)
    for first in (0, 100, 200):
        writer.put("vibration", first, expected(first, first + 100))
    assert writer.end("vibration") == 300
    assert writer.end("force") is None
    for first in range(0, 6, 2):
        samples = np.arange(first, first + 2)[:, None] + np.zeros(10)
        samples[:, :2] *= 48.0
        writer.put("force", first, samples)
    writer.cut(130)
    writer.set_about("patch", "another")
    writer.commit()
    writer.close()
    with Recording(tmp_path / "a.uf") as recording:
        np.testing.assert_array_equal(recording.vibration()[1], expected(0, 130))
        assert list(recording.force_samples()[:, 1]) == [0.0, 48.0, 96.0]
        assert recording.about["patch"] == "another"


def test_what_tiles_were_asked_and_did_is_kept_and_a_tile_that_is_still_takes_no_room(rings, record):
    asked = np.zeros((4_800, 2), np.float32)
    asked[:, 1] = -0.0
    asked[2_400:, 1] = np.arange(2_400)
    recorder = record()
    rings.write(4_800)
    rings.commanded.write(asked, 4_800)
    rings.measured.write(2.0 * asked, 4_800)
    recorder.end(4_800)
    assert recorder.has_ended(10.0)
    with Recording(recorder.path) as recording:
        assert recording.acceleration("commanded")[1].tobytes() == asked.tobytes()
        np.testing.assert_array_equal(recording.acceleration("measured")[1], 2.0 * asked)
    with closing(sqlite3.connect(recorder.path)) as base:
        sizes = base.execute("select sum(length(data)) from measured").fetchone()
    assert sizes == (4_800 * 4,)


def test_a_recording_of_before_accelerometers_has_none(tmp_path):
    path = tmp_path / "old.uf"
    writer = Writer(path, ABOUT)
    writer.put("vibration", 0, expected(0, 480))
    writer.close()
    make_earlier(path, 1)
    with Recording(path) as recording:
        assert len(recording.acceleration("measured")[1]) == 0
        assert len(recording.vibration()[1]) == 480


@pytest.mark.parametrize("version", [3, 4])
def test_the_drive_of_still_tiles_is_read_as_zero_and_takes_no_room(tmp_path, version):
    path, frames = tmp_path / "drive.uf", np.zeros((9_600, 2), np.float32)
    frames[100:200, 1] = 0.5
    frames[4_800:, 0] = -0.0  # which has bits
    writer = Writer(path, ABOUT)
    for first in (0, 4_800):
        writer.put("vibration", first, frames[first : first + 4_800])
    writer.close()
    if version < 4:
        make_earlier(path, version)
    with Recording(path) as recording:
        assert recording.version == version
        assert recording.vibration()[1].tobytes() == frames.tobytes()
        assert recording.frames_between("vibration", 4_000, 5_000).tobytes() == frames[4_000:5_000].tobytes()
    with closing(sqlite3.connect(path)) as base:
        (size,) = base.execute("select sum(length(data)) from vibration").fetchone()
    assert size == frames.nbytes // (2 if version == 4 else 1)
