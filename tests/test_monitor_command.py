"""The command `monitor`: steps of files, of sessions, and of sessions that fail."""

import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
from functools import partial
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
import soundfile
from long_recording import walked
from made_recordings import ABOUT
from msgspec.structs import replace

from underfoot import monitoring
from underfoot.engine import session
from underfoot.engine.commands import Play
from underfoot.engine.reports import CommandApplied, Fault, Notice, OutputChanged, PatchRefused, ProcessDied, Started
from underfoot.floor.layout import Floor, default_floor
from underfoot.models import gait
from underfoot.patch import preset_files
from underfoot.records.forces import read_forces
from underfoot.records.forces import walk as simulated_walk
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer

SINE = preset_files.patches()["stimulus-sp"]


def test_monitor_prints_and_writes_the_footsteps_of_a_file(underfoot, folder, walk):
    said = underfoot("monitor", "walk.csv", "--steps", "steps.csv", "--contacts", "contacts.csv", "--json")
    assert (said.status, said.error) == (0, "")
    steps = [json.loads(line) for line in said.out.splitlines()]
    assert [step["tile"] for step in steps] == ["t1", "t2"]
    for step, start_s in zip(steps, (0.5, 0.9), strict=True):
        assert step["start_s"] == pytest.approx(start_s, abs=0.01)
        assert step["peak1_n"] == pytest.approx(800.0, abs=1.0)
        assert step["peak2_n"] == pytest.approx(780.0, abs=1.0)
        assert step["impulse_ns"] == pytest.approx(0.6 * gait.mean_force(800.0, 500.0, 780.0), rel=0.01)
    header, *rows = (folder / "steps.csv").read_text().splitlines()
    assert header.startswith("step,tile,side,start_s,contact_ms,peak1_n")
    assert [row.split(",")[1] for row in rows] == ["t1", "t2"]
    contacts = {row.split(",")[-1] for row in rows}
    header, *rows = (folder / "contacts.csv").read_text().splitlines()
    assert header == "time_s,contact,x_m,y_m,force_n,tiles"
    assert {row.split(",")[1] for row in rows} == contacts
    assert max(float(row.split(",")[4]) for row in rows) == pytest.approx(800.0, abs=1.0)


def test_forces_through_a_pipe_are_those_of_the_file(underfoot, folder, walk, monkeypatch):
    """As from `<(zcat walk.csv.gz)`. One that nobody writes to is not waited for, and in the window none is read."""
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    with subprocess.Popen(["cat", walk], stdout=subprocess.PIPE) as writer:
        piped = underfoot("monitor", f"/dev/fd/{writer.stdout.fileno()}", "--floor", "walk.floor.json")
    assert piped == underfoot("monitor", walk)
    assert {path.name for path in folder.iterdir()} == {"walk.csv", "walk.floor.json"}
    os.mkfifo("pipe")
    assert "pipe cannot be read: it is a pipe, and nothing was written to it" in underfoot("monitor", "pipe").error
    assert "pipe cannot be read: it is a device, and no file" in underfoot("--recording", "pipe").error


@pytest.mark.parametrize(("factor", "said"), [(-1.0, "are these of the other sign?"), (1e-3, "no steps found: the ")])
def test_monitor_says_when_forces_are_none_that_a_walk_has(underfoot, folder, walk, factor, said):
    header, *rows = walk.read_text().splitlines()
    table = np.array([[float(cell) for cell in row.split(",")] for row in rows])
    table[:, 1:] *= factor
    np.savetxt(walk, table, delimiter=",", header=header, comments="", fmt="%.6f")
    assert said in underfoot("monitor", "walk.csv").error


def test_monitor_says_how_many_contacts_a_gap_has_cut(underfoot, folder, walk):
    whole = underfoot("monitor", walk)
    assert "cut by gaps" not in whole.error
    header, *rows = walk.read_text().splitlines()
    at_s = float(whole.out.splitlines()[1].split()[1]) + 0.3  # in the second step, when the first has ended
    kept = [row for row in rows if not at_s < float(row.partition(",")[0]) < at_s + 0.1]
    walk.write_text("\n".join([header, *kept]) + "\n")
    said = underfoot("monitor", walk)
    assert "underfoot: 2 contacts cut by gaps in the samples; they give no step\n" in said.error
    assert len(said.out.splitlines()) == len(whole.out.splitlines()) - 1


def test_monitor_says_the_same_in_lines_for_people_and_stops_when_told(underfoot, folder, walk):
    assert [line.split()[3] for line in underfoot("monitor", "walk.csv").out.splitlines()] == ["t1", "t2"]
    assert len(underfoot("monitor", "walk.csv", "--seconds", "1.2").out.splitlines()) < 3


class Rehearsed:
    """In a session's place: `acts` are, poll by poll, the reports and the force samples of that moment."""

    force_rate_hz = 1000.0
    acts: ClassVar = []
    running = True
    keeps_recording = True
    lost: ClassVar = []
    closed = False

    def __init__(self, target, patch, registry, folder, *, is_edited):
        self.tiles = len(target.floor.tiles)
        self.left, self.recording = list(self.acts), None
        self.force = self

    def record(self, path):
        self.recording = path

    def stop_recording(self):
        return self.lost

    def start(self):
        self.now = 0

    @property
    def health(self):
        return SimpleNamespace(running=self.running, frame=self.now * 48)

    def poll(self):
        reports, self.newton = self.left.pop(0)
        if not self.keeps_recording:
            self.recording = None
        return reports

    def read(self):
        frames = np.arange(self.now, self.now + 100) * 48
        self.now += 100
        return frames, np.full((100, self.tiles, 4), self.newton)

    def close(self):
        Rehearsed.closed = True


@pytest.fixture
def rehearsed(monkeypatch):
    """Sessions that play what the test says."""
    monkeypatch.setattr(monitoring, "Session", Rehearsed)
    for name, value in (("acts", []), ("running", True), ("keeps_recording", True), ("lost", []), ("closed", False)):
        monkeypatch.setattr(Rehearsed, name, value)
    return Rehearsed


def test_monitor_passes_on_what_a_session_has_to_say(underfoot, folder, rehearsed):
    rehearsed.acts = [
        ([Started("the simulator", "there is no sound card")], 0.0),
        ([Fault("gain", "t2", 4711), CommandApplied(0, Play(True))], 50.0),
        ([ProcessDied("engine", "killed"), Notice("tile t4 has no channel")], 0.0),
        ([], 0.0),
    ]
    said = underfoot("monitor", "simulator", "--seconds", "0.35", "--steps", "steps.csv")
    assert said.status == 0
    assert said.error.splitlines() == [
        "underfoot: there is no sound card; going on without sound",
        "underfoot: node gain made a value that is not finite, on tile t2 at frame 4711",
        "underfoot: the engine was lost and is started again: killed",
        "underfoot: tile t4 has no channel",
    ]
    assert len((folder / "steps.csv").read_text().splitlines()) == len(said.out.splitlines()) + 1 == 5
    assert rehearsed.closed


def test_monitor_starts_no_compiler(underfoot, folder, monkeypatch):
    monkeypatch.setattr(session, "STANDBY_AFTER_S", 0.0)
    processes = []

    class Counted(session.Session):
        def poll(self):
            processes.append(set(self.pids))
            return super().poll()

    assert underfoot("monitor", "simulator", "--patch", SINE, "--seconds", "0.1").status == 0  # which compiles kernels
    monkeypatch.setattr(monitoring, "Session", Counted)
    assert underfoot("monitor", "simulator", "--patch", SINE, "--seconds", "0.5").status == 0
    assert set.union(*processes) == {"engine", "standby"}


def test_monitor_ends_where_nothing_can_be_played(refused, rehearsed):
    rehearsed.acts, rehearsed.running = [([PatchRefused.because("no such sound")], 0.0)], False
    assert "the patch is not played: no such sound" in refused("monitor", "simulator", "--steps", "steps.csv")
    assert rehearsed.closed


def test_monitor_waits_for_a_sound_card_that_does_not_answer(underfoot, folder, rehearsed):
    hangs = OutputChanged("the sound card and its server do not answer", "", "the sound card does not answer")
    rehearsed.acts, rehearsed.running = [([hangs], 0.0), ([], 50.0), ([], 0.0)], False
    said = underfoot("monitor", "simulator", "--seconds", "0.25")
    assert (said.status, said.error.splitlines()[0]) == (0, "underfoot: the sound card and its server do not answer")


def test_monitor_keeps_its_steps_when_the_engine_fails_for_good(underfoot, folder, rehearsed):
    failed = OutputChanged("the engine fails again and again; it is not started any more", "nothing")
    last = [ProcessDied("engine", "killed", False), failed], 0.0
    rehearsed.acts, rehearsed.running = [([], 0.0), ([], 50.0), ([], 0.0), last], False
    said = underfoot("monitor", "simulator", "--steps", "steps.csv")
    assert (said.status, said.error.splitlines()) == (1, [f"underfoot: {failed.text}"])
    assert len((folder / "steps.csv").read_text().splitlines()) == len(said.out.splitlines()) + 1 > 1


def test_monitor_goes_on_while_its_engine_is_started_again(underfoot, folder, rehearsed):
    """It ended with the first line that came meanwhile, whatever that said."""
    rehearsed.acts, rehearsed.running = [([], 0.0), ([], 50.0), ([Notice("t1 is silent")], 0.0), ([], 0.0)], False
    ended = underfoot("monitor", "simulator", "--seconds", "0.35", "--steps", "steps.csv")
    assert (ended.status, ended.error.splitlines()) == (0, ["underfoot: t1 is silent"])
    assert len((folder / "steps.csv").read_text().splitlines()) > 1


@pytest.mark.parametrize("running", [True, False])
def test_monitor_goes_on_without_its_recording_but_does_not_hide_it(underfoot, folder, rehearsed, running):
    """Also where the disk is full before the engine plays: an installation did not play after its next start."""
    rehearsed.acts, rehearsed.keeps_recording = [([Notice("the disk is full")], 0.0)] * 3, False
    rehearsed.running = running
    said = underfoot("monitor", "simulator", "--seconds", "0.2", "--record", "rec.uf", "--steps", "steps.csv")
    assert said.status == 1
    assert said.error.splitlines()[-1] == "underfoot: rec.uf was not recorded to the end"
    assert (folder / "steps.csv").is_file()


def test_monitor_goes_on_without_a_table_that_the_disk_refuses_and_keeps_what_is_in_it(underfoot, folder, rehearsed):
    """Both tables were lost, and the message spoke of what is printed."""
    rehearsed.acts = [([], 0.0), ([], 50.0), ([], 0.0), ([], 50.0), ([], 0.0)]
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (24_000, before[1]))
    try:
        said = underfoot("monitor", "simulator", "--seconds", "0.45", "--steps", "steps.csv", "--contacts", "all.csv")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    line = "underfoot: all.csv cannot be written: file too large; it has what came before"
    assert (said.status, said.error.splitlines().count(line)) == (1, 2)  # then, and at the end
    assert len((folder / "steps.csv").read_text().splitlines()) == len(said.out.splitlines()) + 1 == 9
    table = (folder / "all.csv").read_text()
    assert table.count("\n") > 10
    assert table.endswith("t4\n")
    assert sorted(path.name for path in folder.iterdir()) == ["all.csv", "steps.csv"]


def test_monitor_says_what_its_recording_lacks_when_it_ends(underfoot, folder, rehearsed):
    rehearsed.acts, rehearsed.lost = [([], 50.0)] * 3, ["rec.uf is not recorded any further: the disk is full"]
    said = underfoot("monitor", "simulator", "--seconds", "0.2", "--record", "rec.uf")
    assert said.status == 1
    assert said.error.splitlines()[-1] == "underfoot: rec.uf is not recorded any further: the disk is full"


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_monitor_keeps_its_steps_when_its_terminal_is_closed(folder, with_hangup):
    """As by a connection that is lost: the table was lost, too, and an empty file lay there."""
    window, terminal = os.openpty()
    command = [sys.executable, "-m", "underfoot", "monitor", "simulator", "--steps", "steps.csv", "--record", "a.uf"]
    process = subprocess.Popen(command, preexec_fn=partial(os.login_tty, terminal))
    os.close(terminal)
    printed = b""
    while b"person 1" not in printed:
        printed += os.read(window, 4096)
    os.close(window)
    assert process.wait() == 0
    assert "t1" in (folder / "steps.csv").read_text()
    assert sorted(path.name for path in folder.iterdir()) == ["a.uf", "steps.csv"]


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_monitor_ends_well_when_it_is_told_to(underfoot, folder, rehearsed, with_hangup, name):
    number = getattr(signal, name)

    class Interrupting(list):
        def __iter__(self):
            signal.raise_signal(number)
            return super().__iter__()

    before = signal.getsignal(number)
    rehearsed.acts = [([], 0.0), ([], 50.0), (Interrupting(), 0.0)]
    said = underfoot("monitor", "simulator", "--steps", "steps.csv")
    assert said.status == 0
    assert len((folder / "steps.csv").read_text().splitlines()) == len(said.out.splitlines()) + 1 > 1
    assert rehearsed.closed
    assert signal.getsignal(number) == before


def test_a_session_is_recorded_and_rendered_again_to_the_same_samples(underfoot, folder):
    simulated_walk(0.6).save("walk.csv")
    said = underfoot("monitor", "walk.csv", "--patch", SINE, "--record", "rec.uf")
    assert (said.status, said.error) == (0, "")
    recorded, given = read_forces("rec.uf"), read_forces("walk.csv")
    np.testing.assert_allclose(recorded.time_s, given.time_s, rtol=0, atol=1e-9)  # and the file's beginning not again
    np.testing.assert_array_equal(recorded.force_n, given.force_n)
    assert underfoot("render", "rec.uf", "-o", "again.wav").status == 0
    with Recording("rec.uf") as recording:
        first, played = recording.vibration()
    assert first == 0
    assert np.abs(played).max() > 0.0
    np.testing.assert_array_equal(soundfile.read("again.wav", dtype="float32")[0], played)
    assert underfoot("monitor", "rec.uf").status == 0
    tiles = default_floor().tiles
    Floor(tiles[:1]).save("one.json")
    said = underfoot("monitor", "rec.uf", "--floor", "one.json").error
    assert "rec.uf has 4 tiles; allowed: 1, as the floor has" in said
    Floor(tuple(replace(tile, centre_m=(9.0 + tile.centre_m[0], tile.centre_m[1])) for tile in tiles)).save("far.json")
    assert underfoot("monitor", "rec.uf", "--floor", "far.json", "--contacts", "contacts.csv").status == 0
    assert (np.loadtxt("contacts.csv", delimiter=",", skiprows=1, usecols=2) > 8.0).all()


def test_a_recording_that_does_not_fit_into_memory_is_monitored(underfoot, folder):
    """One of hours: 2 h 20 min of four tiles are 1 GB. Here they are a walk, and the same again after a long gap."""
    floor, later = default_floor(), 48_000 * 8400
    samples = walked(floor, 3.0)
    writer = Writer(folder / "long.underfoot", ABOUT | {"floor": floor.dumps().decode()})
    writer.put("force", 0, samples)
    samples[:, :2] += later
    writer.put("force", len(samples), samples)
    writer.close()
    said = underfoot("monitor", "long.underfoot", "--json")
    starts_s = np.array([json.loads(line)["start_s"] for line in said.out.splitlines()])
    assert said.status == 0
    first, again = starts_s[starts_s < 8400.0], starts_s[starts_s >= 8400.0]
    assert len(first) >= 3
    np.testing.assert_allclose(again - 8400.0, first, atol=2e-3)
    said = underfoot("monitor", "long.underfoot", "--json", "--seconds", "8400")
    assert len(said.out.splitlines()) == len(first)


def test_a_simulator_with_non_ideal_sensors_is_monitored(underfoot, folder):
    source = f"simulator:{preset_files.simulations()['child-walking']}"
    said = underfoot("monitor", source, "--record", "rec.uf", "--seconds", "2")
    assert said.status == 0
    assert "uncalibrated: t1, t2, t3, t4 (the nominal curve of the sensors is assumed)" in said.error
    assert len(said.out.splitlines()) > 1
