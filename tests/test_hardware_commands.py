"""`underfoot emulate`, and `underfoot monitor` of hardware that is not there, from end to end."""

import csv
import io
import json
import re
import signal
import socket
import subprocess
import sys
from collections import Counter
from contextlib import contextmanager, redirect_stdout

import numpy as np
import pytest
from free_ports import free_port
from made_recordings import ABOUT
from wired import EVERY_TRANSPORT, ends

from underfoot.commands.session_target import TargetOptions
from underfoot.devices.conversion import nominal_readings
from underfoot.devices.emulation.emulator import Emulator, TileClock
from underfoot.devices.framing.parser import Parser
from underfoot.devices.framing.wire_format import FRAME_BYTES, REST
from underfoot.devices.replay import Replay
from underfoot.errors import DeviceError
from underfoot.floor.forces import read_forces
from underfoot.floor.layout import default_floor
from underfoot.records.recording import Recording
from underfoot.records.recording_writer import Writer

RATE = 48_000.0


@contextmanager
def heard():
    """A UDP port of this machine, and the frames that came there since."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one:
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 22)
        one.bind(("127.0.0.1", 0))
        one.settimeout(0.0)
        parser = Parser()

        def frames():
            found = []
            try:
                while True:
                    found.append(parser.feed(one.recv(1 << 16)).copy())
            except BlockingIOError:
                return np.concatenate(found)

        yield one.getsockname()[1], frames, parser


# --- emulate ---


def test_a_force_file_is_sent_once_and_exactly(underfoot, walk):
    with heard() as (port, frames, parser):
        said = underfoot("emulate", "--udp", port, "--force", walk)
        got = frames()
    assert said.status == 0
    assert said.out == f":{port}\n"
    assert "underfoot: tiles 0 to 1 are t1 to t2\n" in said.error
    assert "3200 frames, 0 lost, 0 doubled, 0 reordered, 0 corrupted, 0 late; 0 samples unheard" in said.error
    force_n = read_forces(walk, default_floor(1, 2)).force_n
    np.testing.assert_array_equal(got["readings"].reshape(-1, 2, 4), nominal_readings(force_n))
    assert parser.counts.accepted == 3200


def test_who_waits_for_the_name_hears_at_once(folder):
    with heard() as (port, frames, _):
        command = [sys.executable, "-m", "underfoot", "emulate", "--udp", str(port), "--seconds", "0.2"]
        with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
            assert process.stdout.readline() == f":{port}\n"
            assert len(frames()) >= 4


def test_a_recording_is_sent_without_what_a_tile_lost(underfoot, folder):
    writer = Writer(folder / "a.underfoot", ABOUT)
    rows = np.column_stack([48.0 * np.arange(40), 48.0 * np.arange(40), np.full((40, 8), 100.0)])
    rows[10:20, 6:] = np.nan
    writer.put("force", 0, rows)
    writer.close()
    with heard() as (port, frames, _):
        said = underfoot("emulate", "--udp", port, "--force", "a.underfoot")
        got = frames()
    assert said.status == 0, said.error
    assert len(got) == 2 * 30
    assert (got["readings"] == 3000).all()


def test_one_tile_of_a_walker_as_lines_of_text_at_another_rate_with_faults(underfoot, folder):
    with heard() as (port, frames, parser):
        options = [
            "--tile",
            2,
            "--seconds",
            1,
            "--rate",
            250,
            "--csv-lines",
            "--lost",
            0.2,
            "--doubled",
            0.1,
            "--seed",
            4,
        ]
        said = underfoot("emulate", "--udp", f"127.0.0.1:{port}", *options)
        got = frames()
    assert said.status == 0
    assert parser.bytes != FRAME_BYTES * parser.counts.valid, "as frames have"
    assert np.unique(got["tile"]).tolist() == [2]
    assert parser.period_us(2) == 4000
    assert f"{parser.counts.doubled} doubled" in said.error
    assert 150 < len(got) < 240


def test_simulated_sensors_instead_of_ideal_ones(underfoot, folder):
    with heard() as (port, frames, _):
        assert underfoot("emulate", "--udp", port, "--seconds", 0.2, "--sensors", "default").status == 0
        got = frames()
    resting = got["readings"][:100]
    assert len(np.unique(resting[:, 0])) > 1  # noise
    assert resting.mean(axis=0).std() > 1.0  # parts are not alike


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_pseudo_terminal_is_named_and_goes_away_at_the_end(underfoot, folder):
    said = underfoot("emulate", "--pty", "--seconds", 0.1)
    assert said.status == 0
    name = said.out.strip()
    assert name.startswith("/")
    assert not (folder / name).exists()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "no transports are given; allowed: one of --pty, "),
        (["--pty", "--udp", "9000"], "2 transports are given; allowed: one of --pty, "),
        (["--udp", "host"], "address is 'host'; allowed: HOST:PORT"),
        (["--pty", "--lost", "2"], "lost is 2.0; allowed: 0 to 1"),
        (["--pty", "--unplug", "soon"], "--unplug is 'soon'; allowed: AT:FOR in seconds"),
        (["--pty", "--seconds", "0"], "--seconds is 0; allowed: above 0"),
        (["--pty", "--rate", "0.1"], "rate_hz is 0.1; allowed: 1 to 100000 Hz"),
        (["--pty", "--tile", "4"], "--tile is 4; allowed: 0 to 3"),
        (["--pty", "--drift", "1e6"], "--drift is 1e+06; allowed: -20000 to 20000 ppm"),
        (["--pty", "--force", "nope.csv"], "nope.csv cannot be read: no such file"),
        (["--pty", "--floor", "nope.json"], "nope.json cannot be read"),
        (["--pty", "--sensors", "nope.json"], "nope.json cannot be read"),
    ],
)
def test_what_cannot_be_emulated_is_one_line(refused, options, message):
    assert message in refused("emulate", *options)


# --- monitor ---


@pytest.fixture
def walk_on(walk):
    """walk.csv without the pause before it: 1.2 s, and on each of two tiles a step of 0.6 s."""
    header, *rows = walk.read_text().splitlines()
    rows = [row.partition(",")[2] for row in rows[400:]]
    walk.write_text("\n".join([header, *(f"{i / 1000.0:.3f},{row}" for i, row in enumerate(rows))]) + "\n")
    return walk


@contextmanager
def walking(sender, path):
    """An emulator that sends a walk over and over."""
    floor = default_floor(1, 2)
    source = Replay(read_forces(path, floor), floor, RATE, repeats=True)
    emulator = Emulator(sender, source, clock=TileClock(drift_ppm=120.0))
    emulator.start()
    try:
        yield
    finally:
        emulator.close()


def figures_of(step):
    return [float(step[name]) for name in ("contact_ms", "peak1_n")]


class Piped(io.StringIO):
    """What comes out of a pipe, at each flush, until two steps on each tile were right: then Ctrl-C is pressed."""

    def __init__(self, expected):
        super().__init__()
        self.expected, self.right, self.seen = expected, Counter(), 0

    def is_right(self):
        return min(self.right["t1"], self.right["t2"]) >= 2

    def flush(self):
        come = self.getvalue()[self.seen :]
        self.seen += len(come)
        for step in map(json.loads, come.splitlines()):
            contact_ms, peak_n = self.expected[step["tile"]]
            self.right[step["tile"]] += figures_of(step) == [
                pytest.approx(contact_ms, abs=6.0), pytest.approx(peak_n, abs=0.5)
            ]  # fmt: skip
        if come and self.is_right():
            signal.raise_signal(signal.SIGINT)


@pytest.mark.skipif(sys.platform == "win32", reason="nobody can be interrupted there")
@EVERY_TRANSPORT
def test_steps_of_hardware_are_those_of_the_file(underfoot, folder, walk_on, scheme):
    """Two on each tile, sooner or later: where this machine is held up the clocks are slewed, and others differ."""
    assert underfoot("monitor", walk_on, "--steps", "file.csv").status == 0
    with (folder / "file.csv").open() as file:
        expected = {step["tile"]: figures_of(step) for step in csv.DictReader(file)}
    assert expected.keys() == {"t1", "t2"}
    sender, transport = ends(scheme)
    options = ["--floor", "walk.floor.json", "--record", "live.underfoot", "--seconds", "480", "--json"]
    said = Piped(expected)
    with walking(sender, walk_on), redirect_stdout(said):
        ended = underfoot("monitor", transport.name, *options)
    assert said.is_right()
    assert ended.status == 0
    assert "underfoot: uncalibrated: t1, t2 (20 counts a newton are assumed)\n" in ended.error
    with Recording(folder / "live.underfoot") as recording:
        assert recording.about["target"] == scheme
        rows = recording.force_samples()
    assert len(rows) > 2000
    assert (np.diff(rows[:, 0]) > 0.0).all()


@pytest.mark.parametrize("command", [("monitor",), ("scene", "footprints", "--target")], ids=lambda words: words[0])
def test_hardware_of_which_nothing_comes_is_said_and_ends_when_it_is_told_to(underfoot, folder, command):
    port = free_port()
    for seconds in (1, 10, 100):  # its engine waits for half of one first, and may be held up
        said = underfoot(*command, f"udp:127.0.0.1:{port}", "--seconds", seconds)
        assert said.status == 0
        if f"udp:127.0.0.1:{port}: nothing comes" in said.error:
            return
    pytest.fail(said.error)


def test_an_accelerometer_is_reported_before_anything_plays(underfoot, walk):
    floor = default_floor(1, 2)
    sender, transport = ends("udp")
    shaken = np.full((400, 2), REST)
    shaken[:, 0] += np.rint(3276.8 * np.sin(np.arange(400) * np.pi / 4.0)).astype(int)  # a tenth of full scale
    emulator = Emulator(sender, Replay(read_forces(walk, floor), floor, RATE, repeats=True), acceleration=shaken)
    emulator.start()
    try:
        accelerometers = ["--accelerometers", "t1:link:98.1 t2:link:98.1"]
        said = underfoot("monitor", transport.name, "--floor", "walk.floor.json", "--seconds", 3, *accelerometers)
    finally:
        emulator.close()
    assert said.status == 0
    (line,) = (line for line in said.error.splitlines() if "asked" in line)
    assert re.fullmatch(r"underfoot: tile t1: asked nothing, done \d[.\d]* m/s\^2 RMS, peak \d[.\d]*", line)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["serial:/dev/nope"], "serial:/dev/nope cannot be opened: there is no such port"),
        (["udp:127.0.0.1"], "allowed: HOST:PORT"),
        (["udp:203.0.113.7:9000"], "udp:203.0.113.7:9000 cannot be listened at: "),
        (["simulator:nix"], "simulator is 'nix'; allowed: PARAMETERS.json, people=N,path=PATH, child-walking,"),
        (["simulator:none.json"], "underfoot: none.json cannot be read: no such file"),
        (["udp:127.0.0.1:9999", "--profiles", "nope"], "nope"),
    ],
)
def test_hardware_that_cannot_be_monitored_is_one_line(refused, arguments, message):
    assert message in refused("monitor", *arguments)


@pytest.mark.parametrize(
    "command",
    [
        ["monitor"],
        ["serve"],
        ["scene", "footprints", "--target"],
        ["experiment", "detection-threshold", "--participant", "p1", "--session", "p1.session", "--target"],
    ],
)
def test_every_command_with_hardware_takes_its_sample_rate(refused, folder, command):
    refusal = refused(*command, "udp:127.0.0.1:9999", "--sensor-rate", "1")
    assert "--sensor-rate is 1; allowed: 20 to 100000 Hz" in refusal
    refusal = refused(*command, "simulator", "--sensor-rate", "500")
    assert "--sensor-rate is for tiles of hardware; simulator has its own rate" in refusal
    assert not (folder / "p1.session").exists()


def test_profiles_are_for_readings(refused, walk):
    assert "--profiles is for tiles that send readings" in refused("monitor", walk, "--profiles", ".")


def test_a_study_or_a_scene_gets_the_target_that_its_options_name(tmp_path):
    port = free_port()
    given = TargetOptions(target=f"udp:127.0.0.1:{port}", profiles=tmp_path, sensor_rate=500.0, sound="default")
    found = given.session_target(walker=False)
    assert (found.kind, found.profiles, found.sensor_hz, found.sound, found.walker) == (
        "udp", str(tmp_path), 500.0, "", False,
    )  # fmt: skip
    with socket.socket(type=socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", port))
        with pytest.raises(DeviceError, match=str(port)):
            given.session_target(walker=False)
