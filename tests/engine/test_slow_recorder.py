"""A recorder that comes too late: what is gone from the rings by then is told, and not only missing."""

import multiprocessing

import numpy as np
from made_recordings import ABOUT

from underfoot.engine import recorder as recorder_module
from underfoot.engine.recorder import Begin, EndRecording, Job, Recorder
from underfoot.engine.recorder_supervisor import RecorderSupervisor
from underfoot.engine.rings import Ring
from underfoot.records.recording import Gap, Recording
from underfoot.records.recording_writer import Writer


def test_what_is_overwritten_before_it_is_recorded_is_said_once_and_a_new_engine_s_gap_is_not(tmp_path, until):
    ring, said = Ring.create(2, 1024), []
    recorder = Recorder(tmp_path / "slow.uf", ABOUT, {"vibration": ring})

    def is_safe(end):
        said.extend(recorder.receive())
        return ring.kept == end

    def play(count):
        ring.write(np.ones((count, 2), np.float32), count)  # at once: the recorder sees all of it or nothing
        until(lambda: is_safe(ring.written), f"{ring.written} frames are safe")

    play(100)
    ring.skip(20_000)  # an engine that takes over leaves out what nobody played
    play(100)
    assert not said
    for _ in range(2):
        play(4096)
    recorder.end(ring.written)
    until(recorder.has_ended, "the file is closed")
    ring.close()
    assert len(said) == 1
    assert said[0].startswith(f"{recorder.path} has gaps: it was not written as fast as it was played; ")
    assert not recorder.last_notices
    with Recording(recorder.path) as recording:
        assert recording.gaps()[0] == Gap(100, 19_900)
        assert len(recording.gaps()) == 3


def test_what_is_overwritten_while_the_recorder_loads_is_said_too(tmp_path, until):
    """As where the window stands still for longer than the rings are, or a recorder that died comes back too late."""
    ring = Ring.create(2, 1024)
    recorder = Recorder(tmp_path / "slow.uf", ABOUT, {"vibration": ring})
    said = recorder.receive()
    for _ in range(3):
        ring.write(np.ones((1024, 2), np.float32), 1024)
    said += recorder.receive() + recorder.receive()  # long before a process has loaded
    recorder.end(ring.written)
    until(recorder.has_ended, "the file is closed")
    ring.close()
    said += recorder.last_notices
    assert [line.partition(": ")[0] for line in said] == [f"{recorder.path} has gaps"]


def test_that_a_file_is_there_is_told_also_of_a_recording_that_ends_while_the_recorder_loads(tmp_path, until):
    """The window opens a recording once it is: a short one, or one on a busy machine, was only listed."""
    ring, told = Ring.create(2, 1024), []
    recorders = RecorderSupervisor({"vibration": ring})
    recorders.begin(tmp_path / "short.uf", ABOUT)
    ring.write(np.ones((100, 2), np.float32), 100)
    recorders.end(100)

    def is_whole():
        assert not recorders.receive()
        told.extend(file.state for file in recorders.take_files())
        return "whole" in told

    until(is_whole, "the file is closed")
    ring.close()
    assert told == ["begun", "whole"]


def test_what_a_recorder_that_stood_still_writes_first_does_not_cost_the_rest(tmp_path, monkeypatch):
    """As by SIGSTOP for 3 s: the ring held as much, and 0.2 s of the last table were overwritten meanwhile."""
    rings = {table: Ring.create(2, 8_000) for table in ("vibration", "commanded")}
    rows = np.ones((6_000, 2), np.float32)

    class Slow(Writer):
        """While it writes the first table, the engine plays on."""

        def put(self, table, first, given):
            super().put(table, first, given)
            if table == "vibration":
                rings["commanded"].write(rows, 4_000)

    monkeypatch.setattr(recorder_module, "Writer", Slow)
    monkeypatch.setattr(recorder_module, "leave_to_session", lambda *signals: None)  # these are this process's
    for ring in rings.values():
        ring.write(rows, 6_000)
    ours, its = multiprocessing.Pipe()
    ours.send(Begin(dict.fromkeys(rings, 0)))
    ours.send(EndRecording(6_000))
    path = tmp_path / "stopped.uf"
    recorder_module.run(its, Job(str(path), ABOUT, {table: (ring.where, 0) for table, ring in rings.items()}))
    for end in (*rings.values(), ours, its):
        end.close()
    with Recording(path) as recording:
        assert recording.ends("commanded") == recording.ends("vibration") == (0, 6_000)
