"""`underfoot serve`, and the clients of docs/network.md against it: their code as it stands, but for the ports."""

import contextlib
import io
import os
import re
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from free_ports import free_port
from long_recording import write_recording
from osc_ends import LOOPBACK, OscEnd

from underfoot import monitoring
from underfoot.floor.layout import default_floor
from underfoot.records.recording import Recording

PLAYS = b"/underfoot/health\0\0\0,T"
"""How a message begins that is sent while the engine runs."""
PAGE = Path(__file__).resolve().parents[2] / "docs" / "network.md"


class Served:
    """A served session in a process of its own, with somebody who walks on it."""

    def __init__(self, folder):
        self.cues, self.messages, self.folder = free_port(), free_port(), folder
        command = [
            sys.executable, "-m", "underfoot", "serve", "simulator", "--tuio", "off", "--record", f"{folder}/",
            "--listen", f"{LOOPBACK}:{self.cues}", "--send", f"{LOOPBACK}:{self.messages}", "--seconds", "3600",
        ]  # fmt: skip
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=os.environ.copy())

    def code(self, what):
        """The block of Python of the page that has these words, for our ports."""
        blocks = re.findall(r"^```python\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
        (block,) = (block for block in blocks if what in block)
        block = re.sub(r"settimeout\(.*\)", "settimeout(400.0)", block)  # a busy machine may take its time
        return block.replace("9701", str(self.messages)).replace("9700", str(self.cues))


@pytest.fixture
def served(tmp_path):
    made = Served(tmp_path)
    yield made
    if made.process.poll() is None:
        made.process.kill()
        made.process.communicate()


def test_clients_of_the_page_hear_a_foot_and_get_onsets_until_it_is_told_to_end_and_has_recorded_them(served, until):
    client_of_thirty_lines_hears_a_foot_and_plays(served)
    trial_for_psychopy_gets_its_onset(served, until)
    with contextlib.closing(OscEnd()) as end:
        for times in (1, 2):
            end.send_message(served.cues, "/underfoot/panic")
            until(lambda times=times: len(end.received("/underfoot/played")) == times, "it is silent")
    with contextlib.closing(OscEnd(served.messages)) as end:
        engine_runs, *_, why_silent, of_tiles = until(lambda: end.received("/underfoot/health"), "its health is told")[
            0
        ]
    assert (engine_runs, why_silent, of_tiles) == (True, "panic", "")
    served.process.send_signal(signal.SIGINT)
    _, error = served.process.communicate(timeout=300.0)
    assert served.process.returncode == 0, error
    assert re.search(r"\d+ datagrams sent, \d+ cues received, 1 refused", error)
    assert error.count("panic, by a cue: nothing plays until serve is started again\n") == 1
    (path,) = served.folder.iterdir()
    assert re.fullmatch(r"20\d\d-\d\d-\d\d \d\d\.\d\d\.\d\d\.underfoot", path.name)
    with Recording(path) as recording:
        texts = [mark.text for mark in recording.marks()]
    assert texts == ["tacton-ws1 on t2", *["tacton-ws2 on t2"] * (len(texts) - 1)]
    assert len(texts) > 1


def client_of_thirty_lines_hears_a_foot_and_plays(served):
    code = served.code("Hears contacts")
    assert len([line for line in code.splitlines() if line]) <= 30
    with contextlib.redirect_stdout(io.StringIO()) as said:
        variables = {}
        exec(code, variables)
    variables["heard"].close()
    variables["asks"].close()
    contact, played = said.getvalue().splitlines()
    assert re.fullmatch(r"contact \d+ at 0\.\d\d, 0\.\d\d m with \d+ N", contact)
    assert re.fullmatch(r"/underfoot/played \d+ \[\d+, [\d.]+, -?[\d.]+\]", played)


def trial_for_psychopy_gets_its_onset(served, until):
    variables = {}
    exec(served.code("PsychoPy trial"), variables)
    floor = variables["Floor"](port=served.cues)
    began_s = time.perf_counter()
    first = variables["trial"](floor, time.perf_counter, "tacton-ws1", "t2", -6.0)
    onsets = [(first["onset_s"], first["frame"])]

    def agrees():
        """Whether two trials are as far apart by this clock as by frames, as they are unless a process had to wait."""
        next = variables["trial"](floor, time.perf_counter, "tacton-ws2", "t2", -6.0)
        onsets.append((next["onset_s"], next["frame"]))
        passed_s, passed = (after - before for before, after in zip(*onsets[-2:], strict=True))
        return passed_s == pytest.approx(passed / 48_000.0, abs=0.5)

    until(agrees, "trials are as far apart as their frames", seen=lambda: onsets)
    with pytest.raises(RuntimeError, match="allowed: -80 to 20 dB"):
        variables["trial"](floor, time.perf_counter, "tacton-ws2", "t2", 60.0)
    floor.socket.close()
    on_its_clock = [began_s, *(onset_s for onset_s, _ in onsets), time.perf_counter()]
    assert on_its_clock == sorted(on_its_clock)


def test_what_cannot_be_served_is_one_line(refused):
    assert "HOST:PORT" in refused("serve", "simulator", "--tuio", "somewhere:3333")
    assert "above 0" in refused("serve", "simulator", "--seconds", "0")
    assert "--level" in refused("serve", "simulator", "--level", "6")
    assert "there.json" in refused("serve", "simulator", "--patch", "there.json")
    assert "no such file or preset" in refused("serve", "simulator", "--patch", "there")
    assert "--patches is there; allowed: a folder" in refused("serve", "simulator", "--patches", "there")
    for folder in ("missing", "missing/"):  # one was made a file, which the next start of a service refused
        said = refused("serve", "simulator", "--seconds", "1", "--record", folder)
        assert "--record is missing; allowed: a folder that is there, or a file NAME.underfoot" in said


def test_it_takes_presets_and_recordings_as_monitor_does(underfoot, folder):
    write_recording(folder / "walk.underfoot", 0.3, default_floor(1, 1), vibration=False)
    (folder / "there.underfoot").write_bytes(b"kept")  # an empty one would keep its name for it
    for target in ("corridor", "walk.underfoot"):
        said = underfoot("serve", target, "--patch", "gravel", "--record", "there.underfoot", "--listen", "off")
        assert said.status == 1
        assert "there.underfoot is there already" in said.error.splitlines()[-1]  # told when all else was looked at


@pytest.mark.parametrize("command", ["serve simulator --tuio off --send off --listen off", "scene frozen-pond"])
def test_a_recording_that_was_lost_is_not_hidden_and_another_one_begins(underfoot, folder, until, monkeypatch, command):
    """As by a full disk, or by a hand in a file manager: the exit status was 0, and a service recorded nothing more."""
    monkeypatch.setattr(monitoring, "AGAIN_S", 0.0)
    monkeypatch.setattr(monitoring, "ROOM_BYTES", 0)
    path, log = folder / "rec.underfoot", folder / "rec.underfoot-wal"

    def remove():
        until(lambda: log.exists() and log.stat().st_size > 100_000, "it is recorded")
        path.unlink()

    remover = threading.Thread(target=remove)
    remover.start()
    said = underfoot(*command.split(), "--record", "rec.underfoot", "--seconds", "3")
    remover.join()
    assert said.status == 1
    assert "rec.underfoot is not recorded any further: " in said.error
    assert said.error.splitlines()[-1] == "underfoot: rec.underfoot was not recorded to the end"
    (next_one,) = re.findall("the recording goes on in (.*)\n", said.error)
    with Recording(next_one) as recording:
        assert recording.span[1] > recording.span[0] > 0


def test_a_tile_that_is_loaded_from_the_first_sample_on_is_named_at_the_end(underfoot, folder):
    """A plate that is not calibrated to 0 is one contact that never ends, and gives no steps."""
    floor = default_floor(1, 1)
    floor.save(folder / "leans.floor.json")
    rows = (f"{k / 1000.0},50,50,50,50" for k in range(3000))
    (folder / "leans.csv").write_text("\n".join(["time_s,t1.1,t1.2,t1.3,t1.4", *rows]))
    off = ["--tuio", "off", "--send", "off", "--listen", "off"]
    said = underfoot("serve", "leans.csv", "--seconds", 1.5, *off)
    assert said.status == 0
    assert "underfoot: untared, loaded from the first sample on: t1\n" in said.error


@pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals")
def test_a_line_of_marks_that_is_unplugged_is_said_while_it_serves(underfoot, folder):
    far, near = os.openpty()

    def unplug():
        while PLAYS not in hears.recv(65536):
            pass
        os.close(near)
        os.close(far)

    class Told(io.StringIO):
        def write(self, text):
            if "marks cannot be read from /dev/" in text:
                signal.raise_signal(signal.SIGINT)
            return super().write(text)

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hears:
        hears.bind((LOOPBACK, 0))
        hears.settimeout(400.0)
        hand = threading.Thread(target=unplug)
        hand.start()
        with contextlib.redirect_stderr(Told()) as told:
            ended = underfoot(
                "serve", "simulator", "--tuio", "off", "--listen", "off", "--seconds", "3600",
                "--send", f"{LOOPBACK}:{hears.getsockname()[1]}", "--serial-marks", os.ttyname(near),
            )  # fmt: skip
        hand.join()
    assert "underfoot: marks cannot be read from /dev/" in told.getvalue()
    assert ended.status == 0, told.getvalue()


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="this system has no terminals that are closed")
def test_what_a_closed_terminal_ends_ends_in_order(folder, with_hangup):
    """All processes are told: in a log, Python's own wrote of memory that it did not know, seven times."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hears:
        hears.bind((LOOPBACK, 0))
        hears.settimeout(400.0)
        to = f"{LOOPBACK}:{hears.getsockname()[1]}"
        command = [
            sys.executable, "-m", "underfoot", "serve", "simulator", "--tuio", "off", "--listen", "off", "--send", to,
        ]  # fmt: skip
        with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as process:
            while PLAYS not in hears.recv(65536):
                pass
            os.killpg(process.pid, signal.SIGHUP)
            _, said = process.communicate()
    assert process.returncode == 0, said
    assert "Traceback" not in said
    assert said.endswith("0 refused\n")
