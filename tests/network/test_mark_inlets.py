"""Marks of LSL streams whose senders end or are started again, over real streams."""

import os
import re
import socket
import subprocess
import sys
import threading
import time
from contextlib import closing, contextmanager, suppress

import pytest

from underfoot.network import mark_inlets
from underfoot.network.mark_inlets import MOST_STREAMS, LslMarks

lsl = pytest.importorskip("pylsl")


@pytest.fixture
def marks():
    """An inlet of all streams, and the texts that it took."""
    heard = []
    with closing(LslMarks(lambda text, at_s: heard.append(text))) as made:
        yield made, heard


def markers(name, source=""):
    """A stream of markers, with the source id `source`."""
    return lsl.StreamOutlet(lsl.StreamInfo(name, "Markers", 1, 0.0, "string", source))


def say(outlet, text, heard, until):
    """Send a mark, and wait until it is taken."""
    assert outlet.wait_for_consumers(120.0)
    outlet.push_sample([text])
    until(lambda: text in heard, text)


@contextmanager
def walled_stream():
    """A stream that answers who looks for streams, but no connection, as behind a firewall; what identifies it."""
    source, over = f"walled {os.getpid()}", threading.Event()
    with socket.socket(type=socket.SOCK_DGRAM) as asked, socket.create_server(("", 0)) as silent:
        asked.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        asked.bind(("", 16571))  # where everybody looks
        asked.settimeout(0.05)
        info = lsl.StreamInfo("walled", "Markers", 1, 0.0, "string", source).as_xml()
        for name, value in {"uid": source, "v4data_port": silent.getsockname()[1], "v4service_port": 9}.items():
            info = re.sub(rf"<{name}.*>", f"<{name}>{value}</{name}>", info)

        def answer():
            while not over.is_set():
                with suppress(TimeoutError):
                    query, (host, _) = asked.recvfrom(65536)
                    *words, port, number = query.decode().split()
                    if f"{os.getpid()}'" in words:  # or the tests of others would wait for it
                        asked.sendto(f"{number}\r\n{info}".encode(), (host, int(port)))

        thread = threading.Thread(target=answer)
        thread.start()
        try:
            yield (source, "walled", "")
        finally:
            over.set()
            thread.join()


def test_each_mark_of_a_sender_that_was_started_again_is_taken_once(marks, until):
    inlet, heard = marks
    first = markers("triggers", "restarted")
    say(first, "before", heard, until)
    del first
    second = markers("triggers", "restarted")
    say(second, "again", heard, until)
    say(markers("other triggers", "restarted"), "of a later stream", heard, until)
    assert sum(source[0] == "restarted" for source in inlet.streams) == 2
    say(second, "once more", heard, until)
    assert (heard.count("before"), heard.count("again"), heard.count("once more")) == (1, 1, 1)


def test_a_stamp_that_cannot_be_counts_as_it_arrives_and_is_said(until):
    """One that is not finite ended `serve`, and one by the calendar, as many send, was a mark in half a century."""
    heard = []
    with closing(LslMarks(lambda text, at_s: heard.append((text, at_s - time.perf_counter())))) as inlet:
        outlet = markers("triggers", "off")
        assert outlet.wait_for_consumers(120.0)
        stamps = {"calendar": time.time(), "nothing": float("nan"), "before": lsl.local_clock() - 30.0}
        for text, stamp_s in stamps.items():
            outlet.push_sample([text], stamp_s)
            until(lambda text=text: text in dict(heard), text)
            assert ("'triggers'" in inlet.problem) == (text != "before")
    found = dict(heard)
    assert found["calendar"] == pytest.approx(0.0, abs=10.0)
    assert found["nothing"] == pytest.approx(0.0, abs=10.0)
    assert found["before"] == pytest.approx(-30.0, abs=10.0)


def test_text_that_is_not_in_utf8_is_a_mark_too(marks, until):
    """It ended the thread that takes marks, of all streams, without a word."""
    _, heard = marks
    outlet = markers("triggers", "old")
    say(outlet, "before", heard, until)
    outlet.push_sample(["Größe".encode("latin-1")])
    until(lambda: "Größe" in heard, "it is taken")
    say(outlet, "after", heard, until)


def test_a_stream_that_ends_for_good_ends_no_other(marks, until):
    inlet, heard = marks
    with_no_source = markers("triggers")
    say(with_no_source, "begin", heard, until)
    gone = (with_no_source.get_info().uid(),)
    assert gone in inlet.streams
    del with_no_source
    until(lambda: gone not in inlet.streams, "its inlet is closed")
    say(markers("triggers", "later"), "of another", heard, until)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere one program alone is asked for streams")
def test_a_stream_behind_a_firewall_is_named_and_not_waited_for(marks, until, monkeypatch):
    """For a second twice in each one and a half nobody's marks were taken; then nobody was told of it."""
    monkeypatch.setattr(mark_inlets, "_CLOCK_S", 0.0)
    inlet, heard = marks
    with walled_stream() as walled:
        until(lambda: walled in inlet.streams, "it has an inlet, without an answer")
        beside = markers("triggers", "beside it")
        say(beside, "of another", heard, until)
        until(lambda: inlet.problem.startswith("stream 'walled' does not answer"), "it is named")
        until(lambda: "'triggers'" not in inlet.problem, "the other one has answered")


def test_streams_that_ended_take_no_place(marks, until):
    _, heard = marks
    ended = [markers("triggers", f"run {k}") for k in range(MOST_STREAMS)]
    until(lambda: all(one.have_consumers() for one in ended), "all are open")
    ended.clear()
    say(markers("triggers", "the next run"), "of the next run", heard, until)


@pytest.mark.parametrize("level", ["", "0"])
def test_the_library_is_silent_on_the_terminal_unless_its_own_configuration_says_otherwise(tmp_path, level):
    """It wrote two lines of its own among those of `serve` and `experiment`."""
    if level:
        (tmp_path / "lsl_api.cfg").write_text(f"[log]\nlevel = {level}\n")
    script = "from underfoot.network.lsl_library import lsl_library\nlsl_library().resolve_streams(0.01)"
    environment = {name: value for name, value in os.environ.items() if name != "LSLAPICFG"} | {"HOME": str(tmp_path)}
    said = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert bool(said.stderr) == bool(level)
