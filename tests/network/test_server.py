"""The server over real sockets: what it sends and how often, and that nothing malformed is accepted."""

import itertools
import json
import os
import platform
import random
import shutil
import socket
import struct
import subprocess
import sys
import time
from contextlib import closing
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from free_ports import free_port
from osc_ends import LOOPBACK, CursorDecoder, OscEnd
from pythonosc.osc_message_builder import build_msg

from underfoot import __version__
from underfoot.engine.reports import Health
from underfoot.errors import DeviceError
from underfoot.floor.contacts import OngoingContact
from underfoot.floor.footsteps import Step
from underfoot.floor.layout import default_floor
from underfoot.network.cues import MarkCue, PanicCue, PlayCue
from underfoot.network.osc import bundle, message
from underfoot.network.plan import NetworkPlan
from underfoot.network.server import MOST_BYTES, MOST_CUES_S, NetworkServer

RATE, FORCE_HZ = 48_000.0, 1000.0


@pytest.fixture
def end():
    with closing(OscEnd()) as made:
        yield made


@pytest.fixture
def serve():
    """`serve(**ways)`: a server of a 2 x 2 floor, or of another `size`."""
    made = []

    def start(before=None, size=(2, 2), **ways):
        made.append(NetworkServer(NetworkPlan.of(**ways), default_floor(*size), RATE, FORCE_HZ, before))
        return made[-1]

    yield start
    for server in made:
        server.close()


def listening():
    port = free_port()
    return port, f"{LOOPBACK}:{port}"


def contact(load=0, x_m=0.1, id=0):
    return OngoingContact(id, x_m, 0.1, 700.0, (0,), 0.0, 3, (load,))


def test_contacts_go_out_sixty_times_a_second_until_they_end(serve, end, until):
    server, decoder, frames = serve(tuio=end.text), CursorDecoder(), []

    def hear():
        frames.extend(end.datagrams())
        return frames

    def shown(k):
        server.show(k / 60.0, 0.0, [contact(x_m=0.1 + 0.001 * k)])
        return len(hear()) > k

    for k in range(30):
        until(partial(shown, k), "its frame comes")
    server.show(1.0, 0.0, [])
    until(lambda: hear()[-1][1][1] == ["alive"], "the contact has ended")
    for frame in frames:
        decoder.decode(frame)
    assert decoder.sources == {f"underfoot@{platform.node()}"}, "not the receiver's name, which two floors would share"
    assert (decoder.added, decoder.removed) == ([1], [1])
    assert decoder.sequences == list(range(decoder.sequences[0], decoder.sequences[0] + len(decoder.sequences)))


def test_contacts_that_nobody_tells_of_any_more_end(serve, end, until):
    server = serve(send=end.text)
    server.show(0.5, 0.0, [contact()])
    until(
        lambda: end.received("/underfoot/contact") and end.received("/underfoot/contact")[0][3] == 700.0, "it is sent"
    )
    until(lambda: end.received("/underfoot/contacts")[-1][1] == 0, "nobody is there any more")


def test_a_bug_is_told_and_keeps_nothing_else_from_being_sent(serve, end, until, capfd):
    """All sending and taking ended, and nobody was told."""
    server = serve(send=end.text)
    server.show(0.5, 0.0, ["no contact"])
    until(lambda: server.problem, "it is told")
    server.show(0.5, 0.0, [contact()])
    until(lambda: end.received("/underfoot/contact"), "the next contact is sent")
    assert "kept something from being sent or taken: AttributeError" in server.problem
    assert capfd.readouterr().err.count("Traceback") == 1


def test_the_last_word_is_that_nobody_is_there_and_ids_go_on(serve, end, until):
    first = serve(tuio=end.text)
    first.show(0.5, 0.0, [contact()])
    until(lambda: ["alive", 1] in end.received("/tuio/2Dcur"), "the contact is sent")
    first.close()
    assert end.received("/tuio/2Dcur")[-2:-1] == [["alive"]]
    last = end.received("/tuio/2Dcur")[-1][1]
    second = serve(before=first, tuio=end.text)
    second.show(0.1, 0.0, [contact()])
    until(lambda: ["alive", 2] in end.received("/tuio/2Dcur"), "the next id")
    assert last + 1 in [arguments[1] for arguments in end.received("/tuio/2Dcur") if arguments[0] == "fseq"]
    assert second.counts.sent > 0


def test_a_step_names_the_contact_under_which_it_was_sent(serve, end, until):
    server = serve(send=end.text)
    server.show(0.5, 0.0, [contact(load=4, id=9)])
    until(lambda: end.received("/underfoot/contact"), "the contact is sent")
    server.send_step(Step(2, "t1", "left", 0.25, 650.0, 800.0, 500.0, 780.0, 400.0, 9.0, 120.0, 80.0, contact=9), 0.7)
    (step,) = until(lambda: end.received("/underfoot/step"), "the step is sent")
    assert step == [2, 1, 0, "t1", "left", 0.25, 650.0, 800.0, 500.0, 780.0, 400.0, 9.0]


def test_health_is_sent_also_where_more_samples_are_lost_than_osc_can_count(serve, end, until):
    """As after half an hour of frame numbers with their bytes swapped: serve ended with an error of Python's."""
    health = Health(True, 0.1, 0.2, 3, 1 << 40, 0.004, 0.001, 0.02, 0.0, 1 << 40, 0.0, 0)
    serve(send=end.text).send_health(health, "panic")
    until(lambda: end.received("/underfoot/health"), "it comes")
    assert end.received("/underfoot/health")[0][:5] == [True, 1 << 40, pytest.approx(0.1), 3, (1 << 31) - 1]


def test_contacts_steps_and_marks_are_lsl_streams(serve, until):
    pylsl = pytest.importorskip("pylsl")
    server = serve(lsl=True)
    inlets = {}
    for name in ("contacts", "steps", "marks", "force"):
        (found,) = pylsl.resolve_byprop("source_id", f"underfoot-live-{name}-{socket.gethostname()}", timeout=120.0)
        inlets[name] = pylsl.StreamInlet(found)
        inlets[name].open_stream(timeout=120.0)
    assert inlets["force"].channel_count == 4

    began_s = pylsl.local_clock() - 2.0

    def ago(time_s):
        return pylsl.local_clock() - began_s - time_s

    def heard(name, tell):
        """The first sample of a stream, of which it is told until it comes."""

        def look():
            tell()
            return inlets[name].pull_sample(timeout=0.02)[0]

        return until(look, name)

    person = heard("contacts", lambda: server.show(0.6, ago(0.6), [contact(load=4, id=9)]))
    assert person == [1.0, 0.1, 0.1, 700.0, 3.0]
    step = Step(2, "t3", "right", 0.25, 650.0, 800.0, 500.0, 780.0, 400.0, 9.0, 120.0, 80.0, contact=9, person=3)
    told = heard("steps", lambda: server.send_step(step, ago(0.25)))
    assert told == [2.0, 1.0, 3.0, 1.0, 2.0, 650.0, 800.0, 500.0, 780.0, 400.0, 9.0]
    assert heard("marks", lambda: server.send_mark("begin", 0, ago(0.0))) == ["begin"]
    loads = np.arange(8.0).reshape(2, 4)
    assert heard("force", lambda: server.send_force(2.0, ago(2.0), loads)) in loads.tolist()
    stamps_s, late_s = {"force": [], "contacts": []}, itertools.cycle((0.0, 0.01, 0.02))

    def told_again():
        """What is sent late, as on a busy machine, keeps its stamp."""
        ago_s = ago(2.0) - next(late_s)
        server.show(2.0, ago_s, [contact(load=5, x_m=0.2)])
        server.send_force(2.0, ago_s, loads)
        for name, place, value in (("force", 0, 4.0), ("contacts", 1, 0.2)):
            samples = zip(*inlets[name].pull_chunk(0.02), strict=True)
            stamps_s[name] += [at_s for sample, at_s in samples if sample[place] == value]
        return min(map(len, stamps_s.values())) > 6

    until(told_again, "it comes again")
    for found_s in stamps_s.values():
        assert found_s == pytest.approx([began_s + 2.0] * len(found_s), abs=1e-3)
    assert server.problem == ""
    for inlet in inlets.values():
        inlet.close_stream()


def test_hello_is_answered_with_all_that_a_client_needs(serve, end, until):
    port, address = listening()
    serve(size=(16, 16), listen=address, tuio="127.0.0.1:3333")
    end.send_message(port, "/underfoot/hello")
    ((name, version, text),) = until(lambda: end.received("/underfoot/hello"), "an answer")
    assert len(text) > 9216, "more than macOS sends unless it is asked to"
    about = json.loads(text)
    assert (name, version) == ("underfoot", __version__)
    assert about["ways"] == {"tuio": "127.0.0.1:3333", "listen": address}
    assert [tile["id"] for tile in about["tiles"]] == [f"t{number}" for number in range(1, 257)]
    assert about["box_m"] == pytest.approx([16 * 0.31 - 0.005] * 2)
    assert "gravel" in about["presets"]


def test_cues_come_in_the_order_in_which_they_were_sent_and_a_panic_before_them(serve, end, until):
    port, address = listening()
    server = serve(listen=address)
    end.send(port, bundle([message("/underfoot/mark", "one", 1), bundle([message("/underfoot/mark", "two")])]))
    end.send_message(port, "/underfoot/play", "gravel", "t1", -6.0, 4)
    end.send_message(port, "/underfoot/panic")
    until(lambda: server.counts.received == 4, "all came")
    found = server.cues()
    assert [one.cue for one in found] == [
        PanicCue(), MarkCue("one", 1), MarkCue("two"), PlayCue("gravel", "t1", -6.0, 4),
    ]  # fmt: skip
    server.answer_played(found[3], 96_000, 0.125)
    server.answer_refused(found[1], "no")
    assert until(lambda: end.received("/underfoot/played")) == [[4, 96_000, 2.0, 0.125]]
    assert until(lambda: end.received("/underfoot/refused")) == [[1, "/underfoot/mark", "no"]]


def test_what_is_osc_but_no_cue_is_refused_with_a_reason(serve, end, until):
    port, address = listening()
    server = serve(listen=address)
    end.send_message(port, "/underfoot/play", "gravel", "t1", float("nan"), 5)
    ((number, refused, reason),) = until(lambda: end.received("/underfoot/refused"))
    assert (number, refused, reason) == (5, "/underfoot/play", "gain_db is nan; allowed: -80 to 20 dB")
    assert server.counts.refused == 1
    assert not server.cues()


@pytest.mark.parametrize("text", ["12\u00a0kg", "今日\u3000開始", "\N{WOMAN}\u200d\N{PERSONAL COMPUTER}"])
def test_text_of_a_cue_may_have_spaces_and_joiners_of_all_scripts(serve, end, until, text):
    port, address = listening()
    server = serve(listen=address)
    end.send_message(port, "/underfoot/mark", text, 6)
    until(lambda: server.counts.received + server.counts.refused, "it is read")
    assert [one.cue for one in server.cues()] == [MarkCue(text, 6)]


def malformed(rng):
    """A datagram that no server may accept."""
    good = bytearray(build_msg("/underfoot/play", ["gravel", "t1", -6.0]).dgram)
    kind = rng.randrange(8)
    if kind == 0:
        return rng.randbytes(rng.randrange(1, 200))
    if kind == 1:
        return bytes(good[: rng.randrange(1, len(good))])
    if kind == 2:
        return bytes(good) + rng.randbytes(4 * rng.randrange(1, 9))
    if kind == 3:
        return build_msg("/underfoot/play", ["gravel", "t1", rng.choice([float("nan"), float("inf"), 1e9])]).dgram
    if kind == 4:
        packet = message("/underfoot/panic")
        for _ in range(rng.randrange(5, 100)):
            packet = bundle([packet])
        return packet
    if kind == 5:
        return b"#bundle\0" + bytes(8) + struct.pack(">i", rng.choice([-4, -1, 0, 3, 2**31 - 1])) + bytes(good)
    if kind == 6:
        return b"/underfoot/mark\0,b\0\0" + struct.pack(">i", rng.randrange(1000)) + rng.randbytes(rng.randrange(4_000))
    return b"/underfoot/mark\0,s\0\0\xff\xfe" + rng.randbytes(1) + b"\0"


def test_malformed_datagrams_are_counted_and_nothing_else(serve, end, until):
    """By hand it was tried with 1e5."""
    port, address = listening()
    server, rng, count = serve(listen=address), random.Random(7), 2000
    for k in range(count):
        end.send(port, malformed(rng))
        if k % 20 == 19:  # the system keeps so many until they are read
            until(lambda sent=k + 1: server.counts.refused >= sent, "all are refused", every=0.001)
    assert (server.counts.refused, server.counts.received, server.cues()) == (count, 0, [])
    end.datagrams()
    until(lambda: end.send_message(port, "/underfoot/hello") or end.received("/underfoot/hello"), "it still answers")


def test_all_that_sixteen_faders_send_to_a_window_that_is_held_up_is_taken_and_the_panic_before_it(serve, end, until):
    """Four faders were too many at 60 Hz; of what sixteen send in a second, the last 256 were left."""
    port, address = listening()
    server, values = serve(listen=address), iter(range(1000))

    def move_fader():
        end.send_message(port, "/underfoot/set", "noise", "amplitude", float(next(values)))

    end.send_message(port, "/underfoot/panic")
    for _ in range(200):
        move_fader()
    until(lambda: move_fader() or server.counts.received > 300, "so many are read", every=0.001)
    panic, *moves = server.cues()
    assert panic.cue == PanicCue()
    assert [one.cue.value for one in moves] == list(range(len(moves)))
    assert len(moves) >= 300


def test_faders_push_no_mark_out_while_nobody_takes_cues(serve, end, until):
    """A window that was held up for a quarter of a second lost marks to sixteen faders, and nobody was told."""
    port, address = listening()
    server = serve(listen=address)
    end.send_message(port, "/underfoot/mark", "before", 1)
    moves = itertools.count()

    def move():
        for _ in range(10):
            end.send_message(port, "/underfoot/set", "noise", "amplitude", float(next(moves)))
        return server.counts.received > 300

    until(move, "so many wait")
    assert server.cues()[0].cue == MarkCue("before", 1)


def test_more_than_so_many_cues_a_second_are_refused_but_panic_is_heard(serve, end, until):
    port, address = listening()
    server = serve(listen=address)
    counts, sent = server.counts, 0
    while counts.refused == 0 and sent < 100 * MOST_CUES_S:
        end.send_message(port, "/underfoot/mark", "m", sent)
        sent += 1
        if sent % 20 == 0:  # the system keeps so many until they are read
            until(lambda sent=sent: counts.received + counts.refused >= sent, "all were read", every=0.001)
    end.send_message(port, "/underfoot/panic")
    until(lambda: counts.received + counts.refused > sent, "the panic was read")
    heard = server.cues()
    assert heard[0].cue == PanicCue()
    assert 0.2 * MOST_CUES_S < len(heard) <= sent
    assert "a second" in server.counts.reason


def test_a_long_datagram_is_refused_unread(serve, end, until):
    port, address = listening()
    server = serve(listen=address)
    for k, length in enumerate((MOST_BYTES, 60_000), 1):
        end.send(port, message("/underfoot/mark", "m" * length))
        until(lambda k=k: server.counts.refused == k, "it is refused")
    assert str(MOST_BYTES) in server.counts.reason


def test_a_port_that_is_taken_is_said_and_an_address_of_another_computer(serve, end):
    taken = f"127.0.0.1:{end.port}: another program listens there, perhaps a second Underfoot; choose another port"
    with pytest.raises(DeviceError, match=taken):
        serve(listen=end.text)
    with pytest.raises(DeviceError, match=r"192\.0\.2\.1:9700: this computer has no such address; choose one of"):
        serve(listen="192.0.2.1:9700")


def marked(server, until, count):
    found = []

    def hear():
        found.extend((cue.cue.text, cue.at_s, cue.sender) for cue in server.cues())
        return len(found) >= count

    until(hear)
    return found


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere the loopback has no broadcast address")
def test_a_whole_network_is_sent_to(serve):
    """As docs/hosts.md does: the system refused it, and nobody was told."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as hears:
        hears.bind(("", 0))
        hears.settimeout(60.0)
        serve(send=f"127.255.255.255:{hears.getsockname()[1]}")
        assert b"/underfoot/contacts" in hears.recv(65536)


unshared = pytest.mark.skipif(
    not shutil.which("unshare") or subprocess.run(["unshare", "-rn", "ip", "link"], capture_output=True).returncode,
    reason="this system makes no network without a way out",
)


@unshared
def test_a_network_that_is_away_is_said_until_it_is_back():
    """As where a cable is not plugged in yet."""
    script = """if True:
        import subprocess
        from polling import Poll
        from underfoot.floor.layout import default_floor
        from underfoot.network.plan import NetworkPlan
        from underfoot.network.server import NetworkServer
        server = NetworkServer(NetworkPlan.of(send="127.0.0.1:9"), default_floor(), 48_000.0, 1000.0)
        print(Poll()(lambda: server.problem))
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        Poll()(lambda: not server.problem)
        server.close()
    """
    assert in_a_network_of_its_own(script) == "nothing can be sent to 127.0.0.1:9: network is unreachable\n"


@unshared
def test_that_cues_cannot_be_answered_is_said_until_they_can():
    """As behind a wall that lets nothing out: nobody was told, here or there."""
    script = """if True:
        import socket, subprocess
        from polling import Poll
        from pythonosc.osc_message_builder import build_msg
        from underfoot.floor.layout import default_floor
        from underfoot.network.plan import NetworkPlan
        from underfoot.network.server import NetworkServer
        def ip(*words):
            subprocess.run(["ip", *words], check=True)
        ip("link", "set", "lo", "up")
        ip("address", "add", "10.0.0.1/32", "dev", "lo")
        server = NetworkServer(NetworkPlan.of(listen="0.0.0.0:9001"), default_floor(), 48_000.0, 1000.0)
        client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        client.bind(("10.0.0.1", 9002))
        client.sendto(build_msg("/underfoot/mark", ["now"]).dgram, ("127.0.0.1", 9001))
        (cue,) = Poll()(server.cues)
        ip("address", "del", "10.0.0.1/32", "dev", "lo")
        def problem():
            server.answer_refused(cue, "it is too late")
            return server.problem
        print(Poll()(problem))
        ip("address", "add", "10.0.0.1/32", "dev", "lo")
        Poll()(lambda: not problem())
        server.close()
    """
    assert in_a_network_of_its_own(script) == "cues cannot be answered: 10.0.0.1:9002: network is unreachable\n"


def in_a_network_of_its_own(script):
    """What a script prints where no network is there, not even this machine's own."""
    helpers = {"PYTHONPATH": str(Path(__file__).parents[1] / "helpers")}
    command = ["unshare", "-rn", sys.executable, "-c", script]
    return subprocess.run(command, env=os.environ | helpers, capture_output=True, text=True, check=True).stdout


def wait_until_read(server, until, far):
    """Wait until all that is written to a line of marks is read: what comes before it is opened is dropped."""
    written = []

    def ask():
        written.append(f"{len(written)}?")
        os.write(far, f"{written[-1]}\n".encode())
        return server.cues()

    heard = until(ask)
    while heard[-1].cue.text != written[-1]:
        heard = until(server.cues)


def test_lines_and_triggers_of_a_serial_port_are_marks(serve, until, monkeypatch):
    pytest.importorskip("pty")
    import pty

    far, near = pty.openpty()
    arrivals = itertools.count()  # a clock that goes on where it is read: where something arrives, not in silence
    monkeypatch.setattr("underfoot.network.mark_inlets.time", SimpleNamespace(perf_counter=lambda: next(arrivals)))
    server = serve(serial_marks=os.ttyname(near))
    wait_until_read(server, until, far)
    os.write(far, b"begin of trial 1\r\n\x05")
    assert [text for text, _, _ in marked(server, until, 2)] == ["begin of trial 1", "trigger 5"]
    os.write(far, b"end")
    ((text, before_s, sender),) = marked(server, until, 1)
    assert (text, sender) == ("end", None)
    for sent, expected in ((b"A", "trigger 65"), (b"\n", "trigger 10"), (b"\r", "trigger 13")):
        os.write(far, sent)
        ((text, at_s, _),) = marked(server, until, 1)
        assert text == expected
        assert at_s == before_s + 1, "as it came, and not as it was known to be over"
        before_s = at_s
    os.close(near)
    os.close(far)
    until(lambda: "marks cannot be read" in server.problem)


def test_a_line_of_marks_that_cannot_be_read_keeps_nothing_from_being_sent(serve, end, until, monkeypatch, tmp_path):
    """Nothing was sent until the adapter was there, which the window opened itself, every 5 s; two programs got some of
    the marks each, and pieces of others."""
    pty = pytest.importorskip("pty")
    monkeypatch.setattr("underfoot.network.mark_inlets._AGAIN_S", 0.01)
    port = str(tmp_path / "adapter")
    servers = serve(serial_marks=port, send=end.text), serve(serial_marks=port)
    until(lambda: "there is no such port" in servers[0].problem)
    servers[0].send_mark("sent", 0, 0.0)
    until(lambda: end.received("/underfoot/mark"))
    far, near = pty.openpty()
    os.symlink(os.ttyname(near), port)
    until(lambda: "" in (problems := [one.problem for one in servers]) and "another program has it" in str(problems))
    reads, waits = sorted(servers, key=lambda one: one.problem)
    wait_until_read(reads, until, far)
    reads.close()
    until(lambda: not waits.problem)
    os.close(near)
    os.close(far)


def test_streams_of_markers_are_marks_at_their_own_time(serve, until):
    lsl = pytest.importorskip("pylsl")
    outlet = lsl.StreamOutlet(lsl.StreamInfo("triggers", "Markers", 1, 0.0, "string", "test"))
    server = serve(lsl_marks=True)
    assert outlet.wait_for_consumers(120.0)
    before_s = time.perf_counter()
    outlet.push_sample(["stimulus 3"], lsl.local_clock() - 2.0)
    after_s = time.perf_counter()
    at_s = next(at_s for text, at_s, _ in marked(server, until, 1) if text == "stimulus 3")
    assert before_s - 0.1 < at_s + 2.0 < after_s + 0.1
